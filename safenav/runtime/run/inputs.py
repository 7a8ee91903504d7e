"""The inputs of the environment in a run, and the objectives that they select."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from safenav.runtime.worlds.lockstep import inputs_of
from safenav.runtime.worlds.protocol import InputWorld
from safenav.team import state as now
from safenav.team.state import State
from safenav.team.team import Team

CAUSE = "input"


def values_of(
    team: Team, state: State, time: float, world: InputWorld | None, by_user: Mapping[str, bool]
) -> frozenset[str]:
    """The inputs that are on at a time. ``world``: what sets them; ``by_user``: what an operator
    set."""
    names = [each.name for each in team.scenario.inputs]
    found = {name: name in state.inputs for name in names}
    found |= inputs_of(world if names else None, int(time)) | dict(by_user)
    return frozenset(name for name in names if found[name])


def selected(team: Team, state: State) -> Iterator[now.Assigned]:
    """The objectives of robots that follow from the inputs, where these are others than before."""
    for i, (robot, member) in enumerate(zip(state.robots, team.members, strict=True)):
        given = dict(member.robot.when)
        mode = next((name for name in given if name in state.inputs), None)
        if mode == robot.mode:
            continue
        base = robot.base or (member.objective, member.robot.within, robot.own, robot.values)
        if mode is None:
            yield now.Assigned(i, base[0], CAUSE, base[1], None, base)
        else:
            yield now.Assigned(i, given[mode], CAUSE, None, mode, base)
