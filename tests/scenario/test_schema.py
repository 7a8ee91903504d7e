"""The JSON Schema: it accepts what the loader accepts, refuses wrong shapes, and names the
same words as the code."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from safenav.formula.syntax import RESERVED_WORDS
from safenav.scenario.model import Controllers, Coordination, ResolveAt, Tracking
from safenav.scenario.reading import areas as area_reader
from safenav.scenario.reading import catalogue, loader
from safenav.scenario.reading import changes as change_reader
from safenav.scenario.reading import expectation as expectation_reader
from safenav.scenario.reading import objective as objective_reader
from safenav.scenario.reading import obstacles as obstacle_reader
from safenav.scenario.reading import partition as partition_reader
from safenav.scenario.reading import robots as robot_reader
from safenav.scenario.reading.maps import map as map_reader
from safenav.scenario.schema import schema_text
from safenav.scenario.yaml.document import DocumentError, Mapping, Node, Scalar, read_document
from safenav.world.map import Heading
from safenav.world.moves import Mobility

SCHEMA: dict[str, Any] = json.loads(schema_text())
VALIDATOR = Draft202012Validator(SCHEMA)
FOLDER = Path(__file__).parents[2] / "scenarios"
VALID = sorted(FOLDER.glob("*.yaml"))
BROKEN = {file.stem: file for file in sorted((FOLDER / "invalid").rglob("*.yaml"))}

WELL_SHAPED = {
    "bad_areas": False,
    "bad_changes": False,
    "bad_event_patterns": False,
    "bad_expectations": False,
    "bad_forms": False,
    "bad_formulas": True,
    "bad_headings": False,
    "bad_obstacle_type": False,
    "bad_partition": False,
    "bad_patrols": False,
    "bad_requirements": False,
    "bad_robot_model": False,
    "bad_robot_names": False,
    "bad_tiles": False,
    "bad_tracking": False,
    "bad_truths": False,
    "form_before_targets": True,
    "duplicate_keys": True,
    "empty_map": False,
    "empty_objectives": False,
    "illegal_map_characters": False,
    "missing_catalogue_file": True,
    "missing_keys": False,
    "no_robots": False,
    "bad_inputs": False,
    "keys_of_an_objective": False,
    "bad_orders": False,
    "never_together": False,
    "no_way_back_with_heading": True,
    "rules_beside": False,
    "not_a_scenario": False,
    "obstacles_in_bad_places": True,
    "partition_with_gaps": True,
    "ragged_map": True,
    "two_map_forms": False,
    "no_map_form": False,
    "keys_of_another_map_form": False,
    "missing_map_file": False,  # rows without cols
    "regions_in_walls": True,
    "regions_outside_map": False,  # one region is negative
    "robots_that_avoid_each_other": True,
    "tracking_of_slow_robots": True,
    "two_robots_on_one_region": True,
    "unknown_keys": False,
    "unknown_models_and_types": True,
    "unknown_region_name": False,  # one name is no name
    "unknown_version": False,
    "unreachable_target": True,
    "wrong_types": False,
}
"""For each broken scenario that is YAML at all: whether its shape is right, so that only the
loader can see what is wrong with it."""


def plain(node: Node) -> Any:
    if isinstance(node, Scalar):
        return node.value
    if isinstance(node, Mapping):
        return {key.value: plain(item) for key, item in node.entries}
    return [plain(item) for item in node.items]


def read(file: Path) -> Any:
    try:
        return plain(read_document(file.read_text(encoding="utf-8")).root)
    except DocumentError:
        return None


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("file", VALID, ids=[file.stem for file in VALID])
def test_valid_scenarios_have_the_right_shape(file: Path) -> None:
    assert [error.message for error in VALIDATOR.iter_errors(read(file))] == []


@pytest.mark.parametrize("name", ["robots", "obstacles"])
def test_the_built_in_catalogue_has_the_right_shape(name: str) -> None:
    file = Path(str(catalogue.__file__)).parents[1] / "built_in" / f"{name}.yaml"
    part = {**SCHEMA["$defs"]["catalogue"], "$defs": SCHEMA["$defs"]}
    assert list(Draft202012Validator(part).iter_errors(read(file))) == []


def test_every_broken_scenario_is_judged() -> None:
    readable = {name for name, file in BROKEN.items() if read(file) is not None}
    assert readable == set(WELL_SHAPED)


@pytest.mark.parametrize(("name", "well_shaped"), WELL_SHAPED.items(), ids=list(WELL_SHAPED))
def test_wrong_shapes_are_refused(name: str, well_shaped: bool) -> None:
    assert VALIDATOR.is_valid(read(BROKEN[name])) is well_shaped


def definition(name: str) -> dict[str, Any]:
    found: dict[str, Any] = SCHEMA["$defs"][name]
    return found


@pytest.mark.parametrize(
    ("part", "keys", "required"),
    [
        (SCHEMA, loader.KEYS, loader.REQUIRED),
        (SCHEMA["properties"]["limits"], loader.LIMIT_KEYS, ()),
        (SCHEMA["properties"]["failures"], loader.FAILURE_KEYS, ()),
        (SCHEMA["properties"]["until"], loader.UNTIL_KEYS, ()),
        (
            SCHEMA["properties"]["suspects"]["items"],
            obstacle_reader.SUSPECT_KEYS,
            obstacle_reader.REQUIRED,
        ),
        (definition("battery"), catalogue.BATTERY_KEYS, catalogue.BATTERY_REQUIRED),
        (definition("map"), map_reader.KEYS, ()),
        (definition("rectangle"), area_reader.KEYS, ()),
        (definition("robot"), robot_reader.KEYS, robot_reader.REQUIRED),
        (definition("obstacle"), obstacle_reader.KEYS, obstacle_reader.REQUIRED),
        (definition("change"), change_reader.KEYS, change_reader.REQUIRED),
        (definition("objective"), objective_reader.KEYS, ()),
        (definition("ltl"), objective_reader.LTL_KEYS, ()),
        (definition("expect"), expectation_reader.KEYS, ()),
        (definition("partition")["oneOf"][1], partition_reader.KEYS, partition_reader.KEYS),
        (definition("timing")["oneOf"][1], catalogue.TIMING_KEYS, catalogue.TIMING_REQUIRED),
        (definition("catalogue"), catalogue.CATALOGUE_KEYS, ()),
        (definition("model"), catalogue.MODEL_KEYS, catalogue.MODEL_REQUIRED),
        (definition("obstacleType"), catalogue.TYPE_KEYS, ()),
        (definition("need"), catalogue.NEED_KEYS, catalogue.TYPE_REQUIRED),
    ],
    ids=lambda value: str(value.get("title", "")) if isinstance(value, dict) else "",
)
def test_schema_and_loader_know_the_same_keys(
    part: dict[str, Any], keys: tuple[str, ...], required: tuple[str, ...]
) -> None:
    assert set(part["properties"]) == set(keys)
    assert set(part.get("required", ())) == set(required)
    assert part["additionalProperties"] is False


@pytest.mark.parametrize(
    ("words", "options"),
    [
        (SCHEMA["properties"]["coordination"]["enum"], Coordination),
        (SCHEMA["properties"]["controllers"]["enum"], Controllers),
        (definition("expect")["properties"]["outcome"]["enum"], expectation_reader.OUTCOMES),
        (definition("model")["properties"]["mobility"]["enum"], Mobility),
        (definition("obstacleType")["properties"]["resolve_at"]["oneOf"][0]["enum"], ResolveAt),
        (definition("robot")["properties"]["tracking"]["enum"], Tracking),
    ],
    ids=["coordination", "controllers", "outcome", "mobility", "resolve_at", "tracking"],
)
def test_schema_and_code_know_the_same_words(words: list[str], options: type[StrEnum]) -> None:
    assert words == [option.value for option in options]


def test_schema_and_code_know_the_same_bounds_and_words_for_defaults() -> None:
    ticks, bounds = definition("timing")["oneOf"]
    assert ticks == bounds["properties"]["least"] == bounds["properties"]["most"]
    assert ticks["maximum"] == catalogue.MOST_TICKS
    assert definition("vision")["oneOf"][1]["const"] == catalogue.UNLIMITED
    assert definition("partition")["oneOf"][0]["const"] == partition_reader.ROOMS


def test_schema_and_code_know_the_same_headings_and_reserved_words() -> None:
    headings = definition("robot")["properties"]["heading"]["enum"]
    assert headings == [heading.label for heading in Heading]
    reserved = SCHEMA["properties"]["robots"]["propertyNames"]["not"]["enum"]
    assert set(reserved) == RESERVED_WORDS | objective_reader.OWN_VARIABLES
