"""``safenav synth`` and ``safenav explain`` of specifications that users bring."""

import json
import subprocess
from functools import partial
from pathlib import Path

import pytest

from explain.conftest import Invoke
from safenav.cli import synth as specification
from safenav.cli.synth import explain, synth, verify
from safenav.synthesis.program import find_binary
from safenav.synthesis.slugs import Synthesizer

LIFT = """\
# a lift
[INPUT]
request
[OUTPUT]
floor: 0...3
[SYS_INIT]
floor = 0
[SYS_TRANS]
floor' <= floor + 1 & floor <= floor' + 1
[ENV_LIVENESS]
request'
[SYS_LIVENESS]
request & floor = 3
floor = 0
"""
DOOR = """\
[INPUT]
open
[OUTPUT]
x: 0...4
[SYS_INIT]
x = 0
[SYS_TRANS]
x' <= x + 1 & x <= x' + 1
# the door
!open' -> x' != 2
[SYS_LIVENESS]
x = 4
x = 0
"""
TRAP = """\
[INPUT]
a
[OUTPUT]
b
[SYS_TRANS]
b' <-> !b
b' -> a'
"""
LAZY = """\
[INPUT]
a
[OUTPUT]
b
[ENV_LIVENESS]
a & b
[SYS_LIVENESS]
a & !a
"""


def written(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_a_strategy_is_that_of_slugs_and_is_correct(tmp_path: Path, invoke: Invoke) -> None:
    file, out = written(tmp_path, "lift.spec", LIFT), tmp_path / "out"
    answer = invoke(synth, file, "-o", out)
    assert answer.status == 0
    heading, _, row, *_ = answer.output.splitlines()
    assert heading.split()[:3] == ["file", "verdict", "states"]
    assert row.split()[:3] == ["lift", "realizable", "13"]
    assert {path.name for path in out.iterdir()} == {"lift.json", "lift.dot", "lift.graphml"}
    options = ["--explicitStrategy", "--jsonOutput"]
    slugs = subprocess.run([find_binary().path, *options, file], capture_output=True, check=True)
    assert (out / "lift.json").read_bytes() == slugs.stdout
    assert invoke(verify, file, out / "lift.json").status == 0
    assert "nothing to explain" in invoke(explain, file).output


def test_an_unrealizable_one_gets_the_strategy_of_the_environment(
    tmp_path: Path, invoke: Invoke
) -> None:
    file = written(tmp_path, "door.structuredslugs", DOOR)
    answer = invoke(synth, file, "-o", tmp_path)
    assert answer.status == 1 and f"safenav explain {file}" in answer.error
    strategy = tmp_path / "door.counterstrategy.json"
    assert invoke(verify, "--counterstrategy", file, strategy).status == 0


def test_initial_inputs_that_win_immediately_are_named(tmp_path: Path, invoke: Invoke) -> None:
    """The environment needs no strategy then: an automaton without nodes is one."""
    text = "[INPUT]\nz\nw\n[OUTPUT]\ny\n[SYS_INIT]\nz -> y\n!w -> !y\n[SYS_LIVENESS]\ny\n"
    file = written(tmp_path, "at_once.structuredslugs", text)
    answer = invoke(synth, file, "-o", tmp_path)
    said = "the initial inputs z=1 w=0 leave no output"
    assert answer.status == 1 and said in answer.output
    strategy = tmp_path / "at_once.counterstrategy.json"
    answer = invoke(verify, "--counterstrategy", file, strategy)
    assert answer.status == 0 and said in answer.output
    possible = text.replace("!w -> !y", "!w -> y")
    file.write_text(possible)
    assert invoke(verify, "--counterstrategy", file, strategy).status == 1


@pytest.mark.parametrize(
    ("owner", "status", "said"),
    [
        ("INPUT", 3, "realizable, but its strategy is too large to list (the strategy of large"),
        ("OUTPUT", 1, "unrealizable, but the environment's strategy is too large to list"),
    ],
)
def test_a_verdict_is_given_where_the_strategy_is_too_large(
    owner: str,
    status: int,
    said: str,
    tmp_path: Path,
    invoke: Invoke,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was "nothing is proven" for the larger specifications of the literature."""
    monkeypatch.setattr(specification, "Synthesizer", partial(Synthesizer, memory_mb=40))
    lines = [f"[{owner}]", *(f"x{k}" for k in range(22))]
    lines += ["[INPUT]", "i", "[OUTPUT]", "o", "[SYS_LIVENESS]", "o" if owner == "INPUT" else "i"]
    file = tmp_path / "large.structuredslugs"
    file.write_text("\n".join(lines) + "\n")
    found = invoke(synth, file)
    assert (found.status, said in found.error + found.output) == (status, True)
    explained = invoke(explain, file)
    assert explained.status == (0 if status == 3 else 1)


def test_a_core_names_lines_and_assumptions_were_tried(tmp_path: Path, invoke: Invoke) -> None:
    file = written(tmp_path, "door.structuredslugs", DOOR)
    answer = invoke(explain, file)
    assert answer.status == 1
    assert [line for line in answer.output.splitlines() if line.startswith("  - ")] == [
        "  - line 6 [SYS_INIT] x = 0",
        "  - line 8 [SYS_TRANS] x' <= x + 1 & x <= x' + 1",
        "  - line 10 [SYS_TRANS] !open' -> x' != 2  # the door",
        "  - line 12 [SYS_LIVENESS] x = 4",
        "  - [ENV_LIVENESS] open'",
    ]
    told = json.loads(invoke(explain, file, "--json").output)["unrealizable"]
    assert told["assumptions"] == ["open'"]
    assert told["play"]["goal"]["formula"] == "x = 4"
    mended = written(tmp_path, "mended", DOOR + "[ENV_LIVENESS]\nopen'\n")
    assert invoke(explain, mended).status == 0


def test_inputs_that_leave_the_system_without_a_move_are_shown(
    tmp_path: Path, invoke: Invoke
) -> None:
    answer = invoke(explain, written(tmp_path, "trap", TRAP))
    assert answer.status == 1
    assert "then the inputs a=0 leave no reply that keeps all guarantees" in answer.output


def test_a_win_against_its_own_assumptions_is_a_warning(tmp_path: Path, invoke: Invoke) -> None:
    file = written(tmp_path, "lazy", LAZY)
    answer = invoke(synth, file)
    assert answer.status == 0
    assert "warning: the system may win by breaking its own assumptions" in answer.error
    assert "assumption: line 6 [ENV_LIVENESS] a & b" in answer.error


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (DOOR.replace("x = 4", "y = 4"), "door:12:1: undeclared variable 'y'"),
        (DOOR.replace("x = 4", "F(x = 4)"), "door:12:1: temporal operator 'F'"),
        (
            DOOR.replace("[SYS_INIT]", "[ENV_TRANS]\nx' = 1\n[SYS_INIT]"),
            "the environment moves first",
        ),
        (DOOR.replace("[SYS_LIVENESS]", "[LIVENESS]"), "door:11:"),
    ],
)
def test_errors_are_shown_at_their_positions(
    text: str, said: str, tmp_path: Path, invoke: Invoke
) -> None:
    file = written(tmp_path, "door", text)
    for command in (synth, explain):
        answer = invoke(command, file)
        assert answer.status == 2 and said in answer.error


def test_without_time_only_proven_results_are_printed(
    tmp_path: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("safenav.explain.play.BUDGET_SECONDS", 0.0)
    answer = invoke(explain, written(tmp_path, "s", "[OUTPUT]\na\n[SYS_TRANS]\na'\n!a'\n"))
    assert answer.status == 1
    assert answer.output.splitlines()[1:] == [
        "These guarantees conflict:",
        "  - line 4 [SYS_TRANS] a'",
        "  - line 5 [SYS_TRANS] !a'",
        "  (some checks timed out: the core may not be minimal)",
    ]
