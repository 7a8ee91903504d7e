"""The typed reader on a small language: values with places, all errors, and their schema."""

import json
from typing import Annotated, Any, ClassVar, Literal

import pytest
from jsonschema import Draft202012Validator
from msgspec import Struct

from safenav.scenario.yaml.document import Scalar, plain, read_document
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.json_schema import schema_text
from safenav.scenario.yaml.typed import Item, Key, NameForm, Raw, key, read, version

CupName = Annotated[Scalar, NameForm("a cup", taken=frozenset({"mug"}))]


class Kettle(Struct, frozen=True):
    """A kettle."""

    litres: Annotated[float, Key("Its volume.", above=0)] = 1.5
    lid: Annotated[bool, Key("Whether it has one.")] = True


class Cup(Item, frozen=True):
    """A cup."""

    one: ClassVar = "cup {name}"
    size: Literal["small", "large"] | None = key("Its size.", "for example 'size: small'")
    spoons: int = key("Number of spoons.", most=3, default=0)
    tea: str | tuple[str, ...] | None = key("Kinds of tea.", expected="a kind, or a list of kinds")
    place: Annotated[Raw, Key(form=tuple[int, int])] | None = key("Where it stands.")


class Table(Item, frozen=True):
    """A laid table."""

    label: ClassVar = ""
    elsewhere: ClassVar = {"coffee": "it is served later"}
    table: int | None = version(2, "table", "table")
    kettle: Kettle = Kettle()
    cups: dict[CupName, Cup] | None = None


def found(text: str) -> tuple[Table, list[str]]:
    """The table in a text, and the errors as ``column: found (hint)``."""
    findings = Findings("table.yaml")
    table = read(Table, read_document(text).root, "the table", findings)
    told = [f"{d.column}: {d.found}" + f" ({d.hint})" * bool(d.hint) for d in findings.diagnostics]
    return table, told


def test_values_have_their_types_defaults_and_places() -> None:
    table, told = found("{table: 2, cups: {mine: {size: small, tea: [green], place: [1, 2]}}}")
    assert told == [] and table.kettle == Kettle(1.5, True)
    ((name, cup),) = (table.cups or {}).items()
    assert (name.text, name.place.column) == ("mine", 19)
    assert (cup.size, cup.spoons, cup.tea) == ("small", 0, ("green",))
    assert cup.place is not None and cup.place.what == "'place' of cup mine"
    assert not cup.flawed and cup.at("spoons") is None


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "{table: 1}",
            ["9: version 1 of the table format is unknown (this safenav reads 'table: 2')"],
        ),
        ("{table: 2, coffee: 1}", ["12: unknown key 'coffee' in the table (it is served later)"]),
        (
            "{table: 2, ketle: {litres: 0}}",
            [
                "12: unknown key 'ketle' in the table (did you mean 'kettle'? known: cups, kettle)",
                "28: 'litres' of kettle is 0, and must be more than 0",
            ],
        ),
        (
            "{table: 2, kettle: {lid: yes}}",
            ["26: 'lid' of kettle: found the text 'yes', expected true or false (write true)"],
        ),
        (
            "{table: 2, cups: {mug: {size: big, spoons: 4}}}",
            [
                "31: 'size' of cup mug: unknown word 'big' (known: large, small)",
                "44: 'spoons' of cup mug is 4, and must be at most 3",
                "19: 'mug' is reserved (use another name)",
            ],
        ),
        (
            "{table: 2, cups: {a: {tea: 3}}}",
            [
                "22: cup a: the key 'size' is missing (its size, for example 'size: small')",
                "28: 'tea' of cup a: found the number 3, expected a kind, or a list of kinds",
            ],
        ),
    ],
)
def test_all_errors_are_reported_with_place_and_hint(text: str, told: list[str]) -> None:
    assert found(text)[1] == told
    assert not Draft202012Validator(SCHEMA).is_valid(plain(read_document(text).root))


def test_an_item_with_an_error_is_flawed_and_keeps_its_other_values() -> None:
    table, _ = found("{table: 2, cups: {a: {size: big, spoons: 2}}}")
    (cup,) = (table.cups or {}).values()
    assert cup.flawed and cup.size is None and cup.spoons == 2


SCHEMA: dict[str, Any] = json.loads(schema_text(Table, "table"))


def test_the_schema_says_the_same() -> None:
    Draft202012Validator.check_schema(SCHEMA)
    assert Draft202012Validator(SCHEMA).is_valid({"table": 2, "cups": {"a": {"size": "large"}}})
    spoons = SCHEMA["$defs"]["cup"]["properties"]["spoons"]
    about = "Number of spoons. Default: 0."
    assert spoons == {"description": about, "type": "integer", "minimum": 0, "maximum": 3}
    assert SCHEMA["$defs"]["kettle"]["properties"]["litres"]["exclusiveMinimum"] == 0
