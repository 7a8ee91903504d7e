"""Every record that can be written is read back unchanged, meets the published schema, is read by
the judge if it is a fact, and has one sentence if it is an event."""

import json
import os
import random
import types
from collections.abc import Iterable, Mapping
from enum import StrEnum
from inspect import cleandoc
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest
from click.testing import CliRunner
from jsonschema import Draft202012Validator
from msgspec import Meta, Struct
from msgspec.structs import fields, replace

from once import from_yaml, trace_of_shipped
from safenav import Outcome, RegionMap, Scenario, TraceWriter, read_trace
from safenav.cli.new import new as command
from safenav.judge import lines as judge
from safenav.run.wording import Wording
from safenav.scenario.objective import Objective
from safenav.trace import vocabulary
from safenav.trace.fields import convert, entries, objective_of
from safenav.trace.file import as_data, read_bytes
from safenav.trace.records import KINDS, VERSION, Header, Record
from safenav.trace.schema import schema_text, trace_schema
from support.damage import GOOD

OBJECTIVES = (
    {"patrol": [58, [27, 28]]},
    {"hold": 4},
    {"ltl": {"liveness": ["region = 3"]}},
)
ROBOTS = ("quad", "digit")


CAUSES = {
    **dict.fromkeys(("appeared", "service"), ("scenario", "world", "user", "battery")),
    "objective": ("scenario", "user", "input"),
}
"""What can cause a change, by its type of line; of the others: the first three of these."""


def examples(seed: int) -> list[Record]:
    """One of each type, the header first; whether optional fields are there depends on the seed."""
    rng = random.Random(seed)
    found: list[Record] = [_example(kind, rng) for kind in KINDS.values()]
    assert isinstance(found[0], Header)
    return [replace(found[0], tick=0, trace=VERSION), *found[1:]]


def _example(annotation: Any, rng: random.Random) -> Any:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        bound = arguments[1]
        if not isinstance(bound, Meta):
            return _example(arguments[0], rng)
        if bound.min_length is not None:
            return _example(arguments[0], rng) or _example(annotation, rng)
        if bound.pattern is None:
            return arguments[0](bound.ge + rng.randrange(9))
        words = bound.pattern.strip("^($)").split("|")
        return "ab" * 32 if "64" in bound.pattern else rng.choice(words)
    if origin is Literal or (isinstance(annotation, type) and issubclass(annotation, StrEnum)):
        return rng.choice(arguments or list(annotation))
    if origin in (Union, types.UnionType):
        return _example(rng.choice([a for a in arguments if a is not type(None)]), rng)
    if origin is tuple and arguments[-1] is not Ellipsis:
        return tuple(_example(a, rng) for a in arguments)
    if origin in (tuple, frozenset):
        return origin(_example(arguments[0], rng) for _ in range(rng.randrange(4)))
    if origin is not None and issubclass(origin, Mapping):
        return {name: _example(arguments[1], rng) for name in ROBOTS}
    if annotation is Scenario:
        return convert(Scenario, GOOD["door"]()[0]["scenario"])
    if annotation is Objective:
        return objective_of(rng.choice(OBJECTIVES))
    if isinstance(annotation, type) and issubclass(annotation, Struct):
        return _struct(annotation, rng)
    return {
        **{str: f"name_{rng.randrange(10**9)}", int: 7, float: 1.5, bool: True},
        object: [1, {"deep": None}],
    }[annotation]


def _struct(kind: type[Struct], rng: random.Random) -> Struct:
    """An object with the robots of the header."""
    hints, given = get_type_hints(kind, include_extras=True), dict[str, Any]()
    for field in fields(kind):
        if field.name == "line" or (field.default is None and rng.random() < 0.5):
            continue
        value = _example(hints[field.name], rng)
        if isinstance(value, vocabulary.ChangeCause):
            causes = CAUSES.get(str(kind.__struct_config__.tag), CAUSES["service"][:3])
            value = vocabulary.ChangeCause(rng.choice(causes))
        if field.name == "robot" and isinstance(value, str):
            value = ROBOTS[0]
        if field.name == "robots" and isinstance(value, tuple | frozenset):
            value = type(value)(ROBOTS[: len(value)])
        given[field.name] = value
    return kind(**given)


SHIPPED = ("case_study_1_beliefs", "case_study_2", "case_study_3", "corridor_swap", "two_digits")
SCHEMA = Draft202012Validator(trace_schema())
MAP = RegionMap.from_grid(["." * 99], names={"gate": 46, "dock": 47})
NO_EVENTS = {"header", "move", "hold", "backtrack", "belief", "checkpoint", "discovered"}
"""What happens in every tick, or belongs to another line's sentence."""


@pytest.mark.parametrize("seed", range(20))
def test_every_record_is_written_read_and_judged_alike(seed: int, tmp_path: Path) -> None:
    """It has a tick and no line number, and a fact is never marked as a note."""
    records, file = examples(seed), tmp_path / "t.jsonl"
    with TraceWriter(file) as writer:
        for record in records:
            writer(record)
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert {line["type"] for line in lines} == {*KINDS}
    for number, line in enumerate(lines):
        assert not [*SCHEMA.iter_errors(line)], line
        assert not number or list(line)[:2] == ["type", "tick"]
        assert "line" not in line
        if line["type"] in judge.KINDS:
            judge.read_object(judge.KINDS[line["type"]], line)
        if line.pop("note", None) is None:
            line["note"] = True
        assert [*SCHEMA.iter_errors(line)]
    trace = read_trace(file)
    assert [trace.header, *trace.records] == records
    assert [record.line for record in trace.records] == [*range(2, len(lines) + 1)]


@pytest.mark.parametrize("seed", range(10))
def test_every_event_has_one_sentence(seed: int) -> None:
    for record in examples(seed):
        if record.type in NO_EVENTS:
            with pytest.raises(TypeError, match="is not an event"):
                Wording(MAP).sentence(record)
            continue
        sentence = Wording(MAP).sentence(record)
        assert sentence and "\n" not in sentence and not sentence.endswith(".")
        assert "None" not in sentence


@pytest.mark.parametrize("name", SHIPPED)
def test_the_trace_of_a_shipped_scenario_meets_the_schema(name: str) -> None:
    content = trace_of_shipped(name).read_bytes()
    assert not [e for line in content.splitlines() for e in SCHEMA.iter_errors(json.loads(line))]
    trace = read_bytes(content)
    written = [json.dumps(as_data(record)) for record in (trace.header, *trace.records)]
    again = read_bytes("\n".join(written).encode())
    assert (again.header, again.records, again.ignored) == (trace.header, trace.records, 0)


@pytest.mark.parametrize("change", [{"tick": -1}, {"to": "8"}, {"heading": "up"}, {"by": "chance"}])
def test_a_wrong_line_violates_the_schema(change: dict[str, object]) -> None:
    (move,) = (as_data(record) for record in examples(0) if record.type == "move")
    assert [*SCHEMA.iter_errors(move | change)]


def test_the_judge_judges_every_line_that_is_not_a_note() -> None:
    facts = {name for name, kind in KINDS.items() if not kind.note}
    assert facts == {*judge.KINDS} and len(facts) < len(KINDS)


SENTENCES = from_yaml(Path(__file__).with_name("sentences.yaml").read_text())


@pytest.mark.parametrize("told", SENTENCES)
def test_a_sentence_names_regions_robots_and_reasons(told: str) -> None:
    about = SENTENCES[told]
    wording = Wording(MAP, RegionMap.label, **about.pop("wording", {}))
    assert wording.sentence(convert(KINDS[about["type"]], {"tick": 3} | about)) == told


class Interrupted(Header):
    """A header whose line is interrupted while it is made."""

    @property
    def note(self) -> bool:
        raise KeyboardInterrupt


def test_an_interrupt_before_the_first_line_is_written_leaves_no_file(tmp_path: Path) -> None:
    header = examples(0)[0]
    interrupted = Interrupted(**{name: getattr(header, name) for name in header.__struct_fields__})
    with pytest.raises(KeyboardInterrupt), TraceWriter(tmp_path / "t.jsonl") as writer:
        writer(interrupted)
    assert [*tmp_path.iterdir()] == []


DOCS = Path(__file__).parents[2] / "docs"
WORDS = (
    *(vocabulary.BlockReason, vocabulary.MoveEnd, vocabulary.ActResult, vocabulary.ChangeCause),
    *(vocabulary.DeadlineVerdict, vocabulary.OperatorCause, Outcome),
)


def table(head: str, rows: Iterable[tuple[str, ...]]) -> str:
    columns = head.split(" | ")
    lines = ["| " + " | ".join(row) + " |" for row in (columns, ["---"] * len(columns), *rows)]
    return "\n".join(lines).replace("| --- ", "|---").replace("--- |", "---|") + "\n"


def row(name: str, kind: Any) -> tuple[str, str, str]:
    """A kind of line or object: its name, its fields, and its documentation."""
    fields = [each for each in entries(kind) if each.name not in ("tick", "t")]
    needed = ", ".join(f"`{each.encode_name}`" for each in fields if each.required)
    optional = ", ".join(f"`{each.encode_name}`" for each in fields if not each.required)
    both = "; ".join(filter(None, (needed, optional and f"optional {optional}")))
    text = " ".join(cleandoc(kind.__doc__).split()).replace("``", "`").replace("None", "null")
    return f"`{name}`", both, "Note. " + text if getattr(kind, "note", False) else text


def test_the_published_schema_and_the_reference_are_those_of_the_records() -> None:
    words = ((kind.__name__, ", ".join(f"`{word}`" for word in kind)) for kind in WORDS)
    text = page = (DOCS / "trace.md").read_text()
    for mark, made in {
        "lines": table("type | fields | meaning", (row(*each) for each in KINDS.items())),
        "words": table("kind | words", words),
    }.items():
        begin, end = f"<!-- {mark} -->\n", "<!-- end -->"
        before, rest = text.split(begin)
        text = before + begin + made + end + rest.split(end, 1)[1]
    if os.environ.get("SAFENAV_GOLDEN"):
        (DOCS / "trace.md").write_text(text)
        (DOCS / "trace.schema.json").write_text(schema_text())
    assert page == text, "make golden"
    assert (DOCS / "trace.schema.json").read_text() == schema_text(), "make golden"
    assert CliRunner().invoke(command, ["--schema", "trace"]).output == schema_text()
    Draft202012Validator.check_schema(trace_schema())
