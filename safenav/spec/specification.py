"""A robot's GR(1) specification: variables, constraints with their origins, and its text.

The text is structured slugs, one constraint per line, and reads like documentation: sections in a
fixed order, constraints under a comment with their origin. A reader makes any such file verifiable:
the formulas stay text (in infix notation), and a comment above a constraint becomes part of its
origin, next to the line number.

Moves on a map take one constraint per direction or run of walls, not per pair of positions. So the
text stays short, and the synthesizer shares adders and comparisons.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from enum import StrEnum
from functools import lru_cache
from pathlib import PurePath

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, UsageError
from safenav.files import HINT, foreign_character
from safenav.formula.parser import MAX_NUMBER, FormulaError, parse
from safenav.formula.syntax import Formula, one_of
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.poses import Pose


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
    """A variable: Boolean if ``bounds`` is None, else an integer within ``bounds`` (inclusive)."""

    name: str
    owner: Owner
    bounds: tuple[int, int] | None = None
    note: str = ""

    @property
    def range(self) -> range:
        """All values of the variable in ascending order."""
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
    """One line of a section. ``formula`` is structured-slugs text without line breaks; ``regions``:
    the constrained regions (walls, targets), for explanations."""

    section: Section
    formula: str
    origin: Origin
    regions: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if not (isinstance(self.section, Section) and isinstance(self.formula, str)):
            found = f"{type(self.section).__name__} and {type(self.formula).__name__}"
            raise UsageError(f"a Constraint takes a Section and a formula, not {found}")


@lru_cache(maxsize=1 << 15)
def formula_of(constraint: Constraint) -> Formula:
    """Return the parsed formula of a constraint. Raises InputError if it cannot be read."""
    try:
        return parse(constraint.formula)
    except FormulaError as error:
        raise unreadable(constraint, error.found, error.column, error.hint) from error


def unreadable(constraint: Constraint, found: str, column: int = 1, hint: str = "") -> InputError:
    """Return the error for a constraint that cannot be read, at its line if it is from a file."""
    file, _, line = constraint.origin.item.rpartition(":")
    if line.isdecimal():
        return InputError([Diagnostic(file, int(line), column, found, hint, constraint.formula)])
    place = f"{constraint.origin.item}: [{constraint.section}] {constraint.formula}"
    return InputError([Diagnostic(place, 1, column, found, hint)])


class Specification(Struct, frozen=True):
    """A robot's specification. The order of variables and constraints matters: the same order gives
    the same strategy, byte for byte."""

    robot: str
    title: str
    variables: tuple[Variable, ...]
    constraints: tuple[Constraint, ...]

    def section(self, section: Section) -> tuple[Constraint, ...]:
        return tuple(c for c in self.constraints if c.section is section)

    def owned(self, owner: Owner) -> tuple[Variable, ...]:
        return tuple(v for v in self.variables if v.owner is owner)

    def without(self, dropped: Iterable[Constraint]) -> Specification:
        """Return the specification without these constraints (for explanations)."""
        gone = set(dropped)
        left = tuple(c for c in self.constraints if c not in gone)
        return replace(self, constraints=left)

    def with_more(self, *more: Constraint) -> Specification:
        """Return the specification with further constraints."""
        return replace(self, constraints=(*self.constraints, *more))

    def to_structuredslugs(self) -> str:
        """Return the specification as structured-slugs text that ends in a newline."""
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


_INTEGER = re.compile(r"([A-Za-z_][\w.@]*)\s*:\s*(\d{1,10})\s*\.\.\.\s*(\d{1,10})\Z", re.ASCII)
MOST_EXPANDED, MOST_TIMES = 200_000, 16
"""Limit of the characters to which the buffers of a file expand: this number plus this many times
the file's length. Published specifications expand to at most 18 times their length."""
_SHOWN = 60
"""Characters of a line in a message."""
_SECTIONS: Mapping[str, Owner | Section] = {s.value: s for s in (*Owner, *Section)}
_VARIABLES = f"in [INPUT] or [OUTPUT], a name, or name:min...max with min <= max <= {MAX_NUMBER}"
_BOOLEAN = re.compile(r"[A-Za-z_][\w.@]*\Z", re.ASCII)


def read_specification(text: str, file: str = "-", robot: str = "robot") -> Specification:
    """Return the specification in structured-slugs ``text``.

    Raises InputError with the first invalid line or the first ambiguous line end (see
    ``safenav.files``). (safenav's synthesizer, which reads files first, reports all invalid lines.)
    Formulas are read when they are used.
    """

    def flaw(line: int, found: str, hint: str, column: int = 1) -> InputError:
        return InputError([Diagnostic(file, line, column, found, hint)])

    if (foreign := foreign_character(text)) is not None:
        raise flaw(foreign[0], f"not text: {foreign[2]}", HINT, foreign[1])
    from safenav.formula.prefix import to_infix  # only for users' files

    variables: dict[str, Variable] = {}
    constraints: list[Constraint] = []
    section: Owner | Section | None = None
    title = comment = ""
    left = MOST_EXPANDED + MOST_TIMES * len(text)  # limit of characters in infix notation
    for number, raw in enumerate(text.split("\n"), 1):
        line = raw.strip(" \t\r")
        if not line:
            comment = ""
        elif line.startswith("#"):
            comment = line.lstrip("# ")
            title = title or (comment if section is None else "")
        elif line.startswith("[") and not line.startswith("[]"):
            section, comment = _SECTIONS.get(line.strip("[]").strip()), ""
            if section is None:
                known = " ".join(f"[{name}]" for name in _SECTIONS)
                raise flaw(number, f"unknown section {line}", f"sections: {known}")
        elif isinstance(section, Section):
            try:
                formula = to_infix(line, left)
            except FormulaError as error:
                raise flaw(number, error.found, error.hint) from None
            left -= len(formula) - len(line)
            constraints.append(Constraint(section, formula, Origin(f"{file}:{number}", comment)))
        else:
            if line.partition(":")[0].strip() in ("TRUE", "FALSE"):
                raise flaw(number, f"'{line}' is a constant, not a variable", "choose another name")
            variable = None if section is None else _variable(line, section, comment)
            if variable is None or variable.name in variables:
                raise flaw(number, f"'{line[:_SHOWN]}' declares no new variable", _VARIABLES)
            variables[variable.name], comment = variable, ""
    # A strategy numbers inputs before outputs, for any order of the sections.
    ordered = sorted(variables.values(), key=lambda v: list(Owner).index(v.owner))
    title = title or PurePath(file).name
    return Specification(robot, title, tuple(ordered), tuple(constraints))


def _variable(line: str, owner: Owner, note: str) -> Variable | None:
    integer = _INTEGER.match(line)
    if integer:
        low, high = int(integer[2]), int(integer[3])
        good = low <= high <= MAX_NUMBER
        return Variable(integer[1], owner, (low, high), note) if good else None
    return Variable(line, owner, None, note) if _BOOLEAN.match(line) else None


SOURCE_MAP = "paper, eq. (1)"
SOURCE_MOBILITY = "paper, Section VI"


def among(poses: Collection[Pose], mark: str = "") -> str:
    """Return a formula, which binds like an atom: the robot is in one of the poses. ``mark``: the
    suffix of its variables."""
    regions: dict[Heading | None, set[Region]] = {}
    for pose in poses:
        regions.setdefault(pose.heading, set()).add(pose.region)
    facings: dict[frozenset[Region], list[Heading]] = {}
    for heading in sorted(heading for heading in regions if heading is not None):
        facings.setdefault(frozenset(regions[heading]), []).append(heading)
    atoms = [one_of("region", regions[None], mark)] if None in regions else []
    for there, facing in facings.items():
        atom = one_of("region", there, mark)
        if len(facing) < len(Heading):
            atom = f"{atom} & {one_of('heading', facing, mark)}"
        atoms.append(f"({atom})")
    return atoms[0] if len(atoms) == 1 else "(" + " | ".join(atoms) + ")"


def step_formula(variable: str, heading: Heading, world: RegionMap) -> str:
    """Return the atom for a step of ``variable`` in a direction. It ignores the map's edges."""
    offset = world.cols if heading in (Heading.NORTH, Heading.SOUTH) else 1
    if heading in (Heading.NORTH, Heading.WEST):
        return f"{variable} = {variable}' + {offset}"
    return f"{variable}' = {variable} + {offset}"


def headings(world: RegionMap) -> tuple[Heading, ...]:
    """Return the directions in which the map has several regions (a 1 x n map has no north)."""
    vertical = (Heading.NORTH, Heading.SOUTH) if world.rows > 1 else ()
    sideways = (Heading.EAST, Heading.WEST) if world.cols > 1 else ()
    return tuple(h for h in Heading if h in vertical or h in sideways)


def stepping(world: RegionMap, item: str) -> Iterator[Constraint]:
    """Yield the constraints of a step: the robot stays or enters a 4-neighbour, and never steps
    around the edge of the map."""
    section = Section.SYS_TRANS
    origin = Origin(item, "stay, or step to a neighbouring region", SOURCE_MOBILITY)
    steps = (step_formula("region", heading, world) for heading in headings(world))
    yield Constraint(section, " | ".join(["region' = region", *steps]), origin)
    if world.cols == 1:
        return
    for heading in (Heading.EAST, Heading.WEST):
        if open_edge := wrapping(heading, world):
            origin = Origin(item, f"no step {heading.label} from the map's edge", SOURCE_MOBILITY)
            step = step_formula("region", heading, world)
            yield Constraint(section, f"{one_of('region', open_edge)} -> !({step})", origin)


def wrapping(heading: Heading, world: RegionMap) -> list[Region]:
    """Return the free regions at the eastern or western edge whose next index, in that direction,
    is a free region at the opposite edge."""
    column, on = (world.cols - 1, 1) if heading is Heading.EAST else (0, -1)
    edge = (world.region(row, column) for row in range(world.rows))
    return [region for region in edge if world.is_free(region) and world.is_free(region + on)]


def walls(world: RegionMap) -> Iterator[Constraint]:
    """Yield the constraints that forbid walls, one for each run of walls in a row."""
    origin = Origin("map", "walls are never entered", SOURCE_MAP)
    for first, last in _runs(world):
        if first == last:
            formula = f"region' != {first}"
        elif first == 0:
            formula = f"region' > {last}"
        elif last == world.size - 1:
            formula = f"region' < {first}"
        else:
            formula = f"region' < {first} | region' > {last}"
        yield Constraint(Section.SYS_TRANS, formula, origin, tuple(range(first, last + 1)))


def _runs(world: RegionMap) -> Iterator[tuple[Region, Region]]:
    """Yield the maximal runs of consecutive walls in a row, as pairs (first, last)."""
    for row in range(world.rows):
        first: Region | None = None
        for region in range(world.region(row, 0), world.region(row, world.cols)):
            if region in world.walls:
                first = region if first is None else first
            elif first is not None:
                yield first, region - 1
                first = None
        if first is not None:
            yield first, world.region(row, world.cols - 1)


def heading_rules(world: RegionMap, item: str) -> Iterator[Constraint]:
    """Yield the constraints of heading mobility: a stay keeps the heading, and a step sets it and
    never leads backwards."""
    section = Section.SYS_TRANS
    origin = Origin(item, "staying keeps the heading", SOURCE_MOBILITY)
    yield Constraint(section, "region' = region -> heading' = heading", origin)
    origin = Origin(
        item,
        "a step faces its direction and never goes backwards (0 north, 1 east, 2 south, 3 west)",
        SOURCE_MOBILITY,
    )
    for heading in headings(world):
        step = step_formula("region", heading, world)
        formula = f"{step} -> heading' = {heading:d} & heading != {heading.opposite:d}"
        yield Constraint(section, formula, origin)
