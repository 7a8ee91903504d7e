"""Trace files, as they are read: diagnostics that point, traces of runs that were killed, and no
orders to a terminal. The judge alone refuses what is refused here (``judge.test_parts``)."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from once import from_yaml, trace_of_shipped
from safenav import InputError, Trace, TraceWriter, check_trace, read_trace
from support.damage import GOOD, Edit, damage, find, text

Read = Callable[[list[str]], Trace]
REFUSED = from_yaml(Path(__file__).with_name("refused.yaml").read_text())
DOOR = text(GOOD["door"]())
HEADER = DOOR[0]


def of_header(who: str, words: str, path: str, value: object) -> tuple[str, str, str, list[Edit]]:
    return who, "door", words, [{"line": ["header"], "fields": {path: value}}]


NESTED: list[object] = []
for _ in range(250):
    NESTED = [NESTED]
ROBOT = GOOD["door"]()[0]["scenario"]["robots"][0]
MANY = [ROBOT | {"name": f"r{k}"} for k in range(1001)]
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
    of_header("by the judge alone", "too much nesting", ALWAYS, [" ^ ".join(["TRUE"] * 200)]),
]
"""Who refuses it, the good trace, words, and edits; the first edit names the line."""
NOT_TRACES: list[tuple[list[str], int, str]] = [
    ([], 0, "empty"),
    (["", "", ""], 0, "empty"),
    (['{"type": "head'], 0, "the first line is incomplete"),
    (DOOR[1:], 1, "the first line must be the header"),
    ([HEADER, *DOOR], 2, "a second header"),
    ([*DOOR[:6], DOOR[6][:-4], *DOOR[7:]], 7, "not JSON"),
    ([*DOOR[:-1], DOOR[-1][:-4], ""], len(DOOR), "not JSON"),
    ([HEADER, '{"type": "goal", "tick": 1, "tick": 2}', ""], 2, "'tick' appears twice"),
    ([HEADER, '{"type": "goal", "tick": NaN}', ""], 2, "NaN is not a valid JSON number"),
    ([HEADER, '{"type": "goal", "tick": 1e999}', ""], 2, "is beyond"),
    ([HEADER, '{"tick": 9007199254740993}', ""], 2, "beyond 9007199254740991"),
    ([HEADER, '{"tick": ' + "9" * 6000 + "}", ""], 2, "beyond 9007199254740991"),
    ([HEADER, "[" * 200_000, ""], 2, "nested"),
    ([HEADER, "[1]", ""], 2, "must be a JSON object"),
    ([HEADER, "1" * 10_000_001, ""], 2, "longer than 10 MB"),
    ([HEADER, '{"type": "gone", "cause": "\\ud800"}', ""], 2, "half of a character"),
]
"""Lines, the number of the wrong one (0: the whole file), and words."""


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Reads lines from a file t.jsonl."""

    def from_file(lines: list[str]) -> Trace:
        (file := tmp_path / "t.jsonl").write_text("\n".join(lines))
        return read_trace(file)

    return from_file


@pytest.mark.parametrize("name", ["line", "data", "from_", "late", "outcome", "region", "__a"])
def test_a_robot_may_have_the_name_of_a_field(name: str, read: Read) -> None:
    lines = [json.loads(line.replace("quad", name)) for line in DOOR]
    assert read(text(lines)).robots.keys() == {name, "digit"}


def test_unknown_notes_and_fields_are_ignored(read: Read) -> None:
    note = {"type": "battery", "note": True, "robot": "quad", "percent": [1]}
    edits = [{"line": ["move"], "insert": note}, {"line": ["move"], "fields": {"speed": 3}}]
    lines = text(damage(GOOD["door"](), edits))
    trace = read(lines)
    assert len(trace.records) == len(lines) - 2


@pytest.mark.parametrize("cut", [0, 20])
def test_only_an_incomplete_last_line_is_ignored(cut: int, read: Read) -> None:
    trace = read([*DOOR[:-1], DOOR[-1][: len(DOOR[-1]) - cut]])
    assert trace.cut_off is (trace.outcome is None) is bool(cut)


@pytest.mark.parametrize(("who", "name", "words", "edits"), CASES)
def test_a_wrong_value_is_named_with_its_line(
    who: str, name: str, words: str, edits: list[Edit], read: Read
) -> None:
    lines = damage(GOOD[name](), edits)
    line = find(lines, *edits[0]["line"]) + 1
    if who == "by the judge alone":
        read(text(lines))
        with pytest.raises(InputError, match=rf"line {line}: .*{words}"):
            check_trace(text(lines))
        return
    with pytest.raises(InputError) as refused:
        read(text(lines))
    assert any(words in each.found for each in refused.value.diagnostics)
    assert {each.line for each in refused.value.diagnostics} == {line}


@pytest.mark.parametrize(("lines", "line", "words"), NOT_TRACES)
def test_a_file_that_programs_read_differently_or_that_is_not_a_trace_is_refused(
    lines: list[str], line: int, words: str, read: Read
) -> None:
    with pytest.raises(InputError) as refused:
        read(lines)
    (problem,) = refused.value.diagnostics
    assert problem.line == line and words in problem.found


def test_the_first_errors_are_reported_in_the_order_of_the_lines(
    read: Read, tmp_path: Path
) -> None:
    lines = GOOD["door"]()
    del lines[5]["type"]
    del lines[3]["to"]
    with pytest.raises(InputError) as refused:
        read([*text(lines), *["{"] * 100])
    first, second, *more, last = refused.value.diagnostics
    assert (first.file, first.line, first.found) == (
        str(tmp_path / "t.jsonl"),
        4,
        "`to` is missing",
    )
    assert second.line == 6 and len(more) == 18 and last.found == "and 81 more errors"


HOSTILE = json.dumps("\x1b[2J\x07\x9b\u2028\u202e\nx", ensure_ascii=False)[1:-1]
"""Orders to a terminal, some of them unescaped, as another program may write them."""


@pytest.mark.parametrize("name", ["quad", "door"])
def test_names_that_control_the_terminal_are_refused_and_shown_escaped(
    name: str, read: Read
) -> None:
    """Also as keys."""
    trace = trace_of_shipped("case_study_1_beliefs").read_text()
    with pytest.raises(InputError) as refused:
        read([trace.replace(f'"{name}', f'"{name}{HOSTILE}')])
    assert all(each.found.isprintable() for each in refused.value.diagnostics)


def test_texts_of_a_trace_cannot_control_the_terminal(read: Read, tmp_path: Path) -> None:
    """Explanations may have several lines."""
    lines = trace_of_shipped("case_study_1_beliefs").read_text().splitlines()
    end = '"explanation":"'
    lines[-1] = lines[-1].replace(end, rf"{end}one\ntwo\u001b{HOSTILE}")
    trace = read(lines)
    assert trace.outcome is not None and check_trace(trace).ok
    told = "one\ntwo\\x1b\\x1b[2J\\x07\\x9b\\u2028\\u202e\nx"
    assert trace.outcome.explanation.startswith(told)
    with TraceWriter(tmp_path / "again.jsonl") as writer:
        for record in (trace.header, *trace.records):
            writer(record)
    written = (tmp_path / "again.jsonl").read_text().splitlines()
    said = json.dumps([json.loads(line) for line in written], ensure_ascii=False)
    assert said.isprintable()


def test_an_interrupt_before_the_first_line_is_written_leaves_no_file(
    read: Read, tmp_path: Path
) -> None:
    header, file = read(DOOR).header, tmp_path / "again.jsonl"

    class Interrupted(type(header)):  # type: ignore[misc]
        @property
        def note(self) -> bool:
            raise KeyboardInterrupt

    interrupted = Interrupted(**{name: getattr(header, name) for name in header.__struct_fields__})
    with pytest.raises(KeyboardInterrupt), TraceWriter(file) as writer:
        writer(interrupted)
    assert not file.exists()
