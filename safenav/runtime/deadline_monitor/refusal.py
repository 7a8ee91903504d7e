"""Deadlines that cannot be met, found before the start."""

from __future__ import annotations

from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.deadline_monitor.ledger import MISSION, mission_end
from safenav.runtime.deadline_monitor.moment import goals_from_start, moment_of, objectives_change
from safenav.runtime.deadlines.bound import earliest
from safenav.runtime.deadlines.round_deadlines import Walk, least_within
from safenav.runtime.energy.batteries import Batteries, least_capacity, least_charge
from safenav.runtime.formulas import permitted
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion

_NUMBERS = {1: "its target", 2: "both targets"}


def refusal_of(team: TeamState, batteries: Batteries) -> Conclusion | None:
    """Return the conclusion of a run that is unrealizable before its first tick: a deadline that
    the robots could not meet even alone, or an insufficient charge. None if there is neither, or in
    a resumed run."""
    if team.scenario.continues:
        return None
    refused: dict[str, int | None] = {}
    parts = []
    for robot in team.robots.values():
        within = robot.robot.within
        if within is None:
            continue
        least = _least(team, robot)
        if least is None or least > within:
            refused[robot.name] = least
            parts.append(f"{robot.name}: {_words(robot, within, least)}")
    by = team.scenario.until.by
    if by is not None and not objectives_change(team):
        moment, _ = moment_of(team, len(team.robots), {})
        orders = [goals_from_start(team, robot) for robot in team.robots.values()]
        soonest = mission_end(team, moment, earliest(moment), orders)
        if soonest is None or soonest > by:
            refused[MISSION] = soonest
            when = "at all" if soonest is None else f"before tick {soonest}"
            parts.append(f"the mission cannot be completed {when}, and is due by {by}")
    for robot in team.robots.values():
        if robot.charge is None or team.scenario.flat is not None:
            continue
        need = least_charge(batteries, robot)
        if need is None or need > robot.charge:
            refused[f"{robot.name}.battery"] = need
            enough = least_capacity(batteries, robot) if need is None else None
            words = _charge_words(team, robot, need)
            parts.append(words if enough is None else f"{words}; a capacity of {enough} suffices")
    if not refused:
        return None
    why = "; ".join(parts)
    return Conclusion(Outcome.UNREALIZABLE, why, links=tuple(parts), refused=refused)


def _charge_words(team: TeamState, robot: RobotState, need: int | None) -> str:
    battery, word = robot.robot.model.battery, team.scenario.map.word
    assert battery is not None
    here, name = word(robot.pose.region), robot.name
    if need is not None:
        return f"{name} needs a charge of {need} at {here}, and has {robot.charge}"
    if robot.pose.region in team.scenario.chargers:
        text = f"from the charger {here} (full: {battery.capacity}) {name} reaches no other stop"
    else:
        text = f"from {here}, with any charge up to {battery.capacity}, {name} reaches no stop"
    return f"{text} from which it can continue"


def _least(team: TeamState, robot: RobotState) -> int | None:
    graph, objective = team.graph(robot), robot.robot.objective
    start, ticks = graph.number(robot.pose), robot.robot.model.timing
    targets, allowed = graph.on_each(objective.targets), permitted(robot.robot, graph)
    walk = Walk(graph, targets, allowed, start, ticks)
    least = least_within(replace(walk, strict=objective.literal))
    return least_within(walk) if least is None else least  # else synthesis reports it


def _words(robot: RobotState, within: int, least: int | None) -> str:
    count = len(robot.robot.objective.targets)
    what = _NUMBERS.get(count, f"all {count} targets")
    text = f"no walk meets {what} every {within} tick{'s' * (within > 1)}"
    return text if least is None else f"{text}: the fastest round takes {least}"
