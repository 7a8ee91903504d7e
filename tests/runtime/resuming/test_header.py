"""The audit compares the header of a rest with the run that it continues."""

import re

import pytest
from safenav.runtime.analysis.resuming import resumed

from runtime.facts import case
from runtime.played import loaded, play
from runtime.resuming.cuts import KINDS, ONE, continued
from safenav.audit.check import audit
from safenav.trace.reading import read_lines

DOOR = case("resumed/door_with_deadlines")


@pytest.mark.parametrize(
    ("end", "robot", "other", "rule"),
    [
        (48, "q", {"rounds": 2}, "deadline"),
        (40, "q", {"turn": 0}, "goal-order"),
        (40, "q", {"clock": {"since": 8}}, "deadline"),
        (15, "r", {"seen": [0, 1, 2]}, "completed"),
    ],
)
def test_a_false_header_breaks_the_rule_that_depends_on_it(
    end: int, robot: str, other: dict[str, object], rule: str
) -> None:
    """The audit counts from what the header tells of the run before."""
    scenario = loaded(DOOR if robot == "q" else ONE % KINDS["cover"])
    run = continued(play(scenario), end, scenario)
    run.records[0]["scenario"]["begun"]["robots"][robot] |= other
    assert rule in run.broken


@pytest.mark.parametrize(
    ("end", "where", "other", "said"),
    [
        (40, ("begun", "robots", "q", "rounds"), 2, "rounds of q: 2; in the first run: 0"),
        (
            40,
            ("begun", "robots", "q", "seen"),
            [],
            "targets that q has met: none; in the first run: 0",
        ),
        (40, ("begun", "robots", "q", "turn"), 0, "next target of q: 0; in the first run: 1"),
        (
            40,
            ("begun", "robots", "q", "clock", "since"),
            2,
            "ticks of q in its round: 2; in the first run: 3",
        ),
        (
            24,
            ("begun", "robots", "d", "uncounted"),
            False,
            "uncounted target of d: False; in the first run: True",
        ),
        (
            36,
            ("begun", "robots", "d", "uncounted"),
            True,
            "uncounted target of d: True; in the first run: False",
        ),
        (24, ("begun", "due"), {}, "deadlines: none; in the first run: {'door@2'"),
        (24, ("begun", "due", "door@2"), 9, "deadlines: {.*}; in the first run: {"),
        (
            40,
            ("begun", "had"),
            ["d", "q"],
            "robots that moved in tick 1: d, q; in the first run: d",
        ),
        (24, ("begun", "asked"), {}, "requests: none; in the first run: {'door@2'"),
        (24, ("begun", "asked", "door@2", "q"), 9, "requests: {.*}; in the first run: {'door@2'"),
        (40, ("begun", "stays"), ["door@2"], "permanent obstacles: door@2; in the first run: none"),
        (
            40,
            ("begun", "closed"),
            ["door@2"],
            "untraversable obstacles: door@2; in the first run: none",
        ),
        (40, ("begun", "waited"), {}, "ticks without progress: none; in the first run: {'q'"),
        (40, ("begun", "waited", "q"), 9, "; in the first run: {'q'"),
        (40, ("begun", "trace"), "0" * 64, "continues another trace"),
        (24, ("begun", "late"), ["door@2"], "late obstacles: door@2; in the first run: none"),
        (40, ("begun", "robots", "q", "clock", "over"), True, r"judged\): \(False, True, True\)"),
        (40, ("begun",), None, "does not record that it continues"),
        (40, ("robots", "q", "start"), 0, r"pose of q: \(0, "),
        (
            40,
            ("robots", "q", "objective"),
            {"visit": [0, 4]},
            "objective of q: visit 0, 4; in the first run: ",
        ),
    ],
)
def test_a_header_that_differs_from_the_run_before_is_reported(
    end: int, where: tuple[str, ...], other: object, said: str
) -> None:
    told = told_otherwise(DOOR, end, where, other)
    assert any(re.search(said, one) for one in told), told


def told_otherwise(text: str, end: int, where: tuple[str, ...], other: object) -> list[str]:
    """What the audit says of the header of a rest that was changed."""
    scenario = loaded(text)
    first = read_lines(play(scenario).lines[:end])
    run = play(resumed(first, scenario))
    place = run.records[0]["scenario"]
    for key in where[:-1]:
        place = place[key]
    place[where[-1]] = other
    found = audit(read_lines(run.lines), first).findings
    return [one.explanation for one in found if one.rule == "continuation"]


def test_a_charge_and_the_progress_with_a_load_are_compared() -> None:
    told = told_otherwise(case("resumed/charge"), 20, ("robots", "c", "battery", "start"), 12)
    assert told[0].startswith("charge of c: 12; in the first run: ")
    told = told_otherwise(case("resumed/loads"), 20, ("begun", "met"), {})
    assert told[0].startswith("fulfilled needs of load@13#2: 0; in the first run: 1")
