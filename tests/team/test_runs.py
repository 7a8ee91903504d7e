"""Runs of random missions, whatever the durations of steps (docs/coordination.md). That they keep
all rules, campaigns show."""

import os
from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from msgspec.structs import replace

from drawn import loads
from safenav.errors import Outcome
from safenav.runtime.control import coordinate
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Clock
from support.durations import Uneven
from support.missions import mission

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 30
FAMILIES = ("tight_hidden", "parking_hidden", "tight_needs")
VERDICTS = (Outcome.COMPLETED, Outcome.OPERATOR_NEEDED, Outcome.UNREALIZABLE)


@pytest.mark.parametrize("seed", range(COUNT))
def test_both_clocks_end_alike_and_no_plan_waits_for_itself(
    seed: int, played: Callable[[], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The net that would ask for another plan (I3) never catches one."""
    stuck = coordinate.stuck

    def never(*arguments: Any) -> bool:
        assert not stuck(*arguments), "a plan waits for itself"
        return False

    monkeypatch.setattr(coordinate, "stuck", never)
    _, scenario = loads(lambda number: mission(FAMILIES[seed % 3], number), seed)
    random = Random(f"speeds {seed}")
    speeds = {robot.name: random.uniform(0.3, 3.0) for robot in scenario.robots}
    live = replace(scenario, clock=Clock.LIVE)
    world = Uneven(live, speeds=speeds, delayed=0.2, seed=seed)
    ends = {Mission(scenario).run().outcome, Mission(live, world=world).run().outcome}
    assert len(ends) == 1 and ends < {*VERDICTS}
    played()
