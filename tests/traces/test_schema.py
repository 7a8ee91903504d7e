"""Every line that the published schema allows is read, judged and written again; what it does not
allow, no reader reads."""

import json
from pathlib import Path
from random import Random
from typing import Any

import pytest
from jsonschema import Draft202012Validator

import warm
from once import ROOT, trace_of_shipped
from safenav import Trace, TraceWriter, check_trace, read_trace
from support.damage import GOOD, Line

PUBLISHED = (ROOT / "docs" / "trace.schema.json").read_text()
RULES: dict[str, Any] = json.loads(PUBLISHED)
TYPES = {rule["if"]["properties"]["type"]["const"]: rule["then"] for rule in RULES["allOf"]}
SCHEMA = Draft202012Validator(RULES)
HEADER = GOOD["door"]()[0]
OBJECTIVES = ({"patrol": [8, [9, 10]]}, {"hold": 4}, {"ltl": {"liveness": ["region = 3"]}})
ROBOTS, OBSTACLE = ("digit", "quad"), "door@9"
CAUSES = {
    **dict.fromkeys(("appeared", "service"), ("scenario", "world", "user", "battery")),
    "objective": ("scenario", "user", "input"),
}
"""What can cause a change, by its type of line; of the others: the first three of these."""


def examples(seed: int) -> list[Line]:
    """One of each type, the header first; whether optional fields are there depends on the seed."""
    rng = Random(seed)
    found = [example(line, rng) for line in TYPES.values()]
    return [found[0] | {"trace": HEADER["trace"]}, *found[1:]]


def example(schema: Any, rng: Random) -> Any:
    """A value that a schema allows; names are those of the header's scenario."""
    match schema:
        case {"$ref": "#/$defs/Scenario"}:
            return HEADER["scenario"]
        case {"$ref": str(name)}:
            return example(RULES["$defs"][name.rpartition("/")[2]], rng)
        case {"anyOf": options}:
            return example(rng.choice([one for one in options if one != {"type": "null"}]), rng)
        case {"const": value}:
            return value
        case {"enum": words}:
            return rng.choice(words)
        case {"minProperties": 1}:
            return rng.choice(OBJECTIVES)
        case {"additionalProperties": inner}:
            return {name: example(inner, rng) for name in ROBOTS}
        case {"properties": fields}:
            return {
                name: named(name, example(inner, rng), fields, rng)
                for name, inner in fields.items()
                if inner and (inner.get("default", "needed") is not None or rng.random() < 0.5)
            }
        case {"prefixItems": items}:
            return [example(item, rng) for item in items]
        case {"type": "array", "items": inner}:
            count = max(schema.get("minItems", 0), rng.randrange(4))
            found = [example(inner, rng) for _ in range(count)]
            return sorted({*found}) if schema.get("uniqueItems") else found
        case {"pattern": str(pattern)}:
            return "ab" * 32 if "64" in pattern else rng.choice(pattern.strip("^($)").split("|"))
        case {"type": "integer" | "number"}:
            return schema.get("minimum", 7) + rng.randrange(9)
        case {"type": "boolean"}:
            return True
        case {"type": "string"}:
            return f"name_{rng.randrange(10**9)}"
    return [1, {"deep": None}]


def named(name: str, value: Any, fields: Line, rng: Random) -> Any:
    """The value of a field, with names that the scenario has and causes that its line may have."""
    match name, value:
        case ("robot", str()):
            return ROBOTS[0]
        case ("robots", list()):
            return [*ROBOTS[: len(value)]]
        case ("obstacle", str()):
            return OBSTACLE
        case ("cause", str()) if "explanation" not in fields:
            (kind,) = fields["type"]["enum"]
            return rng.choice(CAUSES.get(kind, CAUSES["service"][:3]))
    return value


def rewritten(trace: Trace, file: Path) -> list[Line]:
    with TraceWriter(file) as writer:
        for record in (trace.header, *trace.records):
            writer(record)
    return [json.loads(line) for line in file.read_text().splitlines()]


@pytest.mark.parametrize("seed", range(20))
def test_reader_judge_and_writer_agree_on_every_line(seed: int, tmp_path: Path) -> None:
    """It has a tick and no line number, and a fact is never marked as a note."""
    lines, (file, again) = examples(seed), (tmp_path / f"{k}.jsonl" for k in range(2))
    for line in lines:
        assert not [*SCHEMA.iter_errors(line)], line
    file.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    trace = read_trace(file)
    check_trace(file)
    written = rewritten(trace, again)
    assert written == lines
    for line in written[1:]:
        assert [*line][:2] == ["type", "tick"]
        line |= {"note": None} if "note" in line else {"note": True}
        assert [*SCHEMA.iter_errors(line)], line
    assert [record.line for record in trace.records] == [*range(2, len(lines) + 1)]


SHIPPED = ("case_study_1_beliefs", "case_study_2", "case_study_3", "corridor_swap", "two_digits")


@pytest.mark.parametrize("name", SHIPPED)
def test_the_trace_of_a_shipped_scenario_matches_the_schema(name: str, tmp_path: Path) -> None:
    lines = [json.loads(line) for line in trace_of_shipped(name).read_text().splitlines()]
    assert not [error for line in lines for error in SCHEMA.iter_errors(line)]
    trace = read_trace(trace_of_shipped(name))
    assert rewritten(trace, tmp_path / "again.jsonl") == lines


@pytest.mark.parametrize("change", [{"tick": -1}, {"to": "8"}, {"heading": "up"}, {"by": "chance"}])
def test_a_wrong_line_violates_the_schema(change: dict[str, object]) -> None:
    assert [*SCHEMA.iter_errors(example(TYPES["move"], Random(0)) | change)]


def test_new_prints_the_published_schema() -> None:
    assert warm.safenav("new", "--schema", "trace").stdout == PUBLISHED
    Draft202012Validator.check_schema(json.loads(PUBLISHED))
