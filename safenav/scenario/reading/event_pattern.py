"""Reads patterns of events: a kind, then robots, an obstacle, a region, in any order."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from safenav.scenario.event_pattern import EventKind, EventPattern
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node, clipped
from safenav.scenario.yaml.findings import Findings, suggestion

# A region may be written [row, col], alone or in an obstacle's name: one word all the same.
_WORD = re.compile(r"(?:\[[^\]]*\]|[^\s\[])+")


class EventPatternReader:
    """``obstacle`` reads an obstacle's name (None: reported, or obstacles are not known)."""

    def __init__(
        self,
        regions: RegionReader,
        robots: Sequence[str],
        obstacle: Callable[[Node, str, str], str | None],
        findings: Findings,
    ) -> None:
        self._regions = regions
        self._robots = robots
        self._obstacle = obstacle
        self._findings = findings

    def read_all(self, node: Node | None, what: str) -> tuple[EventPattern, ...] | None:
        """A list of patterns."""
        items = read.sequence(node, what, self._findings)
        if items is None:
            return None
        found = [self._read(item, f"an item of {what}") for item in items]
        return tuple(pattern for pattern in found if pattern is not None)

    def _read(self, node: Node, what: str) -> EventPattern | None:
        text = read.text(node, what, self._findings)
        if text is None:
            return None
        word, *others = _WORD.findall(text) or [text]
        kinds = [kind.value for kind in EventKind]
        if word not in kinds:
            found = f"{what}: there is no event '{clipped(word)}'"
            self._findings.add(node, found, suggestion(word, kinds))
            return None
        robots: set[str] = set()
        obstacles: list[str | None] = []
        regions: list[frozenset[int]] = []
        for other in others:
            region = self._regions.written(other)
            if "@" in other:
                obstacles.append(self._obstacle(node, other, what))
            elif other in self._robots:
                robots.add(other)
            elif region is not None:
                regions.append(frozenset({region}))
            elif area := self._regions.areas.get(other):
                regions.append(area)
            else:
                found = f"{what}: '{clipped(other)}' is not a robot, obstacle, region or area"
                self._findings.add(node, found, suggestion(other, self._robots))
                return None
        if len(obstacles) > 1 or len(regions) > 1:
            found = f"{what}: '{clipped(text)}' names more than one obstacle or region"
            self._findings.add(node, found, "an event names at most one obstacle and one region")
            return None
        obstacle = obstacles[0] if obstacles else None
        named = regions[0] if regions else frozenset()
        return EventPattern(EventKind(word), frozenset(robots), obstacle, named)
