"""Small errors of a module: comparisons, arithmetic, constants, booleans, statements, arguments."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
SEED = 20261125
COUNT = 300
COMPARED = {
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
}
COMPUTED = {
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
}
UNCHANGED = (ast.JoinedStr, ast.pattern, ast.arguments)
"""Nodes in which nothing changes: texts, patterns, parameters."""
TYPES = ("decorator_list", "annotation", "returns")


class Mutant(NamedTuple):
    """An error in a module. ``where``: function or class; ``nth``: which one of those that are
    written alike there; ``line``: where it was when it was drawn."""

    path: str
    where: str
    kind: str
    old: str
    new: str
    nth: int
    line: int

    @property
    def text(self) -> str:
        """Its line of ``mutants.txt``."""
        place = f"{self.path}:{self.line}"
        return "\t".join((place, self.where, self.kind, str(self.nth), self.old, self.new))


def read(text: str) -> Mutant:
    place, where, kind, nth, old, new = text.rstrip("\n").split("\t")
    path, _, line = place.rpartition(":")
    return Mutant(path, where, kind, old, new, int(nth), int(line))


def changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """The errors of one node, each with its kind."""
    match node:
        case ast.Compare(left, [op], rest) if type(op) in COMPARED:
            yield "comparison", ast.Compare(left, [COMPARED[type(op)]()], rest)
        case ast.BinOp(left, op, right) if type(op) in COMPUTED and not _is_text(left):
            yield "arithmetic", ast.BinOp(left, COMPUTED[type(op)](), right)
        case ast.BoolOp(op, values):
            yield "boolean", ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)
        case ast.UnaryOp(ast.Not(), operand):
            yield "boolean", operand
        case ast.Constant(bool(value)):
            yield "constant", ast.Constant(not value)
        case ast.Constant(int(value) | float(value)):
            yield "constant", ast.Constant(value + 1)
        case ast.Call(func, [first, second, *rest], keywords):
            if not any(isinstance(each, ast.Starred) for each in node.args):
                yield "arguments", ast.Call(func, [second, first, *rest], keywords)
        case ast.AugAssign() | ast.Expr(ast.Call()):
            yield "statement", ast.Pass()


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def places(text: str) -> Iterator[tuple[ast.AST, str, str, str, str]]:
    """All errors of a text on one line each: the node, function or class, kind, old and new."""
    lines = [line.encode() for line in text.splitlines()]
    left: list[tuple[ast.AST, str]] = [(ast.parse(text), "")]
    while left:
        node, where = left.pop()
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            where = f"{where}.{node.name}".lstrip(".")
        for kind, new in changes(node):
            if node.lineno == node.end_lineno:
                old = lines[node.lineno - 1][node.col_offset : node.end_col_offset].decode()
                written = ast.unparse(new)
                if old != written and "\n" not in written:
                    yield node, where, kind, old, written
        inner = [(name, value) for name, value in ast.iter_fields(node) if name not in TYPES]
        children = [
            each for _, value in inner for each in (value if isinstance(value, list) else [value])
        ]
        children = [each for each in children if isinstance(each, ast.AST)]
        left += [(each, where) for each in reversed(children) if not isinstance(each, UNCHANGED)]


def mutants(path: Path) -> Iterator[tuple[ast.AST, Mutant]]:
    """All errors of a module, in the order of its text, with their nodes."""
    times, name = Counter[tuple[str, ...]](), path.relative_to(ROOT).as_posix()
    for node, *about in places(path.read_text(encoding="utf-8")):
        where, kind, old, new = about
        nth, times[where, kind, old] = times[where, kind, old], times[where, kind, old] + 1
        yield node, Mutant(name, where, kind, old, new, nth, node.lineno)


def drawn(seed: int = SEED, count: int = COUNT) -> list[Mutant]:
    """A sample of all errors of the package."""
    modules = sorted((ROOT / "safenav").rglob("*.py"))
    everything = [each for path in modules for _, each in mutants(path)]
    return sorted(Random(seed).sample(everything, count))


def applied(mutant: Mutant) -> str | None:
    """The text of the module with the error; None if that place no longer exists."""
    path = ROOT / mutant.path
    for node, each in mutants(path) if path.exists() else ():
        if each._replace(line=0) == mutant._replace(line=0):
            lines = path.read_bytes().splitlines(keepends=True)
            line, end = lines[node.lineno - 1], node.end_col_offset
            new = mutant.new if mutant.kind == "statement" else f"({mutant.new})"
            lines[node.lineno - 1] = line[: node.col_offset] + new.encode() + line[end:]
            return b"".join(lines).decode()
    return None
