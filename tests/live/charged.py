"""Missions of robots with batteries in time."""

from random import Random

import yaml

from campaigns.generate.build import Data
from live.missions import former, timed
from runtime.energy.test_battery_runs import stop
from safenav.team.battery import Energy
from safenav.world.poses import bits

Charged = tuple[int, int]
"""A pose and a charge."""


def alone(seed: int) -> Data:
    """A cart among walls, whose charge suffices or not."""
    data: Data = yaml.safe_load(stop(seed))
    return data


def team(seed: int) -> Data:
    """A mission in time in which the robots of some models have batteries."""
    if (found := former(f"charged_{seed}")) is not None:
        return found
    for again in range(100):
        data, random = timed(7919 * again + seed), Random(f"charged {seed} {again}")
        models = (data.get("catalogue") or {}).get("robots") or {}
        robots = [r for r in data["robots"].values() if r["model"] in models]
        if (
            not robots
            or len(data["robots"]) > 6
            or any("cover" in r["objective"] or "ltl" in r["objective"] for r in robots)
        ):
            continue
        grid = "".join(data["map"]["grid"])
        free = [region for region, cell in enumerate(grid) if cell == "."]
        data["chargers"] = random.sample(free, min(len(free), random.randint(3, 6)))
        data.pop("coordination", None)
        for model in models.values():
            capacity, stay = random.randint(40, 120), random.choice((0, 0, 1))
            model["battery"] = {"capacity": capacity, "charge": random.randint(1, 8), "stay": stay}
        return data
    raise AssertionError(f"no mission with batteries for {seed}")


def lasting(energy: Energy) -> set[Charged]:
    """From where, with the first target next, all targets are met again and again, or the last one
    is where it settles: the greatest sets from which a walk leads to each target and into the set
    of the next one."""
    moves = _moves(energy)
    found = [set(moves) for _ in energy.targets]
    while True:
        after = [
            _leading(moves, target, found[energy.turn(turn + 1)]) & found[turn]
            for turn, target in enumerate(energy.targets)
        ]
        if after == found:
            return found[0]
        found = after


def _moves(energy: Energy) -> dict[Charged, list[Charged]]:
    battery, moves = energy.battery, dict[Charged, list[Charged]]()
    for pose in bits(energy.graph.everywhere):
        for charge in range(battery.capacity + 1):
            after = [(step, charge - battery.move) for step in energy.graph.steps(pose)]
            if energy.chargers >> pose & 1:
                after.append((pose, min(battery.capacity, charge + battery.charge)))
            elif charge >= battery.move:  # else it is out of service
                after.append((pose, charge - battery.stay))
            moves[pose, charge] = [each for each in after if each[1] >= 0]
    return moves


def _leading(moves: dict[Charged, list[Charged]], target: int, then: set[Charged]) -> set[Charged]:
    """From where a walk leads to the target, and there into a set."""
    good = set[Charged]()
    while more := {
        each
        for each, steps in moves.items()
        if each not in good
        and any((target >> to[0] & 1 and to in then) or to in good for to in steps)
    }:
        good |= more
    return good
