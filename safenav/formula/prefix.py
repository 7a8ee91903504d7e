"""Prefix notation of slugsin lines (docs/specifications.md), translated to infix notation."""

import re
from contextlib import suppress
from math import inf

from safenav.formula.parser import FormulaError, parse

_TOKEN = re.compile(r"[!&|^$?]|\d+|[^\s!&|^$?]+")
_STARTS = re.compile(r"[!&|^$?]\s|[01]\s*\Z")
_CONSTANTS = {"0": "FALSE", "1": "TRUE"}


class TooLongError(Exception):
    """A line whose buffers expand to too many characters."""


def to_infix(line: str, most: float = inf) -> str:
    """Return a constraint in infix notation; one already in infix notation is unchanged.

    ``| ! a & b c'`` means ``!a | (b & c')``; ``$ n f1 .. fn`` is a buffer of formulas whose value
    is fn, and ``? i`` recalls its entry i. Buffers that recall each other double their text with
    each entry. Raises TooLongError beyond ``most`` characters of entries, before they are made.
    """
    if not _STARTS.match(line):
        return line
    with suppress(FormulaError):
        parse(line)
        return line
    tokens = _TOKEN.findall(line)[::-1]
    try:
        formula = _Prefix(tokens, most).formula([])
    except (IndexError, ValueError, RecursionError):
        return line  # in neither notation: the caller reports the error
    return line if tokens else formula


class _Prefix:
    """Translation of the tokens of one line, the last one first. ``left``: number of further
    characters that it may write."""

    def __init__(self, tokens: list[str], left: float) -> None:
        self._tokens = tokens
        self._left = left

    def formula(self, buffer: list[str]) -> str:
        match token := self._tokens.pop():
            case "!":
                return f"!({self.formula(buffer)})"
            case "&" | "|" | "^":
                operands = self._operands(token, buffer)
                self._require(sum(map(len, operands)))
                return f" {token} ".join(f"({operand})" for operand in operands)
            case "$":
                entries: list[str] = []
                for _ in range(int(self._tokens.pop())):
                    entries.append(self.formula(entries))
                    self._left -= len(entries[-1])
                    self._require(0)
                return entries[-1]
            case "?":
                return buffer[int(self._tokens.pop())]
        return _CONSTANTS.get(token, token)

    def _require(self, more: int) -> None:
        if more > self._left:
            raise TooLongError("its buffers stand for too many characters")

    def _operands(self, operator: str, buffer: list[str]) -> list[str]:
        """Return both operands; a chain of one operator becomes flat, so that it nests no
        deeper."""
        operands = []
        missing = 2
        while missing:
            if self._tokens[-1] == operator:
                self._tokens.pop()
                missing += 1
            else:
                operands.append(self.formula(buffer))
                missing -= 1
        return operands
