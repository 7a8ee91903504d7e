"""One robot's GR(1) specification: variables, constraints with their origin, and its text.

The text is structured slugs, one constraint per line, and reads like documentation: sections in a
fixed order, constraints under a comment with their origin.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from msgspec import Struct
from msgspec.structs import replace


class Owner(StrEnum):
    INPUT = "INPUT"
    OUTPUT = "OUTPUT"


class Section(StrEnum):
    """The six constraint sections, in the order in which they are printed."""

    ENV_INIT = "ENV_INIT"
    SYS_INIT = "SYS_INIT"
    ENV_TRANS = "ENV_TRANS"
    SYS_TRANS = "SYS_TRANS"
    ENV_LIVENESS = "ENV_LIVENESS"
    SYS_LIVENESS = "SYS_LIVENESS"


class Variable(Struct, frozen=True):
    """A Boolean (``bounds`` is None) or an integer within ``bounds`` (min, max inclusive)."""

    name: str
    owner: Owner
    bounds: tuple[int, int] | None = None
    note: str = ""

    @property
    def range(self) -> range:
        """All its values, ascending."""
        low, high = self.bounds or (0, 1)
        return range(low, high + 1)

    @property
    def declaration(self) -> str:
        if self.bounds is None:
            return self.name
        low, high = self.bounds
        return f"{self.name}:{low}...{high}"


class Origin(Struct, frozen=True):
    """Origin of a constraint.

    ``item``: the scenario item in dotted form (``map``, ``robots.digit.objective``,
    ``obstacles.door@47``). ``rule``: its meaning in words. ``source``: paper or design section.
    Constraints of one item and rule are printed under one comment.
    """

    item: str
    rule: str
    source: str = ""

    def __str__(self) -> str:
        rule = f": {self.rule}" if self.rule else ""
        return f"{self.item}{rule}" + (f" ({self.source})" if self.source else "")


class Constraint(Struct, frozen=True):
    """One line of a section. ``formula`` is structured-slugs text without line breaks;
    ``regions`` are those that it is about (walls, targets), for explanations."""

    section: Section
    formula: str
    origin: Origin
    regions: tuple[int, ...] = ()


class Specification(Struct, frozen=True):
    """A robot's specification. Variables and constraints keep their order: with the same
    order the synthesizer gives the same strategy to the byte."""

    robot: str
    title: str
    variables: tuple[Variable, ...]
    constraints: tuple[Constraint, ...]

    def section(self, section: Section) -> tuple[Constraint, ...]:
        return tuple(c for c in self.constraints if c.section is section)

    def owned(self, owner: Owner) -> tuple[Variable, ...]:
        return tuple(v for v in self.variables if v.owner is owner)

    def without(self, dropped: Iterable[Constraint]) -> Specification:
        """Return the specification without some constraints (for explanations)."""
        gone = set(dropped)
        left = tuple(c for c in self.constraints if c not in gone)
        return replace(self, constraints=left)

    def with_more(self, *more: Constraint) -> Specification:
        """Return the specification with further constraints."""
        return replace(self, constraints=(*self.constraints, *more))

    def to_structuredslugs(self) -> str:
        """Return the specification as structured-slugs text, ending in a newline."""
        lines = [f"# {self.title}", ""]
        for owner in Owner:
            lines.append(f"[{owner}]")
            for variable in self.owned(owner):
                if variable.note:
                    lines.append(f"# {variable.note}")
                lines.append(variable.declaration)
            lines.append("")
        for section in Section:
            lines.append(f"[{section}]")
            last: Origin | None = None
            for constraint in self.section(section):
                if constraint.origin != last:
                    lines.append(f"# {constraint.origin}")
                    last = constraint.origin
                lines.append(constraint.formula)
            lines.append("")
        return "\n".join(lines).rstrip("\n") + "\n"
