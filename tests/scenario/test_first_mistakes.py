"""Mistakes in a first scenario, and the message of each: place, error, remedy."""

from pathlib import Path
from typing import Any

import pytest

from once import beside, from_yaml
from safenav.errors import Diagnostic, InputError
from safenav.scenario.reading.loader import load_scenario_text

FIRST = beside(__file__, "scenarios/first_mistakes_first.yaml")

MISTAKES = from_yaml((Path(__file__).parent / "first_mistakes.yaml").read_text())


def messages(found: tuple[Diagnostic, ...]) -> list[str]:
    """Return messages as ``line:column: error (remedy)``."""
    return [f"{d.line}:{d.column}: {d.found}" + (f" ({d.hint})" if d.hint else "") for d in found]


def test_the_first_scenario_is_valid() -> None:
    assert load_scenario_text(FIRST).name == "first try"


@pytest.mark.parametrize("mistake", MISTAKES, ids=[each["written"] for each in MISTAKES])
def test_a_mistake_is_reported_with_its_remedy(mistake: dict[str, Any]) -> None:
    assert mistake["part"] in FIRST
    text = FIRST.replace(mistake["part"], mistake["written"], 1)
    with pytest.raises(InputError) as caught:
        load_scenario_text(text, "first.yaml")
    assert messages(caught.value.diagnostics) == mistake["told"]
