"""A scenario's expectations are compared with its run: bounds, rounds, order, never."""

import pytest

from safenav.batch.case import Ledger, differences
from safenav.outcome import Outcome
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Expect
from safenav.trace.records import (
    End,
    Goal,
    KnownObstacle,
    Record,
    Request,
    Resolved,
    Violation,
)
from safenav.trace.vocabulary import BlockReason

ROOM = """\
safenav: 1
map:
  grid: |
    ######
    #....#
    ######
  names: {dock: 8}
robots:
  quad: {model: quadcopter, start: 7, objective: {patrol: [7, 10]}}
  digit: {model: digit, start: 10, heading: west, objective: {hold: 10}}
obstacles:
  - {type: door, region: 9}
expect: """

RUN: list[Record] = [
    Goal(1, "quad", 0, 7, 0),
    Violation(2, "quad", 8, 9, "door@9", "push"),
    Request(2, "door@9", "quad", {"digit": 1}, "digit", (9,)),
    Resolved(4, "door@9", "digit", 9, True, None),
    KnownObstacle(4, "uncertainty@8", frozenset({"quad"}), BlockReason.UNTRAVERSABLE),
    Goal(6, "quad", 1, 10, 1),
    End(6, Outcome.COMPLETED, "", {"quad": 1, "digit": 5}, 6, 0.1, 2, 0.05),
]


def expected(written: str) -> Expect:
    return load_scenario_text(ROOM + written + "\n").expect


def wrong(written: str) -> list[str]:
    ledger = Ledger()
    for event in RUN:
        ledger(event)
    return differences(expected(written), ledger)


@pytest.mark.parametrize(
    "written",
    [
        "{ticks: 6}",
        "{rounds: 1}",
        "{rounds: {digit: 5}}",
    ],
)
def test_a_run_that_meets_its_expectation_has_no_difference(written: str) -> None:
    assert wrong(written) == []


@pytest.mark.parametrize(
    ("written", "difference"),
    [
        ("{ticks: 5}", "ticks: expected at most 5, got 6"),
        ("{rounds: 2}", "rounds: expected at least 2 of quad, got 1"),
    ],
)
def test_a_difference_is_named(written: str, difference: str) -> None:
    assert wrong(written) == [difference]
