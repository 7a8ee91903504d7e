"""``safenav synth`` and ``safenav check``: what is written loads again and means the same."""

import json
import subprocess
from pathlib import Path

import networkx
import pytest

from cli.conftest import Command
from once import SCENARIOS
from safenav.synthesis.binary import find_binary

CASE_1 = SCENARIOS / "case_study_1.yaml"

LITERAL = """\
safenav: 1
map: {grid: "#######\\n#.....#\\n#######\\n"}
robots: {flyer: {model: quadcopter, start: 8, objective: {patrol: [12, 10], form: literal}}}
"""
TWO = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  a: {model: rover, start: 8, objective: {visit: [8, 12]}}
  b: {model: rover, start: 10, objective: {visit: [10, 11]}}
catalogue: {robots: {rover: {mobility: free, layer: ground, capabilities: []}}}
"""
CROSSING = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#######"], names: {far: 8, mid: 9, near: 10}}
robots:
  flyer: {model: quadcopter, start: 11, objective: {patrol: [far, {any: [mid, near]}]}}
"""


def test_files_load_again_and_give_the_same_strategy(safenav: Command, tmp_path: Path) -> None:
    done = safenav("synth", CASE_1, "-o", "out")
    assert done.returncode == 0, done.stderr
    for robot in ("quad", "digit"):
        strategy = (tmp_path / "out" / f"{robot}.json").read_bytes()
        nodes = json.loads(strategy)["nodes"]
        graph = networkx.read_graphml(tmp_path / "out" / f"{robot}.graphml")
        assert len(graph.nodes) == len(nodes)
        assert len(graph.edges) == sum(len(node["trans"]) for node in nodes.values())
        dot = (tmp_path / "out" / f"{robot}.dot").read_text()
        assert dot.startswith("digraph")
        assert dot.count(" -> ") == len(graph.edges)
        again = subprocess.run(
            [
                find_binary().path,
                "--explicitStrategy",
                "--jsonOutput",
                tmp_path / "out" / f"{robot}.structuredslugs",
            ],
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


def test_statistics_are_a_table(safenav: Command) -> None:
    done = safenav("synth", CASE_1)
    header, rule, *rows = done.stdout.splitlines()
    assert header.split() == [
        "robot", "verdict", "states", "edges", "goals", "bits", "ms", "verified",
    ]  # fmt: skip
    assert set(rule) == {"-", " "}
    assert [row.split()[:2] for row in rows] == [["quad", "realizable"], ["digit", "realizable"]]


def test_check_says_realizable(safenav: Command) -> None:
    done = safenav("check", CASE_1)
    assert done.returncode == 0
    assert done.stdout.splitlines() == [
        "quad: realizable, patrol 54 <-> 49",
        "digit: realizable, patrol 58 <-> 28",
        "without hidden obstacles: completed in tick 31",
    ]


def test_the_time_limit_of_a_run_does_not_apply_to_check(safenav: Command, tmp_path: Path) -> None:
    scenario = tmp_path / "s.yaml"
    scenario.write_text(CASE_1.read_text().replace("{ticks: 500}", "{seconds: 0.00001}"))
    done = safenav("check", scenario)
    assert (done.returncode, done.stderr) == (0, "")


def test_an_unrealizable_robot_gets_its_specification_and_a_counterstrategy(
    safenav: Command, tmp_path: Path
) -> None:
    done = safenav("synth", SCENARIOS / "unrealizable" / "dead_end.yaml", "-o", "out")
    assert done.returncode == 1, done.stderr
    assert "unrealizable: digit cannot patrol 22 <-> 17" in done.stderr
    out = tmp_path / "out"
    wins = [f"digit.counterstrategy.{ending}" for ending in ("dot", "graphml", "json")]
    texts = ["digit.slugsin", "digit.structuredslugs"]
    assert sorted(file.name for file in out.iterdir()) == [*wins, *texts]
    for text in texts:
        proof = safenav("verify", "--counterstrategy", out / text, out / wins[2])
        assert proof.returncode == 0, proof.stdout + proof.stderr
        again = safenav("synth", out / text, "--json")
        summary = json.loads(again.stdout)
        assert (again.returncode, summary["verdict"], summary["verified"]) == (
            1,
            "unrealizable",
            True,
        )


def test_a_strategy_is_printed_and_a_summary(safenav: Command, tmp_path: Path) -> None:
    assert safenav("synth", CASE_1, "-o", "out").returncode == 0
    assert safenav("synth", CASE_1, "-o", "-").returncode == 2
    printed = safenav("synth", CASE_1, "--robot", "quad", "-o", "-")
    assert printed.stdout == (tmp_path / "out" / "quad.json").read_text()
    summary = json.loads(safenav("synth", CASE_1, "--json").stdout)
    assert [each["robot"] for each in summary["robots"]] == ["quad", "digit"]
    assert all(each["verified"] and each["states"] > 10 for each in summary["robots"])


def test_the_synthesizer_is_looked_up_on_the_path(safenav: Command) -> None:
    folder = find_binary().path.parent
    found = safenav("synth", CASE_1, SAFENAV_SLUGS="slugs", PATH=str(folder))
    assert found.returncode == 0, found.stderr
    lost = safenav("synth", CASE_1, SAFENAV_SLUGS="slugs", PATH="/nowhere")
    assert lost.returncode == 4 and "'slugs' does not exist" in lost.stderr


@pytest.mark.parametrize("command", ["check", "synth", "run"])
def test_a_literal_patrol_is_kept_by_the_letter_or_unrealizable(
    safenav: Command, tmp_path: Path, command: str
) -> None:
    # From 8 the way to 12 leads through 10, which the formula forbids if 12 comes first.
    scenario = tmp_path / "corridor.yaml"
    scenario.write_text(LITERAL)
    done = safenav(command, scenario)
    assert done.returncode == 1
    assert "'form: literal' forbids crossing 10" in done.stdout + done.stderr
    assert "scout" not in done.stdout + done.stderr


@pytest.mark.parametrize("command", ["check", "synth", "run"])
def test_a_weaker_form_is_named_with_its_reason(
    safenav: Command, tmp_path: Path, command: str
) -> None:
    scenario = tmp_path / "corridor.yaml"
    scenario.write_text(LITERAL.replace(", form: literal", ""))
    done = safenav(command, scenario)
    assert done.returncode == 0
    first = "10 first: from here it cannot begin with 12 without crossing 10"
    assert f"patrol 12 <-> 10 ({first})" in done.stdout
    scenario.write_text(CROSSING)
    done = safenav(command, scenario)
    assert done.returncode == 0
    why = "may cross a target on the way: the corridor leaves no other path"
    assert f"patrol far <-> mid|near ({why})" in done.stdout


def test_check_warns_of_unlikely_settings(safenav: Command, tmp_path: Path) -> None:
    scenario = tmp_path / "s.yaml"
    scenario.write_text(
        'safenav: 1\nmap: {grid: ["#####", "#...#", "#####"]}\n'
        "robots: {q: {model: quadcopter, start: 6, objective: {visit: [8, 6]}}}\n"
        "obstacles: [{type: door, region: 7}]\nseed: 3\n"
    )
    done = safenav("check", scenario)
    assert done.returncode == 0
    assert "warning: no robot can resolve door@7: it needs 'push'" in done.stderr
    assert "warning: seed 3 has no effect" in done.stderr
    assert safenav("check", scenario, "--strict").returncode == 1
    told = json.loads(safenav("check", scenario, "--json").stdout)
    assert len(told["warnings"]) == 3
