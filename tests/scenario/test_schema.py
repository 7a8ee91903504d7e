"""The loader and the JSON Schema judge the shape of scenarios alike: every scenario of the project,
and hundreds with one mistake each.

The schema accepts all that the loader accepts, and refuses errors of the shape (a key, a type, a
word, a limit). Only the loader checks names, regions and formulas."""

import ast
import json
import re
from contextlib import suppress
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from once import beside
from safenav.errors import Diagnostic, InputError
from safenav.scenario.reading.loader import load_scenario_text, schema_text
from safenav.scenario.yaml.document import DocumentError, plain, read_document
from scenario.mistakes import disagreement, keys_of, mistakes, places

ROOT = Path(__file__).parents[2]
SCHEMA: dict[str, Any] = json.loads(schema_text())
VALIDATOR = Draft202012Validator(SCHEMA)

FULL = beside(__file__, "scenarios/schema_full.yaml")
"""A scenario with every key but those of other forms, which OTHERS has."""

OTHERS: list[tuple[str, Any]] = [
    ("requirements", {"apart": "always(distance(ann, bob) >= 0.1)"}),
    ("partition", {"tiles": [2, 3]}),
    ("expect", {"ticks": 9, "rounds": 2}),
    ("catalogue", "missing.yaml"),
    ("map", {"grid": "###\n#.#\n###\n"}),
    ("map", {"image": "a.png", "rows": 3, "cols": 4, "share": 0.25}),
    ("map", {"image": "a.png", "rows": 3, "cols": 4, "resolution": 1, "origin": [0, 1]}),
    ("map", {"ros": "map.yaml", "rows": 3, "cols": 4, "share": 0.5, "names": {"dock": 3}}),
    ("map", {"ros": "map.yaml", "resolution": 0.5}),
    ("map", {"movingai": "a.map", "share": 0.5, "rows": 3, "cols": 4, "resolution": 1}),
]
"""Other forms of the values of FULL."""


"""Broken scenarios that alone show that the schema refuses what it must."""


def texts() -> dict[str, str]:
    """Every scenario that stands in a file or in a text of a test."""
    found = {}
    for folder in ("scenarios", "safenav/scenario/templates", "tests"):
        for file in sorted((ROOT / folder).rglob("*.yaml")):
            found[str(file.relative_to(ROOT))] = file.read_text(encoding="utf-8")
    for file in sorted((ROOT / "tests").rglob("*.py")):
        source = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if "safenav: 1" in source else ():
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found[f"{file.relative_to(ROOT)}:{node.lineno}"] = node.value
    return {name: text for name, text in found.items() if re.search("^safenav: ", text, re.M)}


def judged(text: str, file: str = "x.yaml") -> tuple[Diagnostic, ...]:
    """The diagnostics of the loader."""
    try:
        load_scenario_text(text, file)
    except InputError as error:
        return error.diagnostics
    return ()


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(SCHEMA)


def test_every_scenario_of_the_project_is_judged_alike() -> None:
    wrong, count = {}, 0
    for name, text in texts().items():
        with suppress(DocumentError):
            data = plain(read_document(text).root)
            count += 1
            if told := disagreement(data, judged(text, str(ROOT / name)), VALIDATOR):
                wrong[name] = told
    assert wrong == {}
    assert count > 200


DATA: dict[str, Any] = plain(read_document(FULL).root)
FORMS = [*((key, DATA[key]) for key in DATA), *OTHERS]


def test_the_full_scenario_has_no_mistake_and_with_other_forms_every_key() -> None:
    assert judged(FULL) == ()
    assert list(VALIDATOR.iter_errors(DATA)) == []
    ways = [way for key, value in FORMS for way in places({key: value})]
    assert keys_of(SCHEMA, set()) == keys_of(SCHEMA, set()) & {way[-1] for way in ways}


@pytest.mark.parametrize(
    ("key", "value"), FORMS, ids=[f"{key}{i}" for i, (key, _) in enumerate(FORMS)]
)
def test_loader_and_schema_agree_on_a_mistake(key: str, value: Any) -> None:
    # The rest of the scenario is right, so that the schema need not see it.
    part = {"required": [], "properties": {key: SCHEMA["properties"][key]}}
    validator = Draft202012Validator({**SCHEMA, **part})
    wrong = {}
    for turn, way in enumerate(places({key: value})):
        whole = VALIDATOR if len(way) == 1 else validator
        for name, data in mistakes({key: value}, way, turn):
            scenario = {**{k: v for k, v in DATA.items() if k != key}, **data}
            found = judged(json.dumps(scenario))
            missing = [d for d in found if d.found.endswith(" is missing")]
            assert all(d.hint for d in missing), "a missing key is told with an example"
            if told := disagreement(scenario if whole is VALIDATOR else data, found, whole):
                wrong[name] = told
    assert wrong == {}


SIZES = {"rows": 7, "cols": 13, "share": 0.5, "resolution": 0.4, "origin": [0, 1]}


@pytest.mark.parametrize(
    ("form", "start"),
    [
        ({"grid": ["...."]}, 1),
        ({"image": "rooms.png"}, 14),
        ({"ros": "office.yaml"}, 14),
        ({"movingai": "rooms.map"}, 14),
        ({"grid": ["...."], "image": "rooms.png"}, 1),
    ],
)
def test_loader_and_schema_agree_on_the_keys_of_a_map(form: dict[str, Any], start: int) -> None:
    robot = {"model": "quadcopter", "start": start, "objective": {"hold": start}}
    for chosen in product((False, True), repeat=len(SIZES)):
        given = {key: SIZES[key] for key, is_chosen in zip(SIZES, chosen, strict=True) if is_chosen}
        data = {"safenav": 1, "map": {**form, **given}, "robots": {"ann": robot}}
        told = judged(json.dumps(data), str(ROOT / "tests/maps/scenario.yaml"))
        assert VALIDATOR.is_valid(data) == (not told), (data, told)


def test_the_schema_refuses_a_helper_of_an_obstacle_without_a_place() -> None:
    for name, fits in (("door@47", True), ("door", False)):
        part = {"required": [], "properties": {"expect": SCHEMA["properties"]["expect"]}}
        validator = Draft202012Validator({**SCHEMA, **part})
        assert validator.is_valid({"expect": {"helpers": {name: "ann"}}}) is fits
