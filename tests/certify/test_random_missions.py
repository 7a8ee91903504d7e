"""The runs of random missions are certified, whatever their outcome, unless a synthesis exceeds a
limit.

Among the tests the campaign is short; SAFENAV_FUZZ=1000 tries as many others.
"""

import json
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from drawn import loads
from safenav.certify.bundle import bundle_of_run
from safenav.errors import ResourceLimitError
from support.mixed import mixed_mission, tracked_mission

COUNT = int(os.environ.get("SAFENAV_FUZZ", "12"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "5000")) if "SAFENAV_FUZZ" in os.environ else 0
FOUND = (7037, 7054)
"""A stop at a charger that is a visit, and a robot that has left the last place of its plan."""
MADE = {
    "lockstep": mixed_mission,
    "live": partial(mixed_mission, live=True),
    "tracking": tracked_mission,
}


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("seed", [*range(FIRST, FIRST + COUNT), *FOUND])
def test_the_run_of_a_random_mission_is_certified(
    seed: int, made: str, tmp_path: Path, played: Callable[[], None]
) -> None:
    (scenario := tmp_path / "mission.yaml").write_text(
        json.dumps({**loads(MADE[made], seed)[0], "coordination": "resynthesis"})
    )
    try:
        assert bundle_of_run(scenario, tmp_path / "bundle").verdict.accepted
    except ResourceLimitError as limit:  # by beliefs on a large map: no verdict
        pytest.skip(str(limit))
    played()
