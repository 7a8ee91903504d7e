"""The gate: which small errors of safenav the tests find.

    python -m gate safenav/ --count 300 --at-once 2
    python -m gate safenav/judge/ judge lies

draws errors in the modules whose path begins so, and runs the test folders for each until a test
fails: those that are named, or all, first the ones that import the package most often. Prints what
kills each error, or that it survived. Not part of ``make test``: it takes hours. Each run sees its
error in a mount namespace of its own (Linux), so this tree never changes.
"""

import argparse
import ast
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import NamedTuple
from zlib import crc32

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
TYPES = ("annotation", "returns")
"""Nodes and fields in which nothing changes: texts, patterns, parameters, types; neither do the
keywords of a class."""


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
        case ast.BinOp(_, ast.BitOr(), ast.Constant(None)):
            return None  # a type
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
        case ast.Call(ast.Name("isinstance" | "max" | "min")):
            return None  # a crash, or no error
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
        for field, value in ast.iter_fields(node):
            if field in TYPES or (field == "keywords" and isinstance(node, ast.ClassDef)):
                continue
            inner = value if isinstance(value, list) else [value]
            left += (n for n in inner if isinstance(n, ast.AST) and not isinstance(n, UNCHANGED))


def ordered(path: Path) -> list[str]:
    """All folders of tests, first those of the module's package and those that import it most."""
    package = ".".join(path.relative_to(ROOT).with_suffix("").parts[:2])
    named = dict.fromkeys((p.parent.name for p in (ROOT / "tests").glob("*/test_*.py")), 0)
    for folder in named:
        for file in (ROOT / "tests" / folder).rglob("*.py"):
            named[folder] += len(re.findall(rf"{package}\b", file.read_text(encoding="utf-8")))
    own = package.rpartition(".")[2]
    return sorted(named, key=lambda folder: (folder != own, -named[folder], folder))


def failure(tests: list[str], patience: float, mutant: Mutant | None = None) -> str:
    """Run tests with an error; return the first that fails, or why there is none; empty if all
    pass."""
    limit = ["-o", f"faulthandler_timeout={patience}", "-o", "faulthandler_exit_on_timeout=true"]
    command = [sys.executable, "-m", "pytest", "-x", "-v", "-p", "no:cacheprovider", *limit, *tests]
    with tempfile.NamedTemporaryFile(suffix=".py") as file, tempfile.TemporaryFile() as out:
        if mutant is not None:
            text = mutant.text()
            file.write(text)
            file.flush()
            age = 10**9 + crc32(text) % 10**8  # compiled files of others do not fit
            os.utime(file.name, (age, age))
            seen = f'mount --bind {file.name} {mutant.path} && exec "$@"'
            alone = ["unshare", *(["-r"] if os.geteuid() else []), "-m", "sh", "-c", seen, "sh"]
            command = alone + command
        process = subprocess.Popen(
            command, cwd=ROOT, stdout=out, stderr=out, start_new_session=True
        )
        status = process.wait()
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # what a test has left
        out.seek(0)
        said = out.read().decode(errors="replace")
    if status == 0:
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+::.*?)(?: - .*)?$", said, re.MULTILINE)
    begun = re.findall(r"^(\S+::\S.*?) *$", said, re.MULTILINE)
    return failed[1] if failed else f"{begun[-1]} (ends the run)" if begun else "no test can be run"


def killer(mutant: Mutant, folders: list[str], patience: float) -> str:
    """Return what kills a mutant; empty if nothing does."""
    tests = [f"tests/{folder}" for folder in folders or ordered(mutant.path)]
    while found := failure(tests, patience, mutant):
        if "::" not in found or " (ends" in found or not failure([found], patience):
            break
        print(f"{found} fails without an error, too", file=sys.stderr, flush=True)
        tests += ["--deselect", found]
    print(mutant, f"killed by {found}" if found else "SURVIVED", sep="\t", flush=True)
    return found


def main() -> int:
    """Play the mutants; 1 if fewer than 85 % are killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", help="beginning of the paths, from the root of the project")
    parser.add_argument("folders", nargs="*", help="of tests, the cheapest first")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--at-once", type=int, default=1)
    parser.add_argument("--patience", type=float, default=600, help="seconds for a test")
    asked = parser.parse_args()
    paths = sorted((ROOT / "safenav").rglob("*.py"))
    chosen = [path for path in paths if str(path.relative_to(ROOT)).startswith(asked.modules)]
    every = [mutant for path in chosen for mutant in mutants(path)]
    drawn = Random(asked.seed).sample(every, min(asked.count, len(every)))
    with ThreadPoolExecutor(asked.at_once) as pool:
        kills = [*pool.map(lambda one: killer(one, asked.folders, asked.patience), drawn)]
    print(f"{sum(map(bool, kills))} of {len(kills)} killed")
    return int(sum(map(bool, kills)) < 0.85 * len(kills))


if __name__ == "__main__":
    sys.exit(main())
