"""Each trace that is unsafe, untrue, or claims a negative without proof, is refused by its rule.

``good/`` has traces of correct runs, ``broken.yaml`` damages of each: the rule (``no-trace``: it
cannot be read), tick and robot (``-``: none) of the first finding, or of another one that has the
words after a colon, and the edits.
"""

from pathlib import Path

import pytest

from once import from_yaml
from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError
from support.damage import GOOD, Edit, damage, text

BROKEN = from_yaml((Path(__file__).parent / "broken.yaml").read_text())
CASES = [
    pytest.param(name, told, edits, id=f"{name} {number}: {told}")
    for name, each in BROKEN.items()
    for number, (told, *edits) in enumerate(each)
]


@pytest.mark.parametrize("name", GOOD)
def test_a_good_trace_is_accepted(name: str) -> None:
    found = judge(text(GOOD[name]()))
    assert found.ok and found.outcome


@pytest.mark.parametrize(("name", "told", "edits"), CASES)
def test_a_broken_rule_is_named_with_tick_and_robot(
    name: str, told: str, edits: list[Edit]
) -> None:
    about, _, words = told.partition(": ")
    try:
        found = judge(text(damage(GOOD[name](), edits)))
    except NotATraceError:
        assert about.startswith("no-trace")
        return
    said = [
        (f"{one.rule} {one.tick} {one.robot or '-'}", one.explanation)
        for one in (*found.findings, *found.notes)
    ]
    said = said if words else said[:1]
    assert any(about == rule and words in explanation for rule, explanation in said), said
