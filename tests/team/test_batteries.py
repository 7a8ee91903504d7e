"""Random teams on one or two chargers: charges, and what the need of a pose promises."""

import json
import os
from collections.abc import Callable
from random import Random
from typing import Any

import pytest

from drawn import loads
from safenav.outcome import Outcome
from safenav.team import state as now
from safenav.team.apply import apply, initial
from safenav.team.battery import NEVER
from safenav.team.team import Team, team_of
from support.boards import walled
from team.playing import play

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 20


def scenario(seed: int, *, most: int = 3) -> str:
    """A team with batteries in a small space, some of which use charge by standing."""
    random = Random(f"batteries {seed}")
    grid = walled(random, random.randint(3, 5), random.randint(4, 7), 0.2)
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    stay, models, robots = random.choice((0, 0, 1)), dict[str, Any](), dict[str, Any]()
    for k, start in enumerate(random.sample(free, random.randint(1, most))):
        capacity = random.randint(10, 24) * (1 + stay)
        battery = {"capacity": capacity, "charge": random.randint(1, 4) + stay, "stay": stay}
        models[f"m{k}"] = {
            "mobility": random.choice(("free", "free", "heading")),
            "layer": "ground",
            "capabilities": [],
            "battery": battery | {"start": random.randint(capacity // 2, capacity)},
        }
        kind = random.choice(("visit", "visit", "patrol", "once"))
        objective = {kind: random.sample(free, 2)}
        robots[f"r{k}"] = {
            "model": f"m{k}",
            "start": start,
            "heading": "east",
            "objective": objective,
        }
    return json.dumps(
        {
            "safenav": 1,
            "map": {"grid": grid},
            "catalogue": {"robots": models},
            "robots": robots,
            "chargers": random.sample(free, random.choice((1, 2))),
            "until": {"rounds": random.choice((1, 2))},
            "limits": {"ticks": 600},
        }
    )


def charges(team: Team, state: now.State, i: int, energy: Any) -> float:
    """The need of a robot's pose and next target."""
    robot = state.robots[i]
    return float(energy.need(team.members[i].floor, robot.pose, energy.turn(robot.own.memory)))


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_robot_alone_completes_its_rounds_if_its_charge_suffices(
    seed: int, played: Callable[[], None]
) -> None:
    _, plan = loads(lambda number: scenario(number, most=1), seed)
    team = team_of(plan)
    energy = team.members[0].energy
    assert energy is not None
    need = charges(team, initial(team), 0, energy)
    end, lines, _ = play(plan)
    suffices = need <= energy.battery.start
    assert (end.outcome is Outcome.COMPLETED) is suffices, plan
    if not suffices:
        least = None if need >= NEVER else need
        assert lines[-1].refused == {"r0.battery": least}
    played()


@pytest.mark.parametrize("seed", range(COUNT))
def test_no_step_uses_more_than_the_charge(seed: int, played: Callable[[], None]) -> None:
    """Folds the moves of the trace again, by the robots' models alone."""
    _, plan = loads(scenario, seed)
    _, lines, _ = play(plan)
    left = {r.name: float(r.model.battery.start) for r in plan.robots if r.model.battery}
    for line in (one for one in lines if type(one).__name__ == "Move"):
        battery = plan.robot(line.robot).model.battery
        assert battery is not None
        if line.from_ != line.to:
            left[line.robot] -= battery.move
        elif line.to in plan.chargers:
            left[line.robot] = min(battery.capacity, left[line.robot] + battery.charge)
        else:
            left[line.robot] = max(0, left[line.robot] - battery.stay)
        assert left[line.robot] >= 0, plan
    played()


def test_time_drains_a_robot_off_the_chargers_and_charges_one_on_them() -> None:
    _, plan = loads(lambda number: scenario(number, most=1), 3)
    team = team_of(plan)
    energy = team.members[0].energy
    assert energy is not None
    state = initial(team)
    later = apply(team, state, now.Time(2.0, flows=True)).robots[0].charge
    assert later == energy.stayed(state.robots[0].charge, state.robots[0].pose, 2.0)
