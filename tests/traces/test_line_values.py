"""What a line of a trace may hold: the words of the format, names and numbers, and nothing else."""

import json
import types
from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import pytest
from msgspec import Struct

from judge.good_traces import GOOD
from judge.trace_script import edit, find, text
from safenav import line_values
from safenav.errors import InputError
from safenav.line_values import WORDS, WORDS_OF_LINES, flaws
from safenav.trace.fields import entries
from safenav.trace.reading import read_lines
from safenav.trace.records import KINDS


def enums(annotation: Any) -> Iterator[Any]:
    """The enumerations and classes of objects in an annotation."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, types.UnionType, tuple, frozenset, Annotated) or (
        isinstance(origin, type) and issubclass(origin, Mapping)
    ):
        for each in arguments:
            yield from enums(each)
    elif isinstance(annotation, type) and issubclass(annotation, StrEnum | Struct):
        yield annotation


def words_of(kind: Any, line: str, seen: set[Any]) -> Iterator[tuple[str, str, set[str]]]:
    hints = get_type_hints(kind, include_extras=True)
    for entry in entries(kind):
        for found in enums(hints[entry.name]):
            if issubclass(found, StrEnum):
                yield line, entry.encode_name, {*map(str, found)}
            elif found not in seen:
                yield from words_of(found, line, seen | {found})


def test_the_words_are_those_of_the_records() -> None:
    listed = [each for name, kind in KINDS.items() for each in words_of(kind, name, set())]
    assert len(listed) > 15
    for line, key, words in listed:
        assert (WORDS_OF_LINES.get((line, key)) or WORDS[key]) == words, f"{key} of {line}"


OTHER_KEYS = {"always", "init", "liveness", "note", "safety", "targets"}
"""Keys of formulas, the mark of notes, and the targets of an objective, whose key is its kind."""


def keys_of(kind: Any, seen: set[Any]) -> Iterator[str]:
    hints = get_type_hints(kind, include_extras=True)
    for entry in entries(kind):
        yield entry.encode_name
        for found in enums(hints[entry.name]):
            if issubclass(found, Struct) and found not in seen:
                yield from keys_of(found, seen | {found})


def test_the_keys_are_those_of_the_records() -> None:
    known = {key for kind in KINDS.values() for key in keys_of(kind, set())} | OTHER_KEYS
    tables = (line_values._TEXTS, line_values._TRUTHS, line_values._NUMBERS, line_values._BY_NAME)
    assert {*WORDS, *(key for _, key in WORDS_OF_LINES)}.union(*tables) - known == set()


@pytest.mark.parametrize("name", sorted(GOOD))
def test_a_good_trace_has_no_findings(name: str) -> None:
    assert [flaw for line in GOOD[name]() for flaw in flaws(line, line["type"])] == []


@pytest.mark.parametrize("name", ["line", "data", "from_", "late", "outcome", "region", "__a"])
def test_a_robot_may_be_named_as_a_field(name: str) -> None:
    lines = [json.loads(line.replace("quad", name)) for line in text(GOOD["door"]())]
    assert read_lines(text(lines)).header.scenario.robots.keys() == {name, "digit"}


HOSTILE: dict[str, tuple[str, dict[str, object], str]] = {
    "a word": ("move", {"by": "either"}, "`by` has an invalid enum value"),
    "a robot": ("goal", {"robot": "quad is proven safe"}, "`robot` must be a name"),
    "code": ("request", {"bids": {"x: open('f')": 1}}, "neither a field nor a name"),
    "a key of the programs": ("move", {"from_": 3}, "'from_' is not a field"),
    "a method": ("move", {"__class__": 3}, "'__class__' is not a field"),
    "a truth": ("move", {"toward": True}, "`toward` must be"),
    "a number": ("outcome", {"ticks": "never"}, "`ticks` must be"),
    "a target": ("push", {"objectives": {"quad": {"visit": ["all"]}}}, "`objectives[...]` must"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_value_is_refused_with_its_line(name: str) -> None:
    kind, changes, words = HOSTILE[name]
    lines = GOOD["door"]()
    edit(kind, {}, **changes)(lines)
    with pytest.raises(InputError) as error:
        read_lines(text(lines))
    (problem,) = error.value.diagnostics
    assert words in problem.found
    assert problem.line == find(lines, kind) + 1
    assert any(flaws(lines[problem.line - 1], kind))


NESTED: list[object] = []
for _ in range(250):
    NESTED = [NESTED]
MANY = {f"r{k}": {} for k in range(2000)}
HEADERS: dict[str, tuple[dict[str, object], str]] = {
    "robot": ({"robots": {"a.b": {}}}, "'a.b' cannot name a robot"),
    "robots": ({"robots": MANY}, "at most 1000"),
    "obstacle": ({"obstacles": [{"name": "quad"}]}, "'quad' cannot name an obstacle"),
    "rows": ({"map": {"rows": 10**9, "cols": 10**9, "grid": []}}, "at most 262144"),
    "grid": ({"map": {"rows": 2, "cols": 3, "grid": ["...", ".."]}}, "2 rows of 3 characters"),
    "nesting": ({"name": [[[]]], "partition": NESTED}, "nested more than"),
}


@pytest.mark.parametrize("name", HEADERS)
def test_a_hostile_header_is_refused(name: str) -> None:
    changes, words = HEADERS[name]
    header = GOOD["door"]()[0]
    header["scenario"] |= changes
    assert words in " ".join(flaws(header, "header"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('{"type": "goal", "tick": 1, "tick": 2}', "'tick' appears twice"),
        ('{"type": "goal", "tick": NaN}', "NaN is not a number"),
        ('{"type": "goal", "tick": 1e999}', "is beyond"),
        ('{"type": "goal", "tick": 9007199254740993}', "beyond 9007199254740991"),
        ('{"type": "goal", "tick": ' + "9" * 6000 + "}", "beyond 9007199254740991"),
    ],
)
def test_json_that_programs_read_differently_is_refused(line: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_lines([*text(GOOD["door"]()[:1]), line])
