"""Foresight about a scenario before any run: robots that can never continue, and the reasons.

It is the closure with every hidden obstacle known and the robots at their start. An obstacle blocks
whether or not a robot has encountered it, so a robot that cannot continue here cannot in any run.
"""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.coordination.decision import coordinate
from safenav.runtime.coordination.events import Unsettled
from safenav.runtime.coordination.infeasibility import closed
from safenav.runtime.duties.reasons import Shortfall, shortfall_words, shortfalls
from safenav.runtime.team import TeamState
from safenav.scenario.model import Scenario
from safenav.trace.vocabulary import Reason
from safenav.trace.words import listed
from safenav.world.poses import bits

_NEEDED = "an operator will be needed, unless the run is completed before"


class Foresight(Struct, frozen=True):
    """``reach``: the regions that each robot can reach once all resolvable obstacles are resolved.
    ``stuck``: the robots that cannot meet their objective infinitely often; ``lacks``: the
    shortfalls of obstacles that are never resolved."""

    reach: dict[str, frozenset[int]]
    stuck: tuple[str, ...]
    lacks: tuple[Shortfall, ...]


def foresee(scenario: Scenario) -> Foresight:
    """Return the foresight that follows from the scenario alone. Obstacles that appear or
    disappear, and untraversable truths, are left out: they only restrict the robots."""
    floor, closure = closed(_all_known(scenario))
    reach = {
        member.name: frozenset(bits(member.graph.regions_of(poses)))
        for member, poses in zip(floor.problem.members, closure.reach, strict=True)
    }
    stuck = tuple(name for name, live in zip(floor.names, closure.live, strict=True) if not live)
    return Foresight(reach, stuck, shortfalls(floor, closure))


def _all_known(scenario: Scenario) -> TeamState:
    """The team at its start, with every obstacle known and requested."""
    state = TeamState.initial(scenario)
    for obstacle in scenario.obstacles:
        if obstacle.appears is None and obstacle.goes is None:
            state.knowledge.meet(obstacle)
            robot = scenario.robots[0]
            state.requests = state.requests.opened(obstacle, robot.name, robot.start.region)
    return state


def foreseen(scenario: Scenario) -> tuple[str, ...]:
    """Warnings of objectives that no run can meet, one sentence each."""
    found = foresee(scenario)
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
    warnings = [f"{who} cannot meet {whose} infinitely often: {_NEEDED}"]
    lacks = [each for each in found.lacks if not each.too_few]  # another warning reports those
    return (*warnings, *(shortfall_words(each, word) for each in lacks))


def _unserved(scenario: Scenario) -> tuple[str, ...]:
    """Warn of robots that have no room to act together or would trap each other, which the closure
    does not show."""
    end = coordinate(_all_known(scenario), Unsettled(Reason.REQUEST), lambda: None).end
    if end is None or end.outcome is not Outcome.OPERATOR_NEEDED:
        return ()
    return (f"{_NEEDED}: {end.explanation}",)
