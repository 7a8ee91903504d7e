"""The MuJoCo model of a lab: bodies of robots, walls, doors and boxes.

Obstacles that block no robot, such as an order or an empty battery, and those with a hidden truth
have no body. All others have bodies for the robots that they block.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, pi, sin
from typing import Any

from msgspec import Struct, field

from safenav.fleet.transport import Places
from safenav.scenario.model import Need, Obstacle, Robot
from safenav.world.map import Region

EVERY, FIRST, MOST = 1, 4, 28
"""Contact bits of all robots and of the first robot; maximum number of robots with their own
bit."""
BELOW = -10.0
"""Height in metres of obstacles that are absent: below the floor."""
STEP = 0.01
"""Seconds of a step of the simulation."""
LEAF_THICKNESS = 0.05
"""Thickness in metres of a door leaf, on regions of one metre or more."""
LEAF_MASS, LEAF_DAMPING, LEAF_FRICTION = 8.0, 3.0, 4.0
"""A leaf of a door: kg, N m s/rad, N m: more than a drone's thrust moves."""
HEIGHT, TALL = 1.8, 3.0
"""Height in metres of a robot on the ground, unless it is wider; height of walls and doors."""


class LabObstacle(Struct, eq=False):
    """An obstacle. ``key``: name of its shapes; ``touches``: contact bits of the robots that it
    blocks, 0 without a body; ``shapes``: each with its height and its contact bits; ``leaves``: the
    joints of a door; ``stage``: number of fulfilled needs; ``parts``: the robots that have done
    their part of the next one."""

    obstacle: Obstacle
    key: str
    touches: int = 0
    shapes: list[tuple[Any, float, int, int]] = field(default_factory=list)
    leaves: list[int] = field(default_factory=list)
    stage: int = 0
    parts: set[str] = field(default_factory=set)

    @property
    def is_door(self) -> bool:
        """Return whether it has leaves that a robot pushes open."""
        return bool(self.touches) and any(n.action == "push" for n in self.obstacle.needs)

    @property
    def need(self) -> Need:
        """Return the next need."""
        return self.obstacle.needs[min(self.stage, len(self.obstacle.needs) - 1)]

    def show(self, model: Any, *, there: bool) -> None:
        """Put its shapes at their places in a model, or below the floor."""
        for geom, height, contype, conaffinity in self.shapes:
            geom.contype, geom.conaffinity = (contype, conaffinity) if there else (0, 0)
            geom.group = 0 if there else 5
            model.geom_pos[geom.id][2] = height if there else BELOW


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
    return EVERY if len(blocked) == len(robots) else sum({*map(contact_bit, blocked)})


def contact_bit(number: int) -> int:
    """Return the contact bit of the robot with this number in the team."""
    return FIRST << number if number < MOST else EVERY


class Dimensions(Struct, frozen=True):
    """A robot's body: metres, metres and radians per second, kg; ``height``: its altitude,
    ``tilt``: its highest acceleration in m/s^2 as a flyer."""

    name: str
    radius: float
    speed: float
    height: float
    flies: bool
    turning: float
    mass: float
    tilt: float


def body_of(robot: Robot) -> Dimensions:
    """Return the dimensions of a robot, from its model's motion."""
    model = robot.model
    motion = model.figures or {}
    flies = motion.get("kind") == "flyer"
    numbers = {key: float(v) for key, v in motion.items() if isinstance(v, float | int)}
    return Dimensions(
        robot.name,
        numbers.get("size", model.size or 0.5) / 2,
        numbers.get("speed", model.speed or 0.5),
        numbers.get("altitude", 2.2) if flies else 0.0,
        flies,
        numbers.get("turning", 1.5),
        0.5 if flies else 45.0,
        numbers.get("tilt", 3.4),
    )


def model_text(
    places: Places, obstacles: Iterable[LabObstacle], bodies: Iterable[Dimensions]
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
            f'limited="true"/><geom name="{one.key}.{index}" type="box" '
            f'pos="{half} 0 0" size="{half} {thick / 2} {TALL / 2}" mass="{LEAF_MASS}" '
            f'contype="2" conaffinity="{one.touches}"/></body>'
        )
    return text


def _robot(body: Dimensions, bit: int) -> str:
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
