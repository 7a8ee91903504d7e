"""Traces of shipped scenarios, run once for all tests that look at real ones."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from safenav.runtime.mission import Mission, default_synthesizer
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.writing import TraceWriter

SCENARIOS = Path(__file__).parents[2] / "scenarios"
NAMES = ("case_study_1_beliefs", "case_study_2", "case_study_3", "corridor_swap", "two_digits")


@cache
def real_trace(name: str) -> str:
    """The trace of a run of ``scenarios/NAME.yaml``."""
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "trace.jsonl"
        with TraceWriter(file) as writer:
            Mission(scenario, default_synthesizer(scenario), listeners=[writer]).run()
        return file.read_text()
