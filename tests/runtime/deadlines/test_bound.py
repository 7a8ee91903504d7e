"""The lower bound against every behaviour of a team: never above the earliest resolution."""

from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import product
from random import Random

import pytest

from safenav.runtime.deadlines.bound import (
    BoundMoment,
    BoundNeed,
    BoundObstacle,
    BoundRobot,
    earliest,
    tick_of,
)
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, bits, region_mask

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 60
MOST = 24


@dataclass
class Case:
    moment: BoundMoment
    sizes: list[int]


def case(seed: int) -> Case:
    """One to three robots that have just had their turns of tick 0, one or two obstacles."""
    random = Random(seed)
    rows, cols = 2, random.randint(3, 4)
    wall = "#" * (cols + 2)
    inside = [
        "".join("#" if random.random() < 0.15 else "." for _ in range(cols)) for _ in range(rows)
    ]
    world = RegionMap.from_grid([wall, *(f"#{row}#" for row in inside), wall])
    free = sorted(world.free)
    count = random.choice((1, 2, 2, 3))
    walkers = []
    for k in range(count):
        turns = Mobility.HEADING if k == 0 and random.random() < 0.4 else Mobility.FREE
        graph = PoseGraph(world, turns)
        skills = frozenset(action for action in "ab" if random.random() < 0.7)
        start = random.choice(list(bits(graph.everywhere)))
        walkers.append(BoundRobot(graph, start, 0, 1, skills))
    opens = []
    for _ in range(random.randint(1, 2)):
        parts = []
        for k in range(random.choice((1, 1, 2))):
            robots = random.choice((1, 1, 2))
            where = region_mask(random.sample(free, min(2, len(free))))
            same = k > 0 and random.random() < 0.5
            robots = parts[-1].robots if same else robots
            together = robots > 1 and random.random() < 0.5
            parts.append(BoundNeed(frozenset(random.choice("ab")), where, robots, together, same))
        closed = frozenset(k for k in range(count) if random.random() < 0.6)
        opens.append(BoundObstacle(random.choice(free), tuple(parts), (closed,) * len(parts)))
    return Case(
        BoundMoment(tuple(walkers), tuple(opens), count - 1), [w.graph.size for w in walkers]
    )


State = tuple[tuple[int, ...], tuple[tuple[int, frozenset[int], frozenset[int]], ...]]


def resolved_at(case: Case) -> dict[int, int]:
    """The earliest tick in which each obstacle is resolved, over all behaviours without collisions:
    turn after turn, each robot stays or steps, then does what it can where it is."""
    moment = case.moment
    n = moment.count
    everybody = frozenset(range(n))
    states: set[State] = {
        (
            tuple(walker.pose for walker in moment.walkers),
            tuple((0, frozenset[int](), everybody) for _ in moment.opens),
        )
    }
    found: dict[int, int] = {}
    for tick, robot in product(range(1, MOST), range(n)):
        after: set[State] = set()
        graph = moment.walkers[robot].graph
        for poses, stages in states:
            shut = {
                one.region
                for one, (need, _, _) in zip(moment.opens, stages, strict=True)
                if need < len(one.parts) and robot in one.closed[need]
            }
            here = poses[robot]
            for pose in (here, *graph.steps(here)):
                if pose != here and pose % graph.size in shut:
                    continue
                at = (*poses[:robot], pose, *poses[robot + 1 :])
                acted = tuple(acts(case, k, stage, robot, at) for k, stage in enumerate(stages))
                after.add((at, acted))
                for k, (need, _, _) in enumerate(acted):
                    if need == len(moment.opens[k].parts):
                        found.setdefault(k, tick)
        if after == states and robot == n - 1:
            break
        states = after
    return found


def acts(
    case: Case,
    number: int,
    stage: tuple[int, frozenset[int], frozenset[int]],
    robot: int,
    at: tuple[int, ...],
) -> tuple[int, frozenset[int], frozenset[int]]:
    parts = case.moment.opens[number].parts
    need, done, group = stage
    while need < len(parts):
        part = parts[need]

        def there(one: int, part: BoundNeed = part, group: frozenset[int] = group) -> bool:
            able = part.actions <= case.moment.walkers[one].capabilities
            return (
                able
                and bool(part.regions >> at[one] % case.sizes[one] & 1)
                and (not part.same or one in group)
            )

        if not there(robot):
            break
        had = frozenset(filter(there, range(len(at)))) if part.together else done | {robot}
        if len(had) < part.robots:
            return need, frozenset() if part.together else had, group
        need, done, group = need + 1, frozenset(), had
    return need, done, group


@pytest.mark.parametrize("seed", range(COUNT))
def test_the_bound_is_never_above_what_can_be(seed: int) -> None:
    asked = case(seed)
    truth = resolved_at(asked)
    for number, turns in enumerate(earliest(asked.moment)):
        bound = tick_of(turns[-1], asked.moment.count)
        if number in truth:
            assert bound is not None
            assert bound <= truth[number]
