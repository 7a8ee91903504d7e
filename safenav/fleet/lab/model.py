"""The MuJoCo model of a lab: bodies of robots, walls, doors and boxes; the obstacles present now.

Obstacles that block no robot, such as an order or an empty battery, and those with a hidden truth
have no body. All others have bodies for the robots that they block. Obstacles appear and disappear
at the times of the scenario.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import cos, inf, pi, sin
from typing import Any

from msgspec import Struct, field

from safenav.fleet.setpoints import Setpoints
from safenav.fleet.transport import Places
from safenav.motion.flyer import AxisTracker
from safenav.scenario.model import Need, Obstacle, Robot
from safenav.scenario.motion import resolved
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


STEP = 0.005
"""Seconds of a step of the simulation."""
LEAF_THICKNESS = 0.05
"""Thickness in metres of a door leaf, on regions of one metre or more."""
LEAF_MASS, LEAF_DAMPING, LEAF_FRICTION = 8.0, 3.0, 4.0
"""A leaf of a door: kg, N m s/rad, N m: more than a drone's thrust moves."""
HEIGHT, TALL = 1.8, 3.0
"""Height in metres of a robot on the ground, unless it is wider; height of walls and doors."""


class SimulatedBody(Struct):
    """One robot. ``path``: remaining goals, the present one first; ``end``: result of the last
    goal, reported once; ``stay``: the position that it holds without a goal; ``pull``: commanded
    accelerations, which ``thrust`` follows with a lag; ``acts``: its present action, if any;
    ``reference``: the reference that it tracks without a goal."""

    name: str
    radius: float
    speed: float
    height: float
    flies: bool
    turning: float
    mass: float
    tilt: float
    dofs: tuple[int, ...] = ()
    path: list[tuple[float, float, float | None]] = field(default_factory=list)
    begun: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stay: tuple[float, float] = (0.0, 0.0)
    trackers: tuple[AxisTracker, ...] = ()
    pull: tuple[float, float] = (0.0, 0.0)
    thrust: list[float] = field(default_factory=lambda: [0.0, 0.0])
    end: str | None = None
    acts: Handling | None = None
    best: float = inf
    since: float = 0.0
    reference: Setpoints | None = None


class Handling(Struct):
    """An action under way on ``obstacle`` (None: nothing to act on); ``until``: time from which it
    may end (seconds; infinite while the robot pushes a door)."""

    action: str
    obstacle: Obstacle | None
    until: float
    result: str | None = None


def model_text(
    places: Places, obstacles: Iterable[LabObstacle], bodies: Iterable[SimulatedBody]
) -> str:
    """Return the model of a lab in MuJoCo's format."""
    parts = [_wall(places, region) for region in sorted(places.world.walls)]
    solid = [o for o in obstacles if o.touches]
    parts += [_door(places, o) if o.is_door else _box(places, o) for o in solid]
    parts += [_robot(body, contact_bit(number)) for number, body in enumerate(bodies)]
    return (
        f'<mujoco><option timestep="{STEP}" integrator="implicitfast" gravity="0 0 0"/>'
        f"<worldbody>{''.join(parts)}</worldbody></mujoco>"
    )


def _wall(places: Places, region: Region) -> str:
    x, y = places.centre(region)
    dx, dy = (side / 2 for side in places.frame.resolution)
    return (
        f'<geom name="wall.{region}" type="box" pos="{x} {y} {TALL / 2}" '
        f'size="{dx} {dy} {TALL / 2}" euler="0 0 {places.frame.yaw * 180 / pi}"/>'
    )


def _box(places: Places, one: LabObstacle) -> str:
    x, y = places.centre(one.obstacle.region)
    half = 0.3 * min(places.frame.resolution)
    return (
        f'<geom name="{one.key}" type="box" pos="{x} {y} {TALL / 2}" '
        f'size="{half} {half} {TALL / 2}" contype="0" conaffinity="{one.touches}"/>'
    )


def passage(places: Places, region: Region) -> float:
    """Return the direction in radians in which robots pass a door; its leaves are perpendicular to
    it."""
    world = places.world
    row = world.position(region)[0]
    level = any(world.position(each)[0] == row for each in world.neighbours(region))
    return places.frame.yaw + (0.0 if level else pi / 2)


def _door(places: Places, one: LabObstacle) -> str:
    """Return two leaves across the passage, hinged at the sides of their region."""
    x, y = places.centre(one.obstacle.region)
    along = passage(places, one.obstacle.region)
    text = ""
    side = min(places.frame.resolution)
    thick = LEAF_THICKNESS * min(1.0, side)
    reach = min(0.48 * side, side / 2 - 0.8 * thick)  # wide open, it fits in front of the wall
    for index, sign in enumerate((1, -1)):
        across = along + sign * pi / 2
        hx, hy = x + reach * cos(across), y + reach * sin(across)
        half = reach / 2
        text += (
            f'<body name="{one.key}.{index}" pos="{hx} {hy} {TALL / 2}" '
            f'euler="0 0 {(across + pi) * 180 / pi}">'
            f'<joint name="{one.key}.{index}" type="hinge" axis="0 0 1" '
            f'damping="{LEAF_DAMPING}" frictionloss="{LEAF_FRICTION}" range="-100 100" '
            f'limited="true"/><geom name="{one.key}.leaf{index}" type="box" '
            f'pos="{half} 0 0" size="{half} {thick / 2} {TALL / 2}" mass="{LEAF_MASS}" '
            f'contype="2" conaffinity="{one.touches}"/></body>'
        )
    return text


def _robot(body: SimulatedBody, bit: int) -> str:
    slides = f'<joint name="{body.name}.x" type="slide" axis="1 0 0"/>'
    slides += f'<joint name="{body.name}.y" type="slide" axis="0 1 0"/>'
    half = max(HEIGHT / 2 - body.radius, 0.01)
    shape, z = f'type="capsule" size="{body.radius} {half}"', half + body.radius
    if body.flies:
        slides += f'<joint name="{body.name}.z" type="slide" axis="0 0 1"/>'
        shape, z = f'type="sphere" size="{body.radius}"', 0.0
    return (
        f'<body name="{body.name}" pos="0 0 {z}">{slides}'
        f'<joint name="{body.name}.a" type="hinge" axis="0 0 1"/>'
        f'<geom name="{body.name}" {shape} mass="{body.mass}" friction="0.05" priority="1" '
        f'contype="{EVERY | bit}"/>'
        "</body>"
    )


def body_of(robot: Robot) -> SimulatedBody:
    """Return the dimensions of a robot, from its model's motion."""
    model = robot.model
    motion = resolved(model.motion, model.size, model.speed, model.layer) or {}
    flies = motion.get("kind") == "flyer"
    numbers = {key: float(v) for key, v in motion.items() if isinstance(v, float | int)}
    return SimulatedBody(
        robot.name,
        numbers.get("size", model.size or 0.5) / 2,
        numbers.get("speed", model.speed or 0.5),
        numbers.get("altitude", 2.2) if flies else 0.0,
        flies,
        numbers.get("turning", 1.5),
        0.5 if flies else 45.0,
        numbers.get("tilt", 3.4),
    )
