"""The canonical form of a scenario, read again, is the same scenario."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from safenav.errors import InputError
from safenav.scenario.dump import dump
from safenav.scenario.model import Catalogue, Scenario
from safenav.scenario.reading.loader import load_scenario, load_scenario_text

ROOT = Path(__file__).parents[2]
FILES = sorted(
    path
    for folder in ("scenarios", "tests", "benchmarks", "safenav/scenario/templates")
    for path in (ROOT / folder).rglob("*.yaml")
    if "invalid" not in path.parts
)


def same(scenario: Scenario) -> Scenario:
    """The scenario without its file: its name, and warnings about a map that was an image."""
    catalogue = Catalogue(scenario.catalogue.robots, scenario.catalogue.obstacles)
    world = replace(scenario.map, notes=())
    return replace(scenario, source="", catalogue=catalogue, map=world)


def test_every_scenario_of_the_tree_is_read_back_from_its_canonical_form() -> None:
    read = 0
    for path in FILES:
        try:
            scenario = load_scenario(path)
        except InputError:
            continue  # a matrix, a map, a case of something else
        data = json.dumps(dump(scenario))
        again = load_scenario_text(data, str(path))
        assert same(again) == same(scenario), path
        assert json.dumps(dump(again)) == data, path
        read += 1
    assert read > 100


@pytest.mark.parametrize("vision", ["unlimited", "2.5"])
def test_a_robot_may_see_as_far_as_no_robot_of_its_model(vision: str) -> None:
    text = (ROOT / "scenarios/case_study_1_beliefs.yaml").read_text()
    scenario = load_scenario_text(text.replace("vision: 4", f"vision: {vision}"))
    again = load_scenario_text(json.dumps(dump(scenario)))
    assert [robot.model for robot in again.robots] == [robot.model for robot in scenario.robots]
