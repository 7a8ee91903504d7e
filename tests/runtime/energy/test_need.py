"""The need of each pose against pose x target x charge, and stops: batteries never become empty,
and stops always end."""

import os
from collections.abc import Callable
from random import Random

import pytest
from msgspec.structs import replace
from safenav.runtime.stops import NEVER, Stops

from campaigns.generate.build import walled
from drawn import APART, MOST
from safenav.scenario.model import Battery
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, bits

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 30
State = tuple[int, int]


def floor(seed: int) -> Stops:
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
    full, settles = random.random() < 0.5, random.random() < 0.3
    return Stops(graph, targets, graph.everywhere, chargers, battery, full, settles)


def lasting(asked: Stops) -> list[set[State]]:
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


def walks(asked: Stops) -> dict[State, list[State]]:
    """The steps from each (pose, charge)."""
    battery, poses = asked.battery, list(bits(asked.allowed))
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
    found = asked.needs
    for turn, good in enumerate(lasting(asked)):
        for pose in bits(asked.allowed):
            charges = [c for c in range(asked.battery.capacity + 1) if (pose, c) in good]
            need = found[turn].get(pose, NEVER)
            assert charges == list(range(need, asked.battery.capacity + 1))


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_duty_counts_as_a_target_before_those_of_the_robot(
    seed: int, played: Callable[[], None]
) -> None:
    asked, random = replace(floor(seed), full=False), Random(f"duty {seed}")
    played()
    goal, turn = 1 << random.choice(list(bits(asked.allowed))), len(asked.targets) - 1
    moves, capacity = walks(asked), asked.battery.capacity
    after = lasting(asked)[turn]
    back = leading(moves, asked.chargers, set(moves))
    back |= {state for state in moves if asked.chargers >> state[0] & 1}
    duty = asked.for_duty(goal, turn)
    for then in (after & back, after):  # to a charger as well, since it may help again
        good = leading(moves, goal, then)
        if any((at, capacity) in good for at in bits(asked.chargers)):
            break
    else:  # no charge suffices, also not that of a charger
        assert duty is None
        return
    assert duty is not None
    for pose in bits(asked.allowed):
        charges = [c for c in range(capacity + 1) if (pose, c) in good]
        assert charges == list(range(duty.need(pose, 0), capacity + 1))


@pytest.mark.parametrize("seed", range(COUNT))
def test_stops_never_run_empty_and_come_to_an_end(seed: int, played: Callable[[], None]) -> None:
    random, turn, met, stop = Random(f"stop {seed}"), 0, 0, None
    for again in range(MOST):
        asked = floor(seed + again * APART)
        graph, battery = asked.graph, asked.battery
        pose = random.choice(list(bits(asked.allowed)))
        charge = random.randint(0, battery.capacity)
        if asked.need(pose, 0) <= charge:
            break
    else:
        raise AssertionError("no charge suffices")
    played()
    for _ in range(2000):
        if stop is None or (pose == stop and charge >= asked.wanted(pose, turn)):
            stop = asked.next(pose, turn, charge)
        goal = asked.targets[turn] if stop is None else 1 << stop
        ways = graph.distances(goal, asked.allowed)
        after = pose if goal >> pose & 1 else min(graph.steps(pose), key=lambda p: ways[p])
        if after != pose:
            charge -= battery.move
        elif asked.chargers >> pose & 1:
            charge = min(battery.capacity, charge + battery.charge)
        else:
            charge -= battery.stay
        pose = after
        assert charge >= 0
        if stop is not None and pose != stop:
            continue  # on its way to a stop it counts nothing
        if asked.targets[turn] >> pose & 1:
            turn, met = asked.turn(turn + 1), met + 1
            stop = stop if asked.chargers >> pose & 1 else None
        if met == 3 * len(asked.targets):
            return
    raise AssertionError("it does not come to an end")


@pytest.mark.parametrize("which", ["kept", "taken"])
@pytest.mark.parametrize(("busy", "stop"), [((), 9), ((9,), 13), ((13,), 9), ((9, 13), 9)])
def test_a_charger_that_others_have_is_chosen_last(
    busy: tuple[int, ...], stop: int, which: str
) -> None:
    """``kept``: they do not leave it; ``taken``: they charge there."""
    graph = PoseGraph(RegionMap.from_grid(["########", "#......#", "########"]), Mobility.FREE)
    chargers, battery = 1 << 9 | 1 << 13, Battery(9, 1, 0, 1, 0)
    lane = Stops(graph, (1 << 14,), graph.everywhere, chargers, battery)
    assert lane.next(11, 0, 2, **{which: sum(1 << region for region in busy)}) == stop
