"""The ``expect:`` of a scenario: what a run of it should give."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from safenav.outcome import Outcome
from safenav.scenario.event_pattern import EventKind, EventPattern
from safenav.scenario.model import Obstacle, name_parts
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.settings import Expect
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import TEXT, Key, Table, choice, either, form, many, named, whole

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


MISSION = "mission"
OUTCOMES = [outcome for outcome in Outcome if outcome is not Outcome.ERROR]
"""How a run can end but for a defect."""

_NAME = {"description": "An obstacle: type@region.", "type": "string", "pattern": "^.+@.+$"}
_OBSTACLES = form(many(_NAME), "obstacleNames")
_EVENTS = form(
    many({"type": "string", "pattern": rf"^\s*({'|'.join(EventKind)})(\s.*)?$"}), "eventPatterns"
)


class TickKeys(Table):
    at_least = Key(whole(1), "The least ticks.")
    at_most = Key(whole(1), "The most ticks.")


class ExpectKeys(Table):
    about = "The expected result of a run; only the keys that are given are checked."
    definition = "expect"
    outcome = Key(choice(OUTCOMES), "How the run ends.")
    late = Key(form(many(TEXT)), "Exactly the broken promises: robots, obstacles, mission.")
    resolved = Key(_OBSTACLES, "Exactly the obstacles that are resolved.")
    blocked = Key(_OBSTACLES, "Exactly the obstacles that join the known ones.")
    helpers = Key(
        form(named(TEXT, {"pattern": "^.+@.+$"})), "Which robot helps with which obstacle."
    )
    ticks = Key(form(either(whole(1), TickKeys)), "At most this many ticks, or bounds.")
    rounds = Key(
        form(either(whole(1), named(whole()))),
        "At least this many rounds of every robot, or of each.",
    )
    order = Key(_EVENTS, "Events that happen in this order, among others.")
    never = Key(_EVENTS, "Events that do not happen.")


class ExpectationReader:
    """Reads expectations about the given obstacles and robots (names).

    ``obstacles`` is None if they are not all known because some were reported. ``anywhere``: the
    type of obstacle that may appear in any region.
    """

    def __init__(
        self,
        regions: RegionReader,
        obstacles: Sequence[Obstacle] | None,
        robots: Sequence[str],
        findings: Findings,
        anywhere: str = "",
    ) -> None:
        self._regions = regions
        self._obstacles = obstacles
        self._robots = robots
        self._findings = findings
        self._anywhere = anywhere

    def read(self, node: Node | None) -> Expect:
        item = ExpectKeys.read(node, "expect", self._findings)
        if item is None:
            return Expect()
        least_ticks, ticks = self._ticks(item.ticks)
        patterns = EventPatternReader(self._regions, self._robots, self._obstacle, self._findings)
        return Expect(
            item.outcome,
            self._names(item.resolved, "'resolved' of expect"),
            self._names(item.blocked, "'blocked' of expect"),
            self._helpers(item.helpers),
            ticks,
            least_ticks,
            self._rounds(item.rounds),
            patterns.read_all(item.order, "'order' of expect"),
            patterns.read_all(item.never, "'never' of expect"),
            self._late(item.late),
        )

    def _late(self, node: Node | None) -> frozenset[str] | None:
        """Robots whose rounds, obstacles whose resolutions, and ``mission``."""
        what = "'late' of expect"
        items = read.sequence(node, what, self._findings)
        if items is None:
            return None
        names = [read.text(item, f"an item of {what}", self._findings) for item in items]
        known = {*self._robots, MISSION}
        found = [
            name if name in known else self._obstacle(item, name, what)
            for item, name in zip(items, names, strict=True)
            if name is not None
        ]
        return frozenset(name for name in found if name is not None)

    def _ticks(self, node: Node | None) -> tuple[int | None, int | None]:
        """The least and the most ticks: ``40`` or ``{at_least: 10, at_most: 40}``."""
        what = "'ticks' of expect"
        if not isinstance(node, Mapping):
            return None, read.integer(node, what, self._findings, least=1)
        item = TickKeys.read(node, what, self._findings, f"in {what}")
        least, most = (item.at_least, item.at_most) if item else (None, None)
        if least is not None and most is not None and least > most:
            self._findings.add(node, f"{what}: at least {least} and at most {most}")
        return least, most

    def _rounds(self, node: Node | None) -> dict[str, int] | None:
        """``2`` for every robot, or robot by robot."""
        what = "'rounds' of expect"
        if not isinstance(node, Mapping):
            rounds = read.integer(node, what, self._findings, least=1)
            return None if rounds is None else dict.fromkeys(self._robots, rounds)
        found = {}
        for key, value in node.entries:
            rounds = read.integer(value, f"{what}, {clipped(key.text)}", self._findings)
            if key.text not in self._robots:
                told = f"{what}: no robot is named '{clipped(key.text)}'"
                self._findings.add(key, told, suggestion(key.text, self._robots))
            elif rounds is not None:
                found[key.text] = rounds
        return found

    def _names(self, node: Node | None, what: str) -> frozenset[str] | None:
        items = read.sequence(node, what, self._findings)
        if items is None:
            return None
        found = []
        for item in items:
            name = read.text(item, f"an item of {what}", self._findings)
            if name is not None:
                found.append(self._obstacle(item, name, what))
        return frozenset(name for name in found if name is not None)

    def _helpers(self, node: Node | None) -> dict[str, str] | None:
        item = read.mapping(node, "'helpers' of expect", self._findings)
        if item is None:
            return None
        helpers = {}
        for key, value in item.entries:
            obstacle = self._obstacle(key, key.text, "'helpers' of expect")
            robot = read.text(value, f"helper for {clipped(key.text)}", self._findings)
            if robot is not None and robot not in self._robots:
                found = f"'helpers' of expect: no robot is named '{clipped(robot)}'"
                self._findings.add(value, found, suggestion(robot, self._robots))
            elif robot is not None and obstacle is not None:
                helpers[obstacle] = robot
        return helpers

    def _obstacle(self, node: Node, written: str, what: str) -> str | None:
        """The obstacle's name with its region as a number; ``door@dock`` is understood."""
        if self._obstacles is None:
            return None
        kind, where, number = name_parts(written)
        region = self._regions.written(where)
        for obstacle in self._obstacles:
            named = obstacle.type.name, obstacle.region, obstacle.number
            if named == (kind, region, number):
                return obstacle.name
        if kind == self._anywhere and region is not None:
            return f"{kind}@{region}"
        names = [obstacle.name for obstacle in self._obstacles]
        hint = suggestion(written, names) or "the scenario has no obstacles"
        assert isinstance(node, Scalar)
        self._findings.add(node, f"{what}: there is no obstacle '{clipped(written)}'", hint)
        return None
