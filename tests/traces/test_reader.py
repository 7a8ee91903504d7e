"""The reader: diagnostics that point, and traces of runs that were killed. What it refuses in a
field, a word or a name, the judge refuses as well (``refused.yaml``)."""

import json
from pathlib import Path

import pytest

from once import from_yaml
from safenav import InputError, Trace
from safenav.judge.lines import NotATraceError, Reader
from safenav.trace.file import read_bytes
from support.damage import GOOD, Edit, damage, find, text

REFUSED = from_yaml(Path(__file__).with_name("refused.yaml").read_text())
DOOR = text(GOOD["door"]())
HEADER = DOOR[0]


def read(lines: list[str]) -> Trace:
    return read_bytes("\n".join(lines).encode(), "t.jsonl")


@pytest.mark.parametrize("name", ["line", "data", "from_", "late", "outcome", "region", "__a"])
def test_a_robot_may_be_named_as_a_field(name: str) -> None:
    lines = [json.loads(line.replace("quad", name)) for line in DOOR]
    assert read(text(lines)).robots.keys() == {name, "digit"}


def test_unknown_notes_and_fields_are_ignored() -> None:
    note = {"type": "battery", "note": True, "robot": "quad", "percent": [1]}
    edits = [{"line": ["move"], "insert": note}, {"line": ["move"], "fields": {"speed": 3}}]
    lines = text(damage(GOOD["door"](), edits))
    trace = read(lines)
    assert (trace.ignored, len(trace.records)) == (1, len(lines) - 2)


@pytest.mark.parametrize("cut", [0, 20])
def test_only_a_last_line_that_breaks_off_is_ignored(cut: int) -> None:
    trace = read([*DOOR[:-1], DOOR[-1][: len(DOOR[-1]) - cut]])
    assert trace.cut_off is (trace.outcome is None) is bool(cut)


def of_header(who: str, words: str, path: str, value: object) -> tuple[str, str, str, list[Edit]]:
    return who, "door", words, [{"line": ["header"], "fields": {path: value}}]


NESTED: list[object] = []
for _ in range(250):
    NESTED = [NESTED]
MANY = [GOOD["door"]()[0]["scenario"]["robots"][0] | {"name": f"r{k}"} for k in range(1001)]
ALWAYS = "scenario.robots.0.objective.always"
CASES = [
    *(
        (who, name, words, edits)
        for who, traces in REFUSED.items()
        for name, each in traces.items()
        for words, *edits in each
    ),
    of_header("by both readers", "1001 robots; at most 1000", "scenario.robots", MANY),
    of_header("by both readers", "is nested more than 200 deep", "notes", NESTED),
    of_header("by the judge alone", "too much nesting", ALWAYS, ["(" * 3000]),
    of_header("by the judge alone", "too much nesting", ALWAYS, ["!" * 3000 + "TRUE"]),
    of_header("by the judge alone", "too much nesting", ALWAYS, [" -> ".join(["TRUE"] * 400)]),
]


@pytest.mark.parametrize(("who", "name", "words", "edits"), CASES)
def test_a_wrong_value_is_named_with_its_line(
    who: str, name: str, words: str, edits: list[Edit]
) -> None:
    lines = damage(GOOD[name](), edits)
    line = find(lines, *edits[0]["line"]) + 1
    if who == "by the judge alone":
        read(text(lines))
    else:
        with pytest.raises(InputError) as refused:
            read(text(lines))
        assert any(words in each.found for each in refused.value.diagnostics)
        assert {each.line for each in refused.value.diagnostics} == {line}
    if who != "by the reader alone":
        with pytest.raises(NotATraceError, match=rf"^line {line}: .*{words * ('alone' in who)}"):
            list(Reader().lines(text(lines)))


@pytest.mark.parametrize(
    ("lines", "line", "words"),
    [
        ([], 0, "empty"),
        (["", "", ""], 0, "empty"),
        (['{"type": "head'], 0, "the first line is incomplete"),
        (DOOR[1:], 1, "the first line must be the header"),
        ([HEADER, *DOOR], 2, "a second header"),
        ([*DOOR[:6], DOOR[6][:-4], *DOOR[7:]], 7, "not JSON"),
        ([*DOOR[:-1], DOOR[-1][:-4], ""], len(DOOR), "not JSON"),
        ([HEADER, '{"type": "goal", "tick": 1, "tick": 2}', ""], 2, "'tick' appears twice"),
        ([HEADER, '{"type": "goal", "tick": NaN}', ""], 2, "NaN is not a number"),
        ([HEADER, '{"type": "goal", "tick": 1e999}', ""], 2, "is beyond"),
        ([HEADER, '{"tick": 9007199254740993}', ""], 2, "beyond 9007199254740991"),
        ([HEADER, '{"tick": ' + "9" * 6000 + "}", ""], 2, "beyond 9007199254740991"),
        ([HEADER, "[" * 200_000, ""], 2, "nested"),
        (
            [HEADER, '{"type": "gone", "obstacle": "a", "cause": "\\ud800"}'],
            2,
            "half of a character",
        ),
    ],
)
def test_a_file_that_programs_read_differently_or_that_is_not_a_trace_is_refused(
    lines: list[str], line: int, words: str
) -> None:
    with pytest.raises(InputError) as refused:
        read(lines)
    (problem,) = refused.value.diagnostics
    assert problem.line == line and words in problem.found
    with pytest.raises(NotATraceError):
        list(Reader().lines("\n".join(lines).splitlines(keepends=True)))


def test_the_first_problems_are_reported_in_the_order_of_the_lines() -> None:
    lines = GOOD["door"]()
    del lines[5]["type"]
    del lines[3]["to"]
    with pytest.raises(InputError) as refused:
        read([*text(lines), *["{"] * 100])
    first, second, *more, last = refused.value.diagnostics
    assert (first.file, first.line, first.found) == ("t.jsonl", 4, "`to` is missing")
    assert second.line == 6 and len(more) == 18 and last.found == "and 81 more such problems"
