"""Deadlines that cannot be met, and charges that do not suffice, found before the start."""

from __future__ import annotations

from bisect import bisect_left
from math import ceil

from msgspec.structs import replace

from safenav.runtime.control.ends import End
from safenav.runtime.run.deadlines import MISSION, mission_end, objectives_change
from safenav.solve.rounds import Walk, least_within
from safenav.team.battery import NEVER, Energy
from safenav.team.bound import earliest, moment_of
from safenav.team.state import State
from safenav.team.team import Member, Team
from safenav.world.poses import Mask

_NUMBERS = {1: "its target", 2: "both targets"}


def refusal_of(team: Team, state: State) -> End | None:
    """Return the end of a run with a deadline that the robots could not meet even alone, or a
    charge that does not suffice."""
    refused: dict[str, int | None] = {}
    parts = []
    for member, robot in zip(team.members, state.robots, strict=True):
        within = member.robot.within
        if within is not None and ((least := _least(member, robot.pose)) is None or least > within):
            refused[member.name] = least
            parts.append(f"{member.name}: {_words(len(member.targets), within, least)}")
    by = team.scenario.until.by
    if by is not None and not objectives_change(team, 0):
        moment = moment_of(team, state, len(team.members), {})
        orders = [
            _orders(team, member, r.pose)
            for member, r in zip(team.members, state.robots, strict=True)
        ]
        soonest = mission_end(moment, earliest(moment), 0, orders)
        if soonest is None or soonest > by:
            refused[MISSION] = soonest
            when = "at all" if soonest is None else f"before tick {soonest}"
            parts.append(f"the mission cannot be completed {when}, and is due by {by}")
    for member, robot in zip(team.members, state.robots, strict=True):
        energy = member.energy
        if energy is None or team.scenario.flat is not None:
            continue
        need = energy.need(member.floor, robot.pose, energy.turn(robot.own.memory))
        if need > robot.charge:
            refused[f"{member.name}.battery"] = None if need >= NEVER else ceil(need)
            parts.append(_charge_words(team, member, energy, robot.pose, need))
    return End("unrealizable", "; ".join(parts), refused=refused) if refused else None


def _charge_words(team: Team, member: Member, energy: Energy, pose: int, need: float) -> str:
    battery, word = energy.battery, team.world.word
    here, name = word(pose % team.size), member.name
    if need < NEVER:
        return f"{name} needs a charge of {ceil(need)} at {here}, and has {battery.start}"
    if energy.chargers >> pose & 1:
        text = f"from the charger {here} (full: {battery.capacity}) {name} reaches no other stop"
    else:
        text = f"from {here}, with any charge up to {battery.capacity}, {name} reaches no stop"
    text += " from which it can continue"
    enough = _least_capacity(member, energy, pose)
    return text if enough is None else f"{text}; a capacity of {enough} suffices"


def _least_capacity(member: Member, energy: Energy, pose: int) -> int | None:
    """Return the least capacity with which a robot could continue forever; None if there is
    none."""
    low, high = energy.battery.capacity, 4 * member.graph.size * (energy.battery.move + 1)

    def enough(capacity: int) -> bool:
        larger = replace(energy, battery=replace(energy.battery, capacity=capacity))
        return larger.need(member.floor, pose, 0) < NEVER

    capacities = range(low + 1, high + 1)
    return capacities[bisect_left(capacities, True, key=enough)] if enough(high) else None


def _orders(team: Team, member: Member, pose: int) -> list[list[Mask]]:
    """The targets that a robot must meet in sequence for all rounds, from the start; several lists
    if it may begin with any target (``literal``: with the first, or with the one on which it
    stands); none if it chooses the order. A target on which it stands counts as met."""
    objective, masks, count = member.objective, member.targets, len(member.targets)
    if not objective.ordered():
        return []
    if objective.settles:
        orders = [[*masks, *masks[-1:] * (team.rounds - 1)]]
    else:
        firsts = [0]
        if objective.strict:
            firsts += [k for k in range(1, count) if not objective.literal or masks[k] >> pose & 1]
        orders = [[*masks[first:], *masks[:first]] * team.rounds for first in firsts]
    return [order[order[0] >> pose & 1 :] for order in orders]


def _least(member: Member, pose: int) -> int | None:
    walk = Walk(member.graph, member.targets, member.floor, pose, member.ticks)
    least = least_within(replace(walk, strict=member.objective.literal))
    return least_within(walk) if least is None else least  # else synthesis reports it


def _words(count: int, within: int, least: int | None) -> str:
    what = _NUMBERS.get(count, f"all {count} targets")
    text = f"no walk meets {what} every {within} tick{'s' * (within > 1)}"
    return text if least is None else f"{text}: the fastest round takes {least}"
