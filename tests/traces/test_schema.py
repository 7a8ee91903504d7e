"""The published schema and the reference follow the records, and every trace meets them."""

import json
import re
from enum import EnumType
from pathlib import Path

import pytest
from click.testing import CliRunner
from jsonschema import Draft202012Validator

from safenav.cli.new import new as command
from safenav.trace import records, setting, vocabulary
from safenav.trace.fields import entries
from safenav.trace.schema import schema_text, trace_schema
from safenav.trace.writing import as_data
from traces.examples import examples
from traces.real import NAMES, real_trace

DOCS = Path(__file__).parents[2] / "docs"
OBJECTS = (
    setting.ScenarioHeader,
    setting.MapHeader,
    setting.RobotHeader,
    setting.ObstacleHeader,
    setting.NeedHeader,
    setting.UntilHeader,
    setting.LimitsHeader,
    records.Tried,
    records.Signal,
)


def test_the_published_schema_is_that_of_the_records() -> None:
    assert (DOCS / "trace.schema.json").read_text() == schema_text()
    Draft202012Validator.check_schema(trace_schema())


def test_the_command_prints_it() -> None:
    assert CliRunner().invoke(command, ["--schema", "trace"]).output == schema_text()


@pytest.mark.parametrize("seed", range(10))
def test_every_record_meets_the_schema(seed: int) -> None:
    validator = Draft202012Validator(trace_schema())
    for record in examples(seed):
        assert not list(validator.iter_errors(as_data(record))), record.type


@pytest.mark.parametrize("name", NAMES)
def test_real_traces_meet_the_schema(name: str) -> None:
    validator = Draft202012Validator(trace_schema())
    for line in real_trace(name).splitlines():
        assert not list(validator.iter_errors(json.loads(line)))


@pytest.mark.parametrize(
    "change",
    [{"tick": -1}, {"to": "8"}, {"heading": "up"}, {"by": "chance"}, {"signal": {}}],
    ids=lambda change: str(next(iter(change))),
)
def test_a_wrong_line_violates_the_schema(change: dict[str, object]) -> None:
    move = next(as_data(r) for r in examples(0) if isinstance(r, records.Move))
    assert list(Draft202012Validator(trace_schema()).iter_errors({**move, **change}))


@pytest.mark.parametrize("kind", records.KINDS)
def test_every_field_of_a_line_is_in_the_reference(kind: str) -> None:
    text = (DOCS / "trace.md").read_text()
    first = re.compile(rf"^\| [^|]*`{kind}`[^|]*\|")
    rows = [line for line in text.split("## Scenario")[0].splitlines() if first.match(line)]
    assert len(rows) == 1, kind
    where = rows[0]
    if kind == "synthesis":
        where += text.split("### Data of a specification")[1].split("## ")[0]
    told = set(re.findall(r"`([a-z_]+)`", where))
    assert {e.key for e in entries(records.KINDS[kind]) if e.key not in ("tick", "t")} <= told


def test_every_field_of_an_object_in_a_line_is_in_the_reference() -> None:
    text = (DOCS / "trace.md").read_text()
    told = set(re.findall(r"`([a-z_]+)`", text))
    for kind in OBJECTS:
        assert {entry.key for entry in entries(kind)} <= told, kind.__name__


def test_every_word_that_a_field_can_hold_is_in_the_reference() -> None:
    text = (DOCS / "trace.md").read_text()
    words = [kind for kind in vars(vocabulary).values() if isinstance(kind, EnumType)]
    assert len(words) > 8
    for kind in words:
        for word in kind:
            assert f"`{word}`" in text, word
