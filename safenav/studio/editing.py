"""Operations of the drawing on a scenario's text, one function each.

An operation is an object with ``op`` and its arguments. Numbers identify regions, names robots,
indices obstacles.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import yaml
from msgspec import Struct

from safenav.errors import UsageError
from safenav.scenario.language import FORM, RULES, STRICT, TIMED, WITHIN
from safenav.scenario.objective import KINDS, STAYING
from safenav.scenario.reading.regions import place_of
from safenav.scenario.yaml.document import DocumentError, flow, plain, read_document
from safenav.world.map import Region, RegionMap

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
Step = str | int
"""A key of a mapping or an index of a list."""


class Spot(Struct, frozen=True):
    """The position of a node: the indices of its first character and of that after its last.
    ``flow``: in brackets; ``entries``: each entry's start and value by key or index, or None."""

    start: int
    end: int
    flow: bool = False
    entries: dict[Step, tuple[int, Spot]] | None = None


class ScenarioText:
    """The edited text of a scenario, its ``data`` and its map. Raises UsageError for invalid YAML
    or an unreadable map."""

    def __init__(self, text: str, world: RegionMap | None) -> None:
        self.read(text)
        if world is None:
            raise UsageError("fix the map in the text first")
        self.world = world

    def read(self, text: str) -> None:
        """Replace the text and read the new one."""
        try:
            self.data: Any = plain(read_document(text).root)
        except DocumentError as error:
            raise UsageError("fix the text first: it is not valid YAML") from error
        if not isinstance(self.data, dict):
            raise UsageError("fix the text first: it is not a scenario")
        self.text = text
        events: Any = yaml.parse(text, Loader=_LOADER)
        self._root = _spot(text, next(e for e in events if isinstance(e, _NODES)), events)

    def region(self, value: Any) -> Region | None:
        """Return the region that a value of the text names, or None."""
        if isinstance(value, str):
            return self.world.names.get(value)
        place = place_of(value)
        return self.world.region(*place) if isinstance(place, tuple) else place

    def written(self, region: Region, like: Any = None) -> Any:
        """Return a region in the notation of ``like``: a name (if it has one and ``like`` is a text
        or None), a number, or [row, column]. Raises UsageError for a region off the map."""
        if not 0 <= region < self.world.size:
            raise UsageError(f"{region} is not a region of the map")
        if (isinstance(like, str) or like is None) and region in self.world.named:
            return self.world.named[region]
        return region if isinstance(like, int) else [*self.world.position(region)]

    def at(self, *path: Step) -> Any:
        """Return the data at a path, or None."""
        found = self.data
        for step in path:
            if isinstance(found, list) and isinstance(step, int) and step < len(found):
                found = found[step]
            else:
                found = found.get(step) if isinstance(found, dict) else None
        return found

    def spot(self, *path: Step) -> Spot | None:
        """Return the position of the node at a path, or None."""
        found: Spot | None = self._root
        for step in path:
            found = ((found and found.entries) or {}).get(step, (0, None))[1]
        return found

    def put(self, path: tuple[Step, ...], value: str, after: str = "") -> None:
        """Write YAML at a path. A new key follows the key ``after`` or becomes the last one."""
        spot, holder = self.spot(*path), self.spot(*path[:-1])
        if spot is not None:
            return self._replace(spot, value)
        *above, key = path
        if not holder or not holder.entries:
            whole = f"{flow(key)}: {value}"
            block = len(above) == 1 and above[0] == "robots"
            return self.put(tuple(above), f"\n  {whole}" if block else f"{{{whole}}}")
        before = holder.entries.get(after) or [*holder.entries.values()][-1]
        return self._add(holder, before[1], f"{flow(key)}: {value}".replace(": \n", ":\n"))

    def append(self, path: tuple[str, ...], value: str, after: str) -> None:
        """Append an item, as YAML, to a list. A new list follows the key ``after``."""
        holder = self.spot(*path)
        if holder and holder.entries:
            return self._add(holder, [*holder.entries.values()][-1][1], value, "- ")
        return self.put(path, f"\n  - {value}", after)

    def remove(self, *path: Step) -> None:
        """Remove an entry. Lists that become empty disappear; empty mappings remain."""
        holder = self.spot(*path[:-1])
        assert holder is not None and holder.entries is not None
        entries = [*holder.entries.values()]
        number = [*holder.entries].index(path[-1])
        begin, end = entries[number][0], entries[number][1].end
        if len(entries) == 1:
            is_list = isinstance(path[-1], int)
            return self.remove(*path[:-1]) if is_list else self._replace(holder, "{}")
        if not holder.flow:
            begin, end = self.text.rfind("\n", 0, begin) + 1, self._line_end(end) + 1
        elif number + 1 < len(entries):
            end = entries[number + 1][0]
        elif number:
            begin = entries[number - 1][1].end
        return self._splice(begin, end, "")

    def _add(self, holder: Spot, before: Spot, entry: str, dash: str = "") -> None:
        if holder.flow:
            return self._splice(before.end, before.end, f", {entry}")
        indent = holder.start - self.text.rfind("\n", 0, holder.start) - 1
        end = self._line_end(before.end)
        return self._splice(end, end, f"\n{' ' * indent}{dash}{entry}")

    def _replace(self, spot: Spot, value: str) -> None:
        start = spot.start
        comments = re.findall(r"\s(#.*)", self.text[start : spot.end])  # values have no '#'
        if comments:
            end = self._line_end(spot.end)
            rest = self.text[spot.end : end]
            return self._splice(start, end, "  ".join([value + rest, *comments]))
        if value.startswith("\n"):
            start = len(self.text[:start].rstrip(" "))
        gap = " " if value[0] != "\n" and self.text[start - 1] == ":" else ""
        return self._splice(start, spot.end, gap + value)

    def _line_end(self, at: int) -> int:
        return f"{self.text}\n".index("\n", at)

    def _splice(self, start: int, end: int, new: str) -> None:
        self.read(self.text[:start] + new + self.text[end:])


_NODES = (yaml.ScalarEvent, yaml.AliasEvent, yaml.MappingStartEvent, yaml.SequenceStartEvent)
_ENDS = (yaml.MappingEndEvent, yaml.SequenceEndEvent)


def _spot(text: str, event: Any, events: Any) -> Spot:
    """Return the position of the node that begins with an event."""
    start, end = event.start_mark.index, event.end_mark.index
    if not isinstance(event, yaml.CollectionStartEvent):
        return Spot(start, max(start, len(text[:end].rstrip())) if end > start else start)
    entries: dict[Step, tuple[int, Spot]] = {}
    is_mapping = isinstance(event, yaml.MappingStartEvent)
    first: Any
    while not isinstance(first := next(events), _ENDS):
        key: Step = len(entries)
        begin = first.start_mark.index
        if is_mapping:
            key = getattr(first, "value", "")
            first = next(events)
        entries[key] = (begin, _spot(text, first, events))
    closing: Any = first
    end = closing.end_mark.index
    if not event.flow_style and entries:
        end = [*entries.values()][-1][1].end
    return Spot(start, end, bool(event.flow_style), entries)


Operation = Mapping[str, Any]
"""A request of a page: ``op`` and its arguments."""
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def edited(text: str, operation: Operation, world: RegionMap | None) -> str:
    """Return the text after an operation. ``world``: the map of the text (None: unreadable). Raises
    UsageError for an impossible operation."""
    does = OPERATIONS.get(str(operation.get("op")))
    if does is None:
        raise UsageError(f"unknown edit '{str(operation.get('op'))[:40]}'")
    file = ScenarioText(text, world)
    try:
        does(file, operation)
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        raise UsageError(f"this edit does not fit the text ({type(error).__name__})") from error
    return file.text


def paint(file: ScenarioText, edit: Operation) -> None:
    """Make ``regions`` walls or (``wall`` false) floor."""
    spot, world = file.spot("map", "grid"), file.world
    if spot is None:
        raise UsageError("the map comes from a file: copy it into the scenario to paint it")
    # '#' of the grid touches only '#' and '.'; comments are '# ' with words.
    part = file.text[spot.start : spot.end]
    starts = [
        spot.start + found.start(1)
        for found in re.finditer(r"(?m) #+ +[^\s#.].*$|(?:^|[\s\"'])([#.]+)(?=[\s\"',\]]|$)", part)
        if found[1]
    ]
    if [file.text[start : start + world.cols] for start in starts] != world.grid_rows():
        raise UsageError("give each row of this grid its own line in the text, then paint it")
    letters = list(file.text)
    for region in edit["regions"]:
        file.written(region, 0)
        row, col = world.position(region)
        letters[starts[row] + col] = "#" if edit["wall"] else "."
    file.read("".join(letters))


def _start_of_any(file: ScenarioText) -> Any:
    """Return the start of the first robot as an example of notation; [] if there is none."""
    robots = file.at("robots")
    found = robots.values() if isinstance(robots, dict) else ()
    return next((r["start"] for r in found if isinstance(r, dict) and "start" in r), [])


def add_robot(file: ScenarioText, edit: Operation) -> None:
    """Add a robot of ``model`` that holds ``region`` until it gets an objective."""
    name = _new_name(str(edit["model"]), file.at("robots") or {})
    start = file.written(edit["region"], _start_of_any(file))
    heading = {"heading": edit["heading"]} if edit.get("heading") else {}
    objective = {"objective": {STAYING.kind: start}}
    robot = {"model": edit["model"], "start": start} | heading | objective
    file.put(("robots", name), flow(robot))


def move_robot(file: ScenarioText, edit: Operation) -> None:
    robot = _robot(file, edit)
    before = file.region(robot.get("start"))
    way = ("robots", edit["robot"])
    file.put((*way, "start"), flow(file.written(edit["region"], robot.get("start"))))
    held = file.at(*way, "objective", STAYING.kind)
    if held is not None and file.region(held) == before:  # the robot held its start
        file.put((*way, "objective", STAYING.kind), flow(file.written(edit["region"], held)))


def set_objective(file: ScenarioText, edit: Operation) -> None:
    """Set the objective ``kind`` with ``regions`` in order. Each is a number, a list of alternative
    numbers, or the name of an area. Unchanged targets keep their text."""
    robot = _robot(file, edit)
    kind, regions = edit["kind"], list(edit["regions"])
    if kind not in KINDS:
        raise UsageError(f"an objective is one of {', '.join(KINDS)}")
    if not regions:
        raise UsageError("an objective needs a region")
    like = robot.get("start", [])
    written = [_target(file, target, like) for target in regions]
    way = ("robots", edit["robot"], "objective")
    before = robot.get("objective")
    old = before.get(kind) if isinstance(before, dict) else None
    if KINDS[kind].one and old is not None:
        return file.put((*way, kind), flow(written[0]))
    if isinstance(old, list) and len(old) == len(written):
        for i, target in enumerate(written):
            if old[i] != target:
                file.put((*way, kind, i), flow(target))
        return None
    kept = (*((FORM,) * (kind in STRICT)), *((WITHIN,) * (kind in TIMED)), *RULES)
    others = {k: v for k, v in before.items() if k in kept} if isinstance(before, dict) else {}
    value = written[0] if KINDS[kind].one else written
    return file.put(way, flow({kind: value} | others), after="heading")


def _target(file: ScenarioText, target: Any, like: Any) -> Any:
    if isinstance(target, str) and file.at("areas", target) is not None:
        return target
    if isinstance(target, list):
        return {"any": [_target(file, region, like) for region in target]}
    name = file.written(target)
    return name if isinstance(name, str) else file.written(target, like)


def remove_robot(file: ScenarioText, edit: Operation) -> None:
    _robot(file, edit)
    file.remove("robots", edit["robot"])


def _robot(file: ScenarioText, edit: Operation) -> Any:
    robot = file.at("robots", str(edit.get("robot")))
    if not isinstance(robot, dict):
        raise UsageError(f"there is no robot '{str(edit.get('robot'))[:40]}'")
    return robot


def _new_name(model: str, robots: Any) -> str:
    stem = re.sub(r"\W", "_", model)[:20]
    stem = {"quadcopter": "quad"}.get(stem, stem)
    stem = stem if _NAME.fullmatch(stem) else "robot"
    if stem not in robots:
        return stem
    return next(f"{stem}_{n}" for n in range(2, 1000) if f"{stem}_{n}" not in robots)


def add_obstacle(file: ScenarioText, edit: Operation) -> None:
    """Add an obstacle of ``type`` at ``region``, in the notation of the other obstacles, with
    ``from``, ``until`` and ``traversable`` if given."""
    entries = file.at("obstacles")
    entries = entries if isinstance(entries, list) else []
    like = next((e["region"] for e in entries if isinstance(e, dict) and "region" in e), None)
    like = _start_of_any(file) if like is None else like
    keys = ("type", "region", "traversable", "from", "until")
    new = {each: edit[each] for each in keys if edit.get(each) is not None}
    new["region"] = file.written(edit["region"], like)
    file.append(("obstacles",), flow(new), "robots")


def move_obstacle(file: ScenarioText, edit: Operation) -> None:
    """Move an obstacle to ``region``."""
    obstacle = _obstacle(file, edit)
    new = file.written(edit["region"], obstacle.get("region"))
    file.put(("obstacles", edit["index"], "region"), flow(new))


def remove_obstacle(file: ScenarioText, edit: Operation) -> None:
    _obstacle(file, edit)
    file.remove("obstacles", edit["index"])


def _obstacle(file: ScenarioText, edit: Operation) -> Any:
    index = edit.get("index")
    obstacle = file.at("obstacles", index) if isinstance(index, int) and index >= 0 else None
    if not isinstance(obstacle, dict):
        raise UsageError("there is no such obstacle")
    return obstacle


OPERATIONS: Mapping[str, Callable[[ScenarioText, Operation], None]] = {
    found.__name__: found
    for found in (
        *(paint, add_obstacle, move_obstacle, remove_obstacle),
        *(add_robot, move_robot, remove_robot, set_objective),
    )
}
