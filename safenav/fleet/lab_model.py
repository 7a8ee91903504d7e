"""The contents of a lab as MuJoCo's model: bodies of robots, walls, doors and boxes."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, inf, pi, sin

from msgspec import Struct, field

from safenav.fleet.lab_obstacles import EVERY, LabObstacle, contact_bit
from safenav.fleet.place import Places
from safenav.fleet.setpoints import Setpoints
from safenav.fleet.walk import BalancedWalk
from safenav.motion.flyer.tracking import AxisTracker
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.motion import resolved
from safenav.world.map import Region

STEP = 0.005
"""Seconds of a step of the simulation."""
LEAF_MASS, LEAF_DAMPING, LEAF_FRICTION = 8.0, 3.0, 4.0
"""A leaf of a door: kg, N m s/rad, N m: more than a drone's thrust moves."""
HEIGHT, TALL = 1.2, 3.0
"""Metres of a robot on the ground without its round ends; of walls and doors."""


class SimulatedBody(Struct):
    """One robot. ``way``: goals that are left, the first one now; ``end``: how the last of them
    ended, told once; ``stay``: where it holds its place without a goal; ``pull``: commanded
    accelerations, which ``thrust`` follows with a lag; ``acts``: what it performs, if it does;
    ``omega``: of a walker's pendulum (1/s); ``reference``: what it tracks when it has no goal."""

    name: str
    radius: float
    speed: float
    height: float
    flies: bool
    turning: float
    mass: float
    tilt: float
    dofs: tuple[int, ...] = ()
    way: list[tuple[float, float, float | None]] = field(default_factory=list)
    begun: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stay: tuple[float, float] = (0.0, 0.0)
    trackers: tuple[AxisTracker, ...] = ()
    pull: tuple[float, float] = (0.0, 0.0)
    thrust: list[float] = field(default_factory=lambda: [0.0, 0.0])
    end: str | None = None
    acts: Handling | None = None
    best: float = inf
    since: float = 0.0
    omega: float = 0.0
    reference: Setpoints | None = None
    walk: BalancedWalk = field(default_factory=BalancedWalk)


class Handling(Struct):
    """An action under way on ``obstacle`` (None: nothing to act on); ``until``: when it has worked
    long enough."""

    action: str
    obstacle: Obstacle | None
    until: float
    result: str | None = None


def model_text(
    places: Places, obstacles: Iterable[LabObstacle], bodies: Iterable[SimulatedBody]
) -> str:
    """The model of a lab, as MuJoCo reads it."""
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


def _door(places: Places, one: LabObstacle) -> str:
    """Two leaves across the passage, hinged at the sides of their region."""
    world, region = places.world, one.obstacle.region
    x, y = places.centre(region)
    beside = world.neighbours(region)
    row = world.position(region)[0]
    along = 0.0 if any(world.position(r)[0] == row for r in beside) else pi / 2
    along += places.frame.yaw
    text = ""
    for index, sign in enumerate((1, -1)):
        reach = 0.48 * min(places.frame.resolution)
        across = along + sign * pi / 2
        hx, hy = x + reach * cos(across), y + reach * sin(across)
        half = reach / 2
        text += (
            f'<body name="{one.key}.{index}" pos="{hx} {hy} {TALL / 2}" '
            f'euler="0 0 {(across + pi) * 180 / pi}">'
            f'<joint name="{one.key}.{index}" type="hinge" axis="0 0 1" '
            f'damping="{LEAF_DAMPING}" frictionloss="{LEAF_FRICTION}" range="-100 100" '
            f'limited="true"/><geom name="{one.key}.leaf{index}" type="box" '
            f'pos="{half} 0 0" size="{half} 0.025 {TALL / 2}" mass="{LEAF_MASS}" '
            f'contype="2" conaffinity="{one.touches}"/></body>'
        )
    return text


def _robot(body: SimulatedBody, bit: int) -> str:
    slides = f'<joint name="{body.name}.x" type="slide" axis="1 0 0"/>'
    slides += f'<joint name="{body.name}.y" type="slide" axis="0 1 0"/>'
    shape, z = f'type="capsule" size="{body.radius} {HEIGHT / 2}"', HEIGHT / 2 + body.radius
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
    """The measures of a robot, from its model's motion."""
    model = robot.model
    motion = resolved(model.motion, model.size, model.speed, model.layer) or {}
    flies = motion.get("kind") == "flyer"

    def number(key: str, default: float) -> float:
        value = motion.get(key, default)
        assert isinstance(value, float | int)
        return float(value)

    walks = motion.get("kind") == "walker"
    return SimulatedBody(
        robot.name,
        number("size", 0.5) / 2,
        number("speed", 0.5),
        number("altitude", 2.2) if flies else 0.0,
        flies,
        number("turning", 1.5),
        0.5 if flies else 45.0,
        number("tilt", 3.4),
        omega=(9.81 / number("height", 0.8)) ** 0.5 if walks else 0.0,
    )
