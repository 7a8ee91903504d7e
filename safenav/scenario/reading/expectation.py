"""The ``expect:`` of a scenario: the expected results of a run."""

from __future__ import annotations

import re
from collections.abc import Collection

from safenav.outcome import Outcome
from safenav.scenario.event_pattern import EventKind, EventPattern
from safenav.scenario.reading.regions import Reading
from safenav.scenario.settings import Expect
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, clipped
from safenav.scenario.yaml.findings import suggestion
from safenav.scenario.yaml.shapes import (
    TEXT,
    Key,
    Shape,
    Table,
    choice,
    either,
    many,
    named,
    whole,
)

# A region written [row, col], alone or in an obstacle's name, is one word.
_WORD = re.compile(r"(?:\[[^\]]*\]|[^\s\[])+")


MISSION = "mission"
OUTCOMES = [outcome for outcome in Outcome if outcome is not Outcome.ERROR]
"""The outcomes of a run without a defect of the program."""


class TickKeys(Table):
    at_least = Key(whole(1), "The least ticks.")
    at_most = Key(whole(1), "Maximum number of ticks.")


def _names(
    node: Node | None, what: str, reading: Reading, others: Collection[str] = ()
) -> frozenset[str] | None:
    """Return names of obstacles, or of ``others``."""
    items = read.sequence(node, what, reading)
    found = set()
    for item in items or ():
        name = read.text(item, f"an item of {what}", reading)
        if name is not None and name not in others:
            name = _obstacle(item, name, what, reading)
        found |= set() if name is None else {name}
    return None if items is None else frozenset(found)


def _late(node: Node | None, what: str, reading: Reading) -> frozenset[str] | None:
    return _names(node, what, reading, {*reading.named, MISSION})


def _ticks(node: Node | None, what: str, reading: Reading) -> tuple[int | None, int | None]:
    """Return the least and the most ticks: ``40`` or ``{at_least: 10, at_most: 40}``."""
    if not isinstance(node, Mapping):
        return None, read.integer(node, what, reading, least=1)
    item = TickKeys.read(node, what, reading, f"in {what}")
    least, most = (item.at_least, item.at_most) if item else (None, None)
    if least is not None and most is not None and least > most:
        reading.add(node, f"{what}: at least {least} and at most {most}")
    return least, most


def _rounds(node: Node | None, what: str, reading: Reading) -> dict[str, int] | None:
    """Return the rounds of each robot from one number for all, or one for each."""
    if not isinstance(node, Mapping):
        rounds = read.integer(node, what, reading, least=1)
        return None if rounds is None else dict.fromkeys(reading.named, rounds)
    found = {}
    for key, value in node.entries:
        rounds = read.integer(value, f"{what}, {clipped(key.text)}", reading)
        if key.text not in reading.named:
            reading.unknown(key, f"{what}: no robot is named", key.text, reading.named)
        elif rounds is not None:
            found[key.text] = rounds
    return found


def _helpers(node: Node | None, what: str, reading: Reading) -> dict[str, str] | None:
    item = read.mapping(node, what, reading)
    helpers = {}
    for key, value in item.entries if item else ():
        obstacle = _obstacle(key, key.text, what, reading)
        robot = read.text(value, f"helper for {clipped(key.text)}", reading)
        if robot is not None and robot not in reading.named:
            reading.unknown(value, f"{what}: no robot is named", robot, reading.named)
        elif robot is not None and obstacle is not None:
            helpers[obstacle] = robot
    return None if item is None else helpers


def _patterns(node: Node | None, what: str, reading: Reading) -> tuple[EventPattern, ...] | None:
    """Return a list of patterns of events."""
    items = read.sequence(node, what, reading)
    found = [_pattern(item, f"an item of {what}", reading) for item in items or ()]
    return None if items is None else tuple(pattern for pattern in found if pattern is not None)


def _pattern(node: Node, what: str, reading: Reading) -> EventPattern | None:
    text = read.text(node, what, reading)
    if text is None:
        return None
    word, *others = _WORD.findall(text) or [text]
    kinds = [kind.value for kind in EventKind]
    if word not in kinds:
        reading.unknown(node, f"{what}: there is no event", word, kinds)
        return None
    robots: set[str] = set()
    obstacles: list[str | None] = []
    regions: list[frozenset[int]] = []
    for other in others:
        region = reading.written(other)
        if "@" in other:
            obstacles.append(_obstacle(node, other, what, reading))
        elif other in reading.named:
            robots.add(other)
        elif region is not None:
            regions.append(frozenset({region}))
        elif area := reading.areas.get(other):
            regions.append(area)
        else:
            found = f"{what}: '{clipped(other)}' is not a robot, obstacle, region or area"
            reading.add(node, found, suggestion(other, reading.named))
            return None
    if len(obstacles) > 1 or len(regions) > 1:
        found = f"{what}: '{clipped(text)}' names more than one obstacle or region"
        reading.add(node, found, "an event names at most one obstacle and one region")
        return None
    obstacle = obstacles[0] if obstacles else None
    named = regions[0] if regions else frozenset()
    return EventPattern(EventKind(word), frozenset(robots), obstacle, named)


def _obstacle(node: Node, written: str, what: str, reading: Reading) -> str | None:
    """Return an obstacle's name with its region as a number: ``door@47`` for ``door@dock``. None if
    it was reported, or obstacles are not known."""
    if reading.obstacles is None:
        return None
    if (name := reading.obstacle_named(written)) is None:
        names = [obstacle.name for obstacle in reading.obstacles]
        nothing = "the scenario has no obstacles"
        reading.unknown(node, f"{what}: there is no obstacle", written, names, nothing)
    return name


_NAME = {"description": "An obstacle: type@region.", "type": "string", "pattern": "^.+@.+$"}
_OBSTACLES = Shape(many(_NAME), _names, "obstacleNames")
_EVENT = {"type": "string", "pattern": rf"^\s*({'|'.join(EventKind)})(\s.*)?$"}
_EVENTS = Shape(many(_EVENT), _patterns, "eventPatterns")


class ExpectKeys(Table):
    about = "The expected result of a run; only the keys that are given are checked."
    definition = "expect"
    example = "{outcome: completed}"
    outcome = Key(choice(OUTCOMES), "The outcome of the run.")
    late = Key(
        Shape(many(TEXT), _late), "Exactly the missed deadlines: robots, obstacles, mission."
    )
    resolved = Key(_OBSTACLES, "Exactly the obstacles that are resolved.")
    blocked = Key(_OBSTACLES, "Exactly the obstacles that become permanent.")
    helpers = Key(
        Shape(named(TEXT, {"pattern": "^.+@.+$"}), _helpers), "The helper of each obstacle."
    )
    ticks = Key(Shape(either(whole(1), TickKeys), _ticks), "At most this many ticks, or bounds.")
    rounds = Key(
        Shape(either(whole(1), named(whole())), _rounds),
        "At least this many rounds of every robot, or of each.",
    )
    order = Key(_EVENTS, "Events that happen in this order, among others.")
    never = Key(_EVENTS, "Events that do not happen.")


def _expect(node: Node | None, _what: str, reading: Reading) -> Expect:
    item = ExpectKeys.read(node, "expect", reading)
    given = {} if item is None else item.given(*item.known.values())
    given["least_ticks"], given["ticks"] = given.get("ticks", (None, None))
    return Expect(**given)


EXPECT = Shape(ExpectKeys, _expect)
