"""Lines in prefix notation, which structured-slugs files may hold among infix ones.

``| ! a & b c'`` means ``!a | (b & c')``; ``$ n f1 .. fn`` is a buffer of formulas whose value is
fn, and ``? i`` recalls its entry i.
"""

from __future__ import annotations

import re

from safenav.formula.parser import FormulaError, parse

_TOKEN = re.compile(r"[!&|^$?]|\d+|[^\s!&|^$?]+")
_STARTS = re.compile(r"[!&|^$?]\s|[01]\s*\Z")
_NAME = re.compile(r"[A-Za-z_][\w.@]*'?\Z")
_CONSTANTS = {"0": "FALSE", "1": "TRUE"}


def to_infix(line: str) -> str:
    """Return a constraint in infix notation; one already in infix notation is unchanged."""
    if not _STARTS.match(line) or _is_infix(line):
        return line
    try:
        return _Prefix(_TOKEN.findall(line)).whole()
    except (IndexError, ValueError, RecursionError):
        return line  # neither: the caller reports the error


def _is_infix(line: str) -> bool:
    try:
        parse(line)
    except FormulaError:
        return False
    return True


class _Prefix:
    """Translates the tokens of one line, from left to right."""

    def __init__(self, tokens: list[str]) -> None:
        self._tokens = tokens
        self._next = 0

    def whole(self) -> str:
        text = self._formula([])
        if self._next != len(self._tokens):
            raise ValueError("stray text")
        return text

    def _take(self) -> str:
        self._next += 1
        return self._tokens[self._next - 1]

    def _formula(self, buffer: list[str]) -> str:
        token = self._take()
        match token:
            case "!":
                return f"!({self._formula(buffer)})"
            case "&" | "|" | "^":
                operands = self._operands(token, buffer)
                return f" {token} ".join(f"({operand})" for operand in operands)
            case "$":
                entries: list[str] = []
                for _ in range(int(self._take())):
                    entries.append(self._formula(entries))
                return entries[-1]
            case "?":
                return buffer[int(self._take())]
        if token in _CONSTANTS:
            return _CONSTANTS[token]
        if not _NAME.match(token):
            raise ValueError(token)
        return token

    def _operands(self, operator: str, buffer: list[str]) -> list[str]:
        """Both operands; a chain of one operator becomes flat, so that it nests no deeper."""
        operands = []
        missing = 2
        while missing:
            if self._tokens[self._next] == operator:
                self._next += 1
                missing += 1
            else:
                operands.append(self._formula(buffer))
                missing -= 1
        return operands
