"""Formulas of signal temporal logic (docs/motion.md, "Requirements on the motion"), and a parser.

Operators, from the one that binds most tightly: ``*``; ``+ -``; comparisons; ``not`` and the
temporal operators of one operand; ``and``; ``or``; ``until`` and ``since``; ``->`` (to the right).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
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
    """Return the parts of a node, from left to right."""
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
    """Yield the tree and everything below it, from left to right."""
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
_UNARY = ("not", "always", "eventually", "once", "historically")
_LEVELS = {"->": 1, "until": 2, "since": 2, "or": 3, "and": 4, "+": 7, "-": 7, "*": 8}
_LEVELS |= dict.fromkeys((">=", ">", "<=", "<"), 6)
"""How tightly each binary operator binds; those of one operand bind as ``_OPERAND``."""
_OPERAND = 5
_RESERVED = frozenset({*_UNARY, "until", "since", "and", "or", "inf"})


def parse_requirement(text: str) -> Requirement:
    """Return the formula that ``text`` holds. Raises FormulaError."""
    if len(text) > MOST_LENGTH:
        raise FormulaError(1, f"a formula of {len(text)} characters", "split it into several")
    return _Parser(text).whole()


class _Parser:
    def __init__(self, text: str) -> None:
        self._lexemes = tokens_of(text, _TOKEN, _HINTS)
        self._at = 0
        self._depth = 0

    def whole(self) -> Requirement:
        begin = self._peek()
        if begin.kind == "end":
            raise FormulaError(1, "the formula is empty", "e.g. always(distance(a, b) >= 1)")
        tree = _condition(self._expression(), begin)
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

    def _expression(self, least: int = 0) -> Node:
        """Return what begins here, up to an operator that binds less tightly than ``least``."""
        begin = self._peek()
        self._depth += 1
        if self._depth > MOST_DEPTH:
            found = f"nested more than {MOST_DEPTH} deep"
            raise FormulaError(begin.column, found, "split it into several formulas")
        left = self._operand() if least <= _OPERAND else self._factor()
        while (level := _LEVELS.get(self._peek().text, -1)) >= least:
            operator = self._lexemes[self._at]
            self._at += 1
            left = self._joined(left, begin, operator, level)
        self._depth -= 1
        return left

    def _joined(self, left: Node, begin: Token, operator: Token, level: int) -> Node:
        """Return ``left``, which begins at a token, joined with what follows the operator."""
        text = operator.text
        if level > _OPERAND:
            first, after = _number(left, begin), self._peek()
            second = _number(self._expression(level + 1), after)
            if operator.kind != "relation":
                return Arithmetic(text, first, second)
            if self._peek().kind == "relation":
                hint = "comparisons do not chain: join two with 'and'"
                raise FormulaError(self._peek().column, f"unexpected '{self._peek().text}'", hint)
            more, less = (first, second) if text[0] == ">" else (second, first)
            return Margin(Arithmetic("-", more, less))
        held = _condition(left, begin)
        window = self._window() if text in ("until", "since") else Window()
        after = self._peek()
        then = _condition(self._expression(level + (text != "->")), after)
        if text == "->":
            return Compound("or", (Compound("not", (held,)), then))
        return Compound(text, (held, then), window)

    def _operand(self) -> Node:
        operator = self._take(*_UNARY)
        if operator is None:
            return self._factor()
        window = Window() if operator.text == "not" else self._window()
        begin = self._peek()
        operand = _condition(self._expression(_OPERAND), begin)
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
        if self._peek().kind != "number":
            raise self._unexpected("seconds: a number, or 'inf'")
        return self._value()

    def _value(self) -> float:
        found = self._peek()
        self._at += 1
        value = float(found.text)
        if value > 1e9:
            raise FormulaError(found.column, "a number that is too large")
        return value

    def _factor(self) -> Node:
        found = self._peek()
        if opening := self._take("("):
            inner = self._expression()
            self._need(")", f" for the '(' in column {opening.column}")
            return inner
        if self._take("-"):
            after = self._peek()
            return Arithmetic("-", Literal(0.0), _number(self._factor(), after))
        if found.kind == "number":
            return Literal(self._value())
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


def _condition(tree: Node, begin: Token) -> Requirement:
    """Return the tree, which begins at a token and must not be a number."""
    if isinstance(tree, RobotSignal | Literal | Arithmetic):
        hint = "compare it: distance(a, b) >= 1"
        raise FormulaError(begin.column, "a number where a condition is expected", hint)
    return tree


def _number(tree: Node, begin: Token) -> SignalTerm:
    if isinstance(tree, RobotSignal | Literal | Arithmetic):
        return tree
    hint = "only numbers are compared, added and multiplied"
    raise FormulaError(begin.column, "a condition where a number is expected", hint)
