"""``safenav check`` of a trace: what it prints and how it exits."""

import json
from pathlib import Path

import pytest

import warm
from judge.good_traces import GOOD
from judge.trace_script import edit, text


def run(*arguments: str, stdin: str = "") -> warm.Done:
    return warm.safenav("check", *arguments, text=stdin)


@pytest.fixture
def good(tmp_path: Path) -> Path:
    file = tmp_path / "good.jsonl"
    file.write_text("\n".join(text(GOOD["door"]())) + "\n")
    return file


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    lines = GOOD["door"]()
    edit("move", {"tick": 8, "robot": "digit"}, to=17)(lines)
    edit("outcome", {}, ticks=9)(lines)
    file = tmp_path / "bad.jsonl"
    file.write_text("\n".join(text(lines)) + "\n")
    return file


def test_a_good_trace_exits_0_and_says_what_was_checked(good: Path) -> None:
    result = run(str(good))
    assert result.returncode == 0
    assert "no rule broken in 8 ticks of 2 robots" in result.stdout


def test_a_broken_trace_exits_1_and_names_the_first_rule_or_all(bad: Path) -> None:
    results = [run(*options, str(bad)) for options in ([], ["--all"], ["--json"], ["--partial"])]
    assert [result.returncode for result in results] == [1] * 4
    first, rest = results[0].stdout.splitlines()
    assert "line 33: mobility (tick 8, digit): digit enters 17 (2, 5), which is not free" in first
    assert rest == "and 3 more (--all shows them)"
    rules = [line.split(": ")[2].split(" ")[0] for line in results[1].stdout.splitlines()]
    assert rules == ["mobility", "mobility", "mobility", "goal"]
    data = json.loads(results[2].stdout)
    assert (data["ok"], data["outcome"], data["statistics"]["moves"]) == (False, "completed", 16)
    told = data["findings"][0]
    assert [told[key] for key in ("rule", "tick", "robot", "line")] == ["mobility", 8, "digit", 33]


def test_standard_input_is_read() -> None:
    result = run("-", stdin="\n".join(text(GOOD["nested"]())) + "\n")
    assert result.returncode == 0
    assert "<stdin>" in result.stdout


@pytest.mark.parametrize("cut", [-40, -1], ids=["in a line", "before the outcome"])
def test_a_trace_without_outcome_takes_partial(good: Path, cut: int) -> None:
    whole = good.read_text()
    good.write_text(whole[:cut] if cut < -1 else whole[: whole.index('{"type": "outcome"')])
    result = run(str(good))
    assert result.returncode == 1
    assert "ends before its outcome" in result.stdout
    assert "--partial" in result.stdout
    assert run("--partial", str(good)).returncode == 0
