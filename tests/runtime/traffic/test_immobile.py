"""Robots that can never move again, and the objectives that become infeasible."""

import random

from safenav.runtime.traffic.joint_search.immobile import ImmobileRobots
from safenav.runtime.traffic.joint_search.search import Search
from safenav.runtime.traffic.joint_search.states import Course, Exhausted

from runtime.coordination.floors import Bot, Floor


def test_an_immobile_robot_in_the_target_of_another_stops_it() -> None:
    bots = {"a": Bot("6w", [6]), "b": Bot("11w", [11]), "c": Bot("8", [6])}
    floor = Floor(["#####", "#...#", "#...#", "#####"], bots)
    course = Course(floor.problem, 1)
    stuck, start = ImmobileRobots(course), course.begun(floor.poses, floor.counts, ())
    assert (stuck.robots(floor.poses), stuck.cannot_complete(start)) == ({0, 1}, {0, 1, 2})


def test_a_team_that_is_called_hopeless_has_no_joint_plan() -> None:
    """Robots on tight floors, against the exhaustive search."""
    judged = 0
    for seed in range(400):
        rng = random.Random(seed)
        rows, cols = rng.choice([(2, 2), (2, 3), (1, 4)])
        inside = [["." if rng.random() < 0.9 else "#" for _ in range(cols)] for _ in range(rows)]
        grid = ["#" * (cols + 2), *(f"#{''.join(row)}#" for row in inside), "#" * (cols + 2)]
        free = [i for i, c in enumerate("".join(grid)) if c == "."]
        count = rng.randint(2, 4)
        if count > len(free):
            continue
        bots = {
            f"r{k}": Bot(f"{start}{rng.choice(['', *'nesw'])}", rng.sample(free, rng.randint(1, 2)))
            for k, start in enumerate(rng.sample(free, count))
        }
        floor = Floor(grid, bots)
        course = Course(floor.problem, 1)
        start = course.begun(floor.poses, floor.counts, ())
        if ImmobileRobots(course).cannot_complete(start):
            judged += 1
            nobody = [None] * len(bots)
            search = Search(course, lambda *_, n=nobody: n, start, course.completed)
            assert isinstance(search.singles(50_000), Exhausted)
    assert judged > 50
