"""Interventions in words: as data of a page, or as a line of a terminal or a file.

A line begins with its kind: ``resolved door@47``, ``put_back digit 46 east``, ``give_up``; see
``LINES``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import yaml

from safenav.errors import UsageError
from safenav.runtime.intervention import kinds
from safenav.scenario.model import Scenario, name_parts
from safenav.scenario.objective import USAGE
from safenav.scenario.reading.events import read_changes
from safenav.scenario.reading.loader import check_assignable
from safenav.scenario.reading.regions import Reading
from safenav.scenario.settings import Coordination
from safenav.scenario.yaml.document import DocumentError, Node, read_document
from safenav.scenario.yaml.source import parsed
from safenav.world.map import HEADINGS
from safenav.world.moves import Pose

LINES = {
    "resolved": "resolved OBSTACLE",
    "permanent": "permanent OBSTACLE",
    "put_back": "put_back ROBOT REGION [HEADING]",
    "service": "service ROBOT out|back",
    "objective": f"objective ROBOT {USAGE}",
    "order": "order TYPE REGION",
    "input": "input NAME on|off",
    "give_up": "give_up",
}


def read_intervention(line: str, scenario: Scenario) -> kinds.Intervention:
    """Return the intervention of a line of words. Raises UsageError, with the expected form."""
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
    return intervention(data, scenario)


def _value(text: str) -> object:
    try:
        read_document(text)  # checks the limits of depth and size
        return yaml.safe_load(text)
    except (DocumentError, yaml.YAMLError) as error:
        why = f": {error.found}" if isinstance(error, DocumentError) else ""
        raise UsageError(f"'{text[:60]}' is not valid YAML{why}") from error


def intervention(data: Mapping[str, Any], scenario: Scenario) -> kinds.Intervention:
    """Return the change that a page requests, read like the parts of a scenario. Raises UsageError
    for an impossible one."""
    reading = Reading("the change", world=scenario.map, reachable=False)
    found = _read(data, scenario, reading)
    reading.refuse_if_any()
    if found is None:
        known = "close, open, order, truth, objective, service, input, resolved, permanent"
        raise UsageError(f"unknown change; known: {known}, put_back, give_up")
    return found


def _read(
    data: Mapping[str, Any], scenario: Scenario, reading: Reading
) -> kinds.Intervention | None:
    types = scenario.catalogue.obstacles
    match data.get("kind"):
        case "close" | "order" as kind:
            name = str(data.get("type"))
            if name not in types:
                raise UsageError(f"the catalogue has no obstacle type '{name[:40]}'")
            region = reading.region(_node(data.get("region"), reading), "'region'")
            truth = bool(data.get("truth", True)) if types[name].has_truth else None
            if region is None or kind == "order":
                return None if region is None else kinds.PlaceOrder(types[name], region)
            return kinds.AddObstacle(types[name], region, truth)
        case "input":
            return kinds.SetInput(str(data.get("input")), bool(data.get("on")))
        case "open":
            return kinds.RemoveObstacle(str(data.get("obstacle")))
        case "resolved":
            return kinds.MarkResolved(_obstacle(data, reading))
        case "permanent":
            return kinds.MarkPermanent(_obstacle(data, reading))
        case "put_back":
            place = reading.region(_node(data.get("region"), reading), "'region'")
            heading = data.get("heading")
            if heading is not None and heading not in HEADINGS:
                raise UsageError(f"unknown heading '{str(heading)[:40]}'")
            if place is None:
                return None
            return kinds.PutBack(str(data.get("robot")), Pose.of(place, heading))
        case "give_up":
            return kinds.GiveUp()
        case "truth":
            return kinds.SetTruth(str(data.get("obstacle")), bool(data.get("traversable")))
        case "objective" | "service" as kind:
            what = "back" if data.get("active") else "out"
            value = data.get("objective") if kind == "objective" else what
            reading.team = scenario.robots
            reading.named = tuple(robot.name for robot in scenario.robots)
            listed = [{"at": 1, "robot": data.get("robot"), kind: value}]
            changes = read_changes(_node(listed, reading), reading)
            if scenario.coordination is Coordination.ASSIGNABLE:
                check_assignable((), changes, None, reading)
            for change in changes:
                if change.objective is not None:
                    return kinds.AssignObjective(change.robot, change.objective)
                return kinds.SetService(change.robot, change.active is True)
    return None


def _obstacle(data: Mapping[str, Any], reading: Reading) -> str:
    """The obstacle's name with its region as a number: reports print ``door@gate``."""
    written = str(data.get("obstacle"))
    kind, where, number = name_parts(written)
    region = reading.written(where)
    return written if region is None else f"{kind}@{region}" + f"#{number}" * (number > 1)


def _node(data: object, reading: Reading) -> Node | None:
    return parsed(json.dumps(data), reading)
