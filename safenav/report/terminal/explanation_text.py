"""An explanation in words, with a small map, and as data for machines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import click

from safenav.explain.explanation import (
    Core,
    CoreMember,
    Dilemma,
    Explanation,
    NoStrategyCause,
    PlayMoment,
    Repair,
    RepairKind,
    Witness,
    WitnessEnd,
)
from safenav.explain.summary import why_words
from safenav.report.terminal.map import MapPicture, Marker, draw
from safenav.scenario.model import Scenario
from safenav.scenario.objective_text import describe
from safenav.spec.forms import asked_of
from safenav.spec.other_robots.nearby import busy
from safenav.spec.specification import Constraint
from safenav.trace.looks import labels
from safenav.trace.words import listed, regions_words
from safenav.world.map import Heading, Region, RegionMap

_SHOWN, _ENDING = 12, 3
"""Maximum number of shown moments of a play, and the number of last ones among them."""


def explanation_lines(found: Explanation, scenario: Scenario) -> Iterator[str]:
    """Yield the explanation as text."""
    world = scenario.map
    red = click.style("unrealizable:", fg="red", bold=True)
    yield f"{found.robot}: {red} it cannot {describe(asked_of(found.task), scenario.map.word)}"
    yield f"  because {cause_words(found, world)}"
    yield ""
    yield from _indented(_picture(found, scenario))
    yield ""
    yield "These guarantees conflict; without any one of them, the rest is realizable:"
    yield from _indented(f"- {member_words(m, found, world)}" for m in _in_order(found.core))
    if not found.core.alone:
        yield f"  (realizable if {_others(found)} cooperated)"
    if not found.core.minimal:
        yield "  (some checks timed out: the core may not be minimal)"
    if found.core.fairness:
        rules = dict.fromkeys(origin.rule for origin in found.core.fairness)
        yield "even under the assumption:"
        yield from _indented(f"- {rule}" for rule in rules)
    if found.witness is not None:
        yield ""
        yield "What happens:"
        yield from _indented(witness_lines(found.witness, found, world))
    yield ""
    if found.repairs:
        yield "Any one of these repairs suffices (each was tried):"
        yield from _indented(f"- {repair_words(repair, world)}" for repair in found.repairs)
    else:
        yield "No repair was found among the simple ones."


def cause_words(found: Explanation, world: RegionMap) -> str:
    match found.cause:
        case NoStrategyCause.IMPOSSIBLE_START:
            return "its objective does not allow its start"
        case NoStrategyCause.CONTRADICTION:
            return "its objective contradicts itself, whatever the map"
        case NoStrategyCause.FORBIDDEN_WAY:
            return "its objective forbids the moves that the map and its mobility require"
        case NoStrategyCause.CORNERED:
            return f"{_others(found)} can force it into a state where every move breaks a guarantee"
        case NoStrategyCause.KEPT_AWAY:
            return f"{_others(found)} can keep it away forever"
        case _:
            return why_words(found.diagnosis, found.task, world)


def member_words(member: CoreMember, found: Explanation, world: RegionMap) -> str:
    """Return one member of a core in the scenario's terms."""
    item = member.origin.item
    rule = _rule(member.origin.rule, found, world)
    if item == "map" and member.regions:
        return f"{_regions(member.regions, world)} {_is_a_wall(member.regions)}"
    formulas = member.constraints if rule.startswith("ltl") else ()
    lines = "; ".join(_named(c.formula, world) for c in formulas)
    about = f" [{_regions(member.regions, world)}]" if _about_one_goal(member) else ""
    return f"{item}: {rule}{about}" + (f": {lines}" if lines else "")


def repair_words(repair: Repair, world: RegionMap) -> str:
    """Return one repair as advice."""
    change = "; ".join(f"{item}: {value}" for item, value in repair.change)
    if ".ltl." in change:
        return _named(change, world)
    match repair.kind:
        case RepairKind.OPEN_WALL:
            who = " or ".join(repair.helpers)
            obstacle = repair.change[-1][1]
            wall = repair.change[0][1].removeprefix("no wall at ")
            return (
                f"replace the wall at {world.label(int(wall))} by an obstacle {obstacle}, which "
                f"{who} can resolve ({repair.action})"
            ) + "".join(f"; {item}: {value}" for item, value in repair.change[1:-1])
        case RepairKind.REMOVE_WALLS:
            return change.removeprefix("map: ")
        case _:
            return change


def witness_lines(witness: Witness, found: Explanation, world: RegionMap) -> Iterator[str]:
    """Yield the witness as text."""
    robot = found.robot
    match witness.ending:
        case WitnessEnd.CONFINED:
            yield f"{robot} can only reach {_regions(sorted(witness.confined), world)}."
            return
        case WitnessEnd.NO_BEGINNING:
            yield f"{robot} cannot start: no initial state satisfies its guarantees."
            return
    moments = [_moment_words(moment, found, world) for moment in witness.moments]
    if (hidden := len(moments) - _SHOWN) > 1:
        moments[_SHOWN - _ENDING : -_ENDING] = [f"... {hidden} more moments"]
    yield from moments
    if witness.ending is WitnessEnd.STUCK:
        last = witness.moments[-1]
        happens = _inputs_words(witness.pressure, world)
        if happens:
            yield f"Then {happens}, and no move is left:"
        else:
            yield "Then no move is left:"
        for dilemma in witness.dilemmas:
            yield f"  {_dilemma_words(dilemma, last, found, world)}"
        return
    count = len(witness.cycle)
    if count:
        every = "this repeats forever" if count == 1 else f"the last {count} moments repeat"
        yield f"and {every}."
    if witness.goal is not None:
        yield f"Never: {_goal_words(witness.goal, found, world)}."


def explanation_data(found: Explanation, scenario: Scenario) -> dict[str, Any]:
    """Return the explanation as data for machines."""
    core, witness = found.core, found.witness
    return {
        "robot": found.robot,
        "objective": describe(asked_of(found.task)),
        "cause": found.cause.value,
        "because": cause_words(found, scenario.map),
        "lost": [sorted(target) for target in found.diagnosis.lost],
        "confined": sorted(found.diagnosis.confined),
        "culprits": [known.item for known in found.diagnosis.culprits],
        "core": {
            "members": [_member_data(member) for member in core.members],
            "minimal": core.minimal,
            "alone": core.alone,
            "walls": list(core.walls),
            "fairness": [origin.rule for origin in core.fairness],
            "queries": core.queries,
        },
        "witness": None if witness is None else _witness_data(witness),
        "repairs": [_repair_data(repair, scenario.map) for repair in found.repairs],
        "seconds": round(found.seconds, 3),
    }


def _rule(rule: str, found: Explanation, world: RegionMap) -> str:
    """Return a rule in terms of the objective that the user wrote."""
    stands = describe(found.task.objective)
    return rule.replace(stands, describe(asked_of(found.task), world.word))


def _goal_words(goal: Constraint, found: Explanation, world: RegionMap) -> str:
    if goal.origin.rule.startswith("ltl"):
        return f"{goal.origin.rule} ({_named(goal.formula, world)})"
    return f"{_rule(goal.origin.rule, found, world)} [{_regions(goal.regions, world)}]"


def _named(formula: str, world: RegionMap) -> str:
    """Return a formula with the names of regions, as in a scenario."""
    return re.sub(r"(\bregion'?\s*!?=\s*)(\d+)\b", lambda m: m[1] + world.word(int(m[2])), formula)


def _others(found: Explanation) -> str:
    """Return the environment of the robot: the other robots that it may encounter, and inputs."""
    names = [other.name for other in found.task.observed if other.danger]
    inputs = [each.name for each, _ in found.task.inputs]
    if inputs:
        names.append(f"the input{'s' if len(inputs) > 1 else ''} {listed(inputs)}")
    return " or ".join(names) or "other robots"


def _in_order(core: Core) -> list[CoreMember]:
    """Return the members with all walls as one, after the others."""
    walls = [m for m in core.members if m.origin.item == "map"]
    rest = [m for m in core.members if m.origin.item != "map"]
    if len(walls) < 2:
        return [*rest, *walls]
    constraints = tuple(c for m in walls for c in m.constraints)
    return [*rest, CoreMember(walls[0].origin, constraints, core.walls)]


def _about_one_goal(member: CoreMember) -> bool:
    return len(member.constraints) == 1 and bool(member.regions)


def _is_a_wall(regions: Sequence[Region]) -> str:
    return "is a wall" if len(regions) == 1 else "are walls"


def _regions(regions: Sequence[Region], world: RegionMap) -> str:
    if not regions:
        return "no region"
    if len(regions) == 1:
        return f"region {world.label(regions[0])}"
    return f"regions {regions_words(regions)}"


def _moment_words(moment: PlayMoment, found: Explanation, world: RegionMap) -> str:
    if moment.region is None:
        return "its region is unknown"
    words = f"{found.robot} at {world.stance(moment.region, moment.heading)}"
    declared = getattr(found.task.objective, "memory", {})
    remembered = tuple(pair for pair in moment.memory if pair[0] in declared)
    others = _inputs_words((*moment.others, *remembered), world)
    return f"{words}; {others}" if others else words


def _inputs_words(inputs: Sequence[tuple[str, int]], world: RegionMap) -> str:
    """Return the robot's observations in words, without free sides."""
    sides = {busy(heading): heading for heading in Heading}
    words = []
    for name, value in inputs:
        if name in sides:
            if value:
                words.append(f"a robot is to its {sides[name].label}")
        elif name.startswith("at_"):
            known = value < world.size
            where = f"at {world.label(value)}" if known else "out of sight"
            words.append(f"{name.removeprefix('at_')} is {where}")
        else:
            words.append(f"{name} = {value}")
    return ", ".join(words)


def _dilemma_words(dilemma: Dilemma, last: PlayMoment, found: Explanation, world: RegionMap) -> str:
    stays = dilemma.region == last.region
    move = "staying" if stays else f"going to {world.label(dilemma.region)}"
    origin = dilemma.broken.origin
    return f"{move} breaks: {origin.item}: {_rule(origin.rule, found, world)}"


def _picture(found: Explanation, scenario: Scenario) -> list[str]:
    """Return the map with the robots at the start, their targets, and avoided regions."""
    names = labels([robot.name for robot in scenario.robots])
    markers = [Marker(names[r.name], r.start.region, r.start.heading) for r in scenario.robots]
    targets = frozenset[Region]().union(*found.task.targets)
    avoided = dict.fromkeys(found.task.objective.avoid, "avoided")
    wanted = MapPicture(markers, barred=avoided, targets=targets)
    lines = draw(scenario.map, wanted)
    legend = ", ".join(f"{letter} {name}" for name, letter in names.items())
    if targets:
        legend += ", o target"
    if avoided:
        legend += ", XX avoided"
    return [*lines, legend]


def _indented(lines: Iterator[str] | Sequence[str]) -> Iterator[str]:
    return (f"  {line}" for line in lines)


def _member_data(member: CoreMember) -> dict[str, Any]:
    return {
        "item": member.origin.item,
        "rule": member.origin.rule,
        "source": member.origin.source,
        "regions": list(member.regions),
        "constraints": [f"[{c.section}] {c.formula}" for c in member.constraints],
    }


def _witness_data(witness: Witness) -> dict[str, Any]:
    return {
        "ending": witness.ending.value,
        "confined": sorted(witness.confined),
        "moments": [_moment_data(moment) for moment in witness.moments],
        "cycle": [_moment_data(moment) for moment in witness.cycle],
        "pressure": dict(witness.pressure),
        "dilemmas": [
            {
                "region": d.region,
                "heading": None if d.heading is None else d.heading.label,
                "breaks": {"item": d.broken.origin.item, "rule": d.broken.origin.rule},
            }
            for d in witness.dilemmas
        ],
        "never": None if witness.goal is None else witness.goal.formula,
    }


def _moment_data(moment: PlayMoment) -> dict[str, Any]:
    return {
        "region": moment.region,
        "heading": None if moment.heading is None else moment.heading.label,
        "others": dict(moment.others),
        "memory": dict(moment.memory),
    }


def _repair_data(repair: Repair, world: RegionMap) -> dict[str, Any]:
    return {
        "kind": repair.kind.value,
        "change": [{"item": item, "value": value} for item, value in repair.change],
        "helpers": list(repair.helpers),
        "action": repair.action,
        "says": repair_words(repair, world),
    }
