"""Regions and targets in a scenario's notation (``47``, ``[3, 8]``, a name, ``{any: [...]}``), and
its ``areas:`` and ``never_together:``."""

import re
from collections.abc import Mapping as Names
from collections.abc import Sequence as Nodes
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from safenav.scenario import values
from safenav.scenario.model import (
    Catalogue,
    Exclusion,
    Input,
    Obstacle,
    ObstacleType,
    Robot,
    RobotModel,
    Scenario,
    name_parts,
)
from safenav.scenario.objective import Target
from safenav.scenario.values import RectangleKeys
from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, wrong_type
from safenav.scenario.yaml.keys import MOST, Key, Raw
from safenav.scenario.yaml.typed import read
from safenav.strict_json import MOST_REGIONS
from safenav.world.map import Region, RegionMap

T = TypeVar("T")

LISTED = "'safenav new --catalogue' lists them; 'catalogue' in the scenario adds others"
MISSION = "mission"


def too_large(rows: int, cols: int) -> tuple[str, str]:
    """Return the error for a map of this size, with a hint."""
    found = f"a map of {rows} x {cols} regions; the maximum is {MOST_REGIONS} (512 x 512)"
    return found, "use larger regions"


_EXPECTED = "a region: 47, [row, column] or a name"
_BRACKETS = re.compile(r"\[\s*(\d{1,9})\s*,\s*(\d{1,9})\s*\]", re.ASCII)


def place_of(value: object) -> Region | tuple[int, int] | None:
    """Return the number or the row and column of a region in plain data; None for other data."""
    match value:
        case bool() | [bool(), _] | [_, bool()]:
            return None
        case int(number):
            return int(number)
        case [int(row), int(col)]:
            return int(row), int(col)
    return None


def _as_region(node: Node) -> str:
    """Return the notation of a region that a file has in another form; an empty text if unknown."""
    items = document.items_of(node) or [value for _, value in document.entries_of(node)]
    text = " ".join(item.text for item in items if isinstance(item, Scalar))
    keys = [key.text[:3] for key, _ in document.entries_of(node)]
    if keys in ([], ["row", "col"]) and (cell := _CELL.fullmatch(text)):
        return f"write [{cell[1]}, {cell[2]}]"
    if isinstance(node, Sequence) and len(node.items) == 1:
        return "leave out the outer brackets"
    return "name one region" if isinstance(node, Sequence) and len(node.items) > 1 else ""


_CELL = re.compile(r"(\d{1,9})(?:\.0)?[ ;]+(\d{1,9})(?:\.0)?", re.ASCII)


def wall(region: Region, world: RegionMap) -> tuple[str, str]:
    """Return the error for a region in a wall, with a hint."""
    beside = ", ".join(map(world.label, world.neighbours(region)))
    hint = f"free neighbours: {beside}" if beside else "all neighbouring regions are also walls"
    return f"region {world.label(region)} is a wall", hint


class Reading(Findings):
    """Findings of a file and the declarations to which its items refer. Without a valid map only
    the form of regions is checked.

    ``names`` maps declared names to regions and ``areas`` to sets of them, or to None if the
    declaration was invalid. ``named``: all robots, ``team``: the readable ones. ``names_known``:
    whether the map is readable; if not, its names are not checked. ``inputs`` of the environment,
    ``input_names``: also the unreadable ones. ``obstacles``: the readable ones;
    ``obstacles_known``: whether none was reported; ``flat``: the obstacle type that represents a
    robot without charge. ``broken``: entries of the catalogue (``*``: any) and of memory that were
    reported as unusable, and are not also reported as unknown. ``reachable``: report targets that a
    robot cannot reach. ``folder``: the folder of files that it names. ``scenario``: the scenario of
    the file, if it has no error. Methods return None for values that they have reported.
    """

    def __init__(
        self,
        file: str,
        reach: Path | None = None,
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
        self.inputs: tuple[Input, ...] = ()
        self.input_names: tuple[str, ...] = ()
        self.catalogue = Catalogue()
        self.broken = set[str]()
        self.obstacles: tuple[Obstacle, ...] = ()
        self.obstacles_known = True
        self.flat: ObstacleType | None = None
        self.scenario: Scenario | None = None
        self.reachable = reachable
        self.folder = Path(file).parent

    def keep(self, found: Nodes[Obstacle], node: Node | None) -> None:
        """Add the readable obstacles of a list."""
        self.obstacles += tuple(found)
        whole = node is None or (isinstance(node, Sequence) and len(found) == len(node.items))
        self.obstacles_known = self.obstacles_known and whole

    def region(self, node: Node | None, what: str) -> Region | None:
        """Return a region outside walls; None if the node is missing or was reported."""
        if node is None:
            return None
        if isinstance(node, Scalar) and isinstance(node.value, str) and node.value:
            region = self._named(node, node.value, what)
        else:
            region = self._numbered(node, what)
        world = self.world
        if region is None or world is None or region not in world.walls:
            return region
        found, hint = wall(region, world)
        if self.within is not None and len(self.within.items) == 2:
            pair = document.flow(document.plain(self.within))
            if (meant := self.written(pair)) is not None and world.is_free(meant):
                node, found = self.within, f"{pair} lists two regions, not both free"
                hint = f"if it is a row and a column, write [{pair}]"
        self.add(node, f"{what}: {found}", hint)
        return None

    def regions(self, node: Node, what: str) -> Target | None:
        """Return the regions of an area or of one region; None after a reported error."""
        if isinstance(node, Scalar) and isinstance(node.value, str) and node.value in self.areas:
            return self.areas[node.value]
        region = self.region(node, what)
        return None if region is None else frozenset({region})

    def exclusion(self, node: Node, _: str) -> Exclusion | None:
        """Return an exclusion. Report two robots that start in its regions."""
        found: Exclusion | None = read(Exclusion, node, "an entry of never_together", self)
        if found is not None and self.named and len(found.robots) < 2:
            message = "'robots' of never_together: at least two robots are needed"
            self.add(document.below(node, "robots"), message)
        where = document.below(node, "in")
        if isinstance(where, Sequence) and not where.items:
            self.add(where, "'in' of never_together is empty", "name at least one region")
        if found is not None:
            check_starts(found, self.team, where, self)
        return found

    def spans(self, node: Node, what: str) -> tuple[tuple[int, int], ...]:
        """Return ticks and ranges of ticks as pairs of first and last tick."""
        found = []
        for part in node.items if isinstance(node, Sequence) else (node,):
            first, last = values.ends_of(part) or (0, 0)
            if not 1 <= first <= last <= MOST:
                hint = "for example at: [12, 20-30]; ticks count from 1"
                hint = "the lowest tick comes first" if last < first else hint
                wrong_type(part, what, "a tick or a range of ticks", self, hint)
            found.append((first, last))
        return tuple(found)

    def model(self, node: Node, what: str) -> RobotModel | None:
        """Return a robot model of the catalogue."""
        return self._known(node, what, "unknown robot model", self.catalogue.robots, LISTED)

    def type(self, node: Node, what: str) -> ObstacleType | None:
        """Return an obstacle type of the catalogue."""
        return self._known(node, what, "unknown obstacle type", self.catalogue.obstacles, LISTED)

    def task(self, node: Node, what: str) -> ObstacleType | None:
        """Return an obstacle type of the catalogue that blocks no robot."""
        kind = self.type(node, what)
        if kind is not None and kind.blocks != frozenset():
            self.add(node, f"{what}: a {kind.name} stops robots", f"give {kind.name} 'blocks: []'")
        return kind

    def robot(self, node: Node, what: str) -> str | None:
        """Return the name of a robot; None also if the scenario has no robots."""
        robots = {name: name for name in self.named}
        return self._known(node, what, "no robot is named", robots) if robots else None

    def input(self, node: Node, what: str) -> str | None:
        """Return the name of an input."""
        inputs = {name: name for name in self.input_names}
        return self._known(node, what, "no input is named", inputs, "declare it in 'inputs'")

    def check_variable(self, key: Scalar) -> None:
        """Report a variable of formulas with the name of a robot, input, region or area."""
        kinds = {"a robot": self.named, "an input": self.input_names}
        for kind, names in (kinds | {"a region": self.names, "an area": self.areas}).items():
            if key.text in names:
                self.add(key, f"'{clipped(key.text)}' is the name of {kind}", "use another name")

    def _known(
        self, node: Node, what: str, found: str, known: Names[str, T], hint: str = ""
    ) -> T | None:
        word: Scalar | None = read(Scalar, node, what, self, Key(why=hint))
        if word is None:
            return None
        if word.text not in known and self.broken.isdisjoint((word.text, "*")):
            self.unknown(word, f"{what}: {found}", word.text, known, hint)
        return known.get(word.text)

    def obstacle(self, node: Node, what: str) -> str | None:
        """Return an obstacle's name with its region as a number."""
        word: Scalar | None = read(Scalar, node, what, self)
        return None if word is None else self.names_obstacle(word, word.text, what)

    def subject(self, node: Node, what: str) -> str | None:
        """Return the name of a robot, an obstacle or the mission."""
        if isinstance(node, Scalar) and node.value in (*self.named, MISSION):
            return node.text
        return self.obstacle(node, what) if self.named else None

    def written(self, text: str) -> Region | None:
        """Return the region after the ``@`` in a name such as ``door@dock``; None for any other
        text."""
        if text.isascii() and text.isdigit() and len(text) < 10:
            return int(text)
        if (match := _BRACKETS.fullmatch(text)) and self.world is not None:
            row, col = int(match[1]), int(match[2])
            inside = row < self.world.rows and col < self.world.cols
            return self.world.region(row, col) if inside else None
        return self.names.get(text)

    def names_obstacle(self, node: Node, written: str, what: str, column: int = 0) -> str | None:
        """Return an obstacle's name with its region as a number: ``door@47`` for ``door@dock``;
        None after an error, or if obstacles are unknown. ``column``: that of the name in a text."""
        if not self.obstacles_known or self.world is None:
            return None
        kind, where, number = name_parts(written)
        region = self.written(where)
        for each in self.obstacles:
            if (each.type.name, each.region, each.number) == (kind, region, number):
                return each.name
        if self.flat is not None and kind == self.flat.name and region is not None:
            return f"{kind}@{region}"
        word, every = self.world.word, self.obstacles
        names = [o.name.replace(f"@{o.region}", f"@{word(o.region)}", 1) for o in every]
        nothing = "the scenario has no obstacles"
        self.unknown(node, f"{what}: there is no obstacle", written, names, nothing, column)
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
        found, hint = f"{what}: no region or area is named", ""
        if name.isdigit() or _BRACKETS.fullmatch(name):
            hint = f"write {clipped(name)} without quotes"
        elif re.match(r"\(|\d+[ ,;]|\d+\)", name):
            hint = "a position is written in brackets: [row, column]"
            if self.within is not None and name[-1:] != name[:1]:
                self.add(self.within, f"{what}: found a position in parentheses", hint)
                return None
        elif {*(words := re.split("[ ;]+", name))} <= self.names.keys() | self.areas.keys():
            hint = f"write a comma between them: [{clipped(', '.join(words))}]"
        if hint:
            self.add(node, f"{found} '{clipped(name)}'", hint)
        elif self.names_known:
            declared = "names are declared in 'names' of map, areas in 'areas'"
            self.unknown(node, found, name, {**self.names, **self.areas}, declared)
        return None

    def _numbered(self, node: Node, what: str) -> Region | None:
        """Return the region of a number or of a row and column; None after an error."""
        world, place = self.world, place_of(document.plain(node))
        if place is None:
            wrong_type(node, what, _EXPECTED, self, _as_region(node))
            return None
        rows, cols = (world.rows, world.cols) if world else (MOST, MOST)
        if isinstance(place, int):
            shown, inside = f"region {place}", 0 <= place < rows * cols
        else:
            shown, inside = str([*place]), 0 <= place[0] < rows and 0 <= place[1] < cols
        if not inside:
            hint = "regions are numbered from 0"
            if world is not None:
                last = f"{world.size - 1}, that is [0, 0] to [{rows - 1}, {cols - 1}]"
                hint = f"regions go from 0 to {last}"
            self.add(node, f"{what}: {clipped(shown)} is outside the map", hint)
            return None
        if isinstance(place, int):
            return place
        return world.region(*place) if world is not None else None


_AREA = "a list of regions [[1, 1], [1, 2]], or {rows: 1-4, columns: 1-6}"


def resolve_areas(listed: Names[Scalar, Raw] | None, _: Node | None, reading: Reading) -> None:
    """Add the areas of the scenario to ``reading``."""
    areas: dict[str, frozenset[Region] | None] = {}
    for key, value in (listed or {}).items():
        name = clipped(key.text)
        if key.text in reading.names:
            reading.add(key, f"'{name}' already names a region", "use another name")
            continue
        areas[key.text] = _area(value.node, f"area '{name}'", reading)
    reading.areas = areas
    if reading.world is not None:
        known = {name: area for name, area in areas.items() if area is not None}
        reading.world = replace(reading.world, areas=known)


def _area(node: Node, what: str, reading: Reading) -> frozenset[Region] | None:
    """Return the free regions of an area; None after a reported error."""
    before = len(reading)
    found: set[Region] = set()
    reading.within = node if isinstance(node, Sequence) else None
    if isinstance(node, Scalar):
        wrong_type(node, what, _AREA, reading)
    for item in (node,) if isinstance(node, Mapping) else document.items_of(node):
        if isinstance(item, Mapping):
            found |= _rectangle(read(RectangleKeys, item, what, reading), reading)
        elif (region := reading.region(item, what)) is not None:
            found.add(region)
    reading.within = None
    if not found and reading.world is not None and len(reading) == before:
        reading.add(node, f"{what} has no free region", f"expected {_AREA}")
    return frozenset(found) if found and len(reading) == before else None


def _rectangle(item: RectangleKeys, reading: Reading) -> set[Region]:
    """Return the free regions of ``{rows: 1-4, columns: 1-6}``. A missing key means all."""
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
    ends = values.ends_of(span.node)
    if ends is None:
        wrong_type(span.node, span.what, "a number from 0, or a range such as 1-4", reading)
        return range(0)
    first, last = ends
    if first > last or (count is not None and last >= count):
        reason = "is empty" if first > last else "reaches outside the map"
        hint = f"they are numbered from 0 to {count - 1}" if count else "they are numbered from 0"
        reading.add(span.node, f"{span.what}: {first}-{last} {reason}", hint)
        return range(0)
    return range(first, last + 1)


def check_starts(
    each: Exclusion, team: Nodes[Robot], node: Node | None, findings: Findings
) -> None:
    """Report two robots of an exclusion that both start in its regions (at ``node``)."""
    inside = sorted(
        r.name for r in team if r.name in each.robots and r.start.region in each.regions
    )
    if len(inside) > 1:
        found = f"'in' of never_together: {inside[0]} and {inside[1]} both start there"
        findings.add(node, found, "let one start elsewhere")
