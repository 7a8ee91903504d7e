"""A small reader of slugsin, so that published files can be played by the oracle as they stand."""

from collections.abc import Iterator

from oracle.formula import Atom, Binary, Constant, Formula, Not
from oracle.specification import SECTIONS, Section, Specification, Variable


def read_slugsin(text: str) -> Specification:
    """Parse a well-formed file; buffer entries become shared sub-formulas.

    Raises ValueError for a text that is not slugsin.
    """
    variables: list[Variable] = []
    formulas: dict[Section, list[Formula]] = {section: [] for section in SECTIONS}
    headers = {f"[{section.upper()}]": section for section in SECTIONS}
    header = ""
    for raw in text.splitlines():
        line = raw.strip()
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            header = line
        elif header == "[INPUT]":
            variables.append(Variable(line, "input"))
        elif header == "[OUTPUT]":
            variables.append(Variable(line, "output"))
        else:
            formulas[headers[header]].append(read_prefix(line))
    return Specification(
        tuple(variables), **{section: tuple(lines) for section, lines in formulas.items()}
    )


def read_prefix(line: str) -> Formula:
    """Parse one formula in prefix notation."""
    tokens = iter(line.split())
    formula = _formula(tokens, [])
    rest = list(tokens)
    if rest:
        raise ValueError(f"stray text: {rest}")
    return formula


def _formula(tokens: Iterator[str], buffer: list[Formula]) -> Formula:
    token = next(tokens, None)
    match token:
        case None:
            raise ValueError("the formula ends too early")
        case "0" | "1":
            return Constant(token == "1")
        case "!":
            return Not(_formula(tokens, buffer))
        case "&" | "|" | "^":
            left = _formula(tokens, buffer)
            return Binary(token, left, _formula(tokens, buffer))
        case "$":
            entries: list[Formula] = []
            for _ in range(int(next(tokens))):
                entries.append(_formula(tokens, entries))
            return entries[-1]
        case "?":
            return buffer[int(next(tokens))]
        case _:
            return Atom(token.removesuffix("'"), token.endswith("'"))
