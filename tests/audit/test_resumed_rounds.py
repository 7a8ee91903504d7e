"""Names that are not in the scenario, and the progress of objectives that robots resume."""

import pytest

from audit.good_traces import GOOD
from audit.trace_script import text
from safenav.audit.check import check_trace
from safenav.audit.judging import can_have_met
from safenav.audit.lines import Made
from safenav.audit.needs import Need
from safenav.audit.run.progress import Progress


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
