"""Parser of the structured-slugs expression language (docs/specifications.md), and checks of a
formula against declared variables: names, types, ranges, primes.

Operators, from the one that binds most tightly: ``+``; comparisons; ``!``; ``&``; ``|``; ``^``;
``->``; ``<->``. One loop climbs the precedences, so nesting costs few stack frames; depth is
limited all the same, because every later walk over the tree recurses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import reduce

from msgspec import Struct

from safenav.errors import ExitCode, SafenavError
from safenav.formula import syntax
from safenav.formula.syntax import Connective, Operation

MAX_DEPTH = 100
"""Deepest nesting of parentheses, negations and implication chains."""

MAX_NUMBER = 2**31 - 1


class FormulaError(SafenavError):
    """A formula that cannot be read: ``column`` (from 1), what was ``found``, and a ``hint``."""

    exit_code = ExitCode.BAD_INPUT

    def __init__(self, column: int, found: str, hint: str = "") -> None:
        self.column = column
        self.found = found
        self.hint = hint
        super().__init__(f"column {column}: {found}" + (f" ({hint})" if hint else ""))

    def __reduce__(self) -> tuple[type[FormulaError], tuple[int, str, str]]:
        return type(self), (self.column, self.found, self.hint)


def parse(text: str) -> syntax.Formula:
    """Return the formula that ``text`` holds. Raises FormulaError."""
    return _Parser(tokens_of(text, _TOKEN, _HINTS)).whole()


class Token(Struct, frozen=True):
    kind: str
    text: str
    column: int


_TOKEN = re.compile(
    r"(?P<space>\s+)"
    r"|(?P<number>[0-9]+)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:[@.][A-Za-z0-9_]+)*)"
    r"|(?P<iff><-->|<->)"
    r"|(?P<implies>-->|->)"
    r"|(?P<foreign>===?|!==|<=>|=>|=<|<>|\[\])"
    r"|(?P<relation>!=|<=|>=|=|<|>)"
    r"|(?P<and>&&|&|/\\)"
    r"|(?P<or>\|\||\||\\/)"
    r"|(?P<xor>\^)"
    r"|(?P<not>[!~])"
    r"|(?P<plus>\+)"
    r"|(?P<prime>')"
    r"|(?P<open>\()"
    r"|(?P<close>\))"
)

_HINTS = {
    "-": "there is no subtraction: move the term to the other side of the comparison",
    "*": "there is no multiplication: write a sum",
    "\N{RIGHT SINGLE QUOTATION MARK}": "the next value is written with a plain apostrophe: x'",
    "==": "equality is written '='",
    "===": "equality is written '='",
    "!==": "inequality is written '!='",
    "=>": "write '->' for 'implies' or '>=' for 'at least'",
    "=<": "write '<='",
    "<=>": "write '<->' for 'if and only if'",
    "<>": "for 'not equal' write '!='; a goal is a line of its own under 'liveness'",
    "[]": "a line under 'safety' always holds, one under 'liveness' infinitely often",
    "[": "a region is written as its number or its name",
    "{": "join alternatives with '|', or give the regions a name under 'areas'",
}

_WORDS = {
    "and": "write '&'",
    "or": "write '|'",
    "not": "write '!'",
    "implies": "write '->'",
    "iff": "write '<->'",
}
"""Operators in words, as in requirements on the motion and in other languages."""

_TEMPORAL = {
    "F": "put each goal to reach infinitely often under 'liveness'",
    "G": "put each condition that must always hold under 'safety'",
    "U": "GR(1) has no until: use a memory variable, or goals under 'liveness'",
    "W": "GR(1) has no weak until: use a memory variable under 'safety'",
}

_OPERATORS = {
    "iff": Connective.IFF,
    "implies": Connective.IMPLIES,
    "xor": Connective.XOR,
    "or": Connective.OR,
    "and": Connective.AND,
}
"""Operators by the kind of their token."""


def tokens_of(text: str, pattern: re.Pattern[str], hints: Mapping[str, str]) -> list[Token]:
    """Return the tokens of a formula by the groups of a pattern, without ``space``; the last one is
    ``end``. Raises FormulaError for ``foreign`` ones and for characters that no group matches."""
    tokens = []
    position = 0
    while position < len(text):
        match = pattern.match(text, position)
        found = text[position] if match is None else match.group()
        if match is None or match.lastgroup == "foreign":
            raise FormulaError(position + 1, f"unexpected {found!r}", hints.get(found, ""))
        if match.lastgroup != "space":
            tokens.append(Token(str(match.lastgroup), found, position + 1))
        position = match.end()
    return [*tokens, Token("end", "", len(text) + 1)]


class _Parser:
    """Recursive descent with precedence climbing over the tokens of one formula."""

    def __init__(self, tokens: list[Token]) -> None:
        self._tokens = tokens
        self._next = 0
        self._depth = 0
        self._height = 0
        self._inside_next = False

    def whole(self) -> syntax.Formula:
        if self._peek().kind == "end":
            raise FormulaError(1, "the formula is empty", "write TRUE for no condition")
        formula = self._binary(1)
        if self._peek().kind != "end":
            raise self._unexpected("an operator or the end")
        return formula

    def _peek(self) -> Token:
        return self._tokens[self._next]

    def _take(self) -> Token:
        token = self._tokens[self._next]
        self._next += 1
        return token

    def _binary(self, lowest: int) -> syntax.Formula:
        """Parse the operators of precedence ``lowest`` and higher, with all that binds tighter."""
        left = self._unary()
        while (kind := self._peek().kind) in _OPERATORS:
            node = _OPERATORS[kind]
            if (rank := syntax.PRECEDENCE[node]) < lowest:
                break
            operands = [left]
            height = self._height
            chained = kind in ("implies", "iff")
            while self._peek().kind == kind:
                operator = self._take()
                operands.append(self._binary(rank + 1))
                height = max(height, self._height)
                if chained:
                    height = self._bounded(height + 1, operator)
            if chained:
                left = reduce(lambda one, other: Operation(node, (one, other)), operands)
            else:
                left = Operation(node, tuple(operands))
            self._height = height if chained else height + 1
            self._bounded(self._height, self._peek())
        return left

    def _unary(self) -> syntax.Formula:
        token = self._peek()
        if token.kind == "not":
            self._take()
            self._descend(token)
            operand = self._unary()
            self._depth -= 1
            self._height = self._bounded(self._height + 1, token)
            return Operation(Connective.NOT, (operand,))
        if token.kind == "name" and token.text in ("next", "X") and self._opens_next():
            return self._next_formula()
        return self._comparison()

    def _opens_next(self) -> bool:
        return self._tokens[self._next + 1].kind == "open"

    def _next_formula(self) -> syntax.Formula:
        word = self._take()
        if self._inside_next:
            raise FormulaError(word.column, f"{word.text} inside {word.text}", _ONE_STEP)
        self._inside_next = True
        operand = self._parenthesized()
        self._inside_next = False
        if self._peek().kind in ("relation", "plus"):
            hint = "next(...) takes a formula; the next value of a number is written x'"
            raise FormulaError(self._peek().column, f"unexpected {self._shown()}", hint)
        for name in syntax.names_of(operand):
            if name.primed:
                found = f"the primed variable {name.name}' inside {word.text}(...)"
                raise FormulaError(name.column, found, _ONE_STEP)
        self._height = self._bounded(self._height + 1, word)
        return Operation(Connective.NEXT, (operand,))

    def _parenthesized(self) -> syntax.Formula:
        opening = self._take()
        self._descend(opening)
        formula = self._binary(1)
        if self._peek().kind != "close":
            raise self._unexpected(f"')' for the '(' in column {opening.column}")
        self._take()
        self._depth -= 1
        if self._peek().kind == "prime":
            hint = "a prime follows a variable; for a formula write next(...)"
            raise FormulaError(self._peek().column, 'unexpected "\'"', hint)
        return formula

    def _comparison(self) -> syntax.Formula:
        """Return a comparison, a Boolean variable, a constant, or a formula in parentheses."""
        token = self._peek()
        self._height = 0
        if token.kind == "open":
            inner = self._parenthesized()
            if self._peek().kind not in ("relation", "plus"):
                return inner
            if not isinstance(inner, syntax.Name):
                raise FormulaError(
                    self._peek().column,
                    f"unexpected {self._shown()}",
                    "expected a number, found a formula",
                )
            return self._related(self._sum(inner))
        if token.kind == "name" and token.text in ("TRUE", "FALSE"):
            self._take()
            if self._peek().kind in ("relation", "plus"):
                hint = f"{token.text} is not a number"
                raise FormulaError(self._peek().column, f"unexpected {self._shown()}", hint)
            return syntax.Constant(token.text == "TRUE")
        term = self._sum(self._atom())
        if isinstance(term, syntax.Name) and self._peek().kind != "relation":
            return term
        return self._related(term)

    def _related(self, left: syntax.Term) -> syntax.Formula:
        """Return ``left`` compared with the term that follows."""
        if self._peek().kind != "relation":
            raise self._unexpected("a comparison such as '=' after a number")
        relation = syntax.Relation(self._take().text)
        right = self._sum(self._atom())
        if self._peek().kind == "relation":
            hint = "comparisons do not chain: join two with '&'"
            raise FormulaError(self._peek().column, f"unexpected {self._shown()}", hint)
        return syntax.Comparison(relation, left, right)

    def _sum(self, first: syntax.Name | syntax.Number) -> syntax.Term:
        terms = [first]
        while self._peek().kind == "plus":
            self._take()
            terms.append(self._atom())
        return syntax.Sum(tuple(terms)) if len(terms) > 1 else first

    def _atom(self) -> syntax.Name | syntax.Number:
        token = self._peek()
        if token.kind == "number":
            self._take()
            if len(token.text) > 10 or int(token.text) > MAX_NUMBER:
                hint = f"the largest number is {MAX_NUMBER}"
                raise FormulaError(token.column, "a number that is too large", hint)
            return syntax.Number(int(token.text), token.column)
        if token.kind != "name" or token.text in ("TRUE", "FALSE"):
            raise self._unexpected("a variable, a number or '('")
        self._take()
        if token.text in _TEMPORAL:
            found = f"the temporal operator {token.text}"
            raise FormulaError(token.column, found, _TEMPORAL[token.text])
        if token.text in ("next", "X"):
            hint = f"write {token.text}(...) around what must hold in the next state"
            raise FormulaError(token.column, f"unexpected {token.text!r}", hint)
        primed = self._peek().kind == "prime"
        if primed:
            self._take()
            if self._peek().kind == "prime":
                raise FormulaError(self._peek().column, "a second prime", _ONE_STEP)
        return syntax.Name(token.text, primed, token.column)

    def _descend(self, token: Token) -> None:
        """Enter one more level of the text, which bounds the parser's own recursion."""
        self._depth = self._bounded(self._depth + 1, token)

    def _bounded(self, levels: int, token: Token) -> int:
        """Return ``levels`` if the tree is not too high for later recursive walks."""
        if levels > MAX_DEPTH:
            found = f"nested more than {MAX_DEPTH} deep"
            raise FormulaError(token.column, found, "split the formula into several lines")
        return levels

    def _shown(self) -> str:
        token = self._peek()
        return "end of the formula" if token.kind == "end" else repr(token.text)

    def _unexpected(self, expected: str) -> FormulaError:
        token = self._peek()
        hint = f"expected {expected}"
        before = self._tokens[self._next - 1]
        if token.kind == "name" and token.text in _TEMPORAL:
            hint = _TEMPORAL[token.text]
        for word in (token, before) if self._next else (token,):
            if word.kind == "name" and word.text.lower() in _WORDS:
                found = f"unexpected {word.text!r}"
                return FormulaError(word.column, found, _WORDS[word.text.lower()])
        return FormulaError(token.column, f"unexpected {self._shown()}", hint)


_ONE_STEP = "a GR(1) formula refers to this state and the next one only"


Bounds = tuple[int, int] | None
"""Range of an integer variable, None for a Boolean."""


class FormulaFlaw(Struct, frozen=True):
    """One error in a formula, at a column (from 1). ``unknown`` is the name that is not declared,
    so that the caller can suggest another."""

    column: int
    found: str
    hint: str = ""
    unknown: str = ""


def check(
    formula: syntax.Formula,
    declared: Mapping[str, Bounds],
    *,
    next_allowed: bool = True,
) -> tuple[FormulaFlaw, ...]:
    """Return all errors of the formula by column, none if it can be used.

    ``declared`` maps the variables to their range, or None for Booleans. ``next_allowed`` is False
    for initial conditions.
    """
    found = _flaws(formula, declared, next_allowed)
    return tuple(sorted(dict.fromkeys(found), key=lambda problem: problem.column))


_NO_NEXT = "an initial condition refers to the first state only"


def _flaws(
    formula: syntax.Formula, declared: Mapping[str, Bounds], primes: bool
) -> Iterator[FormulaFlaw]:
    compared = isinstance(formula, syntax.Comparison)
    for name in () if isinstance(formula, Operation) else syntax.names_of(formula):
        column, bounds = name.column, declared.get(name.name)
        if name.name not in declared:
            yield FormulaFlaw(column, f"unknown variable {name.name!r}", unknown=name.name)
        elif compared and bounds is None:
            found = f"{name.name} is Boolean and cannot be compared"
            yield FormulaFlaw(column, found, f"write {name.name} or !{name.name}")
        elif not compared and bounds is not None:
            found = f"the number {name.name} stands alone"
            yield FormulaFlaw(column, found, f"write {name.name} = ...")
        if name.primed and not primes:
            yield FormulaFlaw(column, f"the next value {name.name}' here", _NO_NEXT)
    match formula:
        case syntax.Comparison(syntax.Relation.EQUAL | syntax.Relation.UNEQUAL, left, right):
            yield from _range(left, right, declared)
            yield from _range(right, left, declared)
        case Operation(Connective.NEXT, (operand,)) if not primes:
            # Its column is not recorded: that of its first name is near.
            column = next((name.column for name in syntax.names_of(operand)), 1)
            yield FormulaFlaw(column, "next(...) in an initial condition", _NO_NEXT)
    for operand in syntax.operands_of(formula):
        yield from _flaws(operand, declared, primes or syntax.is_next(formula))


def _range(
    term: syntax.Term, other: syntax.Term, declared: Mapping[str, Bounds]
) -> Iterator[FormulaFlaw]:
    if not (isinstance(term, syntax.Name) and isinstance(other, syntax.Number)):
        return
    bounds = declared.get(term.name)
    if bounds is not None and not bounds[0] <= other.value <= bounds[1]:
        found = f"{other.value} is outside the range of {term.name}"
        yield FormulaFlaw(other.column, found, f"{term.name} is from {bounds[0]} to {bounds[1]}")
