"""Real traces with one thing put wrong: ``check-trace`` refuses each of them.

Those that name a field exit 2 (it is no trace), those that tell a run that cannot have been 1.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import warm
from traces.real import real_trace

Line = dict[str, Any]


def refused(name: str, change: Callable[[list[Line]], None], folder: Path) -> tuple[int, str]:
    lines = [json.loads(line) for line in real_trace(name).splitlines()]
    change(lines)
    file = folder / "changed.jsonl"
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    result = warm.safenav("check-trace", file)
    return result.returncode, result.stdout + result.stderr


def first(lines: list[Line], kind: str) -> Line:
    return next(line for line in lines if line["type"] == kind)


@pytest.mark.parametrize(
    ("kind", "field", "value", "words"),
    [
        ("synthesis", "reason", "boredom", "`reason` must be one of initial, request"),
        ("push", "reason", "boredom", "`reason` must be one of request, yield"),
        ("pop", "reason", 3, "`reason` must be one of request, yield"),
        ("blocked", "reason", "boredom", "`reason` must be one of untraversable"),
        ("synthesis", "spec", "nonsense", '`spec` must be a sha256 (64 digits 0-9a-f), not "non'),
        ("synthesis", "spec", "", "`spec` must be a sha256"),
        ("synthesis", "strategy", "nonsense", "`strategy` must be a sha256"),
        ("synthesis", "states", -1, "`states` must be 0 or more or null, not -1"),
        ("synthesis", "seconds", -0.001, "`seconds` must be 0 or more, not -0.001"),
        ("outcome", "seconds", -1, "`seconds` must be 0 or more, not -1"),
        ("outcome", "synthesis_seconds", -1, "`synthesis_seconds` must be 0 or more, not -1"),
        ("outcome", "syntheses", -1, "`syntheses` must be 0 or more, not -1"),
    ],
)
def test_nonsense_in_a_field(
    kind: str, field: str, value: object, words: str, tmp_path: Path
) -> None:
    def change(lines: list[Line]) -> None:
        if kind == "blocked":
            lines.insert(-1, {"type": "blocked", "tick": 1, "obstacle": "door@47", "robots": []})
        first(lines, kind)[field] = value

    code, said = refused("case_study_2", change, tmp_path)
    assert code == 2
    assert words in said


def test_no_syntheses_where_some_are_told_from_the_cache(tmp_path: Path) -> None:
    def change(lines: list[Line]) -> None:
        for line in lines:
            if line["type"] == "synthesis":
                line["cached"] = True
        lines[-1]["syntheses"] = 0

    code, said = refused("case_study_2", change, tmp_path)
    assert code == 1
    assert "it reports 0 syntheses; the trace has 10" in said


@pytest.mark.parametrize("name", ["case_study_2", "case_study_3", "corridor_swap", "two_digits"])
def test_a_run_that_goes_on_after_it_was_completed(name: str, tmp_path: Path) -> None:
    def change(lines: list[Line]) -> None:
        lines[0]["scenario"]["until"]["rounds"] = 1

    code, said = refused(name, change, tmp_path)
    assert code == 1
    assert "every robot has completed 1 round, but the run continues" in said


def test_a_trace_without_its_outcome(tmp_path: Path) -> None:
    code, said = refused("case_study_2", lambda lines: lines.__delitem__(-1), tmp_path)
    assert code == 1
    assert "--partial" in said


def test_a_belief_that_contains_a_wall(tmp_path: Path) -> None:
    def change(lines: list[Line]) -> None:
        belief = next(line for line in lines if line["type"] == "belief" and not line["seen"])
        belief["regions"].append(0)

    code, said = refused("case_study_1_beliefs", change, tmp_path)
    assert code == 1
    assert "believes quad at 0 (0, 0), which is not free" in said


def test_belief_lines_that_were_dropped(tmp_path: Path) -> None:
    text = real_trace("case_study_1_beliefs").splitlines()
    told = [i for i, line in enumerate(text) if json.loads(line)["type"] == "belief"]
    assert len(told) > 30
    for i in told:
        code, _ = refused("case_study_1_beliefs", lambda lines, i=i: lines.__delitem__(i), tmp_path)
        assert code == 1
