"""Observations of robots' strategies: inputs of the environment, and robots that they track."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.spec.other_robots.belief import known_of, observe, watch_for
from safenav.spec.other_robots.knowledge import Knowledge, Tracker
from safenav.spec.task import Observed, Task
from safenav.team import state as now
from safenav.team.state import Is, State
from safenav.team.team import Team
from safenav.world.map import Region


def observed(team: Team, state: State, i: int) -> Iterator[Observed]:
    """The knowledge of a robot with a strategy about the robots that it tracks."""
    known, me = dict(state.robots[i].known), team.members[i]
    for j, member in enumerate(team.members if not me.planned else ()):
        if member.name in me.robot.tracks:
            other = state.robots[j]
            here = other.next % team.size
            found = known.get(j, here)
            seen, belief = (here, found) if isinstance(found, frozenset) else (found, None)
            yield Observed(member.name, seen, belief=belief)


def standing(team: Team, state: State) -> frozenset[int]:
    """The regions of the known obstacles, which block the view."""
    known, pairs = (Is.OPEN, Is.SEALED), zip(team.obstacles, state.obstacles, strict=True)
    return frozenset(obstacle.region for obstacle, each in pairs if each.state in known)


def heard(team: Team, state: State, i: int, task: Task) -> dict[str, int]:
    """The inputs of a robot's strategy now."""
    robot, places = state.robots[i], {m.name: j for j, m in enumerate(team.members)}
    at = {each.name: state.robots[places[each.name]].pose % team.size for each in task.observed}
    known = {name: dict(robot.known).get(places[name], at[name]) for name in at}
    found = observe(task, team.world, known)
    return found | {each.name: int(each.name in state.inputs) for each, _ in task.inputs}


def looked(team: Team, state: State, i: int, task: Task) -> now.Looked | None:
    """The knowledge of a robot after it has looked around; None if its task tracks no robot."""
    if not task.observed:
        return None
    watch, before = watch_for(task, team.world), dict(state.robots[i].known)
    own, found = state.robots[i].pose % team.size, []
    names = [member.name for member in team.members]
    for other in task.observed:
        j = names.index(other.name)
        there, known = state.robots[j].pose % team.size, before.get(j, known_of(other))
        found.append((j, after_look(watch, own, there, known)))
    places = tuple(frozenset(watch.possible(known)) for _, known in found)
    return now.Looked(i, tuple(found), places)


def after_look(watch: Tracker, own: Region, other: Region, known: Knowledge) -> Knowledge:
    """The knowledge after a look from region ``own`` while the other is in ``other``, which only
    decides whether it is seen. If it is not, although every region that it can have reached is in
    sight, the belief is all cells."""
    if watch.visibility.sees(own, other):
        return other
    belief = watch.update(own, known).belief
    return frozenset(range(len(watch.partition.cells))) if belief is None else belief
