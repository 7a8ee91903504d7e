"""A line ends at a line feed, for every reader of specifications and scenarios: behind other
characters, what is a comment to one program would be a formula to another."""

import pytest

from safenav.errors import InputError
from safenav.scenario.reading.loader import load_scenario_text
from safenav.spec.specification import read_specification

SEPARATORS = ["\r", "\f", "\x85", "\u2028"]
"""Some of what Python takes for the end of a line, apart from a line feed."""
ids = [f"U+{ord(separator):04X}" for separator in SEPARATORS]

TEXT = """# {}
[INPUT]
somebody
[OUTPUT]
light
[ENV_TRANS]
# an assumption: {}
[SYS_TRANS]
light' <-> somebody'
"""
HIDDEN = TEXT.format("a light", "none{}!somebody'")
SCENARIO = """safenav: 1
until: {{rounds: 1}}
robots:
  a: {{model: quadcopter, start: 6, objective: {{hold: 6}}}}
map: {{grid: ["#####", "#...#", "#####"]}}
{}
"""


@pytest.mark.parametrize("separator", SEPARATORS, ids=ids)
def test_an_assumption_behind_a_separator_is_refused(separator: str) -> None:
    text = HIDDEN.format(separator) + "[ENV_INIT]\n!somebody\n"
    with pytest.raises(InputError, match=rf"spec:7:22: not text: .*U\+{ord(separator):04X}"):
        read_specification(text, "spec")


@pytest.mark.parametrize("separator", SEPARATORS, ids=ids)
def test_a_scenario_with_a_separator_is_refused(separator: str) -> None:
    with pytest.raises(InputError, match=rf"7:10: not text: .*U\+{ord(separator):04X}"):
        load_scenario_text(SCENARIO.format(f"\n# comment{separator}seed: 3"))
    escaped = f'name: "a\\u{ord(separator):04X}b"'
    with pytest.raises(InputError, match=rf"the text holds .*U\+{ord(separator):04X}"):
        load_scenario_text(SCENARIO.format(escaped))


def test_tabs_and_carriage_returns_before_line_feeds_are_fine() -> None:
    text = HIDDEN.format("\t").replace("\n", "\r\n")
    assert len(read_specification(text).constraints) == 1
    assert load_scenario_text(SCENARIO.format("\tname: x").replace("\t", "").replace("\n", "\r\n"))
