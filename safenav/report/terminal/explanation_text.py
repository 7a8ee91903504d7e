"""Explanations, in words, of robots without a strategy and of runs that needed an operator. They
claim only proven facts about a core."""

import re
from collections.abc import Callable, Iterator, Sequence

import click

from safenav.errors import Outcome
from safenav.explain.explanation import (
    Core,
    CoreMember,
    Explanation,
    LosingPlay,
    NoStrategyCause,
    PlayEnd,
    Repair,
    RepairKind,
    Values,
    why_words,
)
from safenav.review.postmortem import Missing, Postmortem
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Word, describe
from safenav.solve.reasons import need_words
from safenav.spec.specification import Constraint, Owner
from safenav.spec.task import asked_of
from safenav.trace.words import counted, listed, obstacle_words, regions_words, seconds_words
from safenav.world.map import Heading, Region, RegionMap

_SHOWN, _ENDING = 12, 3
"""Maximum number of shown moments of a play, and the number of final ones among them."""


def explanation_lines(found: Explanation, scenario: Scenario) -> Iterator[str]:
    """Yield the explanation of a robot without a strategy as lines of text."""
    world = scenario.map
    red = click.style("unrealizable:", fg="red", bold=True)
    yield f"{found.robot}: {red} it cannot {describe(asked_of(found.task), scenario.map.word)}"
    yield f"  because {cause_words(found, world)}"
    yield ""
    yield core_heading(found.core)
    yield from _indented(f"- {member_words(m, found, world)}" for m in _in_order(found.core))
    yield from _indented(
        core_notes(found.core, _others(found), lambda m: _member_name(m, found, world))
    )
    if found.core.fairness:
        rules = dict.fromkeys(origin.rule for origin in found.core.fairness)
        yield "even under the assumption:"
        yield from _indented(f"- {rule}" for rule in rules)
    if found.play is not None:
        yield ""
        yield "Consequence:"
        yield from _indented(play_lines(found.play, found, world))
    yield ""
    if found.repairs:
        yield "Any one of these repairs suffices (each was tried):"
        yield from _indented(f"- {repair_words(repair, world)}" for repair in found.repairs)
    else:
        yield "No repair was found among the simple ones."


def cause_words(found: Explanation, world: RegionMap) -> str:
    match found.cause:
        case NoStrategyCause.IMPOSSIBLE_START:
            some = "for some initial inputs, " if found.core.together else ""
            return f"{some}its objective does not allow its start"
        case NoStrategyCause.CONTRADICTION:
            start = f"{found.task.item}.start" in {m.origin.item for m in found.core.members}
            itself = "itself or an assumption" if found.core.fairness else "itself"
            contrary = "its start" if start else itself
            return f"its objective contradicts {contrary}, whatever the map"
        case NoStrategyCause.FORBIDDEN_WAY:
            return "no sequence of moves on this map satisfies all its guarantees"
        case NoStrategyCause.CONFLICT:
            return "its guarantees conflict"
        case NoStrategyCause.CORNERED:
            return f"{_others(found)} can force it into a state where every move breaks a guarantee"
        case NoStrategyCause.KEPT_AWAY:
            return f"{_others(found)} can keep it away forever"
        case _:
            return why_words(found.diagnosis, found.task, world)


def member_words(member: CoreMember, found: Explanation, world: RegionMap) -> str:
    """Return a member of a core in the words of the scenario."""
    if member.origin.item == "map" and member.regions:
        verb = "is a wall" if len(member.regions) == 1 else "are walls"
        return f"{_regions(member.regions, world)} {verb}"
    about = _about(member.regions, world) if len(member.constraints) == 1 else ""
    return _constraint_words(member.constraints[0], found, world, about)


def _member_name(member: CoreMember, found: Explanation, world: RegionMap) -> str:
    if member.origin.item == "map" and member.regions:
        return f"the wall at {world.label(member.regions[0])}"
    return member_words(member, found, world)


def _constraint_words(
    constraint: Constraint, found: Explanation, world: RegionMap, about: str = ""
) -> str:
    """Return a guarantee in words, with its formula if the user wrote that."""
    item, rule = constraint.origin.item, _rule(constraint.origin.rule, found, world)
    formula = rule.startswith("ltl") or item.endswith(".always")
    return f"{item}: {rule}{about}" + (f": {_named(constraint.formula, world)}" if formula else "")


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


def play_lines(play: LosingPlay, found: Explanation, world: RegionMap) -> Iterator[str]:
    """Yield a play that the robot loses, as lines of text."""
    robot = found.robot
    match play.ending:
        case PlayEnd.CONFINED:
            yield f"{robot} can only reach {_regions(sorted(found.diagnosis.confined), world)}."
            return
        case PlayEnd.NO_BEGINNING:
            yield f"{robot} cannot start: no initial state satisfies its guarantees."
            return
    moments = [_moment_words(moment, play, found, world) for moment in (*play.walk, *play.cycle)]
    if (hidden := len(moments) - _SHOWN) > 1:
        moments[_SHOWN - _ENDING : -_ENDING] = [f"... {hidden} more moments"]
    yield from moments
    if play.ending is PlayEnd.STUCK:
        happens = _inputs_words(play.pressure, world)
        yield f"Then {happens}, and no move is left:" if happens else "Then no move is left:"
        for dilemma in play.dilemmas:
            stays = dilemma.region == play.walk[-1]["region"]
            move = "staying" if stays else f"going to {world.label(dilemma.region)}"
            yield f"  {move} breaks: {_constraint_words(dilemma.broken, found, world)}"
        return
    count = len(play.cycle)
    if count:
        every = "this repeats forever" if count == 1 else f"the last {count} moments repeat"
        yield f"and {every}."
    if play.goal is not None:
        yield f"Never: {_goal_words(play.goal, found, world)}."


def _rule(rule: str, found: Explanation, world: RegionMap) -> str:
    """Return the words of a rule, with the user's objective in place of its form."""
    stands = describe(found.task.objective)
    return rule.replace(stands, describe(asked_of(found.task), world.word))


def _goal_words(goal: Constraint, found: Explanation, world: RegionMap) -> str:
    if goal.origin.rule.startswith("ltl"):
        return f"{goal.origin.rule} ({_named(goal.formula, world)})"
    return _rule(goal.origin.rule, found, world) + _about(goal.regions, world)


def _named(formula: str, world: RegionMap) -> str:
    """Return a formula with names in place of region numbers, as in a scenario."""
    return re.sub(r"(\bregion'?\s*!?=\s*)(\d+)\b", lambda m: m[1] + world.word(int(m[2])), formula)


def _others(found: Explanation) -> str:
    """Return words for the robot's environment: its objective's inputs if there are any, otherwise
    ``other robots``."""
    inputs = [each.name for each, _ in found.task.inputs]
    some = f"the input{'s' if len(inputs) > 1 else ''} {listed(inputs)}"
    return some if inputs else "other robots"


def _in_order(core: Core) -> list[CoreMember]:
    """Return the members of a core, with all walls as one member at the end."""
    walls = [m for m in core.members if m.origin.item == "map"]
    rest = [m for m in core.members if m.origin.item != "map"]
    if len(walls) < 2:
        return [*rest, *walls]
    constraints = tuple(c for m in walls for c in m.constraints)
    return [*rest, CoreMember(walls[0].origin, constraints, core.walls)]


def _regions(regions: Sequence[Region], world: RegionMap) -> str:
    if len(regions) == 1:
        return f"region {world.label(regions[0])}"
    return f"regions {regions_words(regions)}"


def _about(regions: Sequence[Region], world: RegionMap) -> str:
    return f" [{_regions(regions, world)}]" if regions else ""


def _moment_words(values: Values, play: LosingPlay, found: Explanation, world: RegionMap) -> str:
    heading = Heading(values["heading"]) if "heading" in values else None
    words = f"{found.robot} at {world.stance(values['region'], heading)}"
    declared, strategy = getattr(found.task.objective, "memory", {}), play.strategy
    inputs = strategy.specification.owned(Owner.INPUT) if strategy else ()
    shown = (*(v.name for v in inputs), *(name for name in values if name in declared))
    others = _inputs_words([(name, values[name]) for name in shown], world)
    return f"{words}; {others}" if others else words


def _inputs_words(inputs: Sequence[tuple[str, int]], world: RegionMap) -> str:
    """Return the robot's observations in words."""
    words = []
    for name, value in inputs:
        if name.startswith("at_"):
            known = value < world.size
            where = f"at {world.label(value)}" if known else "out of sight"
            words.append(f"{name.removeprefix('at_')} is {where}")
        else:
            words.append(f"{name} = {value}")
    return ", ".join(words)


def _indented(lines: Iterator[str] | Sequence[str]) -> Iterator[str]:
    return (f"  {line}" for line in lines)


_NAMED = 3


def core_heading(core: Core) -> str:
    """Return the line above the members of a core."""
    if len(core.members) == 1:
        more = "; without it, the rest is realizable" if core.decisive else ""
        return f"This guarantee cannot be kept{more}:"
    if core.decisive:
        return "These guarantees conflict; without any one of them, the rest is realizable:"
    if core.minimal:
        return "These guarantees conflict; without any one of them, the others do not conflict:"
    return "These guarantees conflict:"


def core_notes(core: Core, others: str, name: Callable[[CoreMember], str]) -> Iterator[str]:
    """Yield notes on a core as text. ``others``: the noun for the players that could cooperate;
    ``name`` returns the words for a member."""
    if core.together and core.all_together:
        yield f"(realizable if {others} cooperated)"
    elif core.together:
        yield f"(these alone would be realizable if {others} cooperated)"
    if not core.minimal:
        yield "(some checks timed out: the core may not be minimal)"
    if core.vain:
        without = " or without ".join(map(name, core.vain))
        if len(core.vain) > _NAMED:
            which = "" if len(core.vain) == len(core.members) else f" of {len(core.vain)}"
            without = f"any one{which} of them"
        yield f"(another conflict remains: still unrealizable without {without})"


_CAUSES = {
    "no_capable_robot": "too few robots have a needed action",
    "cyclic_requests": "obstacles keep away the robots that could resolve them",
    "never_resolvable": "the robots that could help cannot reach the regions where they are needed",
    "unrealizable": "a robot has no strategy for its task",
    "no order": "no order of actions lets every robot continue",
    "out_of_service": "robots that are needed are out of service",
    "deadlock": "the robots block each other",
}


def postmortem_lines(found: Postmortem, word: Word) -> Iterator[str]:
    """Yield the reasons for the end of a run as text. ``word`` returns names of regions."""
    result = found.result
    if result.outcome is Outcome.COMPLETED:
        good = click.style("realizable", fg="green")
        done = f"the run is completed after {_time(result.ticks, result.makespan)}"
        late = listed(obstacle_words(name, word) for name in result.late or ())
        why = f"; missed deadlines: {late}" if result.late else ": nothing to explain"
        yield f"every robot is {good}, and {done}{why}"
        return
    ended = click.style(result.outcome.value.replace("_", " "), fg="red", bold=True)
    if result.outcome is not Outcome.OPERATOR_NEEDED:
        yield f"every robot has a strategy; the outcome is {ended}: {result.explanation}"
        return
    live = result.makespan is not None
    at = f"after {_time(result.ticks, result.makespan)}" if live else f"at tick {result.ticks}"
    yield f"every robot is realizable, but the run ends {at}: {ended}"
    cause = result.cause or "unrealizable"
    if cause == "unrealizable" and not found.stuck:
        cause = "no order"
    yield f"  because {_CAUSES[cause]}:"
    yield from (f"  {number}. {link}" for number, link in enumerate(found.chain, 1))
    yield from _missing_lines(found.missing, word)
    yield ""
    if found.repairs:
        yield "With any one of these repairs, a run was completed:"
        for repair in found.repairs:
            change = "; ".join(f"{item}: {value}" for item, value in repair.change)
            yield f"  - {change} (after {_time(repair.ticks, repair.makespan)})"
    else:
        yield f"None of the simple repairs that were tried completes a run ({found.tried} runs)."


def _missing_lines(missing: Sequence[Missing], word: Word) -> Iterator[str]:
    """Yield lines about actions that the team lacks and models with these actions."""
    if missing:
        yield "  in all, this team lacks:"
    for each in missing:
        what = listed(obstacle_words(obstacle.name, word) for obstacle in each.obstacles)
        takes = need_words("' and '".join(each.actions), each.robots, together=each.together)
        has = f", this team has {len(each.have)} ({listed(each.have)})" if each.have else ""
        models = f"models: {listed(each.models)}" if each.models else "no model has it"
        yield f"  - {takes} for {what}{has}; {models}"


def _time(ticks: int, makespan: float | None) -> str:
    return counted(ticks, "tick") if makespan is None else seconds_words(makespan)
