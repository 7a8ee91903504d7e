"""The obstacles of a lab: those present now, and their shapes in MuJoCo.

Obstacles that block no robot, such as an order or an empty battery, and those with a hidden truth
have no body. All others have bodies for the robots that they block. Obstacles appear and disappear
at the times of the scenario.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from msgspec import Struct

from safenav.scenario.model import Need, Obstacle, Robot
from safenav.world.map import Region

EVERY, FIRST, MOST = 1, 4, 28
"""Contact bits of all robots and of the first robot; maximum number of robots with their own
bit."""
BELOW = -10.0
"""Height in metres of obstacles that are absent: below the floor."""


class LabObstacle(Struct, frozen=True):
    """An obstacle. ``key``: name of its shapes; ``touches``: contact bits of the robots that it
    blocks, 0 without a body."""

    obstacle: Obstacle
    key: str
    touches: int

    @property
    def is_door(self) -> bool:
        """Return whether it has leaves that a robot pushes open."""
        return bool(self.touches) and any(n.action == "push" for n in self.obstacle.needs)


def contact_bit(number: int) -> int:
    """Return the contact bit of the robot with this number in the team."""
    return FIRST << number if number < MOST else EVERY


def lab_obstacles(obstacles: Iterable[Obstacle], robots: Sequence[Robot]) -> list[LabObstacle]:
    """Return obstacles with unique keys: an obstacle that appears where an equal one was gets a new
    key."""
    found: list[LabObstacle] = []
    for obstacle in obstacles:
        same = sum(other.obstacle.name == obstacle.name for other in found)
        key = obstacle.name + f"~{same + 1}" * bool(same)
        found.append(LabObstacle(obstacle, key, _touches(obstacle, robots)))
    return found


def _touches(obstacle: Obstacle, robots: Sequence[Robot]) -> int:
    if obstacle.type.has_truth:
        return 0
    blocked = [number for number, robot in enumerate(robots) if obstacle.blocks(robot)]
    if len(blocked) == len(robots):
        return EVERY
    bits = 0
    for number in blocked:
        bits |= contact_bit(number)
    return bits


class Standing:
    """The obstacles present now, by name, in a model with their shapes. ``stages``: number of
    fulfilled needs of each."""

    def __init__(self, model: Any, obstacles: Sequence[LabObstacle]) -> None:
        self._model = model
        self._waits = [o for o in obstacles if o.obstacle.appears is not None]
        self._goes = [o for o in obstacles if o.obstacle.goes is not None]
        self._shapes: dict[str, list[tuple[Any, int, int, float, int]]] = {}
        self._listed = frozenset(one.obstacle.name for one in obstacles)
        self.stages: dict[str, int] = {}
        self.now: dict[str, LabObstacle] = {}
        for one in obstacles:
            self._shapes[one.key] = []
            for geom in map(model.geom, self._names(one)):
                bits = int(geom.contype[0]), int(geom.conaffinity[0])
                kept = (geom, *bits, float(model.geom_pos[geom.id][2]), int(geom.group[0]))
                self._shapes[one.key].append(kept)
            if one.obstacle.appears is None:
                self.now[one.obstacle.name] = one
            else:
                self._hide(one)

    def __iter__(self) -> Iterator[Obstacle]:
        return (one.obstacle for one in self.now.values())

    def stage(self, obstacle: Obstacle) -> int:
        """Return the number of the next need."""
        return min(self.stages.get(obstacle.name, 0), len(obstacle.needs) - 1)

    def need(self, obstacle: Obstacle) -> Need:
        """Return the next need of an obstacle."""
        return obstacle.needs[self.stage(obstacle)]

    def stands(self, obstacle: Obstacle) -> LabObstacle | None:
        found = self.now.get(obstacle.name)
        return found if found is not None and found.obstacle == obstacle else None

    def passes(self, seconds: float, busy: Callable[[Region], bool]) -> None:
        """Let obstacles appear and disappear at their times. ``busy``: whether a robot is in a
        region or in transit to it; no obstacle appears there."""
        for one in [o for o in self._goes if (o.obstacle.goes or 0) <= seconds]:
            self._goes.remove(one)
            self._waits = [other for other in self._waits if other is not one]
            if self.now.get(one.obstacle.name) is one:
                self.remove(one.obstacle)
        for one in [o for o in self._waits if (o.obstacle.appears or 0) <= seconds]:
            if one.touches and busy(one.obstacle.region):
                continue
            self._waits.remove(one)
            for other in [o for o in self.now.values() if o.touches and one.touches]:
                if other.obstacle.region == one.obstacle.region:
                    self.remove(other.obstacle)  # an open door, which the new obstacle replaces
            self.now[one.obstacle.name] = one
            self.stages.pop(one.obstacle.name, None)
            for geom, contype, conaffinity, height, group in self._shapes[one.key]:
                geom.contype, geom.conaffinity, geom.group = contype, conaffinity, group
                self._model.geom_pos[geom.id][2] = height

    def bring(self, obstacle: Obstacle) -> None:
        """Add an unlisted obstacle without a body that the team itself has created: an operator's
        order, or a robot with an empty battery."""
        if obstacle.name not in self._listed and obstacle.name not in self.now:
            self.now[obstacle.name] = LabObstacle(obstacle, obstacle.name, 0)
            self._shapes[obstacle.name] = []
            self.stages.pop(obstacle.name, None)

    def remove(self, obstacle: Obstacle) -> None:
        """Remove an obstacle."""
        one = self.now.pop(obstacle.name, None)
        if one is not None:
            self._hide(one)

    def _hide(self, one: LabObstacle) -> None:
        for geom, *_ in self._shapes[one.key]:
            geom.contype, geom.conaffinity, geom.group = 0, 0, 5
            self._model.geom_pos[geom.id][2] = BELOW

    def _names(self, one: LabObstacle) -> list[str]:
        if one.is_door:
            return [f"{one.key}.leaf0", f"{one.key}.leaf1"]
        return [one.key] if one.touches else []
