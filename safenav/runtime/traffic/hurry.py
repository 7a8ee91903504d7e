"""Joint plans that begin with the request, where it is due: who helps comes as early as possible,
and the others go their own ways beside that."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from safenav.runtime.coordination.problem import Floor
from safenav.runtime.traffic.timed import Quickest
from safenav.world.poses import FAR, Mask

Poses = tuple[int, ...]


def quickest(
    floor: Floor, gate: int, goals: Sequence[Mask], stopping: Callable[[], None]
) -> list[Poses] | None:
    """The joint poses after each tick of a plan that meets the next need of an obstacle; ``goals``:
    where each robot wants to be for what it does now (0: nowhere)."""
    found = Quickest(floor.problem, floor.stages, floor.poses, gate, stopping).plan()
    if found is None:
        return None
    return beside(floor, found.poses, goals)


def beside(floor: Floor, plan: Sequence[Poses], goals: Sequence[Mask]) -> list[Poses]:
    """A plan in which those that it leaves where they are go towards their goals, one after the
    other, wherever that is in nobody's way."""
    problem = floor.problem
    ways = [list(way) for way in zip(*plan, strict=True)]
    still = [i for i, way in enumerate(ways) if len(set(way)) == 1 and goals[i]]
    for robot in still if not problem.apart else ():
        member = problem.members[robot]
        if member.ticks > 1 or (member.turns and problem.interferes(robot)):
            continue  # it might not get back
        allowed, size = problem.allowed(robot, floor.stages), member.graph.size
        field = member.graph.distances(goals[robot] & allowed, allowed)
        way = [floor.poses[robot]]
        for tick in range(1, len(plan)):
            taken = {
                pose % problem.members[other].graph.size
                for other in problem.conflicts[robot]
                for pose in ways[other][tick - 1 :]
            }
            open_ = [
                pose
                for pose in member.graph.steps(way[-1])
                if allowed >> pose & 1 and pose % size not in taken
            ]
            nearest = min(open_, key=lambda pose: field[pose], default=way[-1])
            way.append(nearest if field[nearest] < min(field[way[-1]], FAR) else way[-1])
        ways[robot] = way
    return [tuple(poses) for poses in zip(*ways, strict=True)]
