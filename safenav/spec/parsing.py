"""Structured-slugs text read back as a Specification, so that any file can be verified.

The formulas stay text (in infix notation); a comment above a constraint becomes part of its
origin, next to the line number.
"""

from __future__ import annotations

import re

from safenav.errors import Diagnostic, InputError
from safenav.formula.parser import MAX_NUMBER
from safenav.formula.prefix import TooLongError, to_infix
from safenav.lines import HINT, foreign_character
from safenav.spec.specification import Constraint, Origin, Owner, Section, Specification, Variable

_INTEGER = re.compile(r"([A-Za-z_][\w.@]*)\s*:\s*(\d{1,10})\s*\.\.\.\s*(\d{1,10})\Z", re.ASCII)
MOST_EXPANDED, MOST_TIMES = 200_000, 4
"""Most characters that the buffers of a file stand for: this number, and this many times the length
of the file. Published specifications stand for 1.6 times their length at most."""
_SHOWN = 60
"""Characters of a line in a message."""
_BOOLEAN = re.compile(r"[A-Za-z_][\w.@]*\Z", re.ASCII)


def read_specification(text: str, file: str = "-", robot: str = "robot") -> Specification:
    """Return the specification that structured-slugs ``text`` holds.

    Raises InputError with all invalid lines, or the first ambiguous line end (see
    ``safenav.lines``). Formulas are read when they are used.
    """
    if (foreign := foreign_character(text)) is not None:
        at, column, found = foreign
        raise InputError([Diagnostic(file, at, column, f"not text: {found}", HINT)])
    variables: list[Variable] = []
    constraints: list[Constraint] = []
    problems: list[Diagnostic] = []
    section: Owner | Section | None = None
    title = comment = ""
    left = MOST_EXPANDED + MOST_TIMES * len(text)  # characters of formulas in infix notation
    for number, raw in enumerate(text.split("\n"), 1):
        line = raw.strip(" \t\r")
        if not line:
            comment = ""
        elif line.startswith("#"):
            comment = line.lstrip("# ")
            title = title or comment
        elif line.startswith("[") and not line.startswith("[]"):
            section, comment = _section(line), ""
            if section is None:
                hint = "sections: " + " ".join(f"[{s}]" for s in (*Owner, *Section))
                problems.append(Diagnostic(file, number, 1, f"unknown section {line}", hint))
        elif isinstance(section, Owner):
            variable = _variable(line, section, comment)
            if variable is None:
                hint = f"write a name, or name:min...max with min <= max <= {MAX_NUMBER}"
                problems.append(Diagnostic(file, number, 1, f"'{line}' declares nothing", hint))
            elif any(v.name == variable.name for v in variables):
                problems.append(Diagnostic(file, number, 1, f"{variable.name} is declared twice"))
            else:
                variables.append(variable)
            comment = ""
        elif section is not None:
            try:
                formula = to_infix(line, left)
            except TooLongError as error:
                hint = "write each entry on a line of its own, for an output that holds its value"
                problems.append(Diagnostic(file, number, 1, str(error), hint))
                continue
            left -= len(formula) - len(line)
            constraints.append(Constraint(section, formula, Origin(f"{file}:{number}", comment)))
        elif not problems:
            hint = "a specification begins with a section, such as [INPUT]"
            found = f"'{line[:_SHOWN]}' is in no section"
            problems.append(Diagnostic(file, number, 1, found, hint))
    if problems:
        raise InputError(problems)
    # A strategy counts inputs before outputs, whatever the order of the sections.
    ordered = sorted(variables, key=lambda v: list(Owner).index(v.owner))
    return Specification(robot, title or file, tuple(ordered), tuple(constraints))


def _section(line: str) -> Owner | Section | None:
    name = line.strip("[]").strip()
    if name in set(Owner):
        return Owner(name)
    return Section(name) if name in set(Section) else None


def _variable(line: str, owner: Owner, note: str) -> Variable | None:
    integer = _INTEGER.match(line)
    if integer:
        low, high = int(integer[2]), int(integer[3])
        good = low <= high <= MAX_NUMBER
        return Variable(integer[1], owner, (low, high), note) if good else None
    return Variable(line, owner, None, note) if _BOOLEAN.match(line) else None
