"""Prefix notation of slugsin lines (docs/specifications.md), translated to infix notation."""

import re

from safenav.formula.parser import SAME, FormulaError

_TOKEN = re.compile(r"/\\|\\/|\w[\w.@]*(?:\s*')?|\S", re.ASCII)
_BEGINNING = re.compile(r"[!~\s]*(?:[&|^$?]|/\\|\\/)")
"""Operators with which no infix formula begins."""


def to_infix(line: str, most: int) -> str:
    """Return a constraint in infix notation, unchanged unless it is in prefix notation.

    ``| ! a & b c'`` means ``!a | (b & c')``; ``$ n f1 .. fn`` is a buffer of formulas with the
    value fn, and ``? i`` recalls its entry i. Buffers that recall each other double their text with
    each entry, so FormulaError is raised before entries exceed ``most`` characters.
    """
    if not _BEGINNING.match(line):
        return line
    tokens = [SAME.get(token, token) for token in _TOKEN.findall(line)[::-1]]
    try:
        formula = _Prefix(tokens, most).formula([])
    except (IndexError, ValueError, RecursionError):
        return line  # in neither notation: the caller reports the error
    return line if tokens else formula


class _Prefix:
    """The translation of a line's tokens, which are in reverse order. ``left``: the number of
    further characters that the translation may have."""

    def __init__(self, tokens: list[str], left: int) -> None:
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
        if not (token[0].isalnum() or token[0] == "_"):
            raise ValueError(token)
        return token

    def _require(self, more: int) -> None:
        if more > self._left:
            hint = "define an output for each entry, and use that"
            raise FormulaError(1, "its buffers expand to too many characters", hint)

    def _operands(self, operator: str, buffer: list[str]) -> list[str]:
        """Return the operands of an operator: two, or those of a whole chain of it, so that chains
        do not nest deeper."""
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
