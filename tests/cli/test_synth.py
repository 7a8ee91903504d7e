"""``safenav synth``: what is written loads again and means the same."""

import json
import subprocess
from pathlib import Path

import networkx

import warm
from cli.conftest import Command
from once import SCENARIOS
from safenav.synthesis.program import find_binary
from slugs.commands import STRATEGY

CASE_1 = SCENARIOS / "case_study_1.yaml"


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


def test_each_input_may_come_from_standard_input(
    safenav: Command, environment: dict[str, str], tmp_path: Path
) -> None:
    safenav("run", CASE_1, "--no-map", "--trace", "run.jsonl")
    given = {
        "scenario": (SCENARIOS / "unrealizable" / "separate_rooms.yaml").read_text(),
        "specification": "[INPUT]\n[OUTPUT]\nx\n[SYS_LIVENESS]\nx\n",
        "trace": (tmp_path / "run.jsonl").read_text(),
    }
    for command, kind, status, said in (
        ("explain -", "scenario", 1, "target"),  # its targets are not reachable
        ("synth - -o again", "specification", 0, "again"),
        ("explain -", "specification", 0, "is realizable: nothing to explain"),
        ("certify --trace - -o bundle", "trace", 0, "accepted"),
        ("replay -", "trace", 2, "a trace from standard input has no name"),
        ("studio -", "scenario", 2, "standard input can be read only once"),
    ):
        done = warm.safenav(*command.split(), cwd=tmp_path, env=environment, text=given[kind])
        assert (done.returncode, said in done.stdout + done.stderr) == (status, True), done
    assert (tmp_path / "again" / "specification.json").exists()
