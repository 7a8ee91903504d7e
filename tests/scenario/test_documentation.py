"""The examples of docs/scenario.md load."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from safenav.scenario.loader import load_scenario_text

TEXT = (Path(__file__).parents[2] / "docs" / "scenario.md").read_text(encoding="utf-8")
EXAMPLES: list[str] = re.findall(r"^```yaml\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
WHOLE, *FRAGMENTS = EXAMPLES


def test_the_first_example_is_a_whole_scenario() -> None:
    assert load_scenario_text(WHOLE).name == "opening a door"
    assert len(FRAGMENTS) == 6


@pytest.mark.parametrize("fragment", FRAGMENTS, ids=[str(i) for i in range(len(FRAGMENTS))])
def test_fragments_fit_into_the_whole_scenario(fragment: str) -> None:
    whole = yaml.safe_load(WHOLE) | yaml.safe_load(fragment)
    if "catalogue" in whole:
        assert load_scenario_text(yaml.safe_dump(whole)).robots[0].model.name == "rover"
    else:
        assert load_scenario_text(yaml.safe_dump(whole)).map.cols == 13
