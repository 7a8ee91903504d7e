"""Reads infix formulas as functions of two states, by the table of precedence in docs/scenario.md;
it shares no code with safenav's parser."""

import re
from collections.abc import Callable, Mapping

State = Mapping[str, int]
Truth = Callable[[State, State], bool]
"""Whether a formula holds now; the second state is that after the step."""

TOKEN = re.compile(r"\s*(<->|->|!=|<=|>=|[\w@.]+|[^\s\w])")
LOOSE = ("<->", "->", "^", "|", "&")
"""The loosest first; all group to the left."""
SAID = {"<->": "{} == {}", "->": "not {} or {}", "^": "{} != {}", "|": "{} or {}", "&": "{} and {}"}


def truth(text: str) -> Truth:
    """Return the formula as a function."""
    found: Truth = eval(f"lambda now, then: {_Reader(text).formula(0)}")
    return found


class _Reader:
    """The rest of a formula; ``now``: the state of names without a prime."""

    def __init__(self, text: str) -> None:
        self.left = [*TOKEN.findall(text), ""]
        self.now = "now"

    def formula(self, level: int) -> str:
        """The next formula of operators that bind at least so tightly, as Python."""
        if level == len(LOOSE):
            return self._tight()
        found, sign = self.formula(level + 1), LOOSE[level]
        while self.left[0] == sign:
            self.left.pop(0)
            found = f"({SAID[sign].format(found, self.formula(level + 1))})"
        return found

    def _tight(self) -> str:
        match self.left[0]:
            case "!":
                self.left.pop(0)
                return f"(not {self._tight()})"
            case "(":
                return self._inner()
            case "next":
                self.left.pop(0)
                self.now = "then"
                found = self._inner()
                self.now = "now"
                return found
        left = self._sum()
        if self.left[0] not in ("=", "!=", "<", "<=", ">", ">="):
            return f"bool({left})"
        sign = self.left.pop(0)
        return f"({left} {'==' if sign == '=' else sign} {self._sum()})"

    def _inner(self) -> str:
        assert self.left.pop(0) == "("
        found = self.formula(0)
        assert self.left.pop(0) == ")"
        return found

    def _sum(self) -> str:
        word = self.left.pop(0)
        found = {"TRUE": "1", "FALSE": "0"}.get(word) or word
        if not found.isdigit():
            primed = self.left[0] == "'"
            found = f"{'then' if primed else self.now}[{word!r}]"
            del self.left[: int(primed)]
        if self.left[0] == "+":
            self.left.pop(0)
            return f"{found} + {self._sum()}"
        return found
