"""The ``changes:`` for robots during a run, and the ``inputs:`` that the environment sets."""

from __future__ import annotations

import re
from typing import ClassVar

from msgspec.structs import replace

from safenav.scenario.objective import Ltl, Objective, kinds_that, one_of
from safenav.scenario.reading.objective import (
    VARIABLE,
    ObjectiveKeys,
    is_reserved,
    read_objective,
    read_within,
)
from safenav.scenario.reading.obstacles import MOST_TICKS, TICK
from safenav.scenario.reading.regions import Reading
from safenav.scenario.reading.robots import misses_targets
from safenav.scenario.settings import Input, RobotChange
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.fields import IDENTIFIER, well_named
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.shapes import Key, Shape, Table

SERVICE = {"out": False, "back": True}


class ChangeKeys(Table):
    definition = "change"
    rules: ClassVar = {"oneOf": ({"required": ["objective"]}, {"required": ["service"]})}
    at = Key(TICK, "The tick at which it applies.", required="for example 'at: 12'")
    robot = Key(shapes.TEXT, required="the name of a robot of the team")
    objective = Key(shapes.form(ObjectiveKeys), "Its objective from then on; not 'ltl'.")
    service = Key(shapes.word(SERVICE), "out: it stops; back: it continues.")


CHANGES = shapes.form(shapes.many(ChangeKeys))


def read_changes(node: Node | None, reading: Reading) -> tuple[RobotChange, ...]:
    """Return the readable changes by tick, those of one tick in the order of the file; errors in
    the others are reported."""
    found = [
        _change(item, reading) for item in ChangeKeys.each(node, "changes", "a change", reading)
    ]
    return tuple(sorted((c for c in found if c is not None), key=lambda change: change.at))


def _change(item: ChangeKeys, reading: Reading) -> RobotChange | None:
    before = len(reading)
    at, name = item.at, item.robot
    shown = name or "a change"
    if name is not None:
        reading.names_robot(item.where(ChangeKeys.robot), name)
    item.of = f"of {shown}"
    active, at_service = item.service, item.where(ChangeKeys.service)
    if (item.objective is None) is (at_service is None):
        found = f"a change of {clipped(name or 'a robot')} needs exactly one of 'objective' and"
        hint = "give it an 'objective', or 'service: out' or 'service: back'; one for each change"
        reading.add(item.node, f"{found} 'service'", hint)
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
        message = f"{name} has a battery, and gets an objective without an order of its targets"
        reading.add(node, message, f"use {kinds}")
    if found is not None and robot is not None:
        misses_targets(replace(robot, objective=found), node, reading)
    return found


_SPAN = re.compile(r"(\d{1,9})(?:\s*-\s*(\d{1,9}))?")
_AGAIN = {"off": (False,), "on": (True,), "both": (False, True)}
_TICKS = shapes.either(TICK, shapes.matching(_SPAN))


def _spans(node: Node | None, what: str, findings: Findings) -> tuple[tuple[int, int], ...]:
    """Return ticks and ranges of ticks: ``12``, ``10-20``, or a list of both."""
    found = []
    for part in node.items if isinstance(node, Sequence) else () if node is None else (node,):
        text = str(part.value) if isinstance(part, Scalar) else ""
        match = _SPAN.fullmatch(text)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
        if not 1 <= first <= last <= MOST_TICKS:
            hint = "for example at: [12, 20-30]; ticks count from 1"
            message = f"{what}: found {read.described(part)}, expected a tick or a range of ticks"
            findings.add(part, message, hint)
        found.append((first, last))
    return tuple(found)


def _again(node: Node | None, what: str, findings: Findings) -> tuple[bool, ...]:
    """Return the values of ``off``, ``on`` or ``both``; YAML may read two of them as Booleans."""
    if node is None:
        return ()
    value = node.value if isinstance(node, Scalar) else None
    word = {True: "on", False: "off"}.get(value) if isinstance(value, bool) else value
    if not isinstance(word, str) or word not in _AGAIN:
        found = f"{what}: found {read.described(node)}, expected off, on or both"
        findings.add(node, found, "the value that the input has infinitely often")
        return ()
    return _AGAIN[word]


class InputKeys(Table):
    definition = "input"
    example = "{at: 12-30}; {} for one that a program sets"
    at = Key(
        Shape(shapes.either(_TICKS, shapes.many(_TICKS)), _spans),
        "Ticks when a simulation has it on: 12, 20-30 or a list.",
    )
    always_eventually = Key(
        Shape({"enum": [*_AGAIN, True, False]}, _again),
        "Assumed infinitely often: off, on or both.",
    )


INPUTS = shapes.form(shapes.named(InputKeys, VARIABLE))


def read_inputs(node: Node | None, reading: Reading) -> tuple[Input, ...]:
    """Return the named inputs; errors are reported."""
    item, found = read.mapping(node, "inputs", reading, example="{alarm: {at: 12-30}}"), []
    for key, value in item.entries if item else ():
        name = clipped(key.text)
        what = f"input {name}"
        taken = is_reserved(key.text) or key.text in reading.named
        if well_named(key, "an input", reading, IDENTIFIER) and taken:
            reading.add(key, f"'{name}' is reserved", "use another name")
        fields = InputKeys.read(value, what, reading)
        if fields is None:
            found.append(Input(key.text))
            continue
        spans, again = fields.at or (), fields.always_eventually or ()
        found.append(Input(key.text, spans, again))
    return tuple(found)
