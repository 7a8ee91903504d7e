"""Formulas of signal temporal logic (docs/motion.md, "Requirements on the motion") and a parser.

Operators, in descending precedence: ``*``; ``+ -``; comparisons; ``not`` and the unary temporal
operators; ``and``; ``or``; ``until``; ``->`` (to the right).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import inf
from typing import ClassVar

from msgspec import Struct

from safenav.formula.parser import FormulaError, FormulaParser, Token, tokens_of

ARGUMENTS = {"distance": 2, "speed": 1, "height": 1, "x": 1, "y": 1}
"""The signals of robots (metres, metres per second) with their numbers of robots."""

EVENTS = ("requested", "resolved")


class RobotSignal(Struct, frozen=True):
    """A signal of the motion of one or two robots: ``distance(a, b)``."""

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
    """The condition ``term >= 0``. Its robustness is the term's value."""

    term: SignalTerm


class Happens(Struct, frozen=True):
    """An event, ``requested_door@47``: 1 at its instants, -1 at all others."""

    kind: str
    obstacle: str
    column: int = 0


class Window(Struct, frozen=True):
    """Seconds from ``begin`` to ``end``, both included."""

    begin: float = 0.0
    end: float = inf


class Compound(Struct, frozen=True):
    """Formulas joined by an operator: ``not``, ``and``, ``or``; within a window ``always``,
    ``eventually``, ``until``."""

    operator: str
    operands: tuple[Requirement, ...]
    window: Window = Window()


SignalTerm = RobotSignal | Literal | Arithmetic
Requirement = Margin | Happens | Compound
Node = SignalTerm | Requirement


def children(tree: Node) -> tuple[Node, ...]:
    """Return the operands of a node, from left to right; none for a leaf."""
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
    """Yield the root of a tree and all nodes below it, from left to right."""
    yield tree
    for child in children(tree):
        yield from nodes(child)


MOST_LENGTH = 2000
"""Maximum number of characters of a formula."""

_TOKEN = re.compile(
    r"(?P<space>\s+)"
    r"|(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)"
    rf"|(?P<event>(?:{'|'.join(EVENTS)})_[A-Za-z_][\w-]*@[A-Za-z0-9_][\w-]*(?:#\d+)?)"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<foreign><->|=>|==?|!=?|&&?|\|\|?|~|/\\|\\/|[/^])"
    r"|(?P<mark>->|>=|<=|[-+*(),\[\]<>])"
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
_WORDS = {"G": "always", "F": "eventually", "U": "until", "globally": "always"}
_WORDS |= {"finally": "eventually", "AND": "and", "OR": "or", "NOT": "not", "implies": "->"}
_UNARY = ("not", "always", "eventually")
_RELATIONS = (">=", ">", "<=", "<")
_OPERAND = 5
"""The precedence of unary operators."""
_RESERVED = {word: word for word in (*_UNARY, "until", "and", "or", "inf")}


def parse_requirement(text: str) -> Requirement:
    """Return the formula that ``text`` holds. Raises FormulaError."""
    if len(text) > MOST_LENGTH:
        raise FormulaError(1, f"more than {MOST_LENGTH} characters", "split the formula")
    tokens = tokens_of(text, _TOKEN, _HINTS, _RESERVED)
    return _condition(_Parser(tokens).whole(), tokens[0])


class _Parser(FormulaParser[Node]):
    levels: ClassVar = {
        **{"->": 1, "until": 2, "or": 3, "and": 4, "+": 7, "-": 7, "*": 8},
        **dict.fromkeys(_RELATIONS, 6),
    }
    misplaced: ClassVar = {word: f"write '{meant}'" for word, meant in _WORDS.items()}
    deepest = 50

    def joined(self, left: Node, begin: Token, operator: Token, level: int) -> Node:
        text = operator.text
        if level > _OPERAND:
            first, second = _number(left, begin), _number(*self.part(level + 1))
            if text not in _RELATIONS:
                return Arithmetic(text, first, second)
            more, less = (first, second) if text[0] == ">" else (second, first)
            return Margin(Arithmetic("-", more, less))
        held = _condition(left, begin)
        window = self._window() if text == "until" else Window()
        then = _condition(*self.part(level + (text != "->")))
        if text == "->":
            return Compound("or", (Compound("not", (held,)), then))
        return Compound(text, (held, then), window)

    def operand(self, least: int) -> Node:
        operator = self.take(*_UNARY) if least <= _OPERAND else None
        if operator is None:
            return self._factor()
        window = Window() if operator.text == "not" else self._window()
        return Compound(operator.text, (_condition(*self.part(_OPERAND)),), window)

    def _window(self) -> Window:
        opening = self.take("[")
        if opening is None:
            return Window()
        begin = self._seconds()
        self.need(",", "between the ends of a window: [0,45]")
        end = self._seconds()
        self.need("]", "at the end of a window")
        if begin > end or begin == inf:
            found = f"the window [{begin:g},{end:g}] ends before it begins"
            raise FormulaError(opening.column, found)
        return Window(begin, end)

    def _seconds(self) -> float:
        if found := self.take("number"):
            return _value(found)
        if self.take("inf"):
            return inf
        raise self.unexpected("seconds: a number, or 'inf'")

    def _factor(self) -> Node:
        if opening := self.take("("):
            return self.enclosed(opening)
        if self.take("-"):
            after = self.peek()
            return Arithmetic("-", Literal(0.0), _number(self._factor(), after))
        if number := self.take("number"):
            return Literal(_value(number))
        if event := self.take("event"):
            kind, _, obstacle = event.text.partition("_")
            return Happens(kind, obstacle, event.column)
        if self.peek().kind != "name" or self.peek().text in _WORDS:
            raise self.unexpected("a formula")
        return self._signal(self.next())

    def _signal(self, name: Token) -> RobotSignal:
        if name.text not in ARGUMENTS:
            known = ", ".join(ARGUMENTS)
            hint = f"signals: {known}; events: requested_door@47, resolved_door@47"
            raise FormulaError(name.column, f"'{name.text}' is not a signal", hint)
        self.need("(", f"and the robots of {name.text}")
        robots = [self.need("name", "of a robot")]
        while self.take(","):
            robots.append(self.need("name", "of a robot"))
        self.need(")", f"after the robots of {name.text}")
        wanted = ARGUMENTS[name.text]
        if len(robots) != wanted:
            found = f"{name.text} takes {wanted} robot{'s' * (wanted > 1)}, not {len(robots)}"
            raise FormulaError(name.column, found)
        names = tuple(robot.text for robot in robots)
        return RobotSignal(name.text, names, tuple(robot.column for robot in robots))


def _value(number: Token) -> float:
    if (value := float(number.text)) > 1e9:
        raise FormulaError(number.column, "a number that is too large: the maximum is 1e9")
    return value


def _condition(tree: Node, begin: Token) -> Requirement:
    """Return the tree, which begins at a token, as a condition. A number is an error."""
    if isinstance(tree, RobotSignal | Literal | Arithmetic):
        hint = "compare it: distance(a, b) >= 1"
        raise FormulaError(begin.column, "found a number, expected a condition", hint)
    return tree


def _number(tree: Node, begin: Token) -> SignalTerm:
    if isinstance(tree, RobotSignal | Literal | Arithmetic):
        return tree
    hint = "only numbers are compared, added and multiplied; join two comparisons with 'and'"
    raise FormulaError(begin.column, "found a condition, expected a number", hint)
