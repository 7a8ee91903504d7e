"""Files of a run to save, also of a changed run that has not ended."""

import io
import json
import sys
import zipfile
from pathlib import Path

import pytest

from children import ran
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario
from safenav.studio import session
from safenav.trace.file import as_data
from safenav.trace.records import Record
from studio.serving import SCENARIOS


@pytest.fixture(scope="module")
def trace() -> bytes:
    """Eight ticks of case study 1, changed in every way."""
    records: list[Record] = []
    mission = Mission(load_scenario(SCENARIOS / "case_study_1.yaml"), listeners=[records.append])
    mission.start()
    for change in (
        {"kind": "close", "type": "door", "region": 44},
        "service digit out",
        "objective digit {hold: 72}",
        "service digit back",
    ):
        mission.intervene(change)
        mission.step()
        mission.step()
    mission.give_up()
    return "".join(json.dumps(as_data(record)) + "\n" for record in records).encode()


def test_the_run_so_far_in_three_dimensions(trace: bytes) -> None:
    page = session.page_3d(trace, "run.jsonl")
    assert b'id="motion"' in page and b"</html>" in page


def test_the_bundle_of_a_changed_run_is_accepted_by_its_own_checker(
    trace: bytes, tmp_path: Path
) -> None:
    with zipfile.ZipFile(io.BytesIO(session.bundle(trace, "run.jsonl"))) as files:
        files.extractall(tmp_path)
    (checker,) = tmp_path.rglob("check.py")
    command = [sys.executable, "-I", "-S", str(checker), str(checker.parent)]
    done = ran(command)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "made 4 changes" in done.stdout
