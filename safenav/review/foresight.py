"""Foresight about a scenario before any run: the robots that can never continue, with the reasons;
and a rehearsal without hidden obstacles.

Foresight is the closure with every hidden obstacle known and all robots at their starts. An
obstacle also blocks robots that do not know it, so a robot that cannot continue in this closure
cannot continue in any run.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from safenav.review.lint import needed_actions
from safenav.runtime.control.ends import hopeful, infeasible
from safenav.runtime.control.strategies import Controller
from safenav.runtime.run.mission import Mission, RunResult, uninterrupted
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.yaml.findings import closest
from safenav.solve.reasons import Shortfall, shortfall_words, shortfalls
from safenav.solve.solve import BudgetError, Solver, closure_of
from safenav.spec.compile import assumption_names
from safenav.synthesis.slugs import Synthesizer
from safenav.team import state as now
from safenav.team.apply import apply, initial
from safenav.team.state import State
from safenav.team.team import Team, team_of
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause
from safenav.trace.words import listed, moment_words
from safenav.world.poses import Mask

_NEEDED = "an operator will be needed, unless the run is completed before that"


class Foresight(Struct, frozen=True):
    """Consequences of a scenario. ``reach``: the regions (a mask) that each robot can reach once
    all resolvable obstacles are resolved. ``stuck``: the robots that cannot meet their objective;
    ``lacks``: the shortfalls of obstacles that are never resolved."""

    reach: dict[str, Mask]
    stuck: tuple[str, ...]
    lacks: tuple[Shortfall, ...]


def foresee(scenario: Scenario) -> Foresight:
    """Return the foresight of a scenario. It omits obstacles that appear or disappear and
    untraversable truths, since these only restrict the robots."""
    team, state = _all_known(scenario)
    around = hopeful(team, state)
    closure = closure_of(around)
    reach = {
        member.name: graph.regions_of(poses)
        for member, graph, poses in zip(
            team.members, around.floor.graphs, closure.reach, strict=True
        )
    }
    each = zip(team.members, closure.live, closure.reach, strict=True)
    stuck = tuple(
        member.name
        for member, live, poses in each
        if not live or (member.pursuit.settles and not all(poses & t for t in member.targets))
    )
    return Foresight(reach, stuck, shortfalls(around, closure))


def _all_known(scenario: Scenario) -> tuple[Team, State]:
    """Return the team at its start, with all obstacles known that neither appear nor disappear in
    the run."""
    return _known(scenario, lambda each: each.appears is None and each.goes is None)


def _known(scenario: Scenario, chosen: Callable[[Obstacle], bool]) -> tuple[Team, State]:
    """Return the team at its start, with the given obstacles known and requested."""
    team = team_of(scenario)
    state = initial(team)
    for k, each in enumerate(team.obstacles):
        if chosen(each.source):
            state = apply(team, state, now.Met(0, k, each.region))
    return team, state


def foreseen(scenario: Scenario) -> tuple[str, ...]:
    """Return a sentence for each obstacle without enough robots, each objective that no run can
    meet, and each robot of joint plans with 'tracks'."""
    found, blind = foresee(scenario), list[str]()
    for each in team_of(scenario).members:
        if each.robot.tracks and each.planned:
            blind.append(f"'tracks' of {each.name} has no effect: joint plans drive it")
    return (*_unresolvable(scenario, found.lacks), *_unmet(scenario, found), *blind)


def _unresolvable(scenario: Scenario, lacks: tuple[Shortfall, ...]) -> Iterator[str]:
    """Yield a sentence for each lasting obstacle for which the team has too few robots."""
    if any(each.appears is not None and each.goes is None for each in scenario.obstacles):
        around = hopeful(*_known(scenario, lambda each: each.goes is None))
        lacks = shortfalls(around, closure_of(around))
    able = {action for robot in scenario.robots for action in robot.capabilities}
    known = able & needed_actions(scenario)  # another action may itself be misspelt
    for lack in lacks:
        if lack.too_few:
            lacking = lack.need.skills - able
            meant = (close for action in sorted(lacking) for close in closest(action, known))
            words = shortfall_words(lack, scenario.map.word)
            yield "; ".join([words, *(f"did you mean '{close}'?" for close in meant)])


def _unmet(scenario: Scenario, found: Foresight) -> tuple[str, ...]:
    given = {change.robot for change in scenario.changes if change.objective is not None}
    if found.stuck:
        found = replace(found, stuck=tuple(name for name in found.stuck if name not in given))
    elif not given:
        return _unserved(scenario)
    if not found.stuck or not found.lacks:
        return ()
    word = scenario.map.word
    who = listed(found.stuck)
    whose = "its objective" if len(found.stuck) == 1 else "their objectives"
    ends = all(r.objective.settles for r in scenario.robots if r.name in found.stuck)
    often = "" if ends else " infinitely often"
    warnings = [f"{who} cannot meet {whose}{often}: {_NEEDED}"]
    lacks = [each for each in found.lacks if not each.too_few]  # another warning reports the rest
    return (*warnings, *(shortfall_words(each, word) for each in lacks))


def _unserved(scenario: Scenario) -> tuple[str, ...]:
    """Return a warning if robots have no room to act together or would trap each other, which the
    closure ignores; otherwise an empty tuple."""
    team, state = _all_known(scenario)
    around = hopeful(team, state)
    with suppress(BudgetError):
        if not Solver(around.floor).feasible(around):
            return (f"{_NEEDED}: {infeasible(team, state, around).explanation}",)
    return ()


class Rehearsal(Struct, frozen=True):
    """The ``result`` of a run without hidden obstacles, and ``warnings`` of empty batteries (unless
    a robot would bring another one) and of a proven deadlock."""

    result: RunResult
    warnings: tuple[str, ...]


def rehearse(scenario: Scenario, synthesizer: Synthesizer) -> Rehearsal:
    """Run a scenario without hidden obstacles except its orders."""
    flat = dict[str, str]()

    def heard(record: records.Record) -> None:
        if isinstance(record, records.Service) and record.cause is ChangeCause.BATTERY:
            flat.setdefault(record.robot, moment_words(record.tick, record.t))

    orders = tuple(obstacle for obstacle in scenario.obstacles if obstacle.ordered)
    mission = Mission(replace(scenario, obstacles=orders), synthesizer, listeners=[heard])
    result = uninterrupted(mission.run())
    warnings = [
        f"the battery of {robot} is empty {when} without hidden obstacles"
        for robot, when in (flat if scenario.flat is None else {}).items()
    ]
    if result.cause == "deadlock":
        warnings.append("no order of moves completes the mission: an operator will be needed")
    return Rehearsal(result, tuple(warnings))


def examined(answer: Controller, plan: Scenario) -> dict[str, Any]:
    """Return, as data, a controller's permissions and assumptions, or why there is none."""
    task, world, why = answer.task, plan.map, None
    if not answer.realizable:
        from safenav.explain.explanation import explain_unrealizable  # rare, so imported here

        why = explain_unrealizable(task.robot, task, world)
    assumed = assumption_names(task, world)
    return {"allows": answer.allows(world.word), "assumptions": assumed, "explanation": why}
