"""The programs beside the package (benchmarks, pictures, wheels) can import what they use of it.

No other test runs them, so a moved module would break them unnoticed.
"""

import ast
import re
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from children import ran

ROOT = Path(__file__).parents[2]
PROGRAMS = sorted(
    path for folder in ("benchmarks", "docs", "packaging") for path in (ROOT / folder).rglob("*.py")
)
BENCHMARKS = [path for path in PROGRAMS if path.is_relative_to(ROOT / "benchmarks")]


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_program_imports_from_safenav_is_there(program: Path) -> None:
    for node in ast.walk(ast.parse(program.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "safenav":
            module = import_module(str(node.module))
            for name in (alias.name for alias in node.names):
                found = hasattr(module, name) or find_spec(f"{node.module}.{name}") is not None
                assert found, f"line {node.lineno}: {node.module} has no {name}"


@pytest.mark.parametrize(
    "program",
    [p for p in BENCHMARKS if re.search("^import (argparse|click)", p.read_text(), re.MULTILINE)],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_a_benchmark_with_options_starts(program: Path) -> None:
    """What it imports from beside it is there, too."""
    command = [sys.executable, str(program), "--help"]
    done = ran(command)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("one_clock.py", "--only", "rooms", "--draws", "1", "--long-plans"),
        ("batch.py", "--scenarios", "1", "--repeat", "1", "--jobs", "1"),
    ],
    ids=lambda arguments: str(arguments[0]),
)
def test_a_benchmark_measures(arguments: tuple[str, ...]) -> None:
    """Those that replace a function, or read what a command writes."""
    command = [sys.executable, str(ROOT / "benchmarks" / arguments[0]), *arguments[1:]]
    done = ran(command)
    assert done.returncode == 0, done.stderr
