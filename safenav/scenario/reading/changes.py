"""The ``changes:`` of a scenario: changes for robots during the run."""

from __future__ import annotations

from typing import ClassVar

from msgspec.structs import replace

from safenav.scenario.objective import Ltl, Objective, kinds_that, one_of
from safenav.scenario.reading.objective import ObjectiveKeys, read_objective, read_within
from safenav.scenario.reading.obstacles import TICK
from safenav.scenario.reading.regions import Reading
from safenav.scenario.reading.robots import misses_targets
from safenav.scenario.settings import RobotChange
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node, clipped
from safenav.scenario.yaml.shapes import TEXT, Key, Table, form, many, word

SERVICE = {"out": False, "back": True}


class ChangeKeys(Table):
    definition = "change"
    rules: ClassVar = {"oneOf": ({"required": ["objective"]}, {"required": ["service"]})}
    at = Key(TICK, "The tick at which it applies.", required="for example 'at: 12'")
    robot = Key(TEXT, required="the name of a robot of the team")
    objective = Key(form(ObjectiveKeys), "Its objective from then on; not 'ltl'.")
    service = Key(word(SERVICE), "out: it stops; back: it continues.")


CHANGES = form(many(ChangeKeys))


def read_changes(node: Node | None, reading: Reading) -> tuple[RobotChange, ...]:
    """Return the readable changes by tick, those of one tick in the order of the file; errors in
    the others are reported."""
    found = [_change(item, reading) for item in read.sequence(node, "changes", reading) or ()]
    return tuple(sorted((c for c in found if c is not None), key=lambda change: change.at))


def _change(node: Node, reading: Reading) -> RobotChange | None:
    item = ChangeKeys.read(node, "a change", reading)
    if item is None:
        return None
    before = len(reading)
    at, name = item.at, item.robot
    shown = name or "a change"
    if name is not None and name not in reading.named:
        reading.unknown(item.where(ChangeKeys.robot), "no robot is named", name, reading.named)
    item.of = f"of {shown}"
    active, at_service = item.service, item.where(ChangeKeys.service)
    if (item.objective is None) is (at_service is None):
        found = f"a change of {clipped(name or 'a robot')} needs exactly one of 'objective' and"
        hint = "give it an 'objective', or 'service: out' or 'service: back'; one for each change"
        reading.add(node, f"{found} 'service'", hint)
    objective = _objective(item.objective, name, reading)
    within = read_within(item.objective, shown, objective, reading)
    if at is None or name is None or len(reading) > before:
        return None
    return RobotChange(at, name, objective, active, within)


def _objective(node: Node | None, name: str | None, reading: Reading) -> Objective | None:
    robot = next((robot for robot in reading.team if robot.name == name), None)
    mobility = None if robot is None else robot.model.mobility
    found = read_objective(node, name or "a change", mobility, reading)
    if node is None:
        return None
    if isinstance(found, Ltl):
        hint = f"'ltl' cannot be assigned during a run: use {one_of(kinds_that())}"
        reading.add(node, f"objective of {name}: 'ltl' in a change", hint)
        return None
    if robot is not None and robot.when:
        reading.add(node, f"objective of {name}: its 'when' determines it")
    charged = robot is not None and robot.model.battery is not None
    if charged and found is not None and not found.ordered():
        kinds = one_of(kinds_that(lambda kind: kind.ordered()), chr(39))
        said = f"{name} has a battery, and gets an objective without an order of its targets"
        reading.add(node, said, f"use {kinds}")
    if found is not None and robot is not None:
        misses_targets(replace(robot, objective=found), node, reading)
    return found
