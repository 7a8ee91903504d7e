"""The runs of random missions are certified, whatever their outcome, unless a synthesis exceeds a
limit.

Among the tests the campaign is short; SAFENAV_FUZZ=1000 tries as many others.
"""

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from drawn import loads
from safenav.certify.bundle import bundle_of_run
from safenav.errors import ResourceLimitError
from support.missions import mission

COUNT = int(os.environ.get("SAFENAV_FUZZ", "12"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "5000")) if "SAFENAV_FUZZ" in os.environ else 0
MADE: dict[str, tuple[str, dict[str, str]]] = {
    "lockstep": ("mixed", {}),
    "live": ("mixed", {"clock": "live"}),
    "tracking": ("tracked", {}),
}


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_the_run_of_a_random_mission_is_certified(
    seed: int, made: str, tmp_path: Path, played: Callable[[], None]
) -> None:
    family, more = MADE[made]
    data, _ = loads(lambda number: mission(family, number) | more, seed)
    scenario = tmp_path / "mission.yaml"
    scenario.write_text(json.dumps(data | {"coordination": "resynthesis"}))
    try:
        assert bundle_of_run(scenario, tmp_path / "bundle").verdict.accepted
    except ResourceLimitError as limit:  # by beliefs on a large map: no verdict
        pytest.skip(str(limit))
    played()
