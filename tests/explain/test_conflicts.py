"""Cores, plays and sentences of files that were once explained wrongly."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from random import Random

import pytest

from explain.conftest import Invoke
from once import SCENARIOS
from safenav.cli import explain

TWO_CONFLICTS = """\
[OUTPUT]
a
b
[SYS_TRANS]
a'
!a'
b'
!b'
"""
SOME_INPUTS = """\
[INPUT]
z
w
[OUTPUT]
y
[SYS_INIT]
z -> y
!w -> !y
[SYS_LIVENESS]
y
"""
START_AND_TRAP = """\
[INPUT]
x
[OUTPUT]
y
[SYS_INIT]
x
[SYS_TRANS]
x' -> y & !y'
y'
[SYS_LIVENESS]
y
"""


@pytest.mark.parametrize(
    ("text", "core", "said", "ending", "inputs"),
    [
        (TWO_CONFLICTS, [5, 6], "still unrealizable without line 5 or without line 6", "stuck", {}),
        (
            SOME_INPUTS,
            [7, 8],
            "  the initial inputs z=1 w=0 leave no output that satisfies the guarantees",
            "no_beginning",
            {"z": 1, "w": 0},
        ),
        (
            START_AND_TRAP,
            [6],
            "still unrealizable without line 6",
            "no_beginning",
            {"x": 0},
        ),
    ],
    ids=["two conflicts", "some initial inputs", "a start and a trap"],
)
def test_the_play_is_one_of_the_core_and_other_conflicts_are_named(
    text: str,
    core: list[int],
    said: str,
    ending: str,
    inputs: dict[str, int],
    tmp_path: Path,
    invoke: Invoke,
) -> None:
    file = tmp_path / "s"
    file.write_text(text)
    answer = invoke(explain.command, file)
    assert answer.status == 1 and said in answer.output
    found = json.loads(invoke(explain.command, file, "--json").output)["unrealizable"]
    assert [int(c["item"].rpartition(":")[2]) for c in found["core"]] == core
    assert (found["play"]["ending"], found["play"]["inputs"]) == (ending, inputs)


PORCH = """
safenav: 1
map:
  grid: ["#######", "#.....#", "#.#.#.#", "#.#.#.#", "#..#..#", "#######"]
  names: {porch: [1, 3], kitchen: [1, 2], living: [1, 4], bed: [4, 1]}
inputs: {fire: {at: 6}, person: {at: 6}}
robots:
  a:
    model: quadcopter
    start: porch
    objective:
      ltl:
        safety:
          - fire' -> region' != kitchen
          - person' -> region' != living
          - region = 8 -> region' != 9
        liveness: region = bed
"""
DROP = """
safenav: 1
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
areas: {porch: {rows: 1, columns: 1}}
inputs:
  hazard: {at: 6, always_eventually: off}
  person: {at: 12, always_eventually: off}
robots:
  a:
    model: quadcopter
    start: [3, 3]
    objective:
      ltl:
        memory: {carrying: bool, radio: bool}
        init: "!carrying & !radio"
        safety:
          - carrying' <-> ((carrying & !(region = porch)) | (hazard' & !carrying))
          - radio' <-> person'
          - radio' -> region' = region
          - "!carrying -> region' != porch"
        liveness: ["!carrying"]
"""


def test_each_formula_is_a_member_of_its_own(tmp_path: Path, invoke: Invoke) -> None:
    file = tmp_path / "porch.yaml"
    file.write_text(PORCH)
    (found,) = json.loads(invoke(explain.command, file, "--json").output)["unrealizable"]
    formulas = [c for m in found["core"]["members"] for c in m["constraints"]]
    assert "[SYS_TRANS] fire' -> region' != 9" in formulas
    assert "[SYS_TRANS] region = 8 -> region' != 9" not in formulas
    assert all(len(m["constraints"]) == 1 for m in found["core"]["members"] if "ltl" in m["rule"])


def test_the_play_shows_what_the_robot_does_not_dare(tmp_path: Path, invoke: Invoke) -> None:
    """It idled with all inputs off."""
    file = tmp_path / "drop.yaml"
    file.write_text(DROP)
    answer = invoke(explain.command, file)
    play = answer.output.split("What happens:")[1]
    assert "a at porch 10 [1, 1]; hazard = 0, person = 1, carrying = 0, radio = 1" in play
    assert "and no move is left:" in play
    assert "staying breaks: robots.a.objective: ltl: always: !carrying -> region' != 10" in play


def test_without_time_only_what_is_proven_is_printed(
    tmp_path: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("safenav.explain.realizability.BUDGET_SECONDS", 0.0)
    file = tmp_path / "s"
    file.write_text(TWO_CONFLICTS)
    answer = invoke(explain.command, file)
    assert answer.status == 1
    assert answer.output.splitlines()[1:] == [
        "These guarantees conflict:",
        "  - line 5 [SYS_TRANS] a'",
        "  - line 6 [SYS_TRANS] !a'",
        "  - line 7 [SYS_TRANS] b'",
        "  - line 8 [SYS_TRANS] !b'",
        "  (some checks timed out: the core may not be minimal)",
    ]
    file = tmp_path / "drop.yaml"
    file.write_text(DROP)
    answer = invoke(explain.command, file)
    assert answer.status == 1 and "because its guarantees conflict\n" in answer.output
    assert "What happens" not in answer.output and "cooperated" not in answer.output


CIRCLE = """
safenav: 1
map:
  grid:
    ["###############", "#...#.....#...#", "#.............#", "#...#.....#...#", "###############"]
  names: {west: [2, 4], east: [2, 10], a_button: [2, 1], b_button: [2, 13]}
catalogue:
  robots:
    red: {mobility: free, layer: ground, capabilities: [red_key]}
    blue: {mobility: free, layer: ground, capabilities: [blue_key]}
  obstacles:
    red_door: {action: red_key, resolve_at: [a_button]}
    blue_door: {action: blue_key, resolve_at: [b_button]}
robots:
  r: {model: red, start: [1, 5], objective: {visit: [[1, 5], [2, 3]]}}
  b: {model: blue, start: [1, 9], objective: {visit: [[1, 9], [2, 11]]}}
obstacles: [{type: red_door, region: east}, {type: blue_door, region: west}]
until: {rounds: 1}
limits: {ticks: 200}
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("seed", range(4))
def test_an_interrupt_ends_it(seed: int, number: signal.Signals, tmp_path: Path) -> None:
    """The runs of repairs took it for the end of one run."""
    circle = tmp_path / "circle.yaml"
    circle.write_text(CIRCLE)
    file = [circle, SCENARIOS / "unrealizable" / "separate_rooms.yaml"][seed % 2]
    command = [sys.executable, "-m", "safenav", "explain", str(file)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:  # type: ignore[call-overload]
        time.sleep(0.8 + 2.5 * Random(seed).random())
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode in (130, 1)
    if process.returncode == 130:
        assert err.endswith("interrupted\n")
        assert "None of the simple repairs" not in out and "ended with interrupted" not in out
