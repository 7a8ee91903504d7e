"""The checker judges the runtime, so it must not lean on it, and its documentation is complete."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

import safenav.audit
from safenav.audit.check import NAMES_RULE, RULES

AUDIT = Path(safenav.audit.__file__).parent
DOCUMENT = Path(__file__).parents[2] / "docs" / "trace.md"


def imported(file: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names.add(node.module or "")
    return names


def test_the_checker_shares_no_code_with_the_rest() -> None:
    files = sorted(AUDIT.rglob("*.py"))
    assert len(files) > 10
    for file in files:
        for name in imported(file):
            own = name.startswith("safenav.audit") or name == "safenav.errors"
            assert own or name.split(".")[0] in sys.stdlib_module_names, f"{file.name}: {name}"


def test_every_rule_is_documented() -> None:
    table = DOCUMENT.read_text().split("## Checking a trace")[1]
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    documented = {name for row in rows for name in re.findall(r"`([a-z-]+)`", row)}
    assert documented == {rule.name for rule in RULES} | {NAMES_RULE}
