"""The program of docs/ros2.md runs with its stand-in, and its trace keeps the rules."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

from safenav import check_trace

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "ros2.md").read_text(encoding="utf-8")
PROGRAM, NODE = re.findall(r"^```python [^\n]*\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)


def test_the_mission_runs_with_a_stand_in_for_the_transport(tmp_path: Path) -> None:
    scenario = (ROOT / "scenarios" / "case_study_1.yaml").read_text(encoding="utf-8")
    text = scenario.replace("map:\n", "map:\n  resolution: 1.0\n", 1)
    (tmp_path / "door.yaml").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PROGRAM],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "SAFENAV_CACHE": "off"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "completed True\n"
    assert check_trace(tmp_path / "rehearsal.jsonl").ok


def test_the_node_that_is_not_run_is_at_least_python_and_says_so() -> None:
    methods = {node.name for node in ast.walk(ast.parse(NODE)) if isinstance(node, ast.FunctionDef)}
    assert {"navigate", "reported", "perform"} <= methods
    assert "not run by the tests" in TEXT
