"""``safenav verify``: accepts what slugs prints, refuses damage, and says where and why."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from explain.conftest import Invoke
from safenav.cli.synth import verify as command
from safenav.spec.specification import read_specification
from safenav.synthesis.slugs import Synthesizer

DOOR = """\
# porter: opens the door when asked

[INPUT]
request

[OUTPUT]
region:0...3
open

[ENV_INIT]
!request

[SYS_INIT]
# robots.porter.start: where it begins
region = 0
!open

[ENV_TRANS]
# visitors: whoever asks goes on asking until it is open
request & !open -> request'

[SYS_TRANS]
# robots.porter.mobility: one region a tick
region' <= region + 1 & region <= region' + 1
# obstacles.door: opens from region 3 only
open' -> region' = 3

[SYS_LIVENESS]
# robots.porter.objective: serve whoever asks
!request | open
# robots.porter.objective: rest
region = 0
"""


def test_assumptions_that_cannot_hold_are_reported(tmp_path: Path, invoke: Invoke) -> None:
    text, automaton = _written(tmp_path, DOOR.replace("!request\n\n", "!request\nrequest\n\n"))
    answer = invoke(command, str(text), str(automaton))
    assert answer.status == 0 and answer.output.startswith("correct: ")
    assert "warning: no initial state satisfies the assumptions" in answer.error
    assert json.loads(invoke(command, str(text), str(automaton), "--json").output)["vacuous"]


@pytest.fixture
def door(tmp_path: Path) -> tuple[Path, Path]:
    return _written(tmp_path, DOOR)


def _written(folder: Path, text: str) -> tuple[Path, Path]:
    spec, strategy = folder / "spec.structuredslugs", folder / "strategy.json"
    spec.write_text(text)
    data = Synthesizer().synthesize(read_specification(text)).strategy_json
    assert data is not None
    strategy.write_bytes(data)
    return spec, strategy


def _damaged(strategy: Path, damage: Any) -> Path:
    document = json.loads(strategy.read_text())
    damage(document)
    strategy.write_text(json.dumps(document))
    return strategy


def _open_everywhere(document: dict[str, Any]) -> None:
    """From node 4 on the door stands open wherever the robot is."""
    column = document["variables"].index("open")
    for number, node in document["nodes"].items():
        if int(number) >= 4:
            node["state"][column] = 1


def _loop(document: dict[str, Any]) -> None:
    """Every node is its own only successor."""
    for number, node in document["nodes"].items():
        node["trans"] = [int(number)]


def test_a_broken_guarantee_is_reported_with_origin_and_path(
    door: tuple[Path, Path], invoke: Invoke
) -> None:
    spec, strategy = door
    _damaged(strategy, _open_everywhere)
    found = json.loads(invoke(command, spec, strategy, "--json").output)
    broken = next(f for f in found["failures"] if f["fault"] == "broken_guarantee")
    assert broken["constraint"]["formula"] == "open' -> region' = 3"
    assert "obstacles.door: opens from region 3 only" in broken["constraint"]["rule"]
    path = broken["path"]
    transitions = {int(n): v["trans"] for n, v in json.loads(strategy.read_text())["nodes"].items()}
    assert path[0] == 0
    assert path[-1] == broken["node"]
    assert all(b in transitions[a] for a, b in pairwise(path))
    assert broken["successor"] in transitions[broken["node"]]
    spoken = invoke(command, spec, strategy)
    assert spoken.status == 1
    assert f"shortest path, {len(path) - 1} step" in spoken.output
    assert "obstacles.door" in spoken.output


def test_a_starved_goal_is_named_by_its_line_with_the_cycle(tmp_path: Path, invoke: Invoke) -> None:
    spec, strategy = _written(tmp_path, "[OUTPUT]\nx\n[SYS_LIVENESS]\nx\n!x\n")
    said = [
        line.strip() for line in invoke(command, spec, _damaged(strategy, _loop)).output.split("\n")
    ]
    assert any(
        line.startswith("from: ") and line.endswith(("structuredslugs:4", ":5")) for line in said
    )
    assert "then forever, every step:" in said


def test_the_strategy_may_come_on_standard_input(door: tuple[Path, Path], invoke: Invoke) -> None:
    spec, strategy = door
    assert invoke(command, spec, "-", stdin=strategy.read_bytes()).status == 0


@pytest.mark.parametrize(
    ("spec", "strategy", "said"),
    [
        (b"[INPUTS]\nrequest\n", b"{}", "unknown section [INPUTS]"),
        (b"[INPUT]\n1x\n", b"{}", "expected the name of a variable"),
        (b"[INPUT]\ni\n[SYS_INIT]\n!b\n", b"{}", "spec with ü:4:2: undeclared variable 'b'"),
        (b"\xff\xfe", b"{}", "not valid UTF-8 text"),
        (DOOR.encode(), b"{", "not JSON"),
        (DOOR.encode(), b'{"variables": [], "nodes": {}}', "no variable"),
    ],
    ids=["section", "declaration", "formula", "binary", "truncated", "another specification"],
)
def test_files_that_verify_cannot_read_are_bad_input(
    spec: bytes, strategy: bytes, said: str, tmp_path: Path, invoke: Invoke
) -> None:
    first, second = tmp_path / "spec with ü", tmp_path / "strategy"
    first.write_bytes(spec)
    second.write_bytes(strategy)
    answer = invoke(command, first, second)
    assert answer.status == 2
    assert said in answer.error


def test_a_comparison_beyond_a_range_is_legal(tmp_path: Path, invoke: Invoke) -> None:
    """As in slugs, which only warns."""
    text, automaton = _written(tmp_path, DOOR.replace("region = 0\n!open", "region != 9\n!open"))
    assert invoke(command, text, automaton).status == 0
