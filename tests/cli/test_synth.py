"""``safenav synth`` and ``safenav check``: what is written loads again and means the same."""

import json
import subprocess
from pathlib import Path

import networkx

from cli.conftest import Command
from once import SCENARIOS
from safenav.synthesis.program import find_binary
from slugs.commands import STRATEGY

CASE_1 = SCENARIOS / "case_study_1.yaml"

TWO = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  a: {model: rover, start: 8, objective: {visit: [8, 12]}}
  b: {model: rover, start: 10, objective: {visit: [10, 11]}}
catalogue: {robots: {rover: {mobility: free, layer: ground, capabilities: []}}}
"""


def test_files_load_again_and_give_the_same_strategy(safenav: Command, tmp_path: Path) -> None:
    done = safenav("synth", CASE_1, "-o", "out")
    assert done.returncode == 0, done.stderr
    for robot in ("quad", "digit"):
        strategy = (tmp_path / "out" / f"{robot}.json").read_bytes()
        nodes = json.loads(strategy)["nodes"]
        graph = networkx.read_graphml(tmp_path / "out" / f"{robot}.graphml")
        assert len(graph.nodes) == len(nodes)
        assert (tmp_path / "out" / f"{robot}.dot").read_text().count(" -> ") == len(graph.edges)
        again = subprocess.run(
            [find_binary().path, *STRATEGY, tmp_path / "out" / f"{robot}.structuredslugs"],
            capture_output=True,
            check=True,
        )
        assert again.stdout == strategy


def test_specification_reads_like_documentation(safenav: Command, tmp_path: Path) -> None:
    safenav("synth", CASE_1, "--robot", "digit", "-o", "out")
    assert not (tmp_path / "out" / "quad.json").exists()
    text = (tmp_path / "out" / "digit.structuredslugs").read_text()
    lines = text.splitlines()
    assert lines[0] == "# digit (digit): patrol 58 <-> 28"
    constraints = [
        i
        for i, line in enumerate(lines)
        if line and not line.startswith(("#", "[")) and i > lines.index("[ENV_INIT]")
    ]
    assert constraints
    for i in constraints:  # each under a comment that names the scenario item it comes from
        above = next(line for line in reversed(lines[:i]) if line.startswith("#"))
        assert above.startswith(("# robots.digit", "# map"))
    assert max(map(len, lines)) <= 160


def test_strategies_that_avoid_the_others(safenav: Command, tmp_path: Path) -> None:
    """For automata without a coordination layer: four inputs, and one assumption."""
    (tmp_path / "two.yaml").write_text(TWO)
    done = safenav("synth", "two.yaml", "--avoiding", "--robot", "a", "-o", "out")
    assert done.returncode == 0, done.stderr
    assert "a assumes: infinitely often no robot is beside it (b)" in done.stdout
    text = (tmp_path / "out" / "a.structuredslugs").read_text()
    assert "busy_west' -> move' != 4" in text
    alone = safenav("synth", "two.yaml", "--robot", "a", "-o", "alone")
    assert alone.returncode == 0
    assert "busy" not in (tmp_path / "alone" / "a.structuredslugs").read_text()


def test_a_strategy_is_printed_and_a_summary(safenav: Command, tmp_path: Path) -> None:
    assert safenav("synth", CASE_1, "-o", "out").returncode == 0
    assert safenav("synth", CASE_1, "-o", "-").returncode == 2
    printed = safenav("synth", CASE_1, "--robot", "quad", "-o", "-")
    assert printed.stdout == (tmp_path / "out" / "quad.json").read_text()
    summary = json.loads(safenav("synth", CASE_1, "--json").stdout)
    assert [each["robot"] for each in summary["robots"]] == ["quad", "digit"]
    assert all(each["verified"] and each["states"] > 10 for each in summary["robots"])
