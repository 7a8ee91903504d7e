"""Drawings of scenario texts: all valid and invalid items with a region on the map.

The page draws scenarios with the code for runs, so a drawing is a run that has not begun. It also
lists the items that the user can drag.
"""

from collections.abc import Iterable
from typing import Any

from msgspec.structs import replace

from safenav.report.page.html import encoded
from safenav.run.run import Run
from safenav.run.tracks import RobotTrack
from safenav.run.values import Changes, Hidden, ObstacleStatus, looks
from safenav.scenario.model import Catalogue, Exclusion
from safenav.scenario.objective import KINDS, Objective
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import (
    Mapping,
    Node,
    Scalar,
    Sequence,
    below,
    entries_of,
    items_of,
    read_document,
)
from safenav.world.map import HEADINGS, Region, RegionMap
from safenav.world.poses import Mobility


class _Placing:
    """A reader of regions that reports no errors and accepts walls."""

    def __init__(self, world: RegionMap, names: Iterable[tuple[Scalar, Node]]) -> None:
        self.world = world
        self._reader = Reading("", world=replace(world, walls=frozenset(), names={}))
        found = ((name.text, self._reader.region(node, "")) for name, node in names)
        self.names = {name: region for name, region in found if region is not None}
        self._reader.names = self.names

    def region(self, node: Node | None) -> Region | None:
        return self._reader.region(node, "")

    def target(self, node: Node | None) -> list[Region]:
        """Return the regions of a target in the order of the text."""
        listed = below(node, "any")
        items = listed.items if isinstance(listed, Sequence) else (node,) if node else ()
        found = (self._reader.regions(item, "") or () for item in items)
        return [region for regions in found for region in sorted(regions)]

    def zone(self, node: Node | None) -> frozenset[Region]:
        """Return the regions of a target or a list of targets."""
        listed = items_of(node) or [node]
        return frozenset(region for one in listed for region in self.target(one))


def drawing_of(text: str, stem: str, world: RegionMap, catalogue: Catalogue) -> dict[str, Any]:
    """Return the drawing of a text on its map. ``stem``: the default name of a scenario."""
    root = read_document(text).root
    placing = _Placing(world, entries_of(below(root, "map", "names")))
    robots = [r for r in _robots(root, placing) if r["start"] is not None]
    obstacles, orders = (list(_obstacles(root, placing, key)) for key in ("obstacles", "orders"))
    hidden = [
        *(_hidden(each, "", catalogue) for each in obstacles),
        *(_hidden(each, "order ", catalogue) for each in orders),
    ]
    still = Run(
        name=_text(below(root, "name")) or stem,
        map=world,
        robots=tuple(_tracks(robots, catalogue)),
        hidden={each.name: each for each in hidden},
        chargers=tuple(sorted(placing.zone(below(root, "chargers")))),
        exclusions=tuple(_exclusions(root, placing)),
    )
    return {
        "run": encoded(still, "scenario"),
        "robots": robots,
        "obstacles": obstacles,
        "grid": isinstance(below(root, "map", "grid"), Scalar | Sequence),
    }


def palette(catalogue: Catalogue) -> dict[str, Any]:
    """Return the kinds of robots and obstacles that a user can place on the map, as data."""
    return {
        "robots": [
            {
                "name": model.name,
                "turns": model.mobility is Mobility.HEADING,
                "layer": model.layer,
                "can": sorted(model.capabilities),
            }
            for model in catalogue.robots.values()
        ],
        "obstacles": [
            {
                "name": kind.name,
                "actions": [*dict.fromkeys(need.action for need in kind.needs)],
                "truth": kind.has_truth,
                "blocks": kind.blocks is None or len(kind.blocks) > 0,
            }
            for kind in catalogue.obstacles.values()
        ],
        "objectives": [
            {
                "kind": key,
                "label": key.capitalize(),
                "meaning": kind.meaning,
                "drawing": kind.drawing,
                "least": kind.least,
                "most": 1 if kind.one else None,
                "one": kind.one,
            }
            for key, kind in KINDS.items()
        ],
    }


def _robots(root: Node, placing: _Placing) -> Iterable[dict[str, Any]]:
    for key, node in entries_of(below(root, "robots")):
        objective = below(node, "objective")
        kind, nodes = _stated(objective)
        heading = below(node, "heading")
        yield {
            "name": key.text,
            "model": _text(below(node, "model")),
            "start": placing.region(below(node, "start")),
            "heading": _text(heading) if _text(heading) in HEADINGS else None,
            "kind": kind or None,
            "targets": [placing.target(target) for target in nodes],
            "areas": [area if area in placing.world.areas else None for area in map(_text, nodes)],
            "avoid": sorted(placing.zone(below(objective, "avoid"))),
        }


def _stated(objective: Node | None) -> tuple[str, tuple[Node, ...]]:
    """Return the kind of an unchecked objective (empty if unknown) and the nodes of its targets."""
    for key, value in entries_of(objective):
        if key.text == "ltl":
            return key.text, ()
        if (kind := KINDS.get(key.text)) is not None:
            listed = isinstance(value, Sequence) and not kind.one
            return key.text, items_of(value) if listed else (value,)
    return "", ()


def _obstacles(root: Node, placing: _Placing, key: str) -> Iterable[dict[str, Any]]:
    """Yield the entries of a ``key`` (``obstacles`` or ``orders``) with regions on the map."""
    for index, node in enumerate(items_of(below(root, key))):
        region = placing.region(below(node, "region"))
        if region is not None and isinstance(node, Mapping):
            kind = _text(below(node, "type"))
            yield {"index": index, "type": kind, "region": region}


def _exclusions(root: Node, placing: _Placing) -> Iterable[Exclusion]:
    for node in items_of(below(root, "never_together")):
        robots = frozenset(map(_text, items_of(below(node, "robots"))))
        yield Exclusion(robots, placing.zone(below(node, "in")))


def _tracks(robots: list[dict[str, Any]], catalogue: Catalogue) -> Iterable[RobotTrack]:
    """Yield the tracks of the robots before any move."""
    style = looks([robot["name"] for robot in robots])
    for robot, look in zip(robots, style, strict=True):
        model = catalogue.robots.get(robot["model"])
        turns = model is not None and model.mobility is Mobility.HEADING
        heading = HEADINGS.get(robot["heading"] or "north") if turns else None
        can = tuple(sorted(model.capabilities)) if model else ()
        pose, pursues = ([robot["start"]], [heading]), Changes.of(_objective(robot))
        yield RobotTrack(robot["name"], robot["model"], can, look, *pose, pursues)


def _hidden(obstacle: dict[str, Any], key: str, catalogue: Catalogue) -> Hidden:
    """Return an undiscovered obstacle or order. ``key`` distinguishes equal names."""
    kind = catalogue.obstacles.get(obstacle["type"])
    actions = ("?",) if kind is None else tuple(need.action for need in kind.needs)
    name = f"{obstacle['type']}@{obstacle['region']} {key}{obstacle['index']}"
    status = Changes.of(ObstacleStatus.HIDDEN)
    return Hidden(name, obstacle["type"], obstacle["region"], actions, status, ordered=bool(key))


def _objective(robot: dict[str, Any]) -> Objective | None:
    targets = tuple(frozenset(target) for target in robot["targets"] if target)
    kind = KINDS.get(robot["kind"])
    if not targets or kind is None or kind.wrong(targets):
        return None
    return kind(targets, avoid=frozenset(robot["avoid"]))


def _text(node: Node | None) -> str:
    return str(node.value) if isinstance(node, Scalar) else ""
