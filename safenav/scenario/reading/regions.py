"""Regions and targets as a scenario writes them (``47``, ``[3, 8]``, a name, ``{any: [...]}``), and
its ``areas:`` and ``never_together:``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from collections.abc import Mapping as Names
from collections.abc import Sequence as Nodes
from pathlib import Path

from msgspec.structs import replace

from safenav.scenario import language
from safenav.scenario.model import Catalogue, Exclusion, Obstacle, ObstacleType, Robot, name_parts
from safenav.scenario.objective import Target
from safenav.scenario.values import AnyOf, AreaValue, RectangleKeys
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped, items_of, plain
from safenav.scenario.yaml.findings import Findings, ReadableFolder, wrong_type
from safenav.scenario.yaml.keys import Raw
from safenav.scenario.yaml.typed import read, sequence
from safenav.world.map import MAX_REGIONS, Region, RegionMap

NO_SIZE = "map: region size missing"
"""The error of a map file that the scenario does not divide."""


def too_large(rows: int, cols: int) -> tuple[str, str]:
    """Return the error for a map of this size, with a hint."""
    found = f"a map of {rows} x {cols} regions; the maximum is {MAX_REGIONS} (512 x 512)"
    return found, "use larger regions"


_EXPECTED = "a region: 47, [row, column] or a name"
_BRACKETS = re.compile(r"\[\s*(\d{1,9})\s*,\s*(\d{1,9})\s*\]", re.ASCII)

Value = Node | Raw | None
"""A value of a file: a node, or a raw value, which knows its name in messages."""


def place_of(value: object) -> Region | tuple[int, int] | None:
    """Return the number, or row and column, by which plain data names a region; None if neither."""
    match value:
        case bool() | [bool(), _] | [_, bool()]:
            return None
        case int(number):
            return int(number)
        case [int(row), int(col)]:
            return int(row), int(col)
    return None


def opened(value: Value, what: str) -> tuple[Node | None, str]:
    """Return the node of a value and its name in messages."""
    return (value.node, value.what) if isinstance(value, Raw) else (value, what)


def _union(found: Iterable[Target | None]) -> Target | None:
    """Return the regions of all targets; None if one of them was reported."""
    regions: set[Region] = set()
    for target in found:
        if target is None:
            return None
        regions |= target
    return frozenset(regions)


class Reading(Findings):
    """Findings of a file with the declarations that its items refer to. Without a valid map only
    the form of regions is checked.

    ``names`` maps declared names to regions and ``areas`` to sets of them, or to None if the
    declaration was invalid. ``named``: all robots, ``team``: the readable ones. ``names_known``:
    whether the map is readable; if not, its names are not checked, nor are those of robots if there
    are none. ``inputs`` of the environment. ``obstacles``: None if some were reported; ``flat``:
    the obstacle type that represents a robot without charge. ``reachable``: report targets that a
    robot cannot reach. ``folder``: the folder of files that it names.
    """

    def __init__(
        self,
        file: str,
        reach: ReadableFolder | None = None,
        *,
        world: RegionMap | None = None,
        reachable: bool = True,
    ) -> None:
        super().__init__(file, reach)
        self.world = world
        self.names: Names[str, Region | None] = world.names if world else {}
        self.areas: Names[str, Target | None] = world.areas if world else {}
        self.names_known = True
        self.named: tuple[str, ...] = ()
        self.team: tuple[Robot, ...] = ()
        self.inputs: tuple[str, ...] = ()
        self.catalogue = Catalogue()
        self.obstacles: tuple[Obstacle, ...] | None = None
        self.flat: ObstacleType | None = None
        self.reachable = reachable
        self.folder = Path(file).parent

    def region(self, value: Value, what: str = "") -> Region | None:
        """Return a region that is not a wall; None if there is none or it was reported."""
        node, what = opened(value, what)
        region = None if node is None else self._number(node, what)
        if region is not None and self.world is not None and region in self.world.walls:
            found = f"{what}: region {self.world.label(region)} is a wall"
            self.add(node, found, self._free_nearby(region))
            return None
        return region

    def regions(self, value: Value, what: str = "") -> frozenset[Region] | None:
        """Return the regions of an area, or one region; None if that was reported."""
        node, what = opened(value, what)
        if isinstance(node, Scalar) and isinstance(node.value, str) and node.value in self.areas:
            return self.areas[node.value]
        region = self.region(node, what)
        return None if region is None else frozenset({region})

    def target(self, value: Value, what: str = "") -> Target | None:
        """Return the regions of a region, an area or ``{any: [...]}``; None if it was reported."""
        node, what = opened(value, what)
        if not isinstance(node, Mapping):
            return self.regions(node, what)
        item = read(AnyOf, node, what, self)
        return (
            _union([self.regions(each.node, what) for each in item.any])
            if item and item.any
            else None
        )

    def zone(self, value: Value, what: str = "") -> Target | None:
        """Return all regions of a target, or of a list of targets."""
        node, what = opened(value, what)
        if not isinstance(node, Sequence):
            return self.target(node, what)
        found = self.targets(node, what)
        return None if found is None else _union(found)

    def targets(
        self, value: Value, what: str = "", least: int = 1
    ) -> tuple[Target | None, ...] | None:
        """Return a list of ``least`` targets or more, None in place of those that were reported."""
        node, what = opened(value, what)
        if isinstance(node, Scalar | Mapping):
            hint = "put brackets around it: [47, [3, 8], dock]"
            wrong_type(node, what, "a list of targets", self, hint)
            return None
        items = None if node is None else sequence(node, what, self)
        if items is None or (least == 1 and self.reports_position(node, what)):
            return None
        return tuple(self.target(item, what) for item in items)

    def reports_position(self, node: Node | None, what: str) -> bool:
        """Report two numbers in a list of regions that are probably a row and a column, and return
        whether they are: at least one of the two regions is a wall, and the position is free, or
        both are walls."""
        items = node.items if isinstance(node, Sequence) else ()
        if not self._is_position(items):
            return False
        first, second = (plain(item) for item in items)
        found = f"{what}: [{first}, {second}] is two regions, and not both are free"
        self.add(node, found, f"did you mean [[{first}, {second}]]?")
        return True

    def _is_position(self, items: Nodes[Node]) -> bool:
        match items:
            case [Scalar(value=int(row)), Scalar(value=int(col))] if (
                (world := self.world) and not isinstance(row, bool) and not isinstance(col, bool)
            ):
                free = [world.is_free(row), world.is_free(col)]
                inside = 0 <= row < world.rows and 0 <= col < world.cols
                clear = inside and (not any(free) or world.is_free(world.region(row, col)))
                return clear and not all(free)
        return False

    def written(self, text: str) -> Region | None:
        """Return the region of the part after the ``@`` in a name such as ``door@dock``."""
        if text.isascii() and text.isdigit() and len(text) < 10:
            return int(text)
        if (match := _BRACKETS.fullmatch(text)) and self.world is not None:
            row, col = int(match[1]), int(match[2])
            inside = row < self.world.rows and col < self.world.cols
            return self.world.region(row, col) if inside else None
        return self.names.get(text)

    def obstacle_named(self, text: str) -> str | None:
        """Return the name, with the region's number, of an obstacle written as ``door@dock``; None
        if there is none."""
        kind, where, number = name_parts(text)
        region = self.written(where)
        for each in self.obstacles or ():
            if (each.type.name, each.region, each.number) == (kind, region, number):
                return each.name
        flat = self.flat is not None and kind == self.flat.name and region is not None
        return f"{kind}@{region}" if flat else None

    def names_robot(
        self, node: Node | None, name: str, what: str = "", column: int | None = None
    ) -> bool:
        """Return whether a name is that of a robot; report it if not. ``column``: that of the name
        in a text."""
        if name not in self.named and self.named:
            found = f"{what}: no robot is named" if what else "no robot is named"
            self.unknown(node, found, name, self.named, column=column)
        return name in self.named

    def _number(self, node: Node, what: str) -> Region | None:
        if isinstance(node, Scalar) and isinstance(node.value, str) and node.value:
            return self._named(node, node.value, what)
        match place_of(plain(node)):
            case int(number):
                return self._inside(node, number, what)
            case (row, col):
                return self._at(node, row, col, what)
        wrong_type(node, what, _EXPECTED, self)
        return None

    def _named(self, node: Scalar, name: str, what: str) -> Region | None:
        if name in self.names:
            return self.names[name]
        if name in self.areas:
            area = self.areas[name]
            if area is not None:
                first = self.world.label(min(area)) if self.world is not None else str(min(area))
                found = f"{what}: '{name}' is an area of {len(area)} regions"
                self.add(node, found, f"name one region, for example {first}")
            return None
        found = f"{what}: no region or area is named"
        if name.isdigit():
            self.add(node, f"{found} '{clipped(name)}'", f"write {clipped(name)} without quotes")
        elif re.match(r"\(|\d+[ ,]", name):
            hint = "a position is written in brackets: [row, column]"
            self.add(node, f"{found} '{clipped(name)}'", hint)
        elif self.names_known:
            declared = "names are declared in 'names' of map, areas in 'areas'"
            self.unknown(node, found, name, {**self.names, **self.areas}, declared)
        return None

    def _inside(self, node: Node, number: int, what: str) -> Region | None:
        size = self.world.size if self.world is not None else None
        if number < 0 or (size is not None and number >= size):
            found = f"{what}: region {clipped(str(number))} is outside the map"
            self.add(node, found, self._extent())
            return None
        return number

    def _at(self, node: Node, row: int, col: int, what: str) -> Region | None:
        world = self.world
        if row < 0 or col < 0 or (world and not (row < world.rows and col < world.cols)):
            place = clipped(f"[{row}, {col}]")
            self.add(node, f"{what}: {place} is outside the map", self._extent())
            return None
        return world.region(row, col) if world is not None else None

    def _extent(self) -> str:
        if self.world is None:
            return "regions are numbered from 0"
        last = self.world.size - 1
        rows, cols = self.world.rows - 1, self.world.cols - 1
        return f"regions go from 0 to {last}, that is [0, 0] to [{rows}, {cols}]"

    def _free_nearby(self, region: Region) -> str:
        assert self.world is not None
        beside = self.world.neighbours(region)
        if not beside:
            return "all neighbouring regions are also walls"
        return "free neighbours: " + ", ".join(self.world.label(free) for free in beside)


_AREA = "a list of regions [[1, 1], [1, 2]], or {rows: 1-4, columns: 1-6}"
_RANGE = re.compile(r"(\d{1,9})\s*-\s*(\d{1,9})", re.ASCII)


def resolve_areas(listed: Names[Scalar, AreaValue], reading: Reading) -> None:
    """Add the areas of the scenario to ``reading``."""
    areas: dict[str, frozenset[Region] | None] = {}
    for key, value in listed.items():
        name = clipped(key.text)
        if key.text in reading.names:
            reading.add(key, f"'{name}' already names a region", "use another name")
            continue
        area = areas[key.text] = _area(value.node, f"area '{name}'", reading)
        if area and reading.world is not None:
            notes = (*reading.world.notes, *_meant_cell(value.node, name, reading.world))
            reading.world = replace(reading.world, notes=notes)
    reading.areas = areas
    if reading.world is not None:
        known = {name: area for name, area in areas.items() if area is not None}
        reading.world = replace(reading.world, areas=known)


def _meant_cell(node: Node, name: str, world: RegionMap) -> Iterator[str]:
    """Warn of two regions that are not adjacent: they are probably one region's row and column."""
    match plain(node):
        case [int(one), int(other)] if other not in (one, *world.neighbours(one)):
            if one < world.rows and other < world.cols and world.is_free(world.region(one, other)):
                yield (
                    f"area '{name}' names regions {one} and {other}, which are not adjacent; "
                    f"for the region in row {one}, column {other} alone, write [[{one}, {other}]]"
                )


def _area(node: Node, what: str, reading: Reading) -> frozenset[Region] | None:
    """Return the free regions of an area; None if something was reported."""
    before = len(reading)
    found: set[Region] = set()
    if isinstance(node, Scalar):
        wrong_type(node, what, _AREA, reading)
    if reading.reports_position(node, what):
        return None
    for item in (node,) if isinstance(node, Mapping) else items_of(node):
        if isinstance(item, Mapping):
            found |= _rectangle(read(RectangleKeys, item, what, reading), reading)
        elif (region := reading.region(item, what)) is not None:
            found.add(region)
    if not found and reading.world is not None and len(reading) == before:
        reading.add(node, f"{what} has no free region", f"expected {_AREA}")
    return frozenset(found) if found and len(reading) == before else None


def _rectangle(item: RectangleKeys, reading: Reading) -> set[Region]:
    """Return the free regions of ``{rows: 1-4, columns: 1-6}``; a missing key means all."""
    world = reading.world
    rows = _span(item.rows, world.rows if world else None, reading)
    cols = _span(item.columns, world.cols if world else None, reading)
    if world is None or not item.node.entries:
        return set()
    inside = (world.region(row, col) for row in rows for col in cols)
    return {region for region in inside if region not in world.walls}


def _span(span: Raw | None, count: int | None, reading: Reading) -> range:
    if span is None:
        return range(count or 0)
    value = span.node.value if isinstance(span.node, Scalar) else None
    match = _RANGE.fullmatch(value) if isinstance(value, str) else None
    if match is None and (not isinstance(value, int) or isinstance(value, bool)):
        wrong_type(span.node, span.what, "a number or a range such as 1-4", reading)
        return range(0)
    first, last = (int(match[1]), int(match[2])) if match else (int(value or 0),) * 2
    if first > last or first < 0 or (count is not None and last >= count):
        reason = "is empty" if first > last else "reaches outside the map"
        hint = f"they are numbered from 0 to {count - 1}" if count else "they are numbered from 0"
        reading.add(span.node, f"{span.what}: {first}-{last} {reason}", hint)
        return range(0)
    return range(first, last + 1)


def resolve_exclusions(
    listed: Nodes[language.ExclusionKeys], reading: Reading
) -> tuple[Exclusion, ...]:
    """Return the readable exclusions; errors in the others are reported."""
    known, found = {robot.name: robot for robot in reading.team}, []
    for item in listed:
        before, place, where = len(reading), item.at("robots"), item.at("in")
        names = frozenset(word.text for word in item.robots or ())
        for name in sorted(names):
            reading.names_robot(place, name)
        if not item.flawed and len(names) < 2 and len(reading) == before:
            reading.add(place, f"{item.named('robots')}: at least two robots are needed")
        zone = reading.zone(item.in_)
        if isinstance(where, Sequence) and not where.items:
            reading.add(where, f"{item.named('in')} is empty", "name at least one region")
        team = [known[name] for name in sorted(names & {*known})]
        together = [robot.name for robot in team if zone and robot.start.region in zone]
        if len(together) > 1:
            reason = f"{together[0]} and {together[1]} both start there"
            reading.add(where, f"{item.named('in')}: {reason}", "let one start elsewhere")
        if len(reading) == before and zone is not None:
            found.append(Exclusion(names, zone))
    return tuple(found)
