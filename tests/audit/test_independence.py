"""The checker judges the runtime, so it does not import it; its documentation is complete."""

import ast
import re
import sys
from pathlib import Path

import safenav.audit
from safenav.audit.judging import NAMES_RULE, RULES

AUDIT = Path(safenav.audit.__file__).parent
FORMAT = (
    *("safenav.bounds", "safenav.trace.records", "safenav.trace.setting"),
    *("safenav.trace.vocabulary", "safenav.trace.objective", "safenav.trace.proofs"),
    *("safenav.trace.fields", "safenav.trace.reading"),
)
"""The format of traces, as data: all that the checker shares with what it judges."""

DOCUMENT = Path(__file__).parents[2] / "docs" / "audit.md"


def imported(file: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            names.update(one if source(one).exists() else node.module or "" for one in whole)
    return names


def source(module: str) -> Path:
    """Where a module of safenav is, if it is a file."""
    return AUDIT.parents[1] / f"{module.replace('.', '/')}.py"


def test_the_checker_shares_no_code_with_the_rest() -> None:
    """It needs Python's library only; one module reads traces for it."""
    files = sorted(AUDIT.rglob("*.py"))
    assert len(files) > 10
    for file in files:
        reads = FORMAT if file == AUDIT / "check.py" else ()
        for name in imported(file):
            own = name.startswith("safenav.audit") or name in reads
            assert own or name.split(".")[0] in sys.stdlib_module_names, f"{file.name}: {name}"


def test_the_trace_format_imports_nothing_but_msgspec() -> None:
    modules = ("errors", "file_kind", "line_values", "lines", "outcome", "strict_json")
    plain = (*(f"safenav.{module}" for module in modules), "msgspec", "msgspec.structs")
    for module in FORMAT:
        for name in imported(source(module)):
            known = name in (*FORMAT, *plain)
            assert known or name.split(".")[0] in sys.stdlib_module_names, name


def test_every_rule_is_documented() -> None:
    table = DOCUMENT.read_text()
    rows = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    documented = {name for row in rows for name in re.findall(r"`([a-z-]+)`", row)}
    assert documented == {rule.name for rule in RULES} | {NAMES_RULE}
