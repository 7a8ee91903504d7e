"""Keys that the drawing has no shape for: fields of text, orders, chargers, own models; and what a
map that grows moves in formulas, partitions and requirements."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from once import beside
from safenav.errors import UsageError
from safenav.scenario.reading.loader import load_draft, load_scenario_text
from safenav.scenario.yaml.document import read_document
from safenav.studio.editing.drawing import drawing_of
from safenav.studio.editing.keys import known_keys, parts_of, written
from safenav.studio.editing.operations import edited
from studio.serving import SCENARIOS

FULL = beside(__file__, "scenarios/every_key.yaml")


def changed_lines(before: str, after: str) -> list[str]:
    old = before.splitlines()
    return [line for line in after.splitlines() if line not in old]


@pytest.mark.parametrize(
    ("operation", "lines"),
    [
        (
            {"path": [], "key": "until", "text": "{rounds: 3, by: 90}"},
            ["until: {rounds: 3, by: 90}"],
        ),
        ({"path": [], "key": "clock", "text": "live"}, ["clock: live"]),
        (
            {"path": [], "key": "inputs", "text": "alarm: {at: [3-5]}\nlate:\n  probability: 0.5"},
            ["inputs:", "  alarm: {at: [3-5]}", "  late:", "    probability: 0.5"],
        ),
        ({"path": [], "key": "inputs", "text": " "}, []),
        (
            {"path": ["robots", "ann"], "key": "vision", "text": "3"},
            ["    vision: 3"],
        ),
        (
            {"path": ["robots", "bob", "objective"], "key": "avoid", "text": "[18]"},
            ["  bob: {model: quadcopter, start: 16, objective: {cover: [17, 19], avoid: [18],"],
        ),
    ],
)
def test_a_field_of_text_changes_its_own_lines(operation: dict[str, Any], lines: list[str]) -> None:
    after = edited(FULL, {"op": "set_part", **operation})
    found = changed_lines(FULL, after)
    assert len(found) == len(lines)
    assert all(new.startswith(line) for new, line in zip(found, lines, strict=True)), found
    removed = [line for line in FULL.splitlines() if line not in after.splitlines()]
    assert len(removed) <= (3 if "avoid" in operation["key"] else 1)


@pytest.mark.parametrize(
    ("operation", "found"),
    [
        ({"path": [], "key": "until", "text": "{rounds: 3"}, "until is not valid YAML"),
        ({"path": [], "key": "untill", "text": "3"}, "no key 'untill'"),
        ({"path": ["robots", "cid"], "key": "vision", "text": "3"}, "does not fit the text"),
        ({"path": ["robots", "ann"], "key": "visions", "text": "3"}, "no key 'visions'"),
    ],
)
def test_invalid_yaml_and_unknown_keys_are_refused(operation: dict[str, Any], found: str) -> None:
    with pytest.raises(UsageError, match=found):
        edited(FULL, {"op": "set_part", **operation})


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.yaml")), ids=lambda path: path.stem)
def test_fields_hold_the_values_of_the_document(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    data = yaml.safe_load(text)
    for at, parts in parts_of(read_document(text).root).items():
        steps = [int(step) if step.isdigit() else step for step in at.split("/") if step]
        for key, (value, first, _, last) in parts.items():
            held = data
            for step in [*steps, key]:
                held = held[step]
            assert yaml.safe_load(value) == held or isinstance(held, str | bool)
            assert 0 < first <= last <= len(text.splitlines()) + 1
            assert f"{key}" in text.splitlines()[first - 1]


def test_setting_a_part_to_what_is_shown_changes_no_value() -> None:
    text = (SCENARIOS / "night_round.yaml").read_text(encoding="utf-8")
    for key, (value, *_) in parts_of(read_document(text).root)[""].items():
        again = edited(text, {"op": "set_part", "path": [], "key": key, "text": value})
        assert yaml.safe_load(again) == yaml.safe_load(text)


def test_every_key_of_the_schema_has_a_control_or_a_field() -> None:
    keys = {kind: [one["key"] for one in found] for kind, found in known_keys().items()}
    assert {"inputs", "requirements", "partition", "expect", "failures"} <= set(keys["scenario"])
    assert {"when", "while_waiting", "tracks"} <= set(keys["robot"])
    assert {"within", "avoid", "always", "ltl"} <= set(keys["objective"])
    assert {"battery", "carries", "capabilities"} <= set(keys["model"])
    assert {"needs", "blocks", "resolve_at"} <= set(keys["type"])
    assert all(one["about"] for found in known_keys().values() for one in found)


def test_orders_are_drawn_and_edited_like_obstacles() -> None:
    text = (SCENARIOS / "warehouse_orders.yaml").read_text()
    draft = load_draft(text, "x.yaml")
    assert draft.world is not None
    drawing = drawing_of(text, draft.world, draft.catalogue)
    assert drawing is not None
    assert [(o["list"], o["index"], o["at"]) for o in drawing["obstacles"]] == [
        ("obstacles", 0, None),
        ("obstacles", 1, None),
        ("orders", 0, 10),
        ("orders", 1, 40),
    ]
    order = {"list": "orders", "index": 1}
    text = edited(text, {"op": "move_obstacle", **order, "region": 73})
    text = edited(text, {"op": "set_obstacle", **order, "key": "at", "value": 50})
    assert "  - {at: 50, type: pallet, region: [4, 13]}\n" in text
    text = edited(text, {"op": "remove_obstacle", **order})
    text = edited(text, {"op": "remove_obstacle", "list": "orders", "index": 0})
    assert "orders:" not in text and "obstacles:" in text


def test_a_delivery_is_a_type_and_an_order_that_run() -> None:
    text = (SCENARIOS / "warehouse_orders.yaml").read_text()
    told = {"op": "add_delivery", "action": "lift", "from": 16, "to": 118, "at": 3}
    text = edited(text, told)
    text = edited(text, {**told, "from": 28})
    scenario = load_scenario_text(text, "x.yaml")
    ordered = [found for found in scenario.obstacles if found.ordered]
    assert [order.type.name for order in ordered] == ["pallet", "pallet", "parcel", "parcel_2"]


def test_a_built_in_model_gets_a_battery() -> None:
    text = (SCENARIOS / "warehouse_orders.yaml").read_text()
    text = edited(text, {"op": "own", "of": "robots", "name": "jackal"})
    assert edited(text, {"op": "own", "of": "robots", "name": "jackal"}) == text
    before = load_scenario_text((SCENARIOS / "warehouse_orders.yaml").read_text(), "x.yaml")
    assert load_scenario_text(text, "x.yaml").robots == before.robots
    battery = {"path": ["catalogue", "robots", "jackal"], "key": "battery"}
    text = edited(text, {"op": "set_part", **battery, "text": "{capacity: 60, charge: 5}"})
    text = edited(text, {"op": "set_charger", "region": 118, "on": True})
    text = edited(text, {"op": "set_charger", "region": 106, "on": True})
    scenario = load_scenario_text(text, "x.yaml")
    assert scenario.chargers == {118, 106}
    text = edited(text, {"op": "set_charger", "region": 118, "on": False})
    text = edited(text, {"op": "set_charger", "region": 106, "on": False})
    assert "chargers" not in text
    with pytest.raises(UsageError, match="not built in"):
        edited(text, {"op": "own", "of": "robots", "name": "nobody"})
    with pytest.raises(UsageError, match="the catalogue is a file"):
        edited("catalogue: a.yaml\n" + FULL, {"op": "own", "of": "robots", "name": "go2"})


@pytest.mark.parametrize(
    ("sides", "parts"),
    [
        (
            {"left": 1},
            [
                "region = 11 -> region' != 12",
                "20 = region -> X(region) != 21",
                "liveness: [region = 14, region = 10]",
                "region = 20 -> region' != 19",
                "partition: [[10, 11, 12, 13, 14], [18, 19, 20, 21, 22]]",
                "resolved_door@20",
                "origin: [8.0, 20.0, 0]",
            ],
        ),
        (
            {"top": 1, "bottom": 2},
            [
                "region = 16 -> region' != 17",
                "24 = region -> X(region) != 25",
                "resolved_door@24",
                "origin: [10.0, 16.0, 0]",
            ],
        ),
        ({"bottom": 1}, ["region = 9 -> region' != 10", "resolved_door@17", "origin: [10.0, 18.0"]),
    ],
)
def test_formulas_partitions_and_frames_follow_a_map_that_grows(
    sides: dict[str, int], parts: list[str]
) -> None:
    after = edited(FULL, {"op": "resize", **sides})
    assert [part for part in parts if part not in after] == []


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("region = 12, region = 8", "region >= 12, region = 8", "computes with numbers"),
        ("region = 12, region = 8", "region = 12 + 1, region = 8", "computes with numbers"),
        (
            "  resolution: 2\n  origin: [10, 20, 0]\n",
            "",
            "requirements name x or y in metres",
        ),
    ],
)
def test_a_formula_that_cannot_be_shifted_is_named(old: str, new: str, found: str) -> None:
    text = FULL.replace(old, new).replace("0.1), ", "0.1), always(x(ann) >= 1), ")
    with pytest.raises(UsageError, match=found):
        edited(text, {"op": "resize", "left": 1})
    edited(text, {"op": "resize", "right": 0})


def test_a_long_value_stands_on_lines_of_its_own() -> None:
    text = "a: {first: [1, 2, 3], second: {x: 'a: b', y: \"no\"}, third: a long text with room}"
    value = read_document(text).root.entries[0][1]  # type: ignore[union-attr]
    assert written(value).count("\n") == 2
    assert yaml.safe_load(written(value)) == yaml.safe_load(text)["a"]
