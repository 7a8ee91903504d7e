"""The robots that do not take a load: they have no path to where it is put down."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from safenav.runtime.team import TeamState
from safenav.scenario.model import Obstacle
from safenav.scenario.reachability import is_cut_off


def cut_off(team: TeamState, obstacle: Obstacle, need: int) -> frozenset[str]:
    """Return the robots that do not take a load by a need. An action that has begun is ended even
    if its robot has got another objective."""
    world, robots = team.scenario.map, team.robots
    out = (
        s for s in robots.values() if s.acting is None or obstacle not in robots[s.acting].acts_on
    )
    at = ((state.robot, state.next_pose.region) for state in out)
    return frozenset(r.name for r, here in at if is_cut_off(r, here, obstacle, need, world))


def takers(
    team: TeamState, chosen: Mapping[str, frozenset[str]], loads: Iterable[Obstacle]
) -> dict[str, frozenset[str]]:
    """Return the only robots that take each load next. ``chosen``: for some loads, those of the
    acts for deadlines."""
    found = dict(chosen)
    for load in loads:
        out = cut_off(team, load, team.knowledge.need_of(load))
        if out:
            found[load.name] = found.get(load.name, frozenset(team.robots)) - out
    return found
