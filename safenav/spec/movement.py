"""Moves of a robot: the map and a mobility as guarantees or assumptions.

One constraint per move direction or run of walls, not per pair of positions: the text stays short,
and the synthesizer shares adders and comparisons.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from safenav.spec.specification import Constraint, Origin, Section
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.poses import Pose

SOURCE_MAP = "paper, eq. (1)"
SOURCE_MOBILITY = "paper, Section VI"


def one_of(variable: str, regions: Iterable[Region], prime: str = "") -> str:
    """``variable`` is in one of the regions, as a formula that binds like an atom."""
    atoms = [f"{variable}{prime} = {region:d}" for region in sorted(regions)]
    if not atoms:
        return "FALSE"
    return atoms[0] if len(atoms) == 1 else "(" + " | ".join(atoms) + ")"


def among(poses: Collection[Pose], mark: str = "") -> str:
    """Return the condition that the robot is in one of the poses, as a formula that binds like an
    atom; ``mark``: suffix of the variables."""
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
    """Return the atom for one step of ``variable`` in that direction (ignoring edges)."""
    offset = world.cols if heading in (Heading.NORTH, Heading.SOUTH) else 1
    if heading in (Heading.NORTH, Heading.WEST):
        return f"{variable} = {variable}' + {offset}"
    return f"{variable}' = {variable} + {offset}"


def headings(world: RegionMap) -> tuple[Heading, ...]:
    """Return the directions in which the map has any extent (a 1 x n map has no north)."""
    vertical = (Heading.NORTH, Heading.SOUTH) if world.rows > 1 else ()
    sideways = (Heading.EAST, Heading.WEST) if world.cols > 1 else ()
    return tuple(h for h in Heading if h in vertical or h in sideways)


def stepping(variable: str, section: Section, world: RegionMap, item: str) -> Iterator[Constraint]:
    """Stay or step to a 4-neighbour on the map; never around the map's edge."""
    origin = Origin(item, "stay, or step to a neighbouring region", SOURCE_MOBILITY)
    atoms = [f"{variable}' = {variable}"]
    atoms += [step_formula(variable, heading, world) for heading in headings(world)]
    yield Constraint(section, " | ".join(atoms), origin)
    if world.cols == 1:
        return
    for heading in (Heading.EAST, Heading.WEST):
        if open_edge := wrapping(heading, world):
            origin = Origin(item, f"no step {heading.label} from the map's edge", SOURCE_MOBILITY)
            step = step_formula(variable, heading, world)
            yield Constraint(section, f"{one_of(variable, open_edge)} -> !({step})", origin)


def wrapping(heading: Heading, world: RegionMap) -> list[Region]:
    """Return the regions at the eastern or western edge whose next number in that direction is a
    free region across the edge."""
    column, on = (world.cols - 1, 1) if heading is Heading.EAST else (0, -1)
    edge = (world.region(row, column) for row in range(world.rows))
    return [region for region in edge if world.is_free(region) and world.is_free(region + on)]


def walls(variable: str, section: Section, world: RegionMap, item: str) -> Iterator[Constraint]:
    """Walls are never entered: one constraint for each run of walls within a row."""
    origin = Origin(item, "walls are never entered", SOURCE_MAP)
    for first, last in _runs(world):
        if first == last:
            formula = f"{variable}' != {first}"
        elif first == 0:
            formula = f"{variable}' > {last}"
        elif last == world.size - 1:
            formula = f"{variable}' < {first}"
        else:
            formula = f"{variable}' < {first} | {variable}' > {last}"
        yield Constraint(section, formula, origin, tuple(range(first, last + 1)))


def _runs(world: RegionMap) -> Iterator[tuple[Region, Region]]:
    """Maximal runs of consecutive walls within one row, as (first, last)."""
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
    """Heading mobility: staying keeps the heading, a step sets it, and never backwards."""
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
