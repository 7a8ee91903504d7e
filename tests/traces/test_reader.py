"""The reader: typed lines, diagnostics that point, and traces of runs that were killed. What it
refuses in a field, a word or a name, the judge refuses as well."""

import json
from pathlib import Path

import pytest

from safenav.errors import Diagnostic, InputError, Outcome
from safenav.judge.lines import NotATraceError, Reader
from safenav.strict_json import flaws
from safenav.trace.fields import WrongError, convert
from safenav.trace.file import Trace, read_bytes, read_trace
from safenav.trace.records import Gone, Move, Push, Resolved
from support.damage import GOOD, Line, damage, find, text


def read(lines: list[str]) -> Trace:
    return read_bytes("".join(f"{line}\n" for line in lines).encode(), "t.jsonl")


def refused(lines: list[str]) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as error:
        read(lines)
    return error.value.diagnostics


@pytest.mark.parametrize("name", sorted(GOOD))
def test_a_good_trace_has_no_findings(name: str) -> None:
    assert [flaw for line in GOOD[name]() for flaw in flaws(line, line["type"])] == []


def test_lines_become_typed_records_in_order() -> None:
    trace = read(text(GOOD["door"]()))
    assert list(trace.robots) == ["quad", "digit"]
    assert trace.obstacles["door@9"].resolution_regions(trace.scenario.map) == (9,)
    assert trace.robots["quad"].objective.targets == (frozenset({7}), frozenset({10}))
    move = next(r for r in trace.records if isinstance(r, Move))
    assert (move.line, move.tick, move.robot, move.from_, move.to) == (4, 1, "quad", 7, 8)
    push = next(r for r in trace.records if isinstance(r, Push))
    assert push.objectives["quad"].kind == "hold"
    assert [r.traversable for r in trace.records if isinstance(r, Resolved)] == [None]
    assert trace.outcome is not None
    assert trace.outcome.outcome is Outcome.COMPLETED
    assert not trace.cut_off


@pytest.mark.parametrize("name", ["line", "data", "from_", "late", "outcome", "region", "__a"])
def test_a_robot_may_be_named_as_a_field(name: str) -> None:
    lines = [json.loads(line.replace("quad", name)) for line in text(GOOD["door"]())]
    assert read(text(lines)).robots.keys() == {name, "digit"}


def test_unknown_notes_and_fields_are_ignored() -> None:
    note = {"type": "battery", "note": True, "robot": "quad", "percent": [1]}
    edits = [{"line": ["move"], "insert": note}, {"line": ["move"], "fields": {"speed": 3}}]
    lines = damage(GOOD["door"](), edits)
    trace = read(text(lines))
    assert trace.ignored == 1
    assert len(trace.records) == len(lines) - 2


@pytest.mark.parametrize("cut", [0, 20])
def test_only_a_last_line_that_breaks_off_is_ignored(cut: int) -> None:
    raw = "\n".join(text(GOOD["door"]())).encode()
    trace = read_bytes(raw[: len(raw) - cut])
    assert trace.cut_off is (trace.outcome is None) is bool(cut)


WRONG: list[tuple[str, Line, str]] = [
    ("move", {"to": "8"}, "`to` must be a whole number, not "),
    ("move", {"heading": "up"}, "`heading` must be a string matching regex '^(north|"),
    ("synthesis", {"verdict": "maybe"}, "`verdict` has an invalid enum value 'maybe'"),
    ("push", {"objectives": {"quad": {"visit": ["all"]}}}, "`objectives[...]` must"),
    ("blocked", {"reason": "boredom"}, "`reason` has an invalid enum value"),
    ("move", {"by": "either"}, "`by` has an invalid enum value"),
    ("goal", {"robot": "quad is proven safe"}, "`robot` must be a name"),
    ("request", {"bids": {"x: open('f')": 1}}, "neither a field nor a name"),
    ("move", {"toward": True}, "`toward` must be"),
    ("outcome", {"ticks": "never"}, "`ticks` must be"),
    ("header", {"trace": 2}, "version 4 can be read"),
]


@pytest.mark.parametrize(("kind", "changes", "words"), WRONG)
def test_a_wrong_value_is_named_with_its_line(kind: str, changes: Line, words: str) -> None:
    lines = GOOD["untraversable" if kind == "blocked" else "door"]()
    lines = damage(lines, [{"line": [kind], "fields": changes}])
    (problem,) = refused(text(lines))
    assert words in problem.found
    assert problem.line == find(lines, kind) + 1
    with pytest.raises(NotATraceError, match=f"^line {problem.line}: "):
        list(Reader().lines(text(lines)))


@pytest.mark.parametrize(
    ("kind", "changes", "words"),
    [
        ("request", {"bids": {"digit": -1}}, "`bids[...]` must be a whole number >= 0"),
        ("synthesis", {"seconds": -0.5}, "`seconds` must be a number >= 0"),
        ("push", {"objectives": {"quad": {"patrol": [1]}}}, "`objectives[...]` must be an object"),
    ],
)
def test_a_wrong_value_that_no_rule_reads_is_named(kind: str, changes: Line, words: str) -> None:
    (problem,) = refused(text(damage(GOOD["door"](), [{"line": [kind], "fields": changes}])))
    assert words in problem.found


def test_all_problems_are_reported_in_the_order_of_the_lines() -> None:
    lines = GOOD["door"]()
    del lines[5]["type"]
    del lines[3]["to"]
    first, second = refused(text(lines))
    assert (first.file, first.line, first.found) == ("t.jsonl", 4, "`to` is missing")
    assert second.line == 6


@pytest.mark.parametrize(
    ("change", "line", "words"),
    [
        (lambda lines: [*lines[:6], lines[6][:-4], *lines[7:]], 7, "not JSON"),
        (lambda lines: [*lines[:1], *["{"] * 100], -1, "80 more"),
        (lambda lines: lines[1:], 1, "the first line must be the header"),
        (lambda lines: [lines[0], lines[0], *lines[1:]], 2, "a second header"),
    ],
)
def test_lines_that_are_no_trace_are_refused(change: object, line: int, words: str) -> None:
    assert callable(change)
    problems = refused(change(text(GOOD["door"]())))
    assert len(problems) < 30 and words in problems[-1].found
    assert line in (-1, problems[0].line)


@pytest.mark.parametrize(
    ("raw", "said"),
    [(b"", "empty"), (b"\n\n", "empty"), (b'{"type": "head', "the first line is incomplete")],
)
def test_a_trace_without_a_whole_line_is_refused(raw: bytes, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_bytes(raw)


def test_a_missing_trace_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_trace(tmp_path / "none.jsonl")


def test_half_of_a_character_is_refused() -> None:
    with pytest.raises(WrongError, match="half of a character"):
        convert(Gone, {"tick": 0, "obstacle": "door@1", "cause": "\ud800"})


NESTED: list[object] = []
for _ in range(250):
    NESTED = [NESTED]
MANY = [{"name": f"r{k}"} for k in range(2000)]
HEADERS: dict[str, tuple[dict[str, object], str]] = {
    "robot": ({"robots": [{"name": "a.b"}]}, "'a.b' cannot name a robot"),
    "robots": ({"robots": MANY}, "at most 1000"),
    "obstacle": ({"obstacles": [{"type": {"name": "a.b"}}]}, "'a.b' cannot name an obstacle"),
    "rows": ({"map": {"rows": 10**9, "cols": 10**9}}, "1 to 262144"),
    "cols": ({"map": {"rows": 2, "cols": 0}}, "a map of 2 x 0 regions"),
    "nesting": ({"name": [[[]]], "tiles": NESTED}, "nested more than"),
}


@pytest.mark.parametrize("name", HEADERS)
def test_a_hostile_header_is_refused(name: str) -> None:
    changes, words = HEADERS[name]
    header = GOOD["door"]()[0]
    header["scenario"] |= changes
    assert words in " ".join(flaws(header, "header"))


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ('"tick": 1, "tick": 2', "'tick' appears twice"),
        ('"tick": NaN', "NaN is not a number"),
        ('"tick": 1e999', "is beyond"),
        ('"tick": 9007199254740993', "beyond 9007199254740991"),
        ('"tick": ' + "9" * 6000, "beyond 9007199254740991"),
    ],
)
def test_json_that_programs_read_differently_is_refused(fields: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read([*text(GOOD["door"]()[:1]), f'{{"type": "goal", {fields}}}'])
