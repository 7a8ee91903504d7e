"""Scenarios of which a run once went wrong, each in a file with what its trace must say.

The first comment of a file is its story. Its lines ``#:`` are YAML:

- ``TYPE``: fields of all lines of this type, in their order
- ``some TYPE``, ``no TYPE``: fields of lines that the trace has, or does not have
- ``explained``, ``left_open``: words of the outcome's explanation, and the orders left open there
- ``certified``: a bundle of the run is accepted
- ``clocks``: it is played on each of these
- ``or``: it is also played with these words replaced

Unless it has another ``outcome``, the mission is completed. Each trace must pass the audit. An
exhaustive search over joint states, which shares no code with safenav, has decided what the teams
of ``orders`` can do.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import pytest
import yaml

from certify.making import certified
from runtime.played import play
from safenav.trace.records import KINDS

Rows = list[dict[str, Any]]
OTHERS = ("explained", "left_open", "certified")


def cases() -> Iterator[Any]:
    for file in sorted((Path(__file__).parent / "cases").rglob("*.yaml")):
        lines = file.read_text().splitlines(keepends=True)
        said = yaml.safe_load("".join(line[3:] for line in lines if line.startswith("#:"))) or {}
        text = "".join(line for line in lines if not line.startswith("#:"))
        clocks, changes = said.pop("clocks", [""]), said.pop("or", [])
        for change, clock in product([{}, *changes], clocks):
            changed = f"{text}clock: {clock}\n" if clock else text
            for was, now in change.items():
                assert was in changed, file
                changed = changed.replace(was, now)
            name = " ".join(filter(None, [file.stem, clock, *change.values()]))
            yield pytest.param(changed, said, id=name)


@pytest.mark.parametrize(("text", "said"), [*cases()])
def test_case(text: str, said: dict[str, Rows]) -> None:
    run = play(text)
    assert all(words in run.outcome["explanation"] for words in said.get("explained", ()))
    assert run.still_open == said.get("left_open", run.still_open)
    if said.get("certified"):
        certified(text)
    lines = {what: rows for what, rows in said.items() if what not in OTHERS}
    for what, rows in ({"outcome": [{"outcome": "completed"}]} | lines).items():
        some, _, kind = what.rpartition(" ")
        assert {key for row in rows for key in row} <= {*KINDS[kind].__struct_fields__}, what
        for row in rows if some else ():
            assert bool(run.all(kind, **row)) == (some == "some"), (what, row)
        if not some:
            found = run.all(kind)
            assert len(found) == len(rows), (what, found)
            told = zip(rows, found, strict=True)
            assert [{key: line.get(key) for key in row} for row, line in told] == rows
