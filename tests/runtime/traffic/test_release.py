"""Robots that have completed their part of a joint plan may leave it: the mission stays possible in
every order, shown by going through all states of small floors."""

import os
import random
from collections import deque
from collections.abc import Iterator

from safenav.runtime.resolution.problem import Separation
from safenav.runtime.traffic.joint_search.execution import (
    Execution,
    Schedule,
    schedule,
    still_needed,
)
from safenav.runtime.traffic.joint_search.states import Course, Found, JointState

from runtime.coordination.floors import Bot, Floor
from runtime.traffic.test_joint_search import search

DEAD_END = ["#######", "#.....#", "#..####", "#######"]
FLOORS = int(os.environ.get("SAFENAV_FUZZ", "8"))


def small_floor(seed: int) -> Floor:
    """Two or three robots on a few regions, at least one of them with headings."""
    rng = random.Random(f"release {seed}")
    rows, cols, robots = rng.choice([(2, 4, 2), (3, 3, 2), (3, 4, 2), (2, 3, 3)])
    full = [[rng.random() < 0.15 for _ in range(cols)] for _ in range(rows)]
    lines = ["".join("#" if wall else "." for wall in row) for row in full]
    grid = ["#" * (cols + 2), *(f"#{line}#" for line in lines), "#" * (cols + 2)]
    free = [r for r, cell in enumerate("".join(grid)) if cell == "."]
    places = rng.sample(free, min(len(free), robots))
    bots = {}
    for k, place in enumerate(places):
        heading = rng.choice("nesw") if k == 0 or rng.random() < 0.5 else ""
        bots[f"r{k}"] = Bot(f"{place}{heading}", [rng.choice(free), place])
    return Floor(grid, bots)


def completable(course: Course, start: JointState) -> set[JointState]:
    """The states among all that ``start`` leads to from which the mission can be completed."""
    before: dict[JointState, list[JointState]] = {start: []}
    queue = deque(before)
    while queue:
        state = queue.popleft()
        for robot, pose in course.singles(state):
            after = course.after(state, robot, pose)
            if after not in before:
                before[after] = []
                queue.append(after)
            before[after].append(state)
    found = {state for state in before if course.completed(state)}
    queue = deque(found)
    while queue:
        for state in before[queue.popleft()]:
            if state not in found:
                found.add(state)
                queue.append(state)
    return found


def released(
    course: Course, first: JointState, plan: Schedule, *, returning: bool = True
) -> Iterator[tuple[JointState, tuple[int, ...]]]:
    """Every state of a team whose robots follow a plan in any order and leave it when they have
    done their way, with their steps taken. ``returning``: only by moves that they can undo."""
    problem = course.problem
    start = (first, (0,) * len(plan.paths))
    known, queue = {start}, deque([start])
    while queue:
        state, taken = queue.popleft()
        yield state, taken
        run = Execution(plan)
        run.taken = [*taken]
        after = []
        for robot, pose in course.singles(state):
            graph = problem.members[robot].graph
            if not run.done(robot):
                if run.next(robot) == pose:
                    steps = (*taken[:robot], taken[robot] + 1, *taken[robot + 1 :])
                    after.append((course.after(state, robot, pose), steps))
                continue
            closed = still_needed(problem, run, robot)
            others = {state.poses[o] % graph.size for o in problem.conflicts[robot]}
            around = closed | sum(1 << region for region in others)
            free = graph.everywhere & ~graph.poses_on(around)
            back = not returning or graph.returns(pose, state.poses[robot], free)
            if not closed >> pose % graph.size & 1 and back:
                after.append((course.after(state, robot, pose), taken))
        for one in after:
            if one not in known:
                known.add(one)
                queue.append(one)
        assert run.finished or any(run.next(robot) is not None for robot in range(len(taken)))


def beginnings(floor: Floor) -> Iterator[tuple[Course, JointState, Schedule]]:
    """Plans for the whole mission, each cut where a robot has had its target once."""
    found = search(floor)
    plan = found.run()
    if not isinstance(plan, Found):
        return
    sizes = [member.graph.size for member in floor.problem.members]
    for end in range(2, len(plan.states) + 1):
        states = plan.states[:end]
        if end == len(plan.states) or states[-1].counts != plan.states[end].counts:
            joint = [state.poses for state in states]
            yield (
                found.course,
                states[0],
                schedule(Separation(sizes, floor.problem.conflicts), joint),
            )


def test_robots_that_leave_a_plan_never_make_the_mission_impossible() -> None:
    left = 0
    for seed in range(FLOORS):
        alive: set[JointState] = set()
        for course, first, plan in beginnings(small_floor(seed)):
            alive = alive or completable(course, first)
            states = set(released(course, first, plan))
            assert {state for state, _ in states} <= alive, f"floor {seed}"
            ends = tuple(way[-1] for way in plan.paths)
            run = Execution(plan)
            for state, taken in states:
                run.taken = [*taken]
                done = [robot for robot in range(len(ends)) if run.done(robot)]
                left += not run.finished and any(state.poses[k] != ends[k] for k in done)
    assert left > FLOORS, "hardly anybody leaves a plan here: the test shows nothing"


def test_a_robot_with_headings_must_be_able_to_come_back() -> None:
    """Why not every free region will do: a robot that leaves its plan into a dead end it cannot
    turn round in."""
    floor = Floor(DEAD_END, {"a": Bot("8e", [9, 8]), "b": Bot("12w", [8, 9])})
    for course, first, plan in beginnings(floor):
        reached = {state for state, _ in released(course, first, plan, returning=False)}
        if not reached <= completable(course, first):
            return
    raise AssertionError("no move makes the mission impossible here")
