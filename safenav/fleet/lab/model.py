"""The MuJoCo model of a lab: bodies of robots, walls, doors and boxes.

A walker is an inverted pendulum that keeps its balance on its footsteps. The mass at height h falls
away from the centre of pressure p: c'' = omega^2 (c - p). Its controller can choose p only under
the feet on the ground, and where the next foot lands: it corrects the divergent part of its state,
c + c'/omega, by both (Khadiv et al. 2020, without the step timing). It falls if both do not
suffice. Each foot lands on its planned foothold, moved by its correction.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, hypot, inf, pi, sin

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from safenav.fleet.lab.obstacles import EVERY, LabObstacle, contact_bit
from safenav.fleet.place import Places
from safenav.fleet.setpoints import Setpoints
from safenav.motion.file.records import Foothold
from safenav.motion.flyer.tracking import AxisTracker
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.motion import resolved
from safenav.world.map import Region

Array = NDArray[np.float64]
Point = tuple[float, float]

QUICK = 4.0
"""1/s: how fast the error of the divergent part decays while p is under the feet."""
SOLE = (0.08, 0.04)
"""Metres that p may deviate from the middle of a foot, forwards and sideways."""
REACH = 0.10
"""Metres by which a foot may land beside its foothold."""
FALLEN = 0.30
"""Error of the divergent part, in metres, from which no step can recover the balance."""


class BalancedWalk(Struct):
    """The balance of a walker. ``landed``: corrections (x, y) in metres of the feet on the ground,
    by side and time of landing."""

    landed: dict[tuple[int, float], Point] = field(default_factory=dict)

    def pull(
        self, state: Sequence[float], row: Array, reference: Setpoints, now: float, omega: float
    ) -> Point | None:
        """Return the acceleration (x, y) in a state [x, y, vx, vy] (m, m/s), given the row of the
        reference; None if the walker falls."""
        place, planned = state[:2], row.tolist()
        error = [place[i] - planned[i] + (state[2 + i] - planned[3 + i]) / omega for i in (0, 1)]
        if hypot(*error) > FALLEN:
            return None
        feet = _on_ground(reference, now)
        known, self.landed = self.landed, {}
        for foot in feet:
            key = (foot.side, foot.down)
            stepped = foot.down > reference.begin  # except those on which it stands initially
            fresh = (_within(1.1 * error[0], REACH), _within(1.1 * error[1], REACH))
            self.landed[key] = known.get(key, fresh if stepped else (0.0, 0.0))
        gain = 1 + QUICK / omega
        wanted = [planned[i] - planned[6 + i] / omega**2 + gain * error[i] for i in (0, 1)]
        shifts = [self.landed[foot.side, foot.down] for foot in feet]
        middles = [(f.x + dx, f.y + dy) for f, (dx, dy) in zip(feet, shifts, strict=True)]
        x, y = _under(wanted[0], wanted[1], middles, feet[-1].yaw)
        return omega**2 * (place[0] - x), omega**2 * (place[1] - y)


def _on_ground(reference: Setpoints, now: float) -> list[Foothold]:
    """Return the feet on the ground: before the reference its first, after it its last ones."""
    moment = max(now, reference.begin)
    found = [foot for foot in reference.feet if foot.down <= moment < foot.up]
    if found:
        return found
    last = max(foot.up for foot in reference.feet) - 1e-6
    return [f for f in reference.feet if f.down <= last < f.up] or [reference.feet[-1]]


def _under(x: float, y: float, middles: Sequence[Point], yaw: float) -> Point:
    """Return the point nearest to (x, y) in the box around soles that point in direction
    ``yaw``."""
    c, s = cos(yaw), sin(yaw)
    ahead = [mx * c + my * s for mx, my in middles]
    aside = [my * c - mx * s for mx, my in middles]
    u = min(max(x * c + y * s, min(ahead) - SOLE[0]), max(ahead) + SOLE[0])
    v = min(max(y * c - x * s, min(aside) - SOLE[1]), max(aside) + SOLE[1])
    return u * c - v * s, u * s + v * c


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


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
    ``omega``: natural frequency of a walker's pendulum (1/s); ``reference``: the reference that it
    tracks without a goal."""

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
    omega: float = 0.0
    reference: Setpoints | None = None
    walk: BalancedWalk = field(default_factory=BalancedWalk)


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
    flies, walks = motion.get("kind") == "flyer", motion.get("kind") == "walker"
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
        omega=(9.81 / numbers.get("height", 0.8)) ** 0.5 if walks else 0.0,
    )
