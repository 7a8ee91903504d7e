"""The loader and the JSON Schema judge the shape of scenarios alike: every scenario of the project,
and hundreds with one mistake each. Any other damage also gives a scenario, or an InputError.

The schema accepts all that the loader accepts, and refuses errors of the shape (a key, a type, a
word, a limit). Only the loader checks names, regions and formulas."""

import json
import re
from contextlib import suppress
from copy import deepcopy
from functools import cache, reduce
from itertools import product
from operator import getitem
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import warm
from once import ROOT, beside, from_yaml
from safenav import Diagnostic, InputError, load_scenario_text
from scenario.mistakes import VALUES, disagreement, keys_of, mistakes, places, recorded
from support.examples import CHARACTERS, campaign

FULL = beside(__file__, "scenarios/schema_full.yaml")
"""A scenario with every key but those of other forms, which OTHERS has."""
DATA: dict[str, Any] = from_yaml(FULL)
OTHERS: list[tuple[str, Any]] = [
    ("requirements", {"apart": "always(distance(ann, bob) >= 0.1)"}),
    ("partition", {"tiles": [2, 3]}),
    ("expect", {"ticks": 9, "rounds": 2}),
    ("catalogue", "missing.yaml"),
    ("map", {"grid": "###\n#.#\n###\n"}),
    ("map", {"image": "a.png", "rows": 3, "cols": 4, "share": 0.25}),
    ("map", {"image": "a.png", "rows": 3, "cols": 4, "resolution": 1, "origin": [0, 1]}),
    ("map", {"ros": "map.yaml", "resolution": 0.5, "share": 0.5, "names": {"dock": 3}}),
    ("map", {"movingai": "a.map", "share": 0.5, "rows": 3, "cols": 4, "resolution": 1}),
]
FORMS = [*DATA.items(), *OTHERS]
NEEDED = ("safenav", "map", "areas", "inputs", "catalogue", "robots", "chargers", "obstacles")
"""The keys that others need."""


def judged(text: str, file: str = "x.yaml") -> tuple[Diagnostic, ...]:
    """The diagnostics of the loader."""
    try:
        load_scenario_text(text, file)
    except InputError as error:
        return error.diagnostics
    return ()


@cache
def whole() -> Draft202012Validator:
    """What the schema demands of a scenario."""
    return Draft202012Validator(json.loads(warm.safenav("new", "--schema").stdout))


def of_key(key: str) -> Draft202012Validator:
    """What the schema demands of one key."""
    part = {"required": [], "properties": {key: whole().schema["properties"][key]}}
    return Draft202012Validator({**whole().schema, **part})


def test_loader_and_schema_accept_the_same_scenarios_of_the_project() -> None:
    Draft202012Validator.check_schema(whole().schema)
    wrong, count = {}, 0
    for folder in ("scenarios", "safenav/scenario/templates", "tests"):
        for file in sorted((ROOT / folder).rglob("*.yaml")):
            text = file.read_text(encoding="utf-8")
            with suppress(yaml.YAMLError):
                if re.search("^safenav: ", text, re.MULTILINE):
                    data = from_yaml(text)
                    count += 1
                    if told := disagreement(data, judged(text, str(file)), whole()):
                        wrong[str(file)] = told
    assert wrong == {}
    assert count > 200


def test_the_full_scenario_is_valid_and_all_forms_together_have_every_key(tmp_path: Path) -> None:
    recorded(load_scenario_text(FULL), tmp_path / "t.jsonl")
    assert list(whole().iter_errors(DATA)) == []
    ways = [way for key, value in FORMS for way in places({key: value})]
    assert keys_of(whole().schema, set()) <= {way[-1] for way in ways}


@pytest.mark.parametrize(
    ("key", "value"), FORMS, ids=[f"{key}{i}" for i, (key, _) in enumerate(FORMS)]
)
def test_loader_and_schema_agree_on_an_error(key: str, value: Any) -> None:
    part, wrong = of_key(key), {}
    for turn, way in enumerate(places({key: value})):
        for name, data in mistakes({key: value}, way, turn):
            scenario = {**{k: DATA[k] for k in NEEDED if k != key}, **data}
            found = judged(json.dumps(scenario, separators=(",\n", ": ")))
            missing = [d for d in found if d.found.endswith(" is missing")]
            assert all(d.hint for d in missing), "a missing key is told with an example"
            # The rest of the scenario is right, so that the schema need not see it.
            told = (
                disagreement(scenario, found, whole())
                if len(way) == 1
                else disagreement(data, found, part)
            )
            if told:
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
        assert whole().is_valid(data) == (not told), (data, told)


def test_the_schema_refuses_helpers_of_obstacles_without_a_region() -> None:
    for name, fits in (("door@47", True), ("door", False)):
        assert of_key("expect").is_valid({"expect": {"helpers": {name: "ann"}}}) is fits


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a trace, which each example writes anew."""
    return tmp_path_factory.mktemp("recorded") / "t.jsonl"


def load_or_refuse(text: str, line: Path) -> None:
    try:
        scenario = load_scenario_text(text, "mutated.yaml")
    except InputError as error:
        assert error.diagnostics
        for diagnostic in error.diagnostics:
            assert diagnostic.found, "a refusal says why"
            assert diagnostic.line <= text.count("\n") + text.count("\r") + 3
    else:
        recorded(scenario, line)


SNIPPETS = [
    *"[]{}:,#'\"|>&*!-?%@` \n\t.~=0123456789",
    *("\n  ", "- ", ": ", "''", "!!python/object:os.system ", "&a ", "*a", "*door", "<<: *door"),
    *("true", "null", ".nan", "-.inf", "1e999", "9" * 30, "0x", "--- ", "...", "é", "\x00"),
    *("\ud800", "\u2028", "[8, 9]", "{any: 7}", "next(", "robots", "region", "\ufeff", "\r"),
]
edits = st.tuples(st.integers(0, len(FULL)), st.integers(0, 12), st.sampled_from(["", *SNIPPETS]))


@campaign(300)
@given(st.lists(edits, min_size=1, max_size=4))
def test_any_damage_to_the_text_gives_a_scenario_or_an_input_error(
    line: Path, changes: list[tuple[int, int, str]]
) -> None:
    text = FULL
    for place, removed, added in changes:
        text = text[:place] + added + text[place + removed :]
    load_or_refuse(text, line)


@campaign(200)
@given(st.lists(st.tuples(st.sampled_from([*places(DATA)]), VALUES), min_size=1, max_size=3))
def test_any_value_of_any_key_gives_a_scenario_or_an_input_error(
    line: Path, changes: list[tuple[tuple[Any, ...], Any]]
) -> None:
    scenario = deepcopy(DATA)
    for (*holders, last), value in changes:
        with suppress(KeyError, IndexError, TypeError):  # an earlier change deleted the holder
            reduce(getitem, holders, scenario)[last] = value
    load_or_refuse(json.dumps(scenario, ensure_ascii=False), line)


@campaign(100)
@given(st.text(CHARACTERS, max_size=200))
def test_any_text_gives_a_scenario_or_an_input_error(line: Path, text: str) -> None:
    load_or_refuse(text, line)
