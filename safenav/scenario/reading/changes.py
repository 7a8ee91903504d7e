"""The ``changes:`` of a scenario: changes for robots during the run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from safenav.scenario.model import Robot
from safenav.scenario.objective import Ltl, Objective, avoided, kinds_that, one_of, targets_of
from safenav.scenario.reachability import Reachability
from safenav.scenario.reading.objective import ObjectiveKeys, ObjectiveReader
from safenav.scenario.reading.obstacles import TICK
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.settings import RobotChange
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import TEXT, Key, Table, form, many

SERVICE = {"out": False, "back": True}


class ChangeKeys(Table):
    definition = "change"
    rules: ClassVar = {"oneOf": ({"required": ["objective"]}, {"required": ["service"]})}
    at = Key(TICK, "The tick from which it holds.", required="for example 'at: 12'")
    robot = Key(TEXT, required="the name of a robot of the team")
    objective = Key(form(ObjectiveKeys), "Its objective from then on; not 'ltl'.")
    service = Key(form({"enum": tuple(SERVICE)}), "out: it stands still; back: it continues.")


CHANGES = form(many(ChangeKeys))


class ChangeReader:
    """Reads changes for the robots that could be read (``team``) of all that are ``named``."""

    def __init__(
        self,
        regions: RegionReader,
        team: Sequence[Robot],
        named: frozenset[str],
        findings: Findings,
        reachable: bool,
    ) -> None:
        self._regions = regions
        self._team = {robot.name: robot for robot in team}
        self._named = named
        self._findings = findings
        self._reachable = reachable

    def read(self, node: Node | None) -> tuple[RobotChange, ...]:
        """The changes that could be read, by tick, those of one tick as they stand; what is wrong
        with the others is reported."""
        found = [
            self._change(item) for item in read.sequence(node, "changes", self._findings) or ()
        ]
        return tuple(sorted((c for c in found if c is not None), key=lambda change: change.at))

    def _change(self, node: Node) -> RobotChange | None:
        item = ChangeKeys.read(node, "a change", self._findings)
        if item is None:
            return None
        before = len(self._findings)
        at, name = item.at, item.robot
        if name is not None and name not in self._named:
            hint = suggestion(name, self._named)
            self._findings.add(
                item.where(ChangeKeys.robot), f"no robot is named '{clipped(name)}'", hint
            )
        if (item.objective is None) is (item.service is None):
            what = "needs exactly one of 'objective' and 'service'"
            hint = (
                "give it an 'objective', or 'service: out' or 'service: back'; one for each change"
            )
            self._findings.add(node, f"a change of {clipped(name or 'a robot')} {what}", hint)
        objective, within = self._objective(item.objective, name)
        active = self._service(item.service, name)
        if at is None or name is None or len(self._findings) > before:
            return None
        return RobotChange(at, name, objective, active, within)

    def _objective(
        self, node: Node | None, name: str | None
    ) -> tuple[Objective | None, int | None]:
        if node is None:
            return None, None
        robot = self._team.get(name or "")
        reader = ObjectiveReader(self._regions, self._named, self._findings)
        mobility = robot.model.mobility if robot is not None else None
        found = reader.read(node, name or "a change", mobility)
        if isinstance(found, Ltl):
            hint = f"formulas can be given from the beginning only: {one_of(kinds_that())}"
            self._findings.add(node, f"objective of {name}: formulas in a change", hint)
            return None, None
        if robot is not None and robot.when:
            self._findings.add(node, f"objective of {name}: its 'when' decides what it does")
        if found is not None and robot is not None:
            self._check_reachable(robot, found, node)
        return found, reader.within(node, name or "a change", found)

    def _check_reachable(self, robot: Robot, objective: Objective, node: Node) -> None:
        """Its start reaches everything that it reaches later."""
        world = self._regions.world
        if world is None or not self._reachable:
            return
        avoid = avoided(objective)
        reach = Reachability(robot.model.mobility, robot.start, world, avoid)
        for target in targets_of(objective):
            if not reach.reaches(target):
                where = " or ".join(world.label(region) for region in sorted(target))
                start = world.label(robot.start.region)
                found = f"objective of {robot.name}: {clipped(where, 80)} cannot be reached"
                between = "what it avoids is" if avoid else "walls are"
                self._findings.add(node, found, f"it starts at {start}, and {between} between them")

    def _service(self, node: Node | None, name: str | None) -> bool | None:
        word = read.text(node, f"'service' of {name or 'a change'}", self._findings)
        if word is None:
            return None
        if word not in SERVICE:
            found = f"'service' of {name or 'a change'} is 'out' or 'back', not '{clipped(word)}'"
            self._findings.add(node, found)
            return None
        return SERVICE[word]
