"""The MuJoCo model of a lab: bodies of robots, walls, doors and boxes."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, inf, pi, sin

from msgspec import Struct, field

from safenav.fleet.lab.obstacles import EVERY, LabObstacle, contact_bit
from safenav.fleet.place import Places
from safenav.fleet.setpoints import Setpoints
from safenav.motion.flyer import AxisTracker
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.motion import resolved
from safenav.world.map import Region

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
