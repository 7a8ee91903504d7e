"""Swept regions in traces of live runs: robots that enter them are judged, not robots that were
already there."""

from collections.abc import Callable

import pytest

from audit.good_live_traces import Live
from audit.trace_script import Line, obstacle, robot, text
from safenav.audit.check import check_trace

HOLD: Line = {"ltl": {}}
DOOR = obstacle("door", 8, "push", [8], ["a", "b"]) | {"sweeps": [7, 9, 14]}


def noticed() -> Live:
    """A robot beside a region notices a door there, and one that could open it is inside."""
    robots = {"a": robot("ground", ["push"], 7, HOLD), "b": robot("air", [], 10, HOLD)}
    s = Live(robots, [DOOR], "external")
    s.at(0).depart("a", 8).depart("b", 9).at(1).arrive("a").arrive("b").at(1)
    why = {"proposed": 8, "obstacle": "door@8", "action": "push"}
    s.add("violation", robot="b", at=9, **why).add("backtrack", robot="b", to=9).hold("b", "held")
    return s.at(2).hold("a", "held").at(3)


def away(s: Live) -> Live:
    return s.depart("b", 10).at(4).arrive("b").at(5)


def slides(s: Live) -> Live:
    return away(s).depart("b", 16).at(6).arrive("b", "elsewhere", at=9).at(7).hold("b", "held")


def slides_in(s: Live) -> Live:
    """The other one ends inside again."""
    s.depart("a", 14).at(4).arrive("a").at(5).depart("a", 13)
    return s.at(6).arrive("a", "elsewhere", at=8).at(7).hold("a", "held")


def acts(s: Live) -> Live:
    return s.act("a", on="door@8")


@pytest.mark.parametrize(
    ("story", "culprits"),
    [
        (lambda s: s, []),
        (lambda s: acts(away(s)), []),
        (acts, ["a"]),
        (lambda s: s.depart("b", 15), []),
        (lambda s: away(s).depart("b", 9), ["b"]),
        (lambda s: acts(away(s)).depart("b", 9), ["b"]),
        (slides, []),
        (lambda s: acts(slides(s)), ["a"]),
        (lambda s: s.depart("a", 14).at(4).arrive("a").at(5).depart("a", 8), ["a"]),
        (slides_in, []),
        (lambda s: acts(slides_in(s)), ["a"]),
    ],
    ids=[
        *("stay", "leaves first", "acts beside it", "leaves", "comes back", "comes while it acts"),
        *("slides", "acts beside one that slid", "enters beside it", "slides in", "acts slid in"),
    ],
)
def test_no_robot_enters_or_acts_where_others_are_and_those_there_may_leave(
    story: Callable[[Live], Live], culprits: list[str]
) -> None:
    findings = check_trace(text(story(noticed()).end("interrupted", {"a": 0, "b": 0}))).findings
    told = [(f.rule, f.robot) for f in findings if f.rule != "request"]  # none is made
    assert told == [("swept", culprit) for culprit in culprits]
