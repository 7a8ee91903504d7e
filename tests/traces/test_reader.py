"""The reader: typed lines, diagnostics that point, and traces of runs that were killed."""

from pathlib import Path

import pytest

from safenav.errors import Diagnostic, InputError, Outcome
from safenav.trace.fields import WrongError, convert
from safenav.trace.file import read_bytes, read_lines, read_trace
from safenav.trace.records import Gone, Move, Push, Resolved
from support.damage import GOOD, Line, damage, find, text


def refused(lines: list[str]) -> tuple[Diagnostic, ...]:
    with pytest.raises(InputError) as error:
        read_lines(lines, "t.jsonl")
    return error.value.diagnostics


def test_lines_become_typed_records_in_order() -> None:
    trace = read_lines(text(GOOD["door"]()))
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


def test_unknown_notes_and_fields_are_ignored() -> None:
    note = {"type": "battery", "note": True, "robot": "quad", "percent": [1]}
    edits = [{"line": ["move"], "insert": note}, {"line": ["move"], "fields": {"speed": 3}}]
    lines = damage(GOOD["door"](), edits)
    trace = read_lines(text(lines))
    assert trace.ignored == 1
    assert len(trace.records) == len(lines) - 2


def test_a_last_line_that_breaks_off_is_ignored() -> None:
    raw = "\n".join(text(GOOD["door"]())).encode()
    trace = read_bytes(raw[:-20])
    assert trace.cut_off
    assert trace.outcome is None


def test_a_complete_last_line_without_its_end_counts() -> None:
    trace = read_bytes("\n".join(text(GOOD["door"]())).encode())
    assert not trace.cut_off
    assert trace.outcome is not None


def test_a_broken_line_in_the_middle_is_reported_with_its_number() -> None:
    lines = text(GOOD["door"]())
    lines[6] = lines[6][:-4]
    (problem,) = refused(lines)
    assert (problem.file, problem.line) == ("t.jsonl", 7)
    assert "not JSON" in problem.found


@pytest.mark.parametrize(
    ("kind", "changes", "words"),
    [
        ("move", {"to": "8"}, "`to` must be a whole number, not "),
        ("move", {"heading": "up"}, "`heading` must be a string matching regex '^(north|"),
        ("synthesis", {"verdict": "maybe"}, "`verdict` has an invalid enum value 'maybe'"),
        (
            "push",
            {"objectives": {"quad": {"patrol": [1]}}},
            "`objectives[...]` must be an objective",
        ),
        ("request", {"bids": {"digit": -1}}, "`bids[...]` must be a whole number >= 0"),
        ("synthesis", {"seconds": -0.5}, "`seconds` must be a number >= 0"),
        ("blocked", {"reason": "boredom"}, "`reason` has an invalid enum value"),
    ],
)
def test_a_field_of_the_wrong_kind_is_named(kind: str, changes: Line, words: str) -> None:
    lines = GOOD["untraversable" if kind == "blocked" else "door"]()
    lines = damage(lines, [{"line": [kind], "fields": changes}])
    (problem,) = refused(text(lines))
    assert words in problem.found
    assert problem.line == find(lines, kind) + 1


def test_a_missing_field_is_named() -> None:
    lines = GOOD["door"]()
    del lines[find(lines, "move")]["to"]
    (problem,) = refused(text(lines))
    assert problem.found == "`to` is missing"


def test_all_problems_are_reported_in_the_order_of_the_lines() -> None:
    lines = GOOD["door"]()
    del lines[5]["type"]
    del lines[3]["robot"]
    assert [d.line for d in refused(text(lines))] == [4, 6]


def test_very_many_problems_are_summed_up() -> None:
    lines = text(GOOD["door"]())[:1] + ["{"] * 100
    problems = refused(lines)
    assert len(problems) < 30
    assert "80 more" in problems[-1].found


@pytest.mark.parametrize(
    ("raw", "said"),
    [(b"", "empty"), (b"\n\n", "empty"), (b'{"type": "head', "the first line is incomplete")],
)
def test_a_trace_without_a_whole_line_is_refused(raw: bytes, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_bytes(raw)


def test_a_trace_without_header_is_refused_once() -> None:
    (problem,) = refused(text(GOOD["door"]())[1:])
    assert (problem.line, problem.found) == (1, "the first line must be the header")


def test_a_second_header_is_refused() -> None:
    lines = text(GOOD["door"]())
    assert refused([*lines, lines[0]])[0].line == len(lines) + 1


def test_another_version_is_refused() -> None:
    lines = GOOD["door"]()
    lines[0]["trace"] = 2
    (problem,) = refused(text(lines))
    assert "version 4 can be read" in problem.found


def test_a_missing_trace_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_trace(tmp_path / "none.jsonl")


def test_half_of_a_character_is_refused() -> None:
    with pytest.raises(WrongError, match="half of a character"):
        convert(Gone, {"tick": 0, "obstacle": "door@1", "cause": "\ud800"})
