"""Prefix notation of slugsin lines (docs/specifications.md), translated to infix notation."""

from __future__ import annotations

import re
from contextlib import suppress
from math import inf

from safenav.formula.parser import FormulaError, parse

_TOKEN = re.compile(r"[!&|^$?]|\d+|[^\s!&|^$?]+")
_STARTS = re.compile(r"[!&|^$?]\s|[01]\s*\Z")
_NAME = re.compile(r"[A-Za-z_][\w.@]*'?\Z")
_CONSTANTS = {"0": "FALSE", "1": "TRUE"}


class TooLongError(Exception):
    """A line whose buffers stand for more characters than is allowed; the message says how many."""


def to_infix(line: str, most: float = inf) -> str:
    """Return a constraint in infix notation; one already in infix notation is unchanged.

    ``| ! a & b c'`` means ``!a | (b & c')``; ``$ n f1 .. fn`` is a buffer of formulas whose value
    is fn, and ``? i`` recalls its entry i. Buffers that recall each other double their text with
    each entry. Raises TooLongError beyond ``most`` characters, before that text is made.
    """
    if not _STARTS.match(line):
        return line
    with suppress(FormulaError):
        parse(line)
        return line
    try:
        formula = _Prefix(_TOKEN.findall(line)).whole()
    except (IndexError, ValueError, RecursionError):
        return line  # neither: the caller reports the error
    if formula.length > most:
        found = f"its buffers stand for {formula.length} characters"
        raise TooLongError(f"{found}; at most {most:g} can be read")
    return formula.text()


class _Formula:
    """A formula as the parts of its text; recalled ones are shared."""

    def __init__(self, *parts: str | _Formula) -> None:
        self.parts = parts
        self.length: int = sum(len(p) if isinstance(p, str) else p.length for p in parts)

    def text(self) -> str:
        left: list[str | _Formula] = [self]
        found = []
        while left:
            part = left.pop()
            if isinstance(part, str):
                found.append(part)
            else:
                left.extend(reversed(part.parts))
        return "".join(found)


class _Prefix:
    """Translates the tokens of one line, from left to right."""

    def __init__(self, tokens: list[str]) -> None:
        self._tokens = tokens
        self._next = 0

    def whole(self) -> _Formula:
        formula = self._formula([])
        if self._next != len(self._tokens):
            raise ValueError("stray text")
        return formula

    def _take(self) -> str:
        self._next += 1
        return self._tokens[self._next - 1]

    def _formula(self, buffer: list[_Formula]) -> _Formula:
        token = self._take()
        match token:
            case "!":
                return _Formula("!(", self._formula(buffer), ")")
            case "&" | "|" | "^":
                first, *rest = self._operands(token, buffer)
                parts: list[str | _Formula] = ["(", first, ")"]
                for operand in rest:
                    parts += [f" {token} (", operand, ")"]
                return _Formula(*parts)
            case "$":
                entries: list[_Formula] = []
                for _ in range(int(self._take())):
                    entries.append(self._formula(entries))
                return entries[-1]
            case "?":
                return buffer[int(self._take())]
        if token in _CONSTANTS:
            return _Formula(_CONSTANTS[token])
        if not _NAME.match(token):
            raise ValueError(token)
        return _Formula(token)

    def _operands(self, operator: str, buffer: list[_Formula]) -> list[_Formula]:
        """Return both operands; a chain of one operator becomes flat, so that it nests no
        deeper."""
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
