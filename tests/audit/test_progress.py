"""What goal lines tell of how far a robot is with a cover."""

import pytest

from safenav.audit.progress import Progress
from safenav.trace.objective import Objective
from safenav.trace.records import Goal

COVER = Objective("cover", (frozenset({6}), frozenset({17}), frozenset({11, 13})), "")


@pytest.mark.parametrize(
    ("goals", "covered"),
    [
        ([(0, 0), (2, 0)], {0, 2}),
        ([(0, 0), (2, 0), (1, 1)], set()),
        ([(0, 0), (2, 0), None, (1, 1)], None),  # perhaps the last one of a round, or the first
        ([(0, 0), (2, 0), None, (1, 1), (2, 1), (0, 1)], None),
        ([(0, 0), (2, 0), None, (1, 1), (2, 1), (0, 1), (1, 2)], set()),
        ([(0, 0), None, (1, 0), (2, 0), (0, 1), (1, 1)], {1}),
    ],
)
def test_a_round_is_known_once_its_beginning_was_seen(
    goals: list[tuple[int, int] | None], covered: set[int] | None
) -> None:
    """Each goal with the rounds that are done then; None: a new strategy."""
    progress = Progress.at_start(COVER, start=7)
    for tick, told in enumerate(goals):
        if told is None:
            progress.reset(COVER, tick)
        else:
            progress.meet(Goal(tick, "r", told[0], 6, told[1]))
    assert (progress.covered if progress.fresh else None) == covered
