"""Robots that can never move again, and what that makes hopeless."""

import random

import pytest

from runtime.coordination.floors import Bot, Floor
from safenav.runtime.traffic.immobile import Stuck
from safenav.runtime.traffic.joint import Course, Exhausted
from safenav.runtime.traffic.joint_plan import Search

ROOM = ["#####", "#...#", "#...#", "#####"]
"""Regions 6 to 8 above 11 to 13."""


def found(grid: list[str], bots: dict[str, Bot]) -> tuple[str, str]:
    """Those who can never move again, and those of whom one can never complete."""
    floor = Floor(grid, bots)
    course = Course(floor.problem, 1)
    stuck, start = Stuck(course), course.begun(floor.poses, floor.counts, ())
    names = list(bots)

    def named(robots: set[int]) -> str:
        return " ".join(names[i] for i in sorted(robots))

    return named(stuck.robots(floor.poses)), named(stuck.cannot_complete(start))


@pytest.mark.parametrize(
    ("bots", "stuck", "hopeless"),
    [
        pytest.param(
            {"a": Bot("6w", [8]), "b": Bot("11w", [13])},
            "a b",
            "a b",
            id="face to face in a corner",
        ),
        pytest.param({"a": Bot("6w", [8]), "b": Bot("11s", [13])}, "", "", id="one can turn away"),
        pytest.param({"a": Bot("6w", [8]), "b": Bot("11", [13])}, "", "", id="one needs not turn"),
        pytest.param(
            {"a": Bot("6w", [6]), "b": Bot("11w", [11])}, "a b", "", id="where they want to be"
        ),
        pytest.param(
            {"a": Bot("6w", [6]), "b": Bot("11w", [11]), "c": Bot("8", [12])},
            "a b",
            "",
            id="in nobody's way",
        ),
        pytest.param(
            {"a": Bot("6w", [6]), "b": Bot("11w", [11]), "c": Bot("8", [6])},
            "a b",
            "a b c",
            id="where another one wants to be",
        ),
        pytest.param(
            {"a": Bot("6w", [6]), "b": Bot("11w", [11]), "c": Bot("8", [6], layer="air")},
            "a b",
            "",
            id="on another layer",
        ),
    ],
)
def test_who_is_stuck_and_whom_that_stops(bots: dict[str, Bot], stuck: str, hopeless: str) -> None:
    assert found(ROOM, bots) == (stuck, hopeless)


def test_what_is_called_hopeless_has_no_plan() -> None:
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
        if Stuck(course).cannot_complete(start):
            judged += 1
            nobody = [None] * len(bots)
            search = Search(course, lambda *_, n=nobody: n, start, course.completed)
            assert isinstance(search.singles(50_000), Exhausted)
    assert judged > 50
