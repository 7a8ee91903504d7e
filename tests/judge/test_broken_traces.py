"""Good traces broken on purpose: the judge refuses each that is unsafe, untrue, or claims a
negative without proof. It need not judge bookkeeping: who helps, why a
robot stays, what was planned."""

from collections import Counter

import pytest

from audit.test_rules import CASES, GOOD, GOOD_IN_TICKS, Case, both, living
from audit.trace_script import Line, text
from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError

NARRATIVE = {
    *("backtrack", "belief", "bids", "follows-plan", "helper", "hold", "holds", "late"),
    *("missed-belief", "missed-goal", "missed-pop", "missed-resolution", "out-of-turn", "plan"),
    *("pop", "push", "request", "strategy", "synthesis", "told", "verdicts", "violation"),
}
"""Rules of the audit on lines that explain, on facts that are left out, which makes a run look
worse, and on strategies, which bundles prove."""
BOOKKEEPING = Counter(
    {
        "act opened 5 digit": 1,  # an action on an obstacle that is unknown
        "blocked untraversable 2 quad": 1,  # the line is left out
        "blocked detour 1 rover": 1,  # a weaker word for the same proof
        "command delayed 2 b": 1,
        "command delayed 5 a 2": 1,
        "command opened 8 digit": 3,
        "command delayed 10 a": 1,
        "command simulated 4 a": 1,
        "completed shared_floor 2 - 2": 1,  # it could have ended before
        "gone come_and_gone 5 -": 1,  # the line is left out
        "goal-order unrequested 6 quad": 1,  # a goal that does not count
        "goal-order unrequested 3 digit": 1,
        "inputs door 8 -": 1,  # they are as before
        "names door 8 -": 1,  # in a report that was dropped
        "need lifted 1 cart": 1,
        "order shared_floor 1 one 3": 1,  # turns
        "order door 7 digit": 1,
        "order door 2 quad": 1,
        "order lost_around 2 a 2": 1,
        "outcome door 8 -": 3,  # statistics
        "outcome door 9 -": 1,
        "outcome simulated 6 -": 5,
        "proof operator 2 -": 1,  # the line is left out
        "resolution unrequested 2 digit": 1,  # whether a request was open
        "service told 3 cart 2": 1,  # it was in service already
        "waiting lost 4 -": 2,
        "waiting lost 7 -": 1,
        "waiting waits 3 -": 1,
        "waiting waits 2 -": 1,
    }
)
"""Bookkeeping of other rules: how many of their cases the judge accepts."""
WEAKER = {"pressed", "untraversable", "unrequested"}
"""Traces that are completed for the audit by a round that began before the last resolution."""


def refused(lines: list[Line]) -> bool:
    try:
        return not judge(text(lines)).ok
    except NotATraceError:
        return True


def broken(case: Case) -> list[Line]:
    told, *mutations = case
    lines = GOOD[told.split()[1]]()
    both(*mutations)(lines)
    return lines


@pytest.mark.parametrize("name", GOOD)
def test_a_good_trace_is_accepted(name: str) -> None:
    found = judge(text(GOOD[name]())).findings
    assert {one.rule for one in found} == ({"end"} if name in WEAKER else set())


@pytest.mark.parametrize("name", GOOD_IN_TICKS)
def test_a_good_trace_in_seconds_is_accepted(name: str) -> None:
    found = judge(text(living(GOOD_IN_TICKS[name]()))).findings
    assert {one.rule for one in found} == ({"end"} if name in WEAKER else set())


def test_what_is_unsafe_or_untrue_is_refused() -> None:
    weak = {f"{name} " for name in WEAKER}
    accepted = Counter(
        told
        for told, *mutations in CASES
        if told.split()[0] not in NARRATIVE
        and not any(name in told for name in weak)
        and not refused(broken((told, *mutations)))
    )
    assert not accepted - BOOKKEEPING


@pytest.mark.parametrize("name", ["door", "beliefs", "cycle", "lifted", "opened", "lost"])
def test_a_line_of_other_values_is_refused_or_judged(name: str) -> None:
    lines = GOOD[name]()
    for number, line in enumerate(lines):
        for key in line:
            for value in (None, -1, 2**60, "ghost", []):
                changed = [*lines[:number], {**line, key: value}, *lines[number + 1 :]]
                refused(changed)
