"""The gate: which small errors of safenav the tests find.

    python -m gate --record 5
    python -m gate safenav/ --count 300 --at-once 2

The second draws errors in the modules whose path begins so, and runs, for each, the tests that run
its line, the shortest first, until one fails; the first records which tests these are (all tests
once, in 5 processes; needs the package coverage). Prints what kills each error, or that it
survived. Not part of ``make test``. Each run sees its error in a mount namespace of its own
(Linux), so this tree never changes.
"""

import argparse
import ast
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from hashlib import sha1
from itertools import accumulate, repeat
from pathlib import Path
from random import Random
from typing import Any, NamedTuple
from zlib import crc32

import pytest

ROOT = Path(__file__).parents[1]
COMPARED = ["Lt LtE", "Gt GtE", "Eq NotEq", "In NotIn", "Is IsNot"]
SWAPPED = [*COMPARED, "Add Sub", "And Or", "BitAnd BitOr", "LShift RShift"]
REPLACED = ["Mult Add", "Div Mult", "FloorDiv Mult", "Mod FloorDiv"]
PAIRS = [pair.split() for pair in (*SWAPPED, *REPLACED)] + [pair.split()[::-1] for pair in SWAPPED]
OTHERS: dict[type[ast.AST], type[ast.AST]] = {getattr(ast, a): getattr(ast, b) for a, b in PAIRS}
"""Operators, each with the one that takes its place."""
UNCHANGED = (ast.JoinedStr, ast.pattern, ast.arguments)
TYPES = ("annotation", "returns")
"""Nodes and fields in which nothing changes, like in the keywords of a class."""

RECORD = ROOT / "build" / "gate"
"""What a record consists of: which test has run which lines, and how long each test takes."""
TEST = "SAFENAV_GATE_TEST"  # the environment variable with the label of the test that runs
SETTINGS = """[run]
parallel = true
data_file = {}/data
source = {}/safenav
context = ${{{}-}}
patch = _exit
disable_warnings = no-data-collected, module-not-imported, module-not-measured, already-imported
"""
FIRST = 20  # tests of the first round, which find nearly all errors


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
        case ast.Call(func, [first, second, *rest], keywords) if ast.dump(first) != ast.dump(
            second
        ):
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


def digest(test: str) -> str:
    """The label of a test among recorded lines (its name may hold any character)."""
    return sha1(test.encode()).hexdigest()[:12]


def pytest_runtest_protocol(item: pytest.Item) -> None:
    """As a plugin of pytest: name the test whose lines are recorded from now on."""
    from coverage import Coverage

    os.environ[TEST] = digest(item.nodeid)
    recorder = Coverage.current()
    assert recorder is not None, "lines are not recorded"
    recorder.switch_context(os.environ[TEST])


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """As a plugin of pytest: write down how long a test takes."""
    if report.when == "call" and report.passed and "PYTEST_XDIST_WORKER" not in os.environ:
        with (RECORD / "tests").open("a", encoding="utf-8") as file:
            file.write(f"{report.duration:.3f} {report.nodeid}\n")


def read() -> tuple[Any, dict[str, tuple[float, str]]]:
    """Return the recorded lines, and the duration and name of each test by its label."""
    from coverage import CoverageData

    data = CoverageData(str(RECORD / "data"))
    data.read()
    rows = (RECORD / "tests").read_text(encoding="utf-8").splitlines()
    named = [row.partition(" ")[::2] for row in rows]
    return data, {digest(test): (float(seconds), test) for seconds, test in named}


def record(workers: int) -> int:
    """Run all tests, and record which lines each of them runs, in all of its processes; then once
    more those without lines: a process may have lost its record."""
    shutil.rmtree(RECORD, ignore_errors=True)
    RECORD.mkdir(parents=True)
    (RECORD / "settings").write_text(SETTINGS.format(RECORD, ROOT, TEST))
    paths = {"PYTHONPATH": str(ROOT / "tests"), "COVERAGE_PROCESS_START": str(RECORD / "settings")}
    tests = ["-m", "pytest", "-p", "gate", "-q", "-n", str(workers), "--dist", "worksteal"]
    combined = ["-m", "coverage", "combine", "-qa", "--rcfile", str(RECORD / "settings")]
    lost, status = list[str](), 0
    for _ in range(2):
        env = {**os.environ, **paths}
        status |= subprocess.run([sys.executable, *tests, *lost], cwd=ROOT, env=env).returncode
        subprocess.run([sys.executable, *combined], cwd=ROOT, check=True)
        data, times = read()
        seen = {label.rpartition("|")[2] for label in data.measured_contexts()}
        lost = [test for label, (_, test) in times.items() if label not in seen]
        print(f"{len(lost)} of {len(times)} tests run no line of safenav", file=sys.stderr)
        if not lost:
            break
    return status


def recorded(seconds: float) -> Callable[[Mutant], list[str]]:
    """Return which tests run the line of a mutant, the shortest first, as many as take ``seconds``.

    Lines of a module's own level run once in a process, for whatever test comes first: any test
    that runs a line of the module may find an error there. Tests of a file share the results of
    commands, which one of them runs: those without lines may find an error in its lines, too.
    """
    data, times = read()
    seen = {label.rpartition("|")[2] for label in data.measured_contexts()}
    shared = [timed for label, timed in times.items() if label not in seen]

    def tests(mutant: Mutant) -> list[str]:
        runs = data.contexts_by_lineno(str(mutant.path))
        lines: Iterable[int] = runs
        if (inner := function(mutant)) is not None:
            lines = sorted(line for line in runs if inner < line <= mutant.line)[-1:]
        labels = {label.rpartition("|")[2] for line in lines for label in runs[line]}
        own = [times[label] for label in labels & times.keys()]
        files = {test.partition("::")[0] for _, test in own}
        found = sorted([*own, *(each for each in shared if each[1].partition("::")[0] in files)])
        ends = accumulate(time for time, _ in found)
        return [test for (_, test), end in zip(found, ends, strict=True) if end <= seconds]

    return tests


def function(mutant: Mutant) -> int | None:
    """The first line of the innermost function around a mutant; None at the module's own level."""
    kinds = ast.FunctionDef | ast.AsyncFunctionDef
    nodes = [n for n in ast.walk(ast.parse(mutant.path.read_bytes())) if isinstance(n, kinds)]
    around = [n.lineno for n in nodes if n.lineno < mutant.line <= (n.end_lineno or 0)]
    return max(around, default=None)


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
            age = 10**9 + crc32(text) % 10**8  # so Python ignores compiled files of other mutants
            os.utime(file.name, (age, age))
            seen = f'mount --bind {file.name} {mutant.path} && exec "$@"'
            alone = ["unshare", *(["-r"] if os.geteuid() else []), "-m", "sh", "-c", seen, "sh"]
            command = alone + command
        process = subprocess.Popen(
            command, cwd=ROOT, stdout=out, stderr=out, start_new_session=True
        )
        status = process.wait()
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # processes that a test has left
        out.seek(0)
        said = out.read().decode(errors="replace")
    if status == 0:
        return ""
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+::.*?)(?: - .*)?$", said, re.MULTILINE)
    if idle := [name for name in failed if " cases played, " in name]:
        failed = [name for name in failed if name not in idle] or [""]  # a part of the cases
    begun = re.findall(r"^(\S+::\S.*?) *$", said, re.MULTILINE)
    return failed[0] if failed else f"{begun[-1]} (ends the run)" if begun else "no test can be run"


def killer(mutant: Mutant, rounds: list[list[str]], patience: float) -> str:
    """Return which of the tests kills a mutant; empty if none does. Rounds of tests are run one
    after the other."""
    aside: list[str] = []
    found = ""
    for tests in filter(None, rounds):
        while found := failure([*tests, *aside], patience, mutant):
            if "::" not in found or " (ends" in found or not failure([found], patience):
                break
            print(f"{found} fails without an error, too", file=sys.stderr, flush=True)
            aside += ["--deselect", found]
        if found:
            break
    print(mutant, f"killed by {found}" if found else "SURVIVED", sep="\t", flush=True)
    return found


def main() -> int:
    """Play the mutants; 1 if fewer than 85 % are killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", nargs="?", help="beginning of the paths, from the root")
    parser.add_argument("--record", type=int, metavar="PROCESSES")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--at-once", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=300, help="for all recorded tests")
    asked = parser.parse_args()
    if asked.record:
        return record(asked.record)
    running = recorded(asked.seconds)
    paths = sorted((ROOT / "safenav").rglob("*.py"))
    chosen = [path for path in paths if str(path.relative_to(ROOT)).startswith(asked.modules)]
    every = [mutant for path in chosen for mutant in mutants(path)]
    drawn = Random(asked.seed).sample(every, min(asked.count, len(every)))
    tests = [running(mutant) for mutant in drawn]
    rounds = [[own[:FIRST], own[FIRST:]] for own in tests]
    with ThreadPoolExecutor(asked.at_once) as pool:
        kills = [*pool.map(killer, drawn, rounds, repeat(600.0))]
    print(f"{sum(map(bool, kills))} of {len(kills)} killed")
    return int(sum(map(bool, kills)) < 0.85 * len(kills))


if __name__ == "__main__":
    sys.exit(main())
