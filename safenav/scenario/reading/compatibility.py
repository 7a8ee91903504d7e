"""Settings that exclude each other: goals at runtime, deadlines in ticks, batteries."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat

from safenav.errors import Diagnostic
from safenav.scenario.model import Robot, Scenario
from safenav.scenario.objective import Ltl, kinds_that, one_of
from safenav.scenario.reachability import Reachability
from safenav.scenario.settings import Clock, Coordination, RobotChange
from safenav.scenario.yaml.document import Mapping, Node, below, items_of
from safenav.scenario.yaml.findings import Findings

_ASSIGNABLE = "'coordination: assignable' cannot"
_RESYNTHESIS = "use 'coordination: resynthesis'"


def conflicts(scenario: Scenario) -> tuple[Diagnostic, ...]:
    """Return the errors of a scenario that may differ from its file, without places."""
    findings = Findings(scenario.source)
    for robot in scenario.robots:
        for each in scenario.obstacles:
            if each.shuts_in(robot):
                findings.add(None, f"{each.name} is where {robot.name} starts, and blocks it")
        if robot.start.region in robot.objective.avoid:
            findings.add(None, f"'avoid' of {robot.name}: it starts in a region of these")
    if scenario.coordination is Coordination.ASSIGNABLE:
        check_assignable(scenario.robots, scenario.changes, None, findings)
    check_deadlines(scenario, None, findings)
    return findings.diagnostics


def check_assignable(
    team: Sequence[Robot], changes: Sequence[RobotChange], node: Node | None, findings: Findings
) -> None:
    """Report settings that 'coordination: assignable' (at ``node``) cannot keep: a goal assigned at
    runtime may lie beyond a target, or be one."""
    for robot in team:
        if robot.while_waiting is not None:
            found = f"{_ASSIGNABLE} keep 'while_waiting' of {robot.name}"
            findings.add(node, found, f"leave out the key, or {_RESYNTHESIS}")
        if isinstance(robot.objective, Ltl) and robot.objective.inputs:
            found = f"{_ASSIGNABLE} use inputs in 'ltl' of {robot.name}"
            findings.add(node, found, _RESYNTHESIS)
    given = [(robot.name, robot.objective) for robot in team]
    given += [(robot.name, objective) for robot in team for _, objective in robot.when]
    given += [(change.robot, change.objective) for change in changes if change.objective]
    for name in dict.fromkeys(n for n, o in given if o.literal):
        found = f"{_ASSIGNABLE} keep 'form: literal' of {name}"
        findings.add(node, found, f"leave out the form, or {_RESYNTHESIS}")


def check_deadlines(scenario: Scenario, item: Mapping | None, findings: Findings) -> None:
    """Report deadlines and batteries that no run supports, and deadlines that no run can
    meet. The scenario has no other error."""

    def report(found: str, hint: str, *keys: str) -> None:
        findings.add(below(item, *keys) or below(item, keys[0]) or item, found, hint)

    if scenario.clock is Clock.LIVE and scenario.sets_deadlines:
        found = "'clock: live' with deadlines in ticks: a tick has no length there"
        hint = f"use 'clock: lockstep', or {in_seconds(scenario)}"
        report(found, hint, "clock")
    for robot in (each for each in scenario.robots if each.model.battery is not None):
        pursued = (robot.objective, robot.while_waiting, *(each for _, each in robot.when))
        if not all(objective is None or objective.ordered() for objective in pursued):
            found = f"{robot.name} has a battery, and an objective without an order of its targets"
            hint = f"use {one_of(kinds_that(lambda kind: kind.ordered()), chr(39))}"
            report(found, hint, "robots", robot.name)
        if scenario.coordination is Coordination.ASSIGNABLE:
            found = f"{robot.name} has a battery, which 'coordination: assignable' does not support"
            report(found, "use 'resynthesis'", "coordination")
        if not scenario.chargers:
            if scenario.flat is None and (item is None or item.get("chargers") is None):
                found = f"{robot.name} has a battery, and the scenario has no charger"
                report(found, "list 'chargers', or set 'flat'", "robots", robot.name)
            continue
        reach = Reachability(robot.model.mobility, robot.start, scenario.map)
        if not reach.reaches(scenario.chargers):
            found = f"{robot.name} has a battery and reaches no charger"
            report(found, "place a charger in a region that it can reach", "chargers")
    items = (*items_of(below(item, "obstacles")), *items_of(below(item, "orders")))
    listed = [*zip(scenario.obstacles, items or repeat(item), strict=False)]
    for obstacle, node in listed:
        limit = scenario.limit_of(obstacle)
        for number, need in enumerate(obstacle.needs if limit is not None else ()):
            actions = obstacle.type.actions(number)
            able = sum(actions <= robot.capabilities for robot in scenario.robots)
            if able < need.robots:
                found = f"{obstacle.name} must be resolved within {limit} ticks, but "
                found += f"{able or 'no'} robot{'s' * (able > 1)} can '{need.action}'"
                where = below(node, "resolve_within") or node
                findings.add(where, found, "leave out 'resolve_within'")
                break


def unsafe_live(scenario: Scenario) -> str | None:
    """Return why a scenario cannot run live: a deadline in ticks; None if it can."""
    if scenario.sets_deadlines:
        return (
            "a live run cannot keep deadlines in ticks: a tick has no length there; use "
            f"'clock: lockstep', or {in_seconds(scenario)}"
        )
    return None


def unsafe_lockstep(scenario: Scenario) -> str | None:
    """Return why a scenario cannot run in lockstep: a charge per second; None if it can."""
    for robot in scenario.robots:
        battery = robot.model.battery
        if battery is not None and battery.stay != int(battery.stay):
            return (
                f"'stay: {battery.stay:g}' of {robot.name} is a charge per second: use "
                "'clock: live', or a whole number per tick"
            )
    return None


def in_seconds(scenario: Scenario) -> str:
    """Suggest a deadline in seconds: ``require seconds of the motion: ...``, or a limit."""
    due = [o.name for o in scenario.obstacles if scenario.limit_of(o) is not None]
    if not due and scenario.until.by is not None:
        return "end the run by 'limits: {seconds: 60}'"
    name = due[0] if due else "door@47"
    requirement = f"always(requested_{name} -> eventually[0,60] resolved_{name})"
    return f"require seconds of the motion: 'requirements: [\"{requirement}\"]'"
