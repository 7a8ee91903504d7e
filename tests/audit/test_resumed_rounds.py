"""Headers of resumed runs, and the progress of objectives that robots resume."""

from collections.abc import Iterator

import pytest

from audit.good_traces import GOOD
from audit.trace_script import Line, text
from safenav.audit.check import audit, check_trace
from safenav.audit.judging import can_have_met
from safenav.audit.lines import Made
from safenav.audit.needs import Need
from safenav.audit.rules.rule import Finding
from safenav.audit.run.progress import Progress
from safenav.trace.reading import read_lines


def continued(lines: list[Line]) -> Iterator[Finding]:
    """The findings on a trace that continues one without such a header, and one with it."""
    trace, plain = read_lines(text(lines)), read_lines(text(GOOD["door"]()))
    for after in (plain, trace):
        yield from audit(trace, after=after).findings


STRANGERS = [
    ({"robots": {"mule": {"rounds": 1}}}, "mule"),
    ({"asked": {"door@9": {"mule": 7}}}, "mule"),
    ({"had": ["quad", "mule"]}, "mule"),
    ({"charging": ["mule"]}, "mule"),
    ({"waited": {"mule": 2}}, "mule"),
    ({"met": {"door@9": [["mule"]]}}, "mule"),
    ({"plan": {"robots": {"mule": [[7, None]]}, "orders": [], "reason": "waiting"}}, "mule"),
    ({"plan": {"robots": {}, "orders": [["quad", 1, "mule", 1]], "reason": "waiting"}}, "mule"),
    ({"asked": {"gate@9": {"quad": 7}}}, "gate@9"),
    ({"met": {"gate@9": [["quad"]]}}, "gate@9"),
    ({"stays": ["gate@9"]}, "gate@9"),
    ({"closed": ["gate@9"]}, "gate@9"),
    ({"due": {"gate@9": 3}}, "gate@9"),
    ({"late": ["gate@9"]}, "gate@9"),
]


@pytest.mark.parametrize(("begun", "stranger"), STRANGERS)
def test_a_header_names_only_robots_and_obstacles_of_the_scenario(
    begun: Line, stranger: str
) -> None:
    lines = GOOD["door"]()
    lines[0]["scenario"]["begun"] = begun
    first = check_trace(text(lines)).findings[0]
    told = f"'{stranger}' is not in the scenario"
    assert (first.rule, first.line, first.explanation) == ("names", 1, told)
    assert {f.rule for f in continued(lines)} >= {"names", "continuation"}


@pytest.mark.parametrize("groups", [[], [["quad"]], [["quad"], ["digit"]]])
def test_a_header_with_an_obstacle_whose_needs_are_all_fulfilled_is_refused(
    groups: list[list[str]],
) -> None:
    lines = GOOD["door"]()
    lines[0]["scenario"]["begun"] = {"met": {"door@9": groups}}
    first = check_trace(text(lines)).findings[0]
    told = "cannot have met the first needs of door@9"
    assert (first.rule, first.line) == ("header", 1) and told in first.explanation
    assert {f.rule for f in continued(lines)} == {"header", "continuation"}


@pytest.mark.parametrize("line", ["request", "push"])
def test_of_several_unknown_names_the_first_in_order_is_reported(line: str) -> None:
    lines = GOOD["door"]()
    at = next(i for i, each in enumerate(lines) if each["type"] == line)
    lines[at]["helpers"] = ["zebra", "mule", "yak"]
    (finding, *_) = [f for f in check_trace(text(lines)).findings if f.rule == "names"]
    assert finding.explanation == "'mule' is not in the scenario"


@pytest.mark.parametrize(
    ("groups", "good"),
    [([["a", "b"]], True), ([["a"]], False), ([["a", "d"]], False), ([["a", "b"]] * 2, False)],
)
def test_fulfilled_needs_take_as_many_robots_as_they_require(
    groups: list[list[str]], good: bool
) -> None:
    """Two take a load, and the same two put it down; the last need is another one."""
    pair, every = frozenset("ab"), frozenset("abc")
    here = frozenset([1])
    needs = [Need(every, here, 2), Need(pair, here, 2, same=True), Need(every, here)]
    assert can_have_met(needs, groups) is good


@pytest.mark.parametrize(
    ("targets", "awaited"),
    [([{1}, {2}], 1), ([{2}, {1}], 0), ([{1, 2}, {1, 3}], None), ([{3}, {1, 3}], 0)],
)
def test_a_strategy_that_begins_on_both_targets_may_count_either_next(
    targets: list[set[int]], awaited: int | None
) -> None:
    objective = Made(kind="visit", targets=tuple(map(frozenset, targets)))
    synthesis = Made(objective=objective, memory={"goal": 0})
    assert Progress().remembering(synthesis, 1).awaited == awaited
