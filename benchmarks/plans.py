"""Measures how much shorter joint plans become before they are executed.

    python benchmarks/plans.py                 # 100 plans of random crowds in rooms
    python benchmarks/plans.py --plans 20

The runs are those of the campaigns' family ``crowd``, seed after seed. ``ticks``: each step takes
one, and begins as soon as the plan's order allows. Nothing here is a test: it reports.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Any
from unittest.mock import patch

import click
import missions
from safenav.runtime.resolution.problem import Separation
from safenav.runtime.traffic import planning
from safenav.runtime.traffic.joint_search import shortening
from safenav.runtime.traffic.joint_search.execution import schedule
from safenav.runtime.traffic.joint_search.formula_memory import plain_poses
from safenav.runtime.traffic.joint_search.states import Course, JointState

from safenav.report.terminal.table import table

MOST_TICKS, MOST_MS = 0.75, 5.0
"""Bars: the ratio of ticks, and the median of the milliseconds."""


@dataclass(frozen=True)
class Shortened:
    """Ticks and steps of a plan before and after, and the CPU time that it took."""

    ticks: tuple[int, int]
    steps: tuple[int, int]
    milliseconds: float


def plans(count: int) -> list[Shortened]:
    """The first ``count`` joint plans of the crowds."""
    found: list[Shortened] = []
    original = shortening.shortened

    def measured(course: Course, states: Sequence[JointState], *rest: Any) -> Sequence[JointState]:
        begun = time.process_time()
        new = original(course, states, *rest)
        spent = 1000 * (time.process_time() - begun)
        (a, b), (c, d) = (_size(course, plan) for plan in (states, new))
        found.append(Shortened((a, c), (b, d), spent))
        return new

    with patch.object(planning, "shortened", measured):
        seed = 0
        while len(found) < count:
            missions.crowd(seed)
            seed += 1
    return found[:count]


def _size(course: Course, states: Sequence[JointState]) -> tuple[int, int]:
    """Ticks and steps of a plan."""
    problem = course.problem
    sizes = [member.graph.size for member in problem.members]
    poses = [plain_poses(problem, state.poses) for state in states]
    joint = shortening.timed(schedule(Separation(sizes, problem.conflicts), poses))
    steps = sum(a != b for x, y in pairwise(joint) for a, b in zip(x, y, strict=True))
    return len(joint) - 1, steps


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--plans", "count", default=100, show_default=True)
def main(count: int) -> None:
    """Print ticks and steps of joint plans before and after they are shortened."""
    found = plans(count)
    ticks, steps = (
        [sum(getattr(plan, of)[k] for plan in found) for k in (0, 1)] for of in ("ticks", "steps")
    )
    times = [plan.milliseconds for plan in found]
    longer = sum(plan.ticks[1] > plan.ticks[0] for plan in found)
    ratio, middle = ticks[1] / ticks[0], median(times)
    rows = [
        (f"ticks of {len(found)} plans", *ticks, f"{ratio:.2f}", MOST_TICKS, ratio <= MOST_TICKS),
        ("steps", *steps, f"{steps[1] / steps[0]:.2f}", "", ""),
        ("plans that became longer", "", "", longer, 0, not longer),
        ("median, CPU ms", "", "", f"{middle:.1f}", MOST_MS, middle <= MOST_MS),
        ("slowest, CPU ms", "", "", f"{max(times):.0f}", "", ""),
    ]
    words = {True: "yes", False: "no"}
    told = [(*row[:-1], words.get(row[-1], "")) for row in rows]
    for line in table(("what", "before", "after", "figure", "bar", "met"), told):
        click.echo(line)


if __name__ == "__main__":
    main()
