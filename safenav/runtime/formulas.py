"""The steps between poses that formulas (``ltl``) allow a robot, and the poses of its goals."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property, lru_cache

from safenav.scenario.guarantees import Guarantees, guarantees_of
from safenav.scenario.model import Robot
from safenav.scenario.objective import Ltl, formulas_in
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import Mask, PoseGraph, bits, plain_graph, region_mask


class Formulas:
    """The guarantees of one robot on one map."""

    def __init__(self, objective: Ltl, world: RegionMap, mobility: Mobility) -> None:
        self.guarantees: Guarantees = guarantees_of(objective)
        self._graph = plain_graph(world, mobility)

    @cached_property
    def graph(self) -> PoseGraph:
        """The robot's poses and the steps that the formulas allow with some memory."""
        return PoseGraph(self._graph.world, self._graph.mobility, frozenset(self._closed()))

    @cached_property
    def goals(self) -> tuple[Mask, ...]:
        """Return for each goal the poses in which it may be met: by staying there, or by a step
        into it if staying at neither end meets the goal."""
        found, pose = self.guarantees, self._graph.pose

        def poses_of(goal: int) -> Mask:
            return self.graph.where_met(lambda one, two: found.meets(goal, pose(one), pose(two)))

        return tuple(map(poses_of, range(found.goals)))

    @cached_property
    def met_by_staying(self) -> bool:
        """Whether a robot that stays in a pose of ``goals`` meets the goal."""
        return not self.guarantees.remember_something and all(
            self.guarantees.meets(goal, pose, pose)
            for goal, poses in enumerate(self.goals)
            for pose in self._graph.poses(poses)
        )

    @cached_property
    def staying(self) -> Mask:
        """The poses in which the formulas allow the robot to stay, with some memory."""
        graph, allows = self._graph, self.guarantees.allows
        stays = (pose for pose in graph.poses(graph.everywhere) if allows(pose, pose))
        return region_mask(map(graph.number, stays))

    def _closed(self) -> Iterator[tuple[int, int]]:
        graph = self._graph
        for pose in bits(graph.everywhere):
            for step in graph.steps(pose):
                if not self.guarantees.allows(graph.pose(pose), graph.pose(step)):
                    yield pose, step


def formulas_of(robot: Robot, world: RegionMap) -> Formulas | None:
    """Return the formulas of a robot's own objective; None if it is of another kind."""
    objective = robot.objective
    return _formulas(objective, world, robot.model.mobility) if isinstance(objective, Ltl) else None


_formulas = lru_cache(maxsize=256)(Formulas)


def graph_of(robot: Robot, world: RegionMap) -> PoseGraph:
    """The poses of a robot on a map and the steps that its guarantees allow; cached."""
    found, mobility = formulas_in(robot.objective), robot.model.mobility
    if found is None:
        return plain_graph(world, mobility)
    return _formulas(found, world, mobility).graph


def permitted(robot: Robot, graph: PoseGraph) -> Mask:
    """The poses on free regions that a robot's own objective does not avoid."""
    return graph.outside(robot.objective.avoid)
