"""The examples of docs/scenario.md and docs/maps.md load."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from safenav.errors import InputError
from safenav.scenario.reading.loader import load_scenario_text

ROOT = Path(__file__).parents[2]


def examples(name: str) -> list[str]:
    text = (ROOT / "docs" / name).read_text(encoding="utf-8")
    return re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


WHOLE, *FRAGMENTS = examples("scenario.md")
MAPS = examples("maps.md")
FILES = {
    "floor.png": "rooms.png",
    "wards.png": "rooms_coloured.png",
    "office.yaml": "office.yaml",
    "arena.map": "rooms.map",
}
"""What the files that docs/maps.md names are here."""


def test_the_first_example_is_a_whole_scenario() -> None:
    assert load_scenario_text(WHOLE).name == "opening a door"
    assert len(FRAGMENTS) == 16


@pytest.mark.parametrize("fragment", FRAGMENTS, ids=[str(i) for i in range(len(FRAGMENTS))])
def test_fragments_fit_into_the_whole_scenario(fragment: str) -> None:
    whole = yaml.safe_load(WHOLE) | yaml.safe_load(fragment)
    if "catalogue" in whole:
        assert load_scenario_text(yaml.safe_dump(whole)).robots[0].model.name in ("rover", "digit")
    else:
        assert load_scenario_text(yaml.safe_dump(whole)).map.cols == 13


@pytest.mark.parametrize("fragment", MAPS, ids=["image", "ros", "movingai", "legend"])
def test_maps_of_every_form_load_as_documented(fragment: str) -> None:
    for name, file in FILES.items():
        fragment = fragment.replace(name, str(ROOT / "tests" / "maps" / file))
    text = f"safenav: 1\n{fragment}"
    robots = "robots: {ann: {model: quadcopter, start: %d, objective: {hold: %d}}}\n"
    for start in range(1000):  # wherever it is free
        try:
            assert load_scenario_text(text + robots % (start, start)).map.free
            return
        except InputError as error:
            assert "is a wall" in str(error), error
    raise AssertionError("no region is free")
