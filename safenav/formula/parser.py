"""The parser of the structured-slugs expression language (docs/specifications.md), and checks of
formulas against declared variables: names, types, ranges, primes.

Operators, in descending precedence: ``+``; comparisons; ``!``; ``&``; ``|``; ``^``; ``->``;
``<->``. Depth is limited, since the parser and all later walks over the tree recurse.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import reduce
from itertools import chain
from typing import ClassVar, Generic, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import ExitCode, SafenavError
from safenav.formula import syntax
from safenav.formula.syntax import Connective, Operation

MAX_DEPTH = 100
"""Maximum nesting of operators."""

MAX_NUMBER = 2**31 - 1


class FormulaError(SafenavError):
    """An unreadable formula: ``column`` (from 1), the error ``found``, and a ``hint``."""

    exit_code = ExitCode.BAD_INPUT

    def __init__(self, column: int, found: str, hint: str = "") -> None:
        self.column = column
        self.found = found
        self.hint = hint
        super().__init__(f"column {column}: {found}" + (f" ({hint})" if hint else ""))


T = TypeVar("T")


class Token(Struct, frozen=True):
    """A token. ``kind``: its operator or keyword or, for other tokens, its pattern's group."""

    kind: str
    text: str
    column: int


def tokens_of(
    text: str, pattern: re.Pattern[str], hints: Mapping[str, str], kinds: Mapping[str, str]
) -> list[Token]:
    """Return the tokens of a formula by the groups of a pattern, without ``space``. The last token
    is ``end``. ``kinds``: kinds of keywords and aliases. Raises FormulaError for tokens of the
    group ``foreign`` and characters that no group matches."""
    tokens, position = list[Token](), 0
    while position < len(text):
        match = pattern.match(text, position)
        found = text[position] if match is None else match.group()
        if match is None or match.lastgroup == "foreign":
            raise FormulaError(position + 1, f"unexpected {found!r}", hints.get(found, ""))
        if (group := str(match.lastgroup)) != "space":
            kind = kinds.get(found, found if group == "mark" else group)
            tokens.append(Token(kind, found, position + 1))
        position = match.end()
    return [*tokens, Token("end", "", len(text) + 1)]


class FormulaParser(Generic[T]):
    """Precedence climbing over the tokens of a formula. A language defines ``operand``, which reads
    a part without binary operators, and ``joined``, which reads an operator's right side.

    ``levels``: the precedence of each binary operator; ``misplaced``: hints for tokens in wrong
    places; ``deepest``: the limit of nesting.
    """

    levels: ClassVar[Mapping[str, int]]
    misplaced: ClassVar[Mapping[str, str]]
    deepest: ClassVar[int]

    def __init__(self, tokens: list[Token]) -> None:
        self._tokens = tokens
        self._at = 0
        self._depth = 0

    def operand(self, least: int) -> T:
        raise NotImplementedError

    def joined(self, left: T, begin: Token, operator: Token, level: int) -> T:
        """Read the right side of an operator. Return its operation on ``left`` and that side.
        ``begin``: the first token of ``left``."""
        raise NotImplementedError

    def whole(self) -> T:
        formula = self.expression()
        if self.peek().kind != "end":
            raise self.unexpected("an operator or the end")
        return formula

    def expression(self, least: int = 0) -> T:
        """Return the formula that begins at the next token and ends before an operator with a
        precedence below ``least``."""
        begin = self.peek()
        self._depth += 1
        if self._depth > self.deepest:
            raise too_deep(begin.column)
        left = self.operand(least)
        while (level := self.levels.get(self.peek().kind, -1)) >= least:
            left = self.joined(left, begin, self.next(), level)
        self._depth -= 1
        return left

    def part(self, least: int) -> tuple[T, Token]:
        """Return the formula of ``expression(least)`` and its first token."""
        begin = self.peek()
        return self.expression(least), begin

    def peek(self) -> Token:
        return self._tokens[self._at]

    def next(self) -> Token:
        """Consume and return the next token."""
        self._at += 1
        return self._tokens[self._at - 1]

    def take(self, *kinds: str) -> Token | None:
        """Consume and return the next token if it is one of these."""
        return self.next() if self.peek().kind in kinds else None

    def need(self, kind: str, why: str) -> Token:
        """Consume and return the next token, which must be of this kind. ``why``: the end of the
        error message."""
        if self.peek().kind != kind:
            raise self.unexpected(f"'{kind}' {why}")
        return self.next()

    def enclosed(self, opening: Token) -> T:
        """Return the formula in the parentheses that a token has opened."""
        inner = self.expression()
        self.need(")", f"for the '(' in column {opening.column}")
        return inner

    def unexpected(self, expected: str) -> FormulaError:
        """Return the error at the next token, or at the previous word if that was misread as a
        name."""
        token, before = self.peek(), self._tokens[self._at - 1]
        if before.kind == "name" and before.text in self.misplaced:
            token = before
        shown = "end of the formula" if token.kind == "end" else repr(token.text)
        hint = self.misplaced.get(token.text, f"expected {expected}")
        return FormulaError(token.column, f"unexpected {shown}", hint)


def too_deep(column: int) -> FormulaError:
    return FormulaError(column, "nested too deeply", "split it into several formulas")


_TOKEN = re.compile(
    r"(?P<space>\s+)"
    r"|(?P<number>[0-9]+)"
    r"|(?P<next>(?:next|X)(?=\s*\())"  # they are names elsewhere, as in slugs
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_@.]*)"
    r"|(?P<foreign>==|<=>|=>|=<|<>|\[\])"
    r"|(?P<mark><?--?>|&&?|/\\|\|\|?|\\/|!=|<=|>=|[!~^+'()=<>])"
)

_SECTIONS = "a line under 'safety' always holds, one under 'liveness' infinitely often"
_HINTS = {
    "-": "there is no subtraction: move the term to the other side of the comparison; a region "
    "whose name has '-' is written as its number",
    "*": "there is no multiplication: write a sum",
    "\N{RIGHT SINGLE QUOTATION MARK}": "the next value is written with a plain apostrophe: x'",
    "==": "equality is written '='",
    "=>": "write '->' for 'implies' or '>=' for 'at least'",
    "=<": "write '<='",
    "<=>": "write '<->' for 'if and only if'",
    "<>": "for 'not equal' write '!='; a goal is a line of its own under 'liveness'",
    "[]": _SECTIONS,
    "[": "write a region as its number or its name",
    "{": "join alternatives with '|', or give the regions a name under 'areas'",
}
"""Hints for signs of other languages."""

_WORDS = {"and": "&", "or": "|", "not": "!", "implies": "->", "iff": "<->"}
"""Operators in words, as in motion requirements and other languages."""

SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "~": "!", "-->": "->", "<-->": "<->"}
"""Further spellings of operators."""
_KINDS = {**SAME, "TRUE": "TRUE", "FALSE": "FALSE"}


_Expression = syntax.Formula | syntax.Term
"""A formula or a number: parentheses and ``next(...)`` may contain either; a name may be both."""


class _Parser(FormulaParser[_Expression]):
    """The structured-slugs expression language."""

    levels: ClassVar = {
        operator: level for operator, level in syntax.PRECEDENCE.items() if operator != "!"
    }
    misplaced: ClassVar = {
        **dict.fromkeys("FG", f"leave it out: {_SECTIONS}"),
        **dict.fromkeys(("next", "X"), "put a formula or a number after it in parentheses"),
        "U": "GR(1) has no until: use a memory variable, or goals under 'liveness'",
        "W": "GR(1) has no weak until: use a memory variable under 'safety'",
        "'": "one prime follows a variable; for a formula write next(...)",
        **{w: f"write '{sign}'" for word, sign in _WORDS.items() for w in (word, word.upper())},
    }
    deepest = 2 * MAX_DEPTH + 2  # parentheses, comparisons and sums do not count as nesting
    _inside_next = False

    def joined(self, left: _Expression, begin: Token, operator: Token, level: int) -> _Expression:
        if level == syntax.PRECEDENCE["="]:
            numbers = _number(left, begin), _number(*self.part(level + 1))
            return syntax.Comparison(syntax.Relation(operator.kind), *numbers)
        parts = [(left, begin), self.part(level + 1)]
        while self.take(operator.kind):
            parts.append(self.part(level + 1))
        if operator.kind == "+":
            terms = (syntax.atoms_of(_number(*part)) for part in parts)
            return syntax.Sum(tuple(chain.from_iterable(terms)))
        node, operands = Connective(operator.kind), [_condition(*part) for part in parts]
        if node not in (Connective.IMPLIES, Connective.IFF):
            return Operation(node, tuple(operands))
        return reduce(lambda one, other: Operation(node, (one, other)), operands)

    def operand(self, least: int) -> _Expression:
        """Return a negation, ``next(...)``, number, variable, constant, or expression in
        parentheses."""
        del least
        if opening := self.take("("):
            return self.enclosed(opening)
        if self.take("!"):
            return Operation(Connective.NOT, (_condition(*self.part(syntax.PRECEDENCE["!"])),))
        if word := self.take("next"):
            self._look_ahead(word)
            self._inside_next = True
            inner = self.enclosed(self.next())
            self._inside_next = False
            if not isinstance(inner, syntax.Name | syntax.Number | syntax.Sum):
                return Operation(Connective.NEXT, (inner,))
            atoms = syntax.atoms_of(inner)
            later = [replace(a, primed=True) if isinstance(a, syntax.Name) else a for a in atoms]
            return syntax.Sum(tuple(later)) if isinstance(inner, syntax.Sum) else later[0]
        if constant := self.take("TRUE", "FALSE"):
            return syntax.Constant(constant.kind == "TRUE")
        if number := self.take("number"):
            digits = number.text.lstrip("0") or "0"
            if len(digits) > 10 or int(digits) > MAX_NUMBER:
                hint = f"the largest number is {MAX_NUMBER}"
                raise FormulaError(number.column, "a number that is too large", hint)
            return syntax.Number(int(digits), number.column)
        if self.peek().kind != "name":
            raise self.unexpected("a variable, a number or '('")
        name = self.next()
        if primed := self.take("'"):
            self._look_ahead(name)
        return syntax.Name(name.text, primed is not None, name.column)

    def _look_ahead(self, token: Token) -> None:
        """Raise FormulaError at a primed variable inside ``next(...)``."""
        if self._inside_next:
            found = f"a next value ({token.text}) inside next(...)"
            hint = "a GR(1) formula refers to this state and the next one only"
            raise FormulaError(token.column, found, hint)


def _condition(part: _Expression, begin: Token) -> syntax.Formula:
    """Return ``part``, which begins at a token, as a formula. 0 and 1 become constants."""
    match part:
        case syntax.Number(0 | 1 as value, column):
            return syntax.Constant(value == 1, column)
        case syntax.Number() | syntax.Sum():
            hint = "compare it, as in x + 1 = 3"
            raise FormulaError(begin.column, "found a number, expected a formula", hint)
    return part


def _number(part: _Expression, begin: Token) -> syntax.Term:
    """Return ``part``, which begins at a token, as a number. A formula is an error."""
    if isinstance(part, syntax.Name | syntax.Number | syntax.Sum):
        return part
    hint = "only numbers are compared and added; join two comparisons with '&'"
    raise FormulaError(begin.column, "found a formula, expected a number", hint)


def parse(text: str) -> syntax.Formula:
    """Return the formula in ``text``. Raises FormulaError."""
    tokens = tokens_of(text, _TOKEN, _HINTS, _KINDS)
    formula = _condition(_Parser(tokens).whole(), tokens[0])
    height, level = -1, [formula]
    while level:
        height, level = height + 1, [part for node in level for part in syntax.operands_of(node)]
    if height > MAX_DEPTH:
        raise too_deep(1)
    return formula


Bounds = tuple[int, int] | None
"""The range of an integer variable; None for a Boolean."""


class FormulaFlaw(Struct, frozen=True):
    """An error in a formula, at a column (from 1). ``unknown``: the undeclared name, if that is the
    error, for a suggestion by the caller."""

    column: int
    found: str
    hint: str = ""
    unknown: str = ""


def check(
    formula: syntax.Formula, declared: Mapping[str, Bounds], *, next_allowed: bool = True
) -> tuple[FormulaFlaw, ...]:
    """Return all errors of the formula by column.

    ``declared`` maps each variable to its range (None: Boolean). ``next_allowed`` is False for
    initial conditions.
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
        case syntax.Constant(value, column) if column:  # as in region = 0 | 1
            yield FormulaFlaw(column, f"the number {value:d} stands alone", "compare it")
        case Operation(Connective.NEXT, (operand,)) if not primes:
            # The column of `next` is not recorded; the first name's is near.
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
