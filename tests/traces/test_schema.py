"""The published schema and the reference follow the records, and every trace meets them."""

import json
import os
from collections.abc import Iterable
from inspect import cleandoc
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from jsonschema import Draft202012Validator

from safenav.cli.new import new as command
from safenav.errors import Outcome
from safenav.files import json_line
from safenav.judge import lines
from safenav.trace import records, vocabulary
from safenav.trace.fields import entries
from safenav.trace.file import as_data
from safenav.trace.schema import schema_text, trace_schema
from traces.examples import examples
from traces.real import NAMES, real_trace

DOCS = Path(__file__).parents[2] / "docs"
WORDS = (
    vocabulary.BlockReason,
    vocabulary.MoveEnd,
    vocabulary.ActResult,
    vocabulary.ChangeCause,
    vocabulary.DeadlineVerdict,
    vocabulary.OperatorCause,
    Outcome,
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


@pytest.mark.parametrize("seed", range(10))
def test_the_judge_reads_every_fact_that_can_be_recorded(seed: int) -> None:
    """Its words are those of the records."""
    for record in examples(seed):
        if record.type in lines.KINDS:
            lines.read_object(lines.KINDS[record.type], json.loads(json_line(as_data(record))))


@pytest.mark.parametrize("name", NAMES)
def test_real_traces_meet_the_schema(name: str) -> None:
    validator = Draft202012Validator(trace_schema())
    for line in real_trace(name).splitlines():
        assert not list(validator.iter_errors(json.loads(line)))


@pytest.mark.parametrize(
    "change",
    [{"tick": -1}, {"to": "8"}, {"heading": "up"}, {"by": "chance"}],
    ids=lambda change: str(next(iter(change))),
)
def test_a_wrong_line_violates_the_schema(change: dict[str, object]) -> None:
    move = next(as_data(r) for r in examples(0) if isinstance(r, records.Move))
    assert list(Draft202012Validator(trace_schema()).iter_errors({**move, **change}))


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


def reference() -> dict[str, str]:
    """The tables of the page, by their marks."""
    words = ((kind.__name__, ", ".join(f"`{word}`" for word in kind)) for kind in WORDS)
    return {
        "lines": table("type | fields | meaning", (row(*each) for each in records.KINDS.items())),
        "words": table("kind | words", words),
    }


def test_the_reference_is_that_of_the_records() -> None:
    text = page = (DOCS / "trace.md").read_text()
    for mark, made in reference().items():
        begin, end = f"<!-- {mark} -->\n", "<!-- end -->"
        before, rest = text.split(begin)
        text = before + begin + made + end + rest.split(end, 1)[1]
    if os.environ.get("SAFENAV_GOLDEN"):
        (DOCS / "trace.md").write_text(text)
        (DOCS / "trace.schema.json").write_text(schema_text())
    else:
        assert page == text, "make golden"


def test_the_judge_judges_every_line_that_is_not_a_note() -> None:
    facts = {name for name, kind in records.KINDS.items() if not kind.note}
    assert facts == {*lines.KINDS} and len(facts) < len(records.KINDS)


@pytest.mark.parametrize("kind", records.KINDS)
def test_a_fact_with_the_mark_of_notes_violates_the_schema(kind: str) -> None:
    validator = Draft202012Validator(trace_schema())
    line = next(as_data(r) for r in examples(0) if r.type == kind)
    note = line.pop("note", None)
    assert list(validator.iter_errors(line if note else line | {"note": True}))
