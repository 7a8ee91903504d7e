"""The least charges of a random robot alone with a battery, by a search over pose, target and
charge: with these, and no less, it continues forever, and its run is completed."""

import os
from collections import defaultdict
from collections.abc import Callable
from random import Random

import pytest

from drawn import loads
from runtime.played import play
from support.draft import Data
from support.floors import free_in, walled

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 50
HEADINGS = ("north", "east", "south", "west")
State = tuple[int, int]
"""A pose, which is the region and the heading times the size of the map, and a charge."""


def drawn(seed: int) -> Data:
    """A small space with chargers; some robots use charge by standing."""
    random = Random(f"batteries {seed}")
    grid = walled(random, random.randint(2, 4), random.randint(3, 5), 0.2)
    free = free_in(grid)
    stay, kind = random.choice((0, 0, 1)), random.choice(("visit", "visit", "patrol", "once"))
    capacity = random.randint(4, 16) * (1 + stay)
    battery = {"capacity": capacity, "charge": random.choice((1, 3, 5)) + stay, "stay": stay}
    model = {
        "mobility": random.choice(("free", "free", "heading")),
        "layer": "ground",
        "battery": battery | {"start": random.randint(1, capacity)},
    }
    count = min(len(free), 2 if kind == "patrol" else random.choice((1, 2, 3)))
    robot = {"model": "cart", "start": random.choice(free), "heading": random.choice(HEADINGS)}
    return {
        "safenav": 1,
        "map": {"grid": grid},
        "catalogue": {"robots": {"cart": model}},
        "robots": {"cart": robot | {"objective": {kind: random.sample(free, count)}}},
        "chargers": random.sample(free, min(len(free), random.choice((1, 2, 3)))),
        "until": {"rounds": random.choice((1, 2))},
        "limits": {"ticks": 600},
    }


def walks(data: Data) -> dict[State, set[State]]:
    """The states before each one: by a step, a charge, or a stay."""
    grid, model = data["map"]["grid"], data["catalogue"]["robots"]["cart"]
    battery, cols, size = model["battery"], len(grid[0]), len(grid) * len(grid[0])
    before = defaultdict[State, set[State]](set)
    turns = model["mobility"] == "heading"
    for region in free_in(grid):
        for heading in range(4 if turns else 1):
            pose = heading * size + region
            for charge in range(battery["capacity"] + 1):
                after = [
                    ((way if turns else 0) * size + region + step, charge - 1)
                    for way, step in enumerate((-cols, 1, cols, -1))
                    if "".join(grid)[region + step] == "."
                    and not (turns and way == (heading + 2) % 4)
                ]
                if region in data["chargers"]:
                    after.append((pose, min(battery["capacity"], charge + battery["charge"])))
                elif charge >= 1:  # else it is out of service
                    after.append((pose, charge - battery["stay"]))
                for state in after:
                    if state[1] >= 0:
                        before[state].add((pose, charge))
    return before


def lasting(data: Data) -> list[set[State]]:
    """For each next target the states from which all targets are met infinitely often, or the last
    one is where it settles: the greatest sets from which a walk leads to the target and into the
    set of the next one."""
    before, ((kind, targets),) = walks(data), data["robots"]["cart"]["objective"].items()
    size = len("".join(data["map"]["grid"]))
    found = [set().union(*before.values()) for _ in targets]
    while True:
        after = []
        for turn, target in enumerate(targets):
            last = turn + 1 == len(targets)
            then = found[(turn if kind == "once" else 0) if last else turn + 1]
            good = set[State]()
            left = [state for state in then if state[0] % size == target]
            while left:
                more = before[left.pop()] - good
                good |= more
                left += more
            after.append(good & found[turn])
        if after == found:
            return found
        found = after


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_robot_alone_continues_iff_its_charge_suffices(
    seed: int, played: Callable[[], None]
) -> None:
    data, _ = loads(drawn, seed)
    robot, model = data["robots"]["cart"], data["catalogue"]["robots"]["cart"]
    ((kind, targets),) = robot["objective"].items()
    turn = int(kind == "patrol" and robot["start"] == targets[1])
    heading = HEADINGS.index(robot["heading"]) if model["mobility"] == "heading" else 0
    pose = heading * len("".join(data["map"]["grid"])) + robot["start"]
    charges = [charge for at, charge in lasting(data)[turn] if at == pose]
    need = min(charges, default=None)
    for start in {model["battery"]["start"], need or 1, max(1, (need or 1) - 1)}:
        model["battery"]["start"] = start
        end = play(data).outcome
        suffices = need is not None and start >= need
        assert (end["outcome"] == "completed") is suffices, data
        assert suffices or end["refused"] == {"cart.battery": need}
    played()
