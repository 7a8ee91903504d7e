"""The gate: which small errors of safenav the tests find.

    python -m gate safenav/judge/ judge lies --count 20

draws errors in the modules whose path begins so, and runs the test folders for each, in this order,
until one fails. Prints what kills each error, or that it survived. Not part of ``make test``: it
takes hours, and changes the modules of this tree while it runs.
"""

import argparse
import ast
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
OTHERS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Add,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
"""Operators, each with the one that takes its place."""
UNCHANGED = (ast.JoinedStr, ast.pattern, ast.arguments)
"""Nodes in which nothing changes: texts, patterns, parameters."""


class Mutant(NamedTuple):
    """A module with an error: the text at ``begin`` to ``end`` (bytes of the line) is replaced."""

    path: Path
    line: int
    begin: int
    end: int
    new: str

    def __str__(self) -> str:
        old = self._lines()[self.line - 1][self.begin : self.end].decode()
        return f"{self.path.relative_to(ROOT)}:{self.line}: {old} -> {self.new}"

    def _lines(self) -> list[bytes]:
        return self.path.read_bytes().splitlines(keepends=True)

    def text(self) -> bytes:
        lines = self._lines()
        line = lines[self.line - 1]
        lines[self.line - 1] = line[: self.begin] + self.new.encode() + line[self.end :]
        return b"".join(lines)


def changed(node: ast.AST) -> ast.AST | None:
    """Return a node with an error; None if it has none."""
    match node:
        case ast.Compare(left, [op], rest) if type(op) in OTHERS:
            return ast.Compare(left, [OTHERS[type(op)]()], rest)  # type: ignore[list-item]
        case ast.BinOp(left, op, right) if type(op) in OTHERS:
            return ast.BinOp(left, OTHERS[type(op)](), right)  # type: ignore[arg-type]
        case ast.BoolOp(op, values):
            return ast.BoolOp(OTHERS[type(op)](), values)  # type: ignore[arg-type]
        case ast.UnaryOp(ast.Not(), operand):
            return operand
        case ast.Constant(bool(value)):
            return ast.Constant(not value)
        case ast.Constant(int(value) | float(value)):
            return ast.Constant(value + 1)
        case ast.Call(func, [first, second, *rest], keywords):
            return ast.Call(func, [second, first, *rest], keywords)
        case ast.AugAssign() | ast.Expr(ast.Call()):
            return ast.Pass()
    return None


def mutants(path: Path) -> Iterator[Mutant]:
    """All errors of a module on one line each."""
    left: list[ast.AST] = [ast.parse(path.read_bytes())]
    while left:
        node = left.pop()
        new = changed(node)
        if new is not None and node.lineno == node.end_lineno:  # type: ignore[attr-defined]
            written = ast.unparse(new)
            shown = written if isinstance(new, ast.Pass) else f"({written})"
            place = node.lineno, node.col_offset, node.end_col_offset  # type: ignore[attr-defined]
            yield Mutant(path, *place, shown)
        left += (each for each in ast.iter_child_nodes(node) if not isinstance(each, UNCHANGED))


def failure(tests: object, patience: float) -> str:
    """Run tests; return the first that fails, or why there is none; empty if all pass."""
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "2", "-p", "no:cacheprovider"]
    with subprocess.Popen(
        [*words, str(tests)], cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        try:
            said, _ = process.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return f"{tests} does not end"
    if process.returncode == 0:
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+::.*?)(?: - .*)?$", said, re.MULTILINE)
    return failed[1] if failed else f"{tests} cannot be run"


def killer(mutant: Mutant, folders: list[str], patience: float) -> str:
    """Return what kills a mutant; empty if nothing does."""
    honest = mutant.path.read_bytes()
    for folder in folders:
        mutant.path.write_bytes(mutant.text())
        try:
            found = failure(ROOT / "tests" / folder, patience)
        finally:
            mutant.path.write_bytes(honest)
        if "::" in found and failure(found, patience):
            raise SystemExit(f"{found} fails without an error, too")
        if found:
            return found
    return ""


def main() -> int:
    """Play the mutants; 1 if fewer than 85 % are killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", help="beginning of the paths, from the root of the project")
    parser.add_argument("folders", nargs="+", help="of tests, the cheapest first")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--patience", type=float, default=1200, help="seconds for a folder")
    asked = parser.parse_args()
    paths = sorted((ROOT / "safenav").rglob("*.py"))
    chosen = [path for path in paths if str(path.relative_to(ROOT)).startswith(asked.modules)]
    every = [mutant for path in chosen for mutant in mutants(path)]
    drawn = Random(asked.seed).sample(every, min(asked.count, len(every)))
    survivors = 0
    for mutant in drawn:
        by = killer(mutant, asked.folders, asked.patience)
        survivors += not by
        print(mutant, f"killed by {by}" if by else "SURVIVED", sep="\t", flush=True)
    return int(survivors > 0.15 * len(drawn))


if __name__ == "__main__":
    sys.exit(main())
