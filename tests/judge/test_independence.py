"""The judge shares no code with what it judges, runs no text, and documents its rules."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import safenav.judge
from safenav.judge.engine import FACTS

JUDGE = Path(safenav.judge.__file__).parent
PAGE = Path(__file__).parents[2] / "docs" / "judge.md"
FILES = sorted(JUDGE.rglob("*.py"))
READS = ("safenav.strict_json",)
"""Needs only Python's library, too."""
RUNS = {"eval", "exec", "compile", "__import__", "globals", "breakpoint", "import_module"}


def imported(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            yield node.module or ""


@pytest.mark.parametrize("file", FILES, ids=str)
def test_it_needs_python_alone_and_runs_no_text(file: Path) -> None:
    tree = ast.parse(file.read_text())
    for name in imported(tree):
        own = name.startswith("safenav.judge.") or name in READS
        assert own or name.split(".")[0] in sys.stdlib_module_names - {"importlib", "pickle"}, name
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    used = {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    names |= used - {"compile"}  # of regular expressions
    assert not names & RUNS


def test_each_rule_states_its_requirement_as_the_page_does() -> None:
    names = [rule.name for rule in FACTS]
    assert len({*names}) == len(names)
    for rule in FACTS:
        assert rule.text.endswith(".") and len(rule.text.split()) >= 5, rule.name
    table = PAGE.read_text().partition("## Rules")[2].partition("## Limits")[0]
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    assert rows == [f"| `{rule.name}` | {rule.text} |" for rule in FACTS]


def test_rules_keep_nothing_and_change_no_state() -> None:
    """A rule assigns only local names, and to no part of the state."""
    for file in (JUDGE / "rules.py", JUDGE / "ends.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            targets = node.targets if isinstance(node, ast.Assign) else []
            targets = [node.target] if isinstance(node, ast.AugAssign) else targets
            assert not any(isinstance(t, ast.Attribute | ast.Subscript) for t in targets), file.name
            assert not isinstance(node, ast.Global | ast.Nonlocal), file.name
