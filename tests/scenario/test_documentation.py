"""The examples of docs/scenario.md and docs/maps.md load; tables of keys hold all keys."""

import json
import os
import re
from functools import cache
from typing import Any

import pytest
import yaml

import warm
from once import ROOT, from_yaml
from safenav import load_scenario_text
from scenario.mistakes import keys_of


def examples(name: str) -> list[str]:
    text = (ROOT / "docs" / name).read_text(encoding="utf-8")
    return re.findall(r"^```yaml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


WHOLE, *FRAGMENTS = examples("scenario.md")
MAPS = examples("maps.md")
STARTS = {"floor.png": 107, "office.yaml": 23, "arena.map": 14}
"""The files that docs/maps.md names, which are the maps of the tests here, and a free region."""


@pytest.mark.parametrize("fragment", FRAGMENTS, ids=[str(i) for i in range(len(FRAGMENTS))])
def test_fragments_of_the_scenario_page_load_in_its_example(fragment: str) -> None:
    assert len(FRAGMENTS) > 8
    load_scenario_text(yaml.safe_dump(from_yaml(WHOLE) | from_yaml(fragment)))


@pytest.mark.parametrize(("fragment", "file"), [*zip(MAPS, STARTS, strict=True)], ids=STARTS)
def test_maps_of_every_form_load_as_documented(fragment: str, file: str) -> None:
    start, shown = STARTS[file], fragment.replace("floor.png", "rooms.png")
    robots = f"robots: {{ann: {{model: quadcopter, start: {start}, objective: {{hold: {start}}}}}}}"
    text = f"safenav: 1\n{shown.replace('arena.map', 'rooms.map')}{robots}\n"
    load_scenario_text(text, str(ROOT / "tests/maps/scenario.yaml"))


def tables(page: str) -> list[set[str]]:
    """The words in code in the first column of each table of a page."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    found = re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)
    rows = [[row.split("|")[1] for row in table.splitlines()[2:]] for table in found]
    return [{word for row in table for word in re.findall(r"`([\w-]+)`", row)} for table in rows]


@cache
def schema(kind: str) -> dict[str, Any]:
    """The parts of a schema by their names; ``kind`` is that of the whole."""
    whole = json.loads(warm.safenav("new", "--schema", kind).stdout)
    return whole["$defs"] | {kind: whole}


def described(part: str) -> str:
    """The table of the keys in a part of the schema of scenarios."""
    language, rows = schema("scenario"), ""
    keys = language[part]
    for key, value in keys["properties"].items():
        about = value if "description" in value else language[value["$ref"].split("/")[-1]]
        needed = " Required." if key in keys.get("required", ()) else ""
        said = about["description"].replace("|", "\\|")
        said = said if re.match(r"\w+:", said) else said[0].upper() + said[1:]
        rows += f"| `{key}` | {said}{needed} |\n"
    return f"| key | meaning |\n|---|---|\n{rows}"


def test_the_tables_of_the_page_are_those_of_the_language() -> None:
    page = ROOT / "docs/scenario.md"
    text = page.read_text(encoding="utf-8")
    block = re.compile(r"(<!-- keys of (\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
    made = block.sub(lambda m: f"{m[1]}{described(m[2])}{m[4]}", text)
    if "SAFENAV_GOLDEN" in os.environ:
        page.write_text(made, encoding="utf-8")
    assert text == made, "make golden"
    assert len(block.findall(text)) == 13


@pytest.mark.parametrize(
    ("page", "kind", "part", "others"),
    [
        ("batteries.md", "scenario", "battery", set()),
        ("drive.md", "fleet", "failures", set()),
        ("drive.md", "fleet", "station", {"transport", "network", "simulation", "inputs"}),
    ],
)
def test_a_table_of_the_documentation_has_every_key(
    page: str, kind: str, part: str, others: set[str]
) -> None:
    keys = schema(kind)[part]["properties"].keys()
    most = max(tables(page), key=lambda words: len(words & keys))
    assert most - others == keys


@pytest.mark.parametrize("kind", ["scenario", "fleet"])
def test_the_documentation_has_every_key(kind: str) -> None:
    pages = (page.read_text(encoding="utf-8") for page in (ROOT / "docs").glob("*.md"))
    words = set(re.findall(r"[\w-]+(?=`|:\s)", "\n".join(pages)))
    assert keys_of(schema(kind), set()) - words == set()
