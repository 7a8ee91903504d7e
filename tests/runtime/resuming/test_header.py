"""The audit compares the header of a rest with the run that it continues."""

import re

import pytest

from runtime.played import loaded, play
from runtime.resuming.cuts import BATTERY, DOOR, KINDS, ONE, ORDERS, continued
from safenav.audit.check import audit
from safenav.runtime.analysis.resuming import resumed
from safenav.trace.reading import read_lines


@pytest.mark.parametrize(
    ("end", "robot", "other", "rule"),
    [
        (48, "q", {"rounds": 2}, "deadline"),
        (40, "q", {"turn": 0}, "goal-order"),
        (40, "q", {"clock": {"since": 8}}, "deadline"),
        (15, "r", {"seen": [0, 1, 2]}, "completed"),
    ],
)
def test_a_header_that_tells_otherwise_breaks_a_rule(
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
        (40, ("begun", "robots", "q", "rounds"), 2, "q begins with 2 rounds, but had 0"),
        (40, ("begun", "robots", "q", "seen"), [], r"targets \[\], but had \[0\]"),
        (40, ("begun", "robots", "q", "turn"), 0, "target 0, but 1 was next"),
        (40, ("begun", "robots", "q", "clock", "since"), 2, "began 3 ticks earlier, not 2"),
        (24, ("begun", "due"), {}, "is due, but the first run leaves {'door@2'"),
        (24, ("begun", "due", "door@2"), 9, "is due, but the first run leaves"),
        (40, ("begun", "had"), ["d", "q"], "d, q moved in tick 1"),
        (24, ("begun", "asked"), {}, "nothing is requested; in the first run: {'door@2'"),
        (24, ("begun", "asked", "door@2", "q"), 9, " is requested; in the first run: {'door@2'"),
        (40, ("begun", "stays"), ["door@2"], "door@2 is kept; in the first run: none"),
        (40, ("begun", "closed"), ["door@2"], "door@2 is untraversable; the first run found none"),
        (24, ("begun", "waited"), {}, "the waiting times none; in the first run: {'d'"),
        (24, ("begun", "waited", "d"), 9, "; in the first run: {'d'"),
        (40, ("begun", "trace"), "0" * 64, "continues another trace"),
        (24, ("begun", "late"), ["door@2"], "door@2 is late; in the first run: none"),
        (40, ("begun", "robots", "q", "clock", "over"), True, "q is not disturbed, .*, is judged"),
        (40, ("begun",), None, "does not record that it continues"),
        (40, ("robots", "q", "start"), 0, "q begins at 0"),
        (
            40,
            ("robots", "q", "objective"),
            {"visit": [0, 4]},
            "q has the objective 'visit 0, 4', but had '",
        ),
    ],
)
def test_a_header_that_tells_otherwise_is_found(
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
    told = told_otherwise(BATTERY, 20, ("robots", "c", "battery", "start"), 12)
    assert told[0].startswith("c begins with a charge of 12, but had ")
    told = told_otherwise(ORDERS, 20, ("begun", "met"), {})
    assert told[0].startswith("0 needs of load@13#2 are fulfilled; in the first run: 1")
