"""Changes of catalogue entries work as they are written."""

import json
from typing import Any

import pytest
import yaml
from msgspec.structs import replace

from safenav.explain.entry import model_change, need_change
from safenav.scenario.model import ObstacleType, ResolveAt, RobotModel
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_scenario_text
from safenav.world.moves import Mobility

SCENARIO = """
safenav: 1
map: {grid: ["####", "#..#", "####"]}
catalogue: CATALOGUE
robots: {r: {model: quadcopter, start: 5, objective: {hold: 5}}}
"""
KINDS = [*built_in().obstacles.values()]
OWN = """{obstacles: {
  one: {action: cut, blocks: [ground]},
  two: {needs: [{action: cut}, {action: lift, at: neighbours}]}}}"""


def read(change: tuple[str, str], catalogue: str = "{}") -> Any:
    """The catalogue entry with a change put into a scenario as it is written."""
    path, data = change[0].split(".")[1:], yaml.safe_load(catalogue)
    place = data
    for key in path[:-1]:
        place = place.setdefault(key, {})
    place[path[-1]] = yaml.safe_load(change[1])
    found = load_scenario_text(SCENARIO.replace("CATALOGUE", json.dumps(data)))
    return getattr(found.catalogue, path[0])[path[1]]


@pytest.mark.parametrize("model", built_in().robots.values(), ids=lambda model: model.name)
def test_a_built_in_model_is_written_whole(model: RobotModel) -> None:
    (change,) = model_change(model, capabilities="[cut, push]")
    assert read(change) == replace(model, capabilities=frozenset({"cut", "push"}))


def test_a_model_of_the_scenario_is_changed_in_one_key() -> None:
    model = replace(built_in().robots["digit"], name="ours", mobility=Mobility.HEADING)
    assert model_change(model, capabilities="[cut]") == (
        ("catalogue.robots.ours.capabilities", "[cut]"),
    )


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_built_in_type_is_written_whole(kind: ObstacleType) -> None:
    number = len(kind.needs) - 1
    need = replace(kind.needs[number], at=frozenset({5}))
    found = read(need_change(kind, number, need))
    assert found.needs == (*kind.needs[:number], need)
    assert (
        replace(found, action=kind.action, resolve_at=kind.resolve_at, listed=kind.listed) == kind
    )


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("one", ("catalogue.obstacles.one.resolve_at", "neighbours")),
        (
            "two",
            (
                "catalogue.obstacles.two.needs",
                "[{action: cut, at: neighbours}, {action: lift, at: neighbours}]",
            ),
        ),
    ],
)
def test_a_type_of_the_scenario_is_changed_as_it_is_written(
    name: str, change: tuple[str, str]
) -> None:
    kind = load_scenario_text(SCENARIO.replace("CATALOGUE", OWN)).catalogue.obstacles[name]
    need = replace(kind.needs[0], at=ResolveAt.NEIGHBOURS)
    assert need_change(kind, 0, need) == change
    assert read(change, OWN).needs == (need, *kind.needs[1:])
