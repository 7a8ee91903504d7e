"""A random robot alone with a battery: what the need of its first pose promises."""

import json
import os
from collections.abc import Callable
from random import Random

import pytest

from drawn import loads
from runtime.played import play
from safenav.team.apply import initial
from safenav.team.battery import NEVER
from safenav.team.team import team_of
from support.floors import free_in, walled

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 20


def scenario(seed: int) -> str:
    """A small space with chargers; some robots use charge by standing."""
    random = Random(f"batteries {seed}")
    grid = walled(random, random.randint(3, 5), random.randint(4, 7), 0.2)
    free = free_in(grid)
    stay = random.choice((0, 0, 1))
    capacity = random.randint(10, 24) * (1 + stay)
    battery = {"capacity": capacity, "charge": random.randint(1, 4) + stay, "stay": stay}
    model = {
        "mobility": random.choice(("free", "free", "heading")),
        "layer": "ground",
        "battery": battery | {"start": random.randint(capacity // 2, capacity)},
    }
    objective = {random.choice(("visit", "visit", "patrol", "once")): random.sample(free, 2)}
    robot = {"model": "cart", "start": random.choice(free), "heading": "east"}
    return json.dumps(
        {
            "safenav": 1,
            "map": {"grid": grid},
            "catalogue": {"robots": {"cart": model}},
            "robots": {"cart": robot | {"objective": objective}},
            "chargers": random.sample(free, random.choice((1, 2))),
            "until": {"rounds": random.choice((1, 2))},
            "limits": {"ticks": 600},
        }
    )


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_robot_alone_completes_its_rounds_if_its_charge_suffices(
    seed: int, played: Callable[[], None]
) -> None:
    _, plan = loads(scenario, seed)
    (member,), (robot,) = team_of(plan).members, initial(team_of(plan)).robots
    energy = member.energy
    assert energy is not None
    need = float(energy.need(member.floor, robot.pose, energy.turn(robot.own.memory)))
    end = play(plan).outcome
    suffices = need <= energy.battery.start
    assert (end["outcome"] == "completed") is suffices, plan
    if not suffices:
        assert end["refused"] == {"cart.battery": None if need >= NEVER else need}
    played()
