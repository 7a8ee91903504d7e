"""Prints a specification in either input language of slugs, in all the ways it may be written; and
reads slugsin, so that published files can be played by the oracle as they stand, and the formulas
that safenav prints.

The random source chooses among spellings that mean the same: order and repetition of sections,
operator aliases, spaces, superfluous parentheses, memory buffers, prefix lines in infix files.
Parentheses are otherwise the fewest that the precedence of the operators needs (high to low:
unary, &, |, ^, ->, <->), so that a reader with another table gets another game.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import groupby
from random import Random

from oracle.specification import (
    SECTIONS,
    Atom,
    Compare,
    Constant,
    Formula,
    Number,
    Operation,
    Section,
    Specification,
    Variable,
    apply,
    has_integers,
    parts,
    prime,
)

_PRECEDENCE = {"<->": 1, "->": 2, "^": 3, "|": 4, "&": 5}
_SPELLINGS = {
    "&": ("&", "&&", "/\\"),
    "|": ("|", "||", "\\/"),
    "^": ("^",),
    "->": ("->", "-->"),
    "<->": ("<->", "<-->"),
}
_PREFIX = {"->": "| !", "<->": "! ^"}


def inputs_first(specification: Specification) -> Specification:
    """The same with the declaration order that a structuredslugs file always has."""
    ordered = sorted(specification.variables, key=lambda variable: variable.owner != "input")
    return replace(specification, variables=tuple(ordered))


def to_slugsin(specification: Specification, source: Random) -> str:
    """Prefix notation; only for specifications without integers."""
    runs = [[*run] for _, run in groupby(specification.variables, lambda v: v.owner)]
    return _render(specification, source, runs, lambda formula: prefix(formula, source))


def to_structuredslugs(specification: Specification, source: Random) -> str:
    """Infix notation; `specification` must declare its inputs first."""
    formulas = any(specification.section(section) for section in SECTIONS)
    outputs_first = source.random() < 0.3 and formulas

    def line(formula: Formula) -> str:
        if outputs_first:  # parentheses tell the language, and with it the order of variables
            return f"({infix(formula, source)})"
        if not has_integers(formula) and source.random() < 0.1:
            return prefix(formula, source, buffers=False)
        return infix(formula, source)

    runs = [[*run] for _, run in groupby(specification.variables, lambda v: v.owner)]
    return _render(specification, source, runs[::-1] if outputs_first else runs, line)


def to_plain(spec: Specification, source: Random) -> tuple[str, dict[int, tuple[Section, Formula]]]:
    """Structured slugs in infix notation, and the formula in each line."""
    lines = list[str]()
    places = dict[int, tuple[Section, Formula]]()
    for owner in ("input", "output"):
        lines.append(f"[{owner.upper()}]")
        lines += [_declared(v, ":") for v in spec.variables if v.owner == owner]
    for section in SECTIONS:
        lines.append(f"[{section.upper()}]")
        for formula in spec.section(section):
            lines.append(infix(formula, source))
            places[len(lines)] = section, formula
    return "\n".join(lines) + "\n", places


def prefix(formula: Formula, source: Random, buffers: bool = True) -> str:
    """One line of slugsin. A formula that occurs twice may become an entry of a buffer."""
    if buffers and source.random() < 0.25:
        found = [part for part in parts(formula) if not isinstance(part, Constant)]
        repeated = next((part for k, part in enumerate(found) if part in found[:k]), None)
        if repeated is not None:
            return f"$ 2 {prefix(repeated, source)} {_prefix(formula, repeated)}"
    return _prefix(formula, None)


def _prefix(formula: Formula, recalled: Formula | None) -> str:
    if formula == recalled:
        return "? 0"
    match formula:
        case Constant(value):
            return "1" if value else "0"
        case Atom(name, primed):
            return f"{name}'" if primed else name
        case Operation("next", (operand,)):
            return _prefix(prime(operand), recalled)
        case Operation(operator, operands):
            written = (_prefix(operand, recalled) for operand in operands)
            return " ".join([_PREFIX.get(operator, operator), *written])
        case Compare():
            raise ValueError("slugsin has no integers")


def infix(formula: Formula, source: Random, context: int = 0) -> str:
    """One line of structuredslugs, for a place that needs at least precedence `context`."""
    match formula:
        case Constant(value):
            return "TRUE" if value else "FALSE"
        case Atom(name, primed):
            return f"{name}'" if primed else name
        case Compare(relation, left, right):
            space = source.choice(("", " "))
            return f"{_sum(left, source)}{space}{relation}{space}{_sum(right, source)}"
        case Operation("!", (Compare() as operand,)):
            return f"{source.choice(('!', '! ', '~'))}({infix(operand, source)})"
        case Operation("!", (operand,)):
            return f"{source.choice(('!', '! ', '~'))}{infix(operand, source, 6)}"
        case Operation("next", (operand,)):
            return f"{source.choice(('next', 'X'))}({infix(operand, source)})"
        case Operation(operator, (left, right)):
            level = _PRECEDENCE[operator]
            spelling = source.choice(_SPELLINGS[operator])
            text = f"{infix(left, source, level)} {spelling} {infix(right, source, level + 1)}"
            return f"({text})" if level < context or source.random() < 0.1 else text
    raise AssertionError(formula)


def _sum(numbers: tuple[Number, ...], source: Random) -> str:
    plus = source.choice(("+", " + "))
    return plus.join(
        f"{number.value}'" if number.primed else f"{number.value}" for number in numbers
    )


def _render(
    specification: Specification,
    source: Random,
    declarations: list[list[Variable]],
    line: Callable[[Formula], str],
) -> str:
    pieces: dict[str, list[list[str]]] = {}
    for section in SECTIONS:
        lines = [line(formula) for formula in specification.section(section)]
        cut = source.randrange(len(lines) + 1) if source.random() < 0.2 else len(lines)
        pieces[section.upper()] = [piece for piece in (lines[:cut], lines[cut:]) if piece]
        if not lines and source.random() < 0.3:
            pieces[section.upper()].append([])
    headers = [header for header, several in pieces.items() for _ in several]
    if source.random() < 0.3:
        source.shuffle(headers)  # the parts of one section keep their order: goals are numbered
    blocks = [
        (run[0].owner.upper(), [_declared(v, source.choice((":", ": "))) for v in run])
        for run in declarations
    ] or [("INPUT", []), ("OUTPUT", [])]
    blocks += [(header, pieces[header].pop(0)) for header in headers]
    text = []
    for header, lines in blocks:
        text.append(f"[{header}]")
        if source.random() < 0.1:
            text.append("# a comment: not & a line")
        text += [*lines, *([""] if source.random() < 0.8 else [])]
    return "\n".join(text) + "\n"


def _declared(variable: Variable, colon: str) -> str:
    if variable.range is None:
        return variable.name
    return f"{variable.name}{colon}{variable.range[0]}...{variable.range[1]}"


def read_slugsin(text: str) -> Specification:
    """Parse a well-formed file; buffer entries become shared sub-formulas.

    Raises ValueError or LookupError for a text that is not slugsin.
    """
    variables: list[Variable] = []
    formulas: dict[Section, list[Formula]] = {section: [] for section in SECTIONS}
    header = ""
    for raw in text.splitlines():
        line = raw.strip()
        if line.startswith("["):
            header = line.strip("[]").lower()
        elif line and not line.startswith("#"):
            if header in ("input", "output"):
                variables.append(Variable(line, header))
            else:
                tokens = iter(line.split())
                formulas[header].append(_formula(tokens, []))
                if rest := list(tokens):
                    raise ValueError(f"stray text: {rest}")
    return Specification(tuple(variables), **{name: tuple(f) for name, f in formulas.items()})


def _formula(tokens: Iterator[str], buffer: list[Formula]) -> Formula:
    token = next(tokens, None)
    match token:
        case None:
            raise ValueError("the formula ends too early")
        case "0" | "1":
            return Constant(token == "1")
        case "!" | "&" | "|" | "^":
            count = 1 if token == "!" else 2
            return apply(token, *(_formula(tokens, buffer) for _ in range(count)))
        case "$":
            entries: list[Formula] = []
            for _ in range(int(next(tokens))):
                entries.append(_formula(tokens, entries))
            return entries[-1]
        case "?":
            return buffer[int(next(tokens))]
    return Atom(token.removesuffix("'"), token.endswith("'"))


_TOKENS = re.compile(r"<--?>|--?>|&&|\|\||/\\|\\/|[<>!]=|[\w@.]+'?|\S")
_SIGNS = {spelling: sign for sign, several in _SPELLINGS.items() for spelling in several}
_SIGNS |= {"~": "!", "X": "next"}
_RELATIONS = ("=", "!=", "<", "<=", ">", ">=")


def read_infix(text: str) -> Formula:
    """Parse a formula of structured slugs, of which no variable is named X."""
    tokens = [_SIGNS.get(token, token) for token in reversed(_TOKENS.findall(text))]

    def after(token: str) -> bool:
        return bool(tokens) and tokens[-1] == token and bool(tokens.pop())

    def joined(least: int) -> Formula:
        left = single()
        while tokens and (level := _PRECEDENCE.get(tokens[-1], 0)) >= least:
            operator = tokens.pop()
            left = apply(operator, left, joined(level + 1))
        return left

    def single() -> Formula:
        if after("!"):
            return apply("!", single())
        if after("next"):
            return apply("next", single())
        if after("("):
            inner = joined(1)
            assert after(")"), text
            return inner
        first = added()
        if tokens and tokens[-1] in _RELATIONS:
            return Compare(tokens.pop(), first, added())
        (only,) = first
        word = str(only.value)
        return Constant(word == "TRUE") if word in ("TRUE", "FALSE") else Atom(word, only.primed)

    def added() -> tuple[Number, ...]:
        word = tokens.pop()
        name = word.removesuffix("'")
        number = Number(int(name) if name.isdigit() else name, name != word)
        return (number, *(added() if after("+") else ()))

    whole = joined(1)
    assert not tokens, text
    return whole


Values = Mapping[str, int]
Truth = Callable[[Values, Values], bool]
"""Whether a formula holds now; the second values are those after the step."""
_PYTHON = {"!": "not {}", "<->": "{} == {}", "->": "not {} or {}", "^": "{} != {}"}
_PYTHON |= {"|": "{} or {}", "&": "{} and {}"}


def truth(formula: Formula | str) -> Truth:
    """Return a formula, or its text in structured slugs, as a function."""
    whole = read_infix(formula) if isinstance(formula, str) else formula
    found: Truth = eval(f"lambda now, then: bool({_python(whole)})")
    return found


def _python(formula: Formula) -> str:
    def number(each: Number) -> str:
        return _name(each.value, each.primed) if isinstance(each.value, str) else str(each.value)

    match formula:
        case Constant(value):
            return str(value)
        case Atom(name, primed):
            return f"bool({_name(name, primed)})"
        case Compare(relation, first, second):
            left, right = (" + ".join(map(number, side)) for side in (first, second))
            return f"({left} {'==' if relation == '=' else relation} {right})"
        case Operation("next", (operand,)):
            return _python(prime(operand))
    return f"({_PYTHON[formula.operator].format(*map(_python, formula.operands))})"


def _name(name: str, primed: bool) -> str:
    return f"{'then' if primed else 'now'}[{name!r}]"
