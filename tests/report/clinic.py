"""A clinic with eighteen names, two areas, five robots, joint plans and requests."""

from pathlib import Path

from once import beside
from tests.warm import safenav

SCENARIO = beside(__file__, "scenarios/clinic.yaml")
NAMES = 20


def run(folder: Path) -> Path:
    """The trace of the clinic's run."""
    (folder / "clinic.yaml").write_text(SCENARIO)
    done = safenav("run", "clinic.yaml", "--trace", "clinic.jsonl", "--no-map", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "clinic.jsonl"
