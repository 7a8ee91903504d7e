"""The map as text: two characters per region, robots as labels, obstacles as blocks.

Two robots above each other (one flies) share a region's two characters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from msgspec import Struct, field

from safenav.world.map import Heading, Region, RegionMap

ARROWS = {Heading.NORTH: "^", Heading.EAST: ">", Heading.SOUTH: "v", Heading.WEST: "<"}
WALL = "██"
FREE = " ·"


class Marker(Struct, frozen=True):
    """A robot to draw: its label of one or two characters, its region, and its heading (shown
    beside a label of one character)."""

    letter: str
    region: Region
    heading: Heading | None = None


class MapPicture(Struct, frozen=True):
    """Contents of the map besides the walls. ``closed``: open obstacles by region; ``barred``:
    permanent obstacles by region; ``targets``: regions marked faintly."""

    markers: Sequence[Marker] = ()
    closed: Mapping[Region, str] = field(default_factory=dict)
    barred: Mapping[Region, str] = field(default_factory=dict)
    targets: Collection[Region] = ()


def legend(picture: MapPicture) -> list[str]:
    """Return the meanings of the marks on the map, except those of single robots."""
    lines = [
        f"{_shared(here)} {' and '.join(marker.letter for marker in here)} in one region"
        for here in _by_region(picture).values()
        if len(here) > 1
    ]
    lines += [f"▒▒ {name}" for name in picture.closed.values()]
    lines += [f"XX {name}, blocked" for name in picture.barred.values()]
    return [*lines, " o target of an objective"] if picture.targets else lines


def _by_region(picture: MapPicture) -> dict[Region, list[Marker]]:
    found: dict[Region, list[Marker]] = {}
    for marker in picture.markers:
        found.setdefault(marker.region, []).append(marker)
    return found


def _shared(here: Sequence[Marker]) -> str:
    """Return the two characters of robots that share a region."""
    return "".join(marker.letter[-1] for marker in here)[:2]


def draw(world: RegionMap, picture: MapPicture) -> list[str]:
    """Return the map as lines of text, row 0 first."""
    standing = _by_region(picture)
    cells = [_cell(r, world, picture, standing.get(r, [])) for r in range(world.size)]
    return ["".join(cells[i : i + world.cols]) for i in range(0, world.size, world.cols)]


def _cell(region: Region, world: RegionMap, picture: MapPicture, here: list[Marker]) -> str:
    if len(here) == 1:
        heading, sign = here[0].heading, here[0].letter
        if len(sign) == 2:
            return sign
        return sign + (ARROWS[heading] if heading is not None else " ")
    if here:
        return _shared(here)
    if region in world.walls:
        return WALL
    if region in picture.barred:
        return "XX"
    if region in picture.closed:
        return "▒▒"
    return " o" if region in picture.targets else FREE


def with_names(
    lines: list[str], world: RegionMap, width: int, taken: Callable[[Region], bool]
) -> list[str]:
    """Return a drawing of ``width`` characters for each region, with the names of regions and areas
    in it.

    A name is in the row of its region and covers regions that are not ``taken``: free ones if there
    is room, else also walls. A name without room is left out."""
    middles = {
        name: sorted(area)[(len(area) - 1) // 2] for name, area in world.areas.items() if area
    }
    rows = [list(line) for line in lines]
    written: set[Region] = set()
    for name, region in (*world.names.items(), *middles.items()):
        row, col = world.position(region)
        cells = -(-(len(name) + 1) // width)
        firsts = (col, col + 1, *range(col - 1, col - cells - 1, -1))
        for walls, first in [
            (walls, first) for walls in (frozenset(), world.walls) for first in firsts
        ]:
            covered = [world.region(row, col) for col in range(first, first + cells)]
            inside = first >= 0 and first + cells <= world.cols
            free = all(
                not taken(region)
                and region not in written
                and (region in walls or region not in world.walls)
                for region in covered
            )
            if inside and free:
                written.update(covered)
                begin = first * width
                rows[row][begin : begin + cells * width] = f" {name}".ljust(cells * width)
                break
    return ["".join(row) for row in rows]
