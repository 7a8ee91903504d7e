"""``safenav synth``: what is written loads again and means the same."""

import json
import subprocess
from pathlib import Path

import networkx

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
