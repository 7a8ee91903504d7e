"""What only the records know: each event has one sentence, and the reference names every field."""

import json
import os
from collections.abc import Iterable
from inspect import cleandoc
from pathlib import Path
from typing import Any

import pytest

from once import ROOT, from_yaml
from safenav import Outcome, RegionMap, read_trace
from safenav.run.wording import Wording
from safenav.trace import vocabulary
from safenav.trace.fields import convert, entries
from safenav.trace.records import KINDS
from safenav.trace.schema import schema_text
from traces.test_schema import examples

MAP = RegionMap.from_grid(["." * 99], names={"gate": 46, "dock": 47})
NO_EVENTS = {"header", "move", "hold", "backtrack", "belief", "charge", "checkpoint", "discovered"}
"""What happens in every tick, or belongs to another line's sentence."""


@pytest.mark.parametrize("seed", range(10))
def test_every_event_has_one_sentence(seed: int, tmp_path: Path) -> None:
    (file := tmp_path / "t.jsonl").write_text("\n".join(map(json.dumps, examples(seed))))
    trace = read_trace(file)
    for record in (trace.header, *trace.records):
        if record.type in NO_EVENTS:
            with pytest.raises(TypeError, match="is not an event"):
                Wording(MAP).sentence(record)
            continue
        sentence = Wording(MAP).sentence(record)
        assert sentence and "\n" not in sentence and not sentence.endswith(".")
        assert "None" not in sentence


SENTENCES = from_yaml(Path(__file__).with_name("sentences.yaml").read_text())


@pytest.mark.parametrize("told", SENTENCES)
def test_a_sentence_names_regions_robots_and_reasons(told: str) -> None:
    about = SENTENCES[told]
    wording = Wording(MAP, RegionMap.label, **about.pop("wording", {}))
    assert wording.sentence(convert(KINDS[about["type"]], {"tick": 3} | about)) == told


DOCS = ROOT / "docs"
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
