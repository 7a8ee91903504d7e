"""Prints a specification in either input language of slugs, in all the ways it may be written.

The random source chooses among spellings that mean the same: order and repetition of sections,
operator aliases, spaces, superfluous parentheses, memory buffers, prefix lines in infix files.
Parentheses are otherwise the fewest that the precedence of the operators needs (high to low:
unary, &, |, ^, ->, <->), so that a reader with another table gets another game.
"""

from collections.abc import Callable
from dataclasses import replace
from random import Random

from oracle.formula import Atom, Binary, Compare, Constant, Formula, Next, Not, Number, prime
from oracle.specification import SECTIONS, Section, Specification, Variable

_PRECEDENCE = {"<->": 1, "->": 2, "^": 3, "|": 4, "&": 5}
_SPELLINGS = {
    "&": ("&", "&&", "/\\"),
    "|": ("|", "||", "\\/"),
    "^": ("^",),
    "->": ("->", "-->"),
    "<->": ("<->", "<-->"),
}
_Printer = Callable[[Formula], str]


def inputs_first(specification: Specification) -> Specification:
    """The same with the declaration order that a structuredslugs file always has."""
    ordered = sorted(specification.variables, key=lambda variable: variable.owner != "input")
    return replace(specification, variables=tuple(ordered))


def to_slugsin(specification: Specification, source: Random) -> str:
    """Prefix notation; only for specifications without integers."""
    return _render(
        specification,
        source,
        _runs(specification.variables),
        lambda formula: prefix(formula, source),
    )


def to_structuredslugs(specification: Specification, source: Random) -> str:
    """Infix notation; `specification` must declare its inputs first."""
    inputs = [v for v in specification.variables if v.owner == "input"]
    outputs = [v for v in specification.variables if v.owner == "output"]
    outputs_first = source.random() < 0.3 and any(
        specification.section(section) for section in SECTIONS
    )

    def line(formula: Formula) -> str:
        if outputs_first:  # parentheses tell the language, and with it the order of variables
            return f"({infix(formula, source)})"
        if not _has_integers(formula) and source.random() < 0.1:
            return prefix(formula, source, buffers=False)
        return infix(formula, source)

    runs = [outputs, inputs] if outputs_first else [inputs, outputs]
    return _render(specification, source, [run for run in runs if run], line)


def to_plain(spec: Specification, source: Random) -> tuple[str, dict[int, tuple[Section, Formula]]]:
    """Structured slugs in infix notation, and the formula in each line."""
    lines = list[str]()
    places = dict[int, tuple[Section, Formula]]()
    for owner in ("input", "output"):
        lines.append(f"[{owner.upper()}]")
        for variable in spec.variables:
            if variable.owner == owner:
                bounds = variable.range and f":{variable.range[0]}...{variable.range[1]}"
                lines.append(f"{variable.name}{bounds or ''}")
    for section in SECTIONS:
        lines.append(f"[{section.upper()}]")
        for formula in spec.section(section):
            lines.append(infix(formula, source))
            places[len(lines)] = section, formula
    return "\n".join(lines) + "\n", places


def prefix(formula: Formula, source: Random, buffers: bool = True) -> str:
    """One line of slugsin."""
    if buffers and source.random() < 0.25:
        repeated = _repeated(formula)
        if repeated is not None:
            entry = prefix(repeated, source)
            return f"$ 2 {entry} {_prefix(formula, source, repeated)}"
    return _prefix(formula, source, None)


def _prefix(formula: Formula, source: Random, recalled: Formula | None) -> str:
    if formula == recalled:
        return "? 0"
    match formula:
        case Constant(value):
            return "1" if value else "0"
        case Atom(name, primed):
            return f"{name}'" if primed else name
        case Not(operand):
            return f"! {_prefix(operand, source, recalled)}"
        case Binary(op, left, right):
            a = _prefix(left, source, recalled)
            b = _prefix(right, source, recalled)
            if op == "->":
                return f"| ! {a} {b}"
            return f"! ^ {a} {b}" if op == "<->" else f"{op} {a} {b}"
        case Next(operand):
            return _prefix(prime(operand), source, recalled)
        case Compare():
            raise ValueError("slugsin has no integers")


def infix(formula: Formula, source: Random, context: int = 0) -> str:
    """One line of structuredslugs, for a place that needs at least precedence `context`."""
    match formula:
        case Constant(value):
            return "TRUE" if value else "FALSE"
        case Atom(name, primed):
            return f"{name}'" if primed else name
        case Not(operand):
            sign = source.choice(("!", "! ", "~"))
            if isinstance(operand, Compare):
                return f"{sign}({infix(operand, source)})"
            return f"{sign}{infix(operand, source, 6)}"
        case Binary(op, left, right):
            level = _PRECEDENCE[op]
            text = (
                f"{infix(left, source, level)} {source.choice(_SPELLINGS[op])} "
                f"{infix(right, source, level + 1)}"
            )
            needed = level < context or source.random() < 0.1
            return f"({text})" if needed else text
        case Next(operand):
            return f"{source.choice(('next', 'X'))}({infix(operand, source)})"
        case Compare(relation, left, right):
            space = source.choice(("", " "))
            return f"{_sum(left, source)}{space}{relation}{space}{_sum(right, source)}"


def _sum(numbers: tuple[Number, ...], source: Random) -> str:
    plus = source.choice(("+", " + "))
    return plus.join(
        f"{number.value}'" if number.primed else str(number.value) for number in numbers
    )


def _repeated(formula: Formula) -> Formula | None:
    """A sub-formula that occurs twice and is worth a buffer entry."""
    seen: set[Formula] = set()
    pending = [formula]
    while pending:
        here = pending.pop()
        if here in seen and not isinstance(here, Constant):
            return here
        seen.add(here)
        match here:
            case Not(operand):
                pending.append(operand)
            case Binary(_, left, right):
                pending += [left, right]
            case _:
                pass
    return None


def _has_integers(formula: Formula) -> bool:
    match formula:
        case Compare():
            return True
        case Not(operand) | Next(operand):
            return _has_integers(operand)
        case Binary(_, left, right):
            return _has_integers(left) or _has_integers(right)
        case _:
            return False


def _runs(variables: tuple[Variable, ...]) -> list[list[Variable]]:
    """Consecutive variables of one owner: each run becomes a section."""
    runs: list[list[Variable]] = []
    for variable in variables:
        if runs and runs[-1][0].owner == variable.owner:
            runs[-1].append(variable)
        else:
            runs.append([variable])
    return runs


def _render(
    specification: Specification,
    source: Random,
    declarations: list[list[Variable]],
    line: _Printer,
) -> str:
    parts: dict[str, list[list[str]]] = {}
    for section in SECTIONS:
        lines = [line(formula) for formula in specification.section(section)]
        cut = source.randrange(len(lines) + 1) if source.random() < 0.2 else len(lines)
        parts[section.upper()] = [part for part in (lines[:cut], lines[cut:]) if part]
        if not lines and source.random() < 0.3:
            parts[section.upper()].append([])
    headers = [header for header, pieces in parts.items() for _ in pieces]
    if source.random() < 0.3:
        source.shuffle(headers)  # the parts of one section keep their order: goals are numbered
    blocks = [(header, parts[header].pop(0)) for header in headers]
    declared = [(run[0].owner.upper(), [_declare(v, source) for v in run]) for run in declarations]
    if not declared:
        declared = [("INPUT", []), ("OUTPUT", [])]
    text = []
    for header, lines in declared + blocks:
        text.append(f"[{header}]")
        if source.random() < 0.1:
            text.append("# a comment: not & a line")
        text += [*lines, *([""] if source.random() < 0.8 else [])]
    return "\n".join(text) + "\n"


def _declare(variable: Variable, source: Random) -> str:
    if variable.range is None:
        return variable.name
    colon = source.choice((":", ": "))
    return f"{variable.name}{colon}{variable.range[0]}...{variable.range[1]}"
