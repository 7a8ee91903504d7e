"""Formulas of signal temporal logic (docs/motion.md, "Requirements on the motion"), and a parser.

Operators, from the one that binds most tightly: ``*``; ``+ -``; comparisons; ``not`` and the
temporal operators of one operand; ``and``; ``or``; ``until`` and ``since``; ``->`` (to the right).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from math import inf

from msgspec import Struct

from safenav.formula.parser import FormulaError, Token, tokens_of

ARGUMENTS = {"distance": 2, "speed": 1, "height": 1, "x": 1, "y": 1}
"""The signals of robots (metres, metres per second), and how many robots each takes."""

EVENTS = ("requested", "resolved")


class RobotSignal(Struct, frozen=True):
    """``distance(a, b)``: a signal of the motion of one or two robots."""

    name: str
    robots: tuple[str, ...]
    columns: tuple[int, ...] = ()


class Literal(Struct, frozen=True):
    """A number."""

    value: float


class Arithmetic(Struct, frozen=True):
    """``left + right``, ``left - right`` or ``left * right``."""

    operator: str
    left: SignalTerm
    right: SignalTerm


class Margin(Struct, frozen=True):
    """``term >= 0``: its robustness is the term."""

    term: SignalTerm


class Happens(Struct, frozen=True):
    """``requested_door@47``: 1 at the instants of the event, -1 at all others."""

    kind: str
    obstacle: str
    column: int = 0


class Window(Struct, frozen=True):
    """Seconds from ``begin`` to ``end``, both included."""

    begin: float = 0.0
    end: float = inf


class Compound(Struct, frozen=True):
    """Formulas joined by an operator: ``not``, ``and``, ``or``; within a window ``always``,
    ``eventually``, ``until`` of the future, ``historically``, ``once``, ``since`` of the past."""

    operator: str
    operands: tuple[Requirement, ...]
    window: Window = Window()


SignalTerm = RobotSignal | Literal | Arithmetic
Requirement = Margin | Happens | Compound
Node = SignalTerm | Requirement

PAST = frozenset({"once", "historically", "since"})
UNIVERSAL = frozenset({"always", "historically"})


def children(tree: Node) -> tuple[Node, ...]:
    """The parts of a node, from left to right."""
    match tree:
        case Margin(term):
            return (term,)
        case Compound(_, operands):
            return operands
        case Arithmetic(_, left, right):
            return (left, right)
        case _:
            return ()


def nodes(tree: Node) -> Iterator[Node]:
    """The tree and everything below it, from left to right."""
    yield tree
    for child in children(tree):
        yield from nodes(child)


MOST_DEPTH = 50
"""Deepest nesting: the parser and the evaluator recurse."""

MOST_LENGTH = 2000
"""Maximum number of characters of a formula."""

_TOKEN = re.compile(
    r"(?P<space>\s+)"
    r"|(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)"
    rf"|(?P<event>(?:{'|'.join(EVENTS)})_[A-Za-z_][\w-]*@[A-Za-z0-9_][\w-]*(?:#\d+)?)"
    r"|(?P<word>[A-Za-z_]\w*)"
    r"|(?P<implies>->)"
    r"|(?P<relation>>=|<=|>|<)"
    r"|(?P<foreign><->|=>|==?|!=?|&&?|\|\|?|~|/\\|\\/|[/^])"
    r"|(?P<mark>[-+*(),\[\]])"
)
_HINTS = {
    ":": "a comma separates the ends of a window: [0,5]",
    "@": "an obstacle has its region's number or name: resolved_door@47",
    **dict.fromkeys(("=", "=="), "a signal hardly ever equals a number: write '>=' or '<='"),
    "!=": "write '>=' or '<='",
    **dict.fromkeys(("&", "&&", "/\\"), "write 'and'"),
    **dict.fromkeys(("|", "||", "\\/"), "write 'or'"),
    **dict.fromkeys(("!", "~"), "write 'not'"),
    "=>": "write '->' for 'implies' or '>=' for 'at least'",
    "<->": "write two implications, joined by 'and'",
    "/": "there is no division: multiply by a number",
}
_WORDS = {"G": "always", "F": "eventually", "U": "until", "S": "since", "H": "historically"}
_WORDS |= {"O": "once", "globally": "always", "finally": "eventually", "AND": "and", "OR": "or"}
_WORDS |= {"NOT": "not", "implies": "->"}
_UNARY = ("always", "eventually", "once", "historically")
_RESERVED = frozenset({*_UNARY, "until", "since", "and", "or", "not", "inf"})


def parse_requirement(text: str) -> Requirement:
    """The formula that ``text`` holds. Raises FormulaError."""
    if len(text) > MOST_LENGTH:
        raise FormulaError(1, f"a formula of {len(text)} characters", "split it into several")
    return _Parser(text).whole()


class _Parser:
    def __init__(self, text: str) -> None:
        self._lexemes = tokens_of(text, _TOKEN, _HINTS)
        self._at = 0
        self._depth = 0

    def whole(self) -> Requirement:
        if self._peek().kind == "end":
            raise FormulaError(1, "the formula is empty", "e.g. always(distance(a, b) >= 1)")
        tree = self._condition(self._implication)
        if self._peek().kind != "end":
            raise self._unexpected("an operator or the end")
        return tree

    def _peek(self) -> Token:
        return self._lexemes[self._at]

    def _take(self, *texts: str) -> Token | None:
        """Consume and return the next lexeme if it is one of these."""
        found = self._peek()
        if found.text not in texts or found.kind == "end":
            return None
        self._at += 1
        return found

    def _need(self, text: str, why: str = "") -> None:
        if self._take(text) is None:
            raise self._unexpected(f"'{text}'{why}")

    def _unexpected(self, expected: str) -> FormulaError:
        found = self._peek()
        shown = "end of the formula" if found.kind == "end" else repr(found.text)
        hint = f"expected {expected}"
        if found.kind == "word" and found.text in _WORDS:
            hint = f"write '{_WORDS[found.text]}'"
        return FormulaError(found.column, f"unexpected {shown}", hint)

    def _requirement(self, tree: Node, begin: Token) -> Requirement:
        if isinstance(tree, RobotSignal | Literal | Arithmetic):
            hint = "compare it: distance(a, b) >= 1"
            raise FormulaError(begin.column, "a number where a condition is expected", hint)
        return tree

    def _condition(self, operand: Callable[[], Node]) -> Requirement:
        """Return the operand that begins here, which must not be a number."""
        begin = self._peek()
        return self._requirement(operand(), begin)

    def _number(self, tree: Node, begin: Token) -> SignalTerm:
        if isinstance(tree, RobotSignal | Literal | Arithmetic):
            return tree
        hint = "only numbers are compared, added and multiplied"
        raise FormulaError(begin.column, "a condition where a number is expected", hint)

    def _implication(self) -> Node:
        begin = self._peek()
        self._descend(begin)
        left = self._until()
        if self._take("->"):
            held = self._requirement(left, begin)
            left = Compound("or", (Compound("not", (held,)), self._condition(self._implication)))
        self._depth -= 1
        return left

    def _descend(self, begin: Token) -> None:
        self._depth += 1
        if self._depth > MOST_DEPTH:
            found = f"nested more than {MOST_DEPTH} deep"
            raise FormulaError(begin.column, found, "split it into several formulas")

    def _until(self) -> Node:
        begin = self._peek()
        left = self._junction("or")
        while operator := self._take("until", "since"):
            held, window = self._requirement(left, begin), self._window()
            right = self._condition(partial(self._junction, "or"))
            left = Compound(operator.text, (held, right), window)
        return left

    def _junction(self, word: str) -> Node:
        begin = self._peek()
        operand = partial(self._junction, "and") if word == "or" else self._unary
        left = operand()
        while self._take(word):
            held = self._requirement(left, begin)
            left = Compound(word, (held, self._condition(operand)))
        return left

    def _unary(self) -> Node:
        operator = self._take("not", *_UNARY)
        if operator is None:
            return self._comparison()
        self._descend(operator)
        window = Window() if operator.text == "not" else self._window()
        operand = self._condition(self._unary)
        self._depth -= 1
        return Compound(operator.text, (operand,), window)

    def _window(self) -> Window:
        opening = self._take("[")
        if opening is None:
            return Window()
        begin = self._seconds()
        self._need(",", " between the ends of a window: [0,45]")
        end = self._seconds()
        self._need("]", " at the end of a window")
        if begin > end or begin == inf:
            found = f"the window [{begin:g},{end:g}] ends before it begins"
            raise FormulaError(opening.column, found)
        return Window(begin, end)

    def _seconds(self) -> float:
        if self._take("inf"):
            return inf
        found = self._peek()
        if found.kind != "number":
            raise self._unexpected("seconds: a number, or 'inf'")
        self._at += 1
        return self._value(found)

    def _value(self, found: Token) -> float:
        value = float(found.text)
        if value > 1e9:
            raise FormulaError(found.column, "a number that is too large")
        return value

    def _comparison(self) -> Node:
        begin = self._peek()
        left = self._sum()
        relation = self._peek()
        if relation.kind != "relation":
            return left
        self._at += 1
        first, after = self._number(left, begin), self._peek()
        second = self._number(self._sum(), after)
        if self._peek().kind == "relation":
            hint = "comparisons do not chain: join two with 'and'"
            raise FormulaError(self._peek().column, f"unexpected '{self._peek().text}'", hint)
        more, less = (first, second) if relation.text[0] == ">" else (second, first)
        return Margin(Arithmetic("-", more, less))

    def _sum(self) -> Node:
        return self._chain(("+", "-"), lambda: self._chain(("*",), self._factor))

    def _chain(self, operators: tuple[str, ...], operand: Callable[[], Node]) -> Node:
        begin = self._peek()
        left = operand()
        while operator := self._take(*operators):
            first, after = self._number(left, begin), self._peek()
            left = Arithmetic(operator.text, first, self._number(operand(), after))
        return left

    def _factor(self) -> Node:
        found = self._peek()
        if opening := self._take("("):
            inner = self._implication()
            self._need(")", f" for the '(' in column {opening.column}")
            return inner
        if self._take("-"):
            return Arithmetic("-", Literal(0.0), self._number(self._factor(), self._peek()))
        if found.kind == "number":
            self._at += 1
            return Literal(self._value(found))
        if found.kind == "event":
            self._at += 1
            kind, _, obstacle = found.text.partition("_")
            return Happens(kind, obstacle, found.column)
        if found.kind == "word" and found.text not in _RESERVED:
            return self._signal()
        raise self._unexpected("a formula")

    def _signal(self) -> RobotSignal:
        name = self._peek()
        if name.text not in ARGUMENTS:
            if name.text in _WORDS:
                raise self._unexpected("")
            known = ", ".join(ARGUMENTS)
            hint = f"signals: {known}; events: requested_door@47, resolved_door@47"
            raise FormulaError(name.column, f"'{name.text}' is not a signal", hint)
        self._at += 1
        self._need("(", f" and the robots of {name.text}")
        robots = [self._robot()]
        while self._take(","):
            robots.append(self._robot())
        self._need(")", f" after the robots of {name.text}")
        wanted = ARGUMENTS[name.text]
        if len(robots) != wanted:
            found = f"{name.text} takes {wanted} robot{'s' * (wanted > 1)}, not {len(robots)}"
            raise FormulaError(name.column, found)
        names = tuple(robot.text for robot in robots)
        return RobotSignal(name.text, names, tuple(robot.column for robot in robots))

    def _robot(self) -> Token:
        found = self._peek()
        if found.kind != "word":
            raise self._unexpected("the name of a robot")
        self._at += 1
        return found
