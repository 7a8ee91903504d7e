"""Interventions: a user's possible changes between two ticks, read from the words of a terminal, a
file or a program, or from the data of a page.

A line begins with its kind: ``resolved door@47``, ``put_back digit 46 east``, ``give_up``; see
``LINES``.
"""

import json
from collections.abc import Mapping
from typing import Any

import yaml
from msgspec import Struct

from safenav.errors import UsageError
from safenav.scenario.model import Coordination, Obstacle, Scenario, name_parts
from safenav.scenario.objective import Objective
from safenav.scenario.reading.events import read_changes
from safenav.scenario.reading.loader import check_assignable
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import DocumentError, Node, read_document
from safenav.scenario.yaml.findings import parsed
from safenav.world.map import HEADINGS
from safenav.world.poses import Pose


class Intervention(Struct, frozen=True):
    """A change by a user. ``kind``: see ``LINES``; in a simulated world also ``close``: the
    ``obstacle`` appears as soon as no robot is there, ``open``: one disappears. ``name``: that of
    the robot, the obstacle or the input; ``on``: whether the robot is in service, or the input on
    from now on."""

    kind: str
    name: str = ""
    on: bool = False
    obstacle: Obstacle | None = None
    pose: Pose | None = None
    objective: Objective | None = None


LINES = {
    "resolved": "resolved OBSTACLE",
    "permanent": "permanent OBSTACLE",
    "put_back": "put_back ROBOT REGION [HEADING]",
    "service": "service ROBOT out|back",
    "objective": "objective ROBOT {visit: [A, B]}",
    "order": "order TYPE REGION",
    "input": "input NAME on|off",
    "give_up": "give_up",
}
KEYS = {
    "close": "type region truth?",
    "open": "obstacle",
    "resolved": "obstacle",
    "permanent": "obstacle",
    "put_back": "robot region heading?",
    "service": "robot active",
    "objective": "robot objective",
    "order": "type region",
    "input": "input on",
    "give_up": "",
}
"""The keys of the data of each kind; one with ``?`` may be missing."""


def read_intervention(wanted: str | Mapping[str, Any], scenario: Scenario) -> Intervention:
    """Return the intervention of a line of words, or of data that a page sends, read like the parts
    of a scenario. Raises UsageError for an impossible one, with the expected form."""
    data = _data(wanted) if isinstance(wanted, str) else wanted
    kind = data.get("kind") if isinstance(data, Mapping) else None
    if not isinstance(kind, str) or kind not in KEYS:
        raise UsageError(f"unknown change; known: {', '.join(KEYS)}")
    keys = KEYS[kind].split()
    known = [key.rstrip("?") for key in keys]
    if unknown := [f"'{str(key)[:40]}'" for key in data if key not in ("kind", *known)]:
        raise UsageError(f"'{kind}' has no key {unknown[0]}; known: {', '.join(known) or 'none'}")
    if missing := [key for key in keys if key[-1] != "?" and data.get(key) is None]:
        raise UsageError(f"'{kind}' needs '{missing[0]}'; known: {', '.join(known)}")
    reading = Reading("the change", world=scenario.map, reachable=False)
    found = _read(data, scenario, reading)
    reading.refuse_if_any()
    assert found is not None, "a change without an error is read"
    return found


def _data(line: str) -> dict[str, Any]:
    """Return the data of a line of words."""
    word, *rest = line.split(maxsplit=2) or [""]
    if word not in LINES:
        raise UsageError(f"unknown intervention '{word[:40]}'; known: {'; '.join(LINES.values())}")
    data: dict[str, Any] = {"kind": word}
    match word, rest:
        case (("resolved" | "permanent"), [_, *_]):
            data["obstacle"] = line.split(maxsplit=1)[1].strip().strip("'\"")
        case "put_back", [robot, where]:
            place, *heading = where.rsplit(maxsplit=1) if where.split()[1:] else [where]
            if heading and heading[0] not in HEADINGS:
                place, heading = where, []
            data |= {
                "robot": robot,
                "region": _value(place),
                "heading": heading[0] if heading else None,
            }
        case "service", [robot, ("out" | "back") as way]:
            data |= {"robot": robot, "active": way == "back"}
        case "order", [kind, place]:
            data |= {"type": kind, "region": _value(place)}
        case "input", [name, ("on" | "off") as value]:
            data |= {"input": name, "on": value == "on"}
        case "objective", [robot, objective]:
            data |= {"robot": robot, "objective": _value(objective)}
        case "give_up", []:
            pass
        case _:
            raise UsageError(f"expected: {LINES[word]}; found '{line.strip()[:60]}'")
    return data


def _value(text: str) -> object:
    try:
        read_document(text)  # checks the limits of depth and size
        return yaml.safe_load(text)
    except (DocumentError, yaml.YAMLError) as error:
        why = f": {error.found}" if isinstance(error, DocumentError) else ""
        raise UsageError(f"'{text[:60]}' is not valid YAML{why}") from error


def _read(data: Mapping[str, Any], scenario: Scenario, reading: Reading) -> Intervention | None:
    types = scenario.catalogue.obstacles
    match data.get("kind"):
        case "close" | "order" as kind:
            name = str(data.get("type"))
            if name not in types:
                raise UsageError(f"the catalogue has no obstacle type '{name[:40]}'")
            region = reading.region(_node(data.get("region"), reading), "'region'")
            truth = _flag({"truth": True, **data}, "truth") if kind == "close" else True
            if not (truth or types[name].has_truth):
                raise UsageError(f"'truth': {name} has none")
            if region is None:
                return None
            revealed = truth if types[name].has_truth else None
            new = Obstacle(types[name], region, revealed, ordered=kind == "order")
            return Intervention(kind, new.name, obstacle=new)
        case "input":
            return Intervention("input", str(data.get("input")), _flag(data, "on"))
        case "open":
            return Intervention("open", str(data.get("obstacle")))
        case "resolved" | "permanent" as kind:
            return Intervention(kind, _obstacle(data, reading))
        case "put_back":
            place = reading.region(_node(data.get("region"), reading), "'region'")
            heading = data.get("heading")
            if heading is not None and heading not in [*HEADINGS]:
                raise UsageError(f"unknown heading '{str(heading)[:40]}'")
            if place is None:
                return None
            return Intervention("put_back", str(data.get("robot")), pose=Pose.of(place, heading))
        case "give_up":
            return Intervention("give_up")
        case "objective" | "service" as kind:
            if kind == "objective":
                value = data.get("objective")
            else:
                value = "back" if _flag(data, "active") else "out"
            reading.team = scenario.robots
            reading.named = tuple(robot.name for robot in scenario.robots)
            listed = [{"at": 1, "robot": data.get("robot"), kind: value}]
            changes = read_changes(_node(listed, reading), reading)
            if scenario.coordination is Coordination.ASSIGNABLE:
                check_assignable((), changes, None, reading)
            for each in changes:
                return Intervention(kind, each.robot, bool(each.active), objective=each.objective)
    return None


def _flag(data: Mapping[str, Any], key: str) -> bool:
    """A truth value, which must be stated as one: any text would count as true, even ``"out"``."""
    value = data.get(key)
    if not isinstance(value, bool):
        raise UsageError(f"'{key}' must be true or false, not {value!r}")
    return value


def _obstacle(data: Mapping[str, Any], reading: Reading) -> str:
    """Return the obstacle's name with its region as a number: reports print ``door@gate``."""
    written = str(data.get("obstacle"))
    kind, where, number = name_parts(written)
    region = reading.written(where)
    return written if region is None else f"{kind}@{region}" + f"#{number}" * (number > 1)


def _node(data: object, reading: Reading) -> Node | None:
    return parsed(json.dumps(data), reading)
