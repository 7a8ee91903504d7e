"""Failures of robots in a live run: counts and reactions (docs/coordination.md)."""

from __future__ import annotations

from collections import Counter
from enum import Enum

from msgspec import Struct, field

from safenav.scenario.model import OPERATOR_ACTION, Obstacle, ObstacleType, Robot
from safenav.scenario.settings import FailedMoves, Failures
from safenav.world.map import Region


class Reaction(Enum):
    """Policy after a failed step."""

    RETRY = "the strategy decides again"
    OBSTACLE = "the region counts as an encountered obstacle"
    OUT_OF_SERVICE = "others take over its duties"


class FailureCounts(Struct):
    """Failures that still count. ``moves``: failed steps of each robot into each region;
    ``in_row``: those since its last arrival; ``actions``: failed actions of each robot on each
    obstacle; ``barred``: robots that no longer act on an obstacle; ``opened``: when each obstacle
    was resolved or disappeared; ``out``: why each robot is out of service."""

    moves: Counter[tuple[str, Region]] = field(default_factory=Counter)
    in_row: Counter[str] = field(default_factory=Counter)
    actions: Counter[tuple[str, str]] = field(default_factory=Counter)
    barred: set[tuple[str, str]] = field(default_factory=set)
    opened: dict[str, float] = field(default_factory=dict)
    out: dict[str, str] = field(default_factory=dict)

    def move_failed(self, policy: Failures, robot: str, region: Region, *, fatal: bool) -> Reaction:
        """Count a failed step into ``region``."""
        self.moves[robot, region] += 1
        self.in_row[robot] += 1
        if fatal or self.in_row[robot] >= policy.most:
            return Reaction.OUT_OF_SERVICE
        if self.moves[robot, region] <= policy.retries:
            return Reaction.RETRY
        gives_up = policy.then is FailedMoves.OUT_OF_SERVICE
        return Reaction.OUT_OF_SERVICE if gives_up else Reaction.OBSTACLE

    def arrived(self, robot: str) -> None:
        """Forget the failed steps of a robot that has arrived."""
        self.in_row.pop(robot, None)
        self.moves = Counter({key: n for key, n in self.moves.items() if key[0] != robot})

    def back(self, robot: str) -> None:
        """Forget the failures of a robot that is back in service."""
        self.arrived(robot)
        self.out.pop(robot, None)
        self._forgive({pair for pair in self.actions if pair[0] == robot})

    def action_failed(self, policy: Failures, robot: str, obstacle: str) -> bool:
        """Count a failed action; return whether the robot no longer acts on the obstacle."""
        self.actions[robot, obstacle] += 1
        if self.actions[robot, obstacle] < policy.actions:
            return False
        self.barred.add((robot, obstacle))
        return True

    def gone(self, obstacle: str, now: float) -> None:
        """Record that an obstacle is resolved or has disappeared."""
        self.opened[obstacle] = now
        self._forgive({pair for pair in self.actions if pair[1] == obstacle})

    def _forgive(self, pairs: set[tuple[str, str]]) -> None:
        self.barred -= pairs
        self.actions = Counter({pair: n for pair, n in self.actions.items() if pair not in pairs})

    def appeared(self, obstacle: str) -> None:
        """Record that an obstacle is present, perhaps again."""
        self.opened.pop(obstacle, None)

    def is_late(self, obstacle: str, at: float) -> bool:
        """Whether a report of an obstacle is about a time before it was opened."""
        return at < self.opened.get(obstacle, at)


def unknown(robot: Robot, region: Region) -> Obstacle:
    """Return an obstacle that blocks the robot's layer in a region; only an operator can resolve
    it."""
    layer = robot.model.layer
    return Obstacle(
        ObstacleType(f"unknown_{layer}", OPERATOR_ACTION, blocks=frozenset({layer})), region
    )


def stands_for(obstacle: Obstacle, robot: str) -> bool:
    """Whether an obstacle marks a region where that robot may be lost."""
    return obstacle.type.name == f"lost_{robot}"


def lost(robot: Robot, others: frozenset[str], region: Region) -> Obstacle:
    """Return an obstacle where a lost robot may be; it blocks that robot and ``others``."""
    blocks = frozenset({robot.name, *others})
    return Obstacle(ObstacleType(f"lost_{robot.name}", OPERATOR_ACTION, blocks=blocks), region)
