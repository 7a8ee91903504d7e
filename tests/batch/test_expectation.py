"""A scenario's expectations are compared with its run: bounds, rounds, order, never."""

import pytest

from safenav.outcome import Outcome
from safenav.runtime.analysis.expectation import Ledger, differences
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import EventKind, Expect
from safenav.trace import records
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
        "{ticks: {at_least: 6, at_most: 6}}",
        "{rounds: 1}",
        "{rounds: {digit: 5}}",
        "{order: [violation door@9, request door@9, resolved door@9]}",
        "{order: [goal 7, goal quad 10]}",
        "{order: [goal, goal]}",
        "{order: [request quad digit, resolved digit door@9]}",
        '{order: ["violation dock", "resolved [1, 3]", "blocked quad"]}',
        "{order: []}",
        "{never: [assumption, goal digit, violation digit, resolved quad]}",
    ],
)
def test_a_run_that_meets_its_expectation_has_no_difference(written: str) -> None:
    assert wrong(written) == []


@pytest.mark.parametrize(
    ("written", "difference"),
    [
        ("{ticks: 5}", "ticks: expected at most 5, got 6"),
        ("{ticks: {at_least: 7}}", "ticks: expected at least 7, got 6"),
        ("{rounds: 2}", "rounds: expected at least 2 of quad, got 1"),
        ("{order: [pop]}", "order: expected 'pop', it never happened"),
        (
            "{order: [resolved door@9, request]}",
            "order: expected 'request' after 'resolved door@9' (tick 4), it never happened, "
            "only before (tick 2)",
        ),
        (
            "{order: [goal, goal, goal]}",
            "order: expected 'goal' after 'goal' (tick 6), it never happened, only before (tick 6)",
        ),
        ("{never: [goal 10]}", "never: 'goal 10' happened at tick 6"),
        ("{never: [request digit]}", "never: 'request digit' happened at tick 2"),
    ],
)
def test_a_difference_is_named(written: str, difference: str) -> None:
    assert wrong(written) == [difference]


def test_patterns_speak_of_all_events_but_the_frame_of_a_run_and_what_every_tick_brings() -> None:
    kinds = set(records.KINDS)
    patterns = {kind.value for kind in EventKind}
    assert patterns <= kinds
    # Of a simulated world all obstacles are listed: none is discovered. And what a person changes
    # in a run that goes on is in no scenario.
    frame = {"header", "move", "belief", "outcome", "discovered", "plan_end"}
    changes = {"truth", "objective", "service", "inputs", "operator", "reopened", "waiting"}
    live = {"depart", "arrive", "act", "acted", "hold", "late"}  # in place of moves
    assert kinds - patterns == frame | changes | live | {"deadline", "order"}


def test_a_pattern_is_shown_as_it_can_be_written() -> None:
    (pattern,) = expected("{order: [resolved  door@9 digit dock]}").order or ()
    assert str(pattern) == "resolved digit door@9 8"
    assert expected(f"{{order: [{pattern}]}}").order == (pattern,)
