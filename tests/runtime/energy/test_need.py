"""The need of each pose against pose x target x charge."""

import os
from collections.abc import Callable
from random import Random

import pytest

from safenav.scenario.model import Battery
from safenav.team.battery import NEVER, Energy
from safenav.world.map import RegionMap
from safenav.world.poses import Mobility, PoseGraph, bits
from support.floors import walled

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 30
State = tuple[int, int]


def floor(seed: int) -> Energy:
    random = Random(seed)
    free: list[int] = []
    while len(free) < 6:
        rows, cols = random.randint(2, 4), random.randint(3, 5)
        world = RegionMap.from_grid(walled(random, rows, cols, 0.2))
        free = sorted(world.free)
    graph = PoseGraph(world, random.choice(list(Mobility)))
    targets = tuple(graph.poses_on(1 << r) for r in random.sample(free, random.choice((1, 2, 3))))
    chargers = 0
    for region in random.sample(free, random.choice((0, 1, 2, 3))):
        chargers |= graph.poses_on(1 << region)
    stay = random.choice((0, 0, 1))
    battery = Battery(random.randint(4, 16), random.choice((1, 3, 5)), 0, 1, stay)
    return Energy(graph, chargers, battery, targets, random.random() < 0.3)


def lasting(asked: Energy) -> list[set[State]]:
    """For each next target the (pose, charge) from which all targets are met again and again, or
    the last one is where it settles: the greatest sets from which a walk leads to the target and
    into the set of the next one."""
    moves = walks(asked)
    found = [set(moves) for _ in asked.targets]
    while True:
        after = []
        for turn, target in enumerate(asked.targets):
            following = turn + 1 if turn + 1 < len(found) else turn if asked.settles else 0
            after.append(leading(moves, target, found[following]) & found[turn])
        if after == found:
            return found
        found = after


def walks(asked: Energy) -> dict[State, list[State]]:
    """The steps from each (pose, charge)."""
    battery, poses = asked.battery, list(bits(asked.graph.everywhere))
    moves: dict[State, list[State]] = {}
    for pose in poses:
        for charge in range(battery.capacity + 1):
            after = [(step, charge - battery.move) for step in asked.graph.steps(pose)]
            if asked.chargers >> pose & 1:
                after.append((pose, min(battery.capacity, charge + battery.charge)))
            elif charge >= battery.move:  # else it is out of service
                after.append((pose, charge - battery.stay))
            moves[pose, charge] = [state for state in after if state[1] >= 0]
    return moves


def leading(moves: dict[State, list[State]], target: int, then: set[State]) -> set[State]:
    """From where a walk leads to the target, and there into a set."""
    good = set[State]()
    while True:
        more = {
            state
            for state, steps in moves.items()
            if state not in good
            and any((target >> s[0] & 1 and s in then) or s in good for s in steps)
        }
        if not more:
            return good
        good |= more


@pytest.mark.parametrize("seed", range(COUNT))
def test_every_charge_from_the_least_on_suffices_forever(
    seed: int, played: Callable[[], None]
) -> None:
    asked = floor(seed)
    played()
    found = asked.needs(asked.graph.everywhere)
    for turn, good in enumerate(lasting(asked)):
        for pose in bits(asked.graph.everywhere):
            charges = [c for c in range(asked.battery.capacity + 1) if (pose, c) in good]
            need = found[turn].get(pose, NEVER)
            assert charges == list(range(need, asked.battery.capacity + 1))
