"""Shortened plans: never longer, valid in every order, and the same goals in the same order."""

import random
from collections.abc import Callable
from itertools import pairwise

import pytest
from msgspec.structs import replace
from safenav.runtime.resolution.problem import Separation
from safenav.runtime.traffic.joint_search.execution import schedule
from safenav.runtime.traffic.joint_search.shortening import shortened
from safenav.runtime.traffic.joint_search.states import Course, Found, JointState

from runtime.coordination.floors import Block, Bot, Floor
from runtime.traffic.test_joint_search import SWAP, play, search
from safenav.world.poses import FAR, region_mask

ROOMS = [
    "#########",
    "#...#...#",
    "#.......#",
    "#...#...#",
    "###.#####",
    "#.......#",
    "#.......#",
    "#########",
]


def ticks(floor: Floor, states: list[JointState]) -> int:
    """Ticks of a plan, by its order between the robots alone."""
    sizes = [member.graph.size for member in floor.problem.members]
    apart = floor.problem.zones
    plan = schedule(Separation(sizes, floor.problem.conflicts, apart), [s.poses for s in states])
    waits: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for order in plan.orders:
        waits.setdefault((order.robot, order.step), []).append((order.other, order.before))
    ends = {(robot, -1): 0 for robot in range(len(sizes))}
    left = [(robot, step) for robot, way in enumerate(plan.paths) for step in range(len(way) - 1)]
    while left:
        robot, step = left.pop(0)
        before = [(robot, step - 1), *waits.get((robot, step), ())]
        if all(each in ends for each in before):
            ends[robot, step] = 1 + max(ends[each] for each in before)
        else:
            left.append((robot, step))
    return max(ends.values())


def steps(states: list[JointState]) -> int:
    return sum(a != b for x, y in pairwise(states) for a, b in zip(x.poses, y.poses, strict=True))


def counted(states: list[JointState], robot: int) -> list[int]:
    """The poses in which a plan counts the goals of a robot, in order."""
    return [b.poses[robot] for a, b in pairwise(states) if a.counts[robot] != b.counts[robot]]


def crowd(seed: int) -> Floor:
    """Two to five robots in rooms, some with headings, at times with an obstacle in a doorway,
    or with a room for one robot at a time."""
    rng = random.Random(seed)
    free = [i for i, c in enumerate("".join(ROOMS)) if c == "."]
    turning = ["", *"nesw"] if seed % 3 == 0 else [""]
    starts = rng.sample([region for region in free if region not in (22, 39)], rng.randint(2, 5))
    bots = {
        f"r{k}": Bot(f"{at}{rng.choice(turning)}", rng.sample(free, 2), can="push" if k else "")
        for k, at in enumerate(starts)
    }
    door = Block(22, [("push", 1, [21, 22, 23], False)], blocks=range(len(bots)))
    floor = Floor(ROOMS, bots, [door] if seed % 4 == 0 else [])
    zone = region_mask([37, *range(46, 53), *range(55, 62)])
    if seed % 5 == 0 and sum(zone >> start & 1 for start in starts) < 2:
        floor.problem = replace(floor.problem, zones=((frozenset(range(len(bots))), zone),))
    return floor


@pytest.mark.parametrize("seed", range(40))
def test_a_shortened_plan_meets_the_same_goals_in_fewer_ticks_and_steps(
    seed: int, played: Callable[[], None]
) -> None:
    rng, floor = random.Random(seed), crowd(seed)
    first = floor.problem.nothing_done
    until = (lambda state: state.stages != first) if first else None
    answer = search(floor, goal=until).run(1, 1)
    if not isinstance(answer, Found):
        pytest.skip("no plan within a small budget")
    old, members = list(answer.states), floor.problem.members
    fixed = [i for i, member in enumerate(members) if member.turns or rng.random() < 0.5]
    new = list(shortened(Course(floor.problem, 1), old, fixed))
    played()
    play(floor, Found(tuple(new)), rng)
    assert new[0] == old[0]
    assert new[-1].stages == old[-1].stages
    assert all(state.stages == first for state in new[:-1])
    assert ticks(floor, new) <= ticks(floor, old)
    assert steps(new) <= steps(old)
    for robot in range(len(members)):
        pose, before = new[-1].poses[robot], old[-1].poses[robot]
        if new[-1].stages == first:
            assert counted(new, robot) == counted(old, robot)
            assert pose == before or robot not in fixed
        else:  # the rest of the way to where the old plan ended is left out
            allowed = floor.problem.allowed(robot, first)
            assert members[robot].graph.distances(1 << before, allowed)[pose] < FAR


def stopping() -> None:
    raise InterruptedError


def test_shortening_removes_detours() -> None:
    """One robot walks round the ring before it enters the niche; nobody needs that."""
    floor = Floor(SWAP, {"a": Bot("6", [8]), "b": Bot("8", [6])})
    course = Course(floor.problem, 1)
    states = [course.begun(floor.poses, floor.counts, floor.problem.nothing_done)]
    way = [(7, 8), (6, 8), (7, 8), (12, 8), (12, 7), (12, 8), (12, 7), (12, 6), (7, 6), (8, 6)]
    for poses in way:
        states.append(course.moved(states[-1], poses, range(2)))
    assert course.completed(states[-1])
    with pytest.raises(InterruptedError):
        shortened(course, states, (), stopping)
    new = list(shortened(course, states, ()))
    assert (ticks(floor, states), ticks(floor, new), steps(new)) == (10, 6, 6)
