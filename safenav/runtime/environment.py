"""Environment characterization (EC): the actual world, and what the team knows of it.

The modelled world is the map with its known obstacles O; the actual one also holds the
hidden obstacles R, found when a robot is about to enter one (paper, Sections III and V-A).
"""

from __future__ import annotations

import random
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Protocol

from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.spec.task import Known
from safenav.world.map import Region
from safenav.world.moves import Pose


class World(Protocol):
    """The actual world as a mission meets it: a simulation, or real robots.

    A program that drives real robots implements these three and hands itself to the mission.
    """

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """The unresolved obstacle in a region that ``robot`` is about to enter, if any."""
        ...

    def move(self, robot: Robot, pose: Pose) -> None:
        """Bring the robot to ``pose``: its own region or a neighbouring one."""
        ...

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        """Let the robot perform its actions where it stands: the obstacles that this
        resolves, each with whether its region is traversable (None: no such question)."""
        ...


class SimulatedWorld:
    """The scenario's own hidden obstacles, with probabilities drawn from its seed."""

    def __init__(self, scenario: Scenario) -> None:
        self._map = scenario.map
        self._poses = {robot.name: robot.start for robot in scenario.robots}
        self._hidden = {obstacle.region: obstacle for obstacle in scenario.obstacles}
        self.truths = draw_truths(scenario)

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        del robot  # every robot notices what stands right before it
        return self._hidden.get(region)

    def move(self, robot: Robot, pose: Pose) -> None:
        self._poses[robot.name] = pose

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        here = self._poses[robot.name].region
        done = [
            obstacle
            for obstacle in self._hidden.values()
            if obstacle.type.action in robot.capabilities
            and here in obstacle.resolution_regions(self._map)
        ]
        for obstacle in done:
            del self._hidden[obstacle.region]
        return [(obstacle, self.truths[obstacle.name]) for obstacle in done]


def draw_truths(scenario: Scenario) -> dict[str, bool | None]:
    """What ``traversable`` is in this run: probabilities are drawn in the scenario's order
    from its seed, so that a run can be repeated."""
    generator = random.Random(scenario.seed)
    truths: dict[str, bool | None] = {}
    for obstacle in scenario.obstacles:
        truth = obstacle.traversable
        if isinstance(truth, float):
            truth = generator.random() < truth
        truths[obstacle.name] = truth
    return truths


@dataclass(frozen=True)
class Violation:
    """A proposed move that the augmented specification forbids (paper, eq. for phi_a)."""

    robot: Robot
    at: Region
    proposed: Region
    obstacle: Obstacle


class Characterization:
    """What the team has found out: obstacles met and still pending, and those that have
    joined the known ones (O) for the robots that they block."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.pending: dict[str, Obstacle] = {}
        self.joined: dict[str, tuple[Obstacle, str]] = {}

    def check(self, robot: Robot, pose: Pose, target: Region) -> Violation | None:
        """Whether moving from ``pose`` to ``target`` violates what is observed."""
        if target == pose.region:
            return None
        obstacle = self._world.sense(robot, target)
        if obstacle is None or not obstacle.blocks(robot):
            return None
        return Violation(robot, pose.region, target, obstacle)

    @property
    def standing(self) -> frozenset[Region]:
        """The regions of all obstacles that are known and not removed: they block the view."""
        joined = (obstacle for obstacle, _ in self.joined.values())
        return frozenset(obstacle.region for obstacle in (*self.pending.values(), *joined))

    def meet(self, obstacle: Obstacle) -> None:
        """Remember an obstacle that somebody has run into."""
        self.pending[obstacle.name] = obstacle

    def join(self, obstacle: Obstacle, reason: str) -> None:
        """Add an obstacle to O for the robots that it blocks."""
        self.pending.pop(obstacle.name, None)
        self.joined[obstacle.name] = (obstacle, reason)

    def resolve(self, obstacle: Obstacle) -> None:
        """Forget an obstacle that is gone."""
        self.pending.pop(obstacle.name, None)
        self.joined.pop(obstacle.name, None)

    def known_for(self, robot: Robot, avoid: Collection[str] = ()) -> tuple[Known, ...]:
        """The regions beyond the walls that the robot must not plan through: those of joined
        obstacles, and of pending ones that it is told to ``avoid``."""
        known = [
            Known(o.region, f"obstacles.{o.name}", reason)
            for o, reason in self.joined.values()
            if o.blocks(robot)
        ]
        known += [
            Known(o.region, f"obstacles.{o.name}", "found, and not resolved yet")
            for o in self.pending.values()
            if o.name in avoid and o.blocks(robot)
        ]
        return tuple(sorted(known, key=lambda k: k.region))
