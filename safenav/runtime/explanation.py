"""Why a robot has no strategy, in the scenario's terms.

Reachability under the robot's mobility explains most cases; what it does not explain is said
as far as it is known, never guessed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from safenav.scenario.model import Robot
from safenav.scenario.objective import Patrol, Target, describe, targets_of
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap
from safenav.world.mobility import distances

if TYPE_CHECKING:
    from safenav.runtime.coordination import Impasse
    from safenav.runtime.state import TeamState


def explain_unrealizable(robot: Robot, task: Task, world: RegionMap) -> str:
    """One sentence on why ``robot`` cannot do what ``task`` asks."""
    blocked = {known.region: known.reason for known in task.blocked}
    reach = distances(robot.model.mobility, task.pose, world, blocked)
    lost = [t for t in targets_of(task.objective) if not any(r in reach for r in t)]
    what = f"{robot.name} cannot {describe(task.objective)}"
    if lost:
        obstacles = "".join(f"; {world.label(r)}: {why}" for r, why in sorted(blocked.items()))
        names = " and ".join(_target_words(t, world) for t in lost)
        return f"{what}: no way from {world.label(task.pose.region)} to {names}{obstacles}"
    if isinstance(task.objective, Patrol):
        crossing = _crossing(robot, task, world, set(blocked))
        if crossing is not None:
            return (
                f"{what}: patrol forbids to cross {crossing} out of turn, and there is no other "
                "way; use 'visit' instead, which allows it"
            )
    if task.observed:
        others = ", ".join(other.name for other in task.observed)
        return f"{what}: {others} could keep it from there for ever"
    return f"{what}: a place on the way can be entered but not left under its mobility"


def explain_impasse(impasse: Impasse, state: TeamState) -> str:
    """Why the team needs an operator, and what would help."""
    scenario, obstacle = state.scenario, impasse.obstacle
    if obstacle is None:
        stuck, *ring = impasse.robots
        where = ", ".join(f"{n} at {scenario.map.label(state.poses[n].region)}" for n in ring)
        here = scenario.map.label(state.poses[stuck].region)
        return (
            f"{stuck} at {here} waits for {where or 'another robot'} for ever, and nobody among "
            "them can make way under its mobility"
        )
    where = f"{obstacle.type.name} at {scenario.map.label(obstacle.region)}"
    action = obstacle.type.action
    reasons = {
        "no_capable_robot": f"no robot has the capability '{action}' that removes the {where}",
        "cyclic_requests": f"those who could '{action}' the {where} wait for help themselves "
        "that depends on it",
        "unrealizable": f"nobody can bring about a way past the {where}",
    }
    said = [reasons[impasse.cause.value]]
    for name in impasse.robots:
        robot = scenario.robot(name)
        assignment = state.tasks.current[name]
        task = Task(
            robot,
            state.poses[name],
            assignment.objective,
            assignment.progress.memory,
            state.knowledge.known_for(robot, assignment.avoid),
        )
        said.append(explain_unrealizable(robot, task, scenario.map))
    return "; ".join(said)


def _crossing(robot: Robot, task: Task, world: RegionMap, blocked: set[Region]) -> str | None:
    """The patrol target without which the other one cannot be reached, if that is the reason."""
    patrol = task.objective
    assert isinstance(patrol, Patrol)
    for target, other in ((patrol.first, patrol.second), (patrol.second, patrol.first)):
        if task.pose.region in target:
            continue
        reach = distances(robot.model.mobility, task.pose, world, blocked | target)
        if not any(region in reach for region in other):
            return _target_words(target, world)
    return None


def _target_words(target: Target, world: RegionMap) -> str:
    return " or ".join(world.label(region) for region in sorted(target))
