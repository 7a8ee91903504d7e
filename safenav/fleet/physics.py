"""Robots, walls, doors and boxes in MuJoCo: a lab without robots, for rehearsals and tests.

A robot on the ground is a capsule that slides and turns under limited forces; a quadcopter is a
point mass whose accelerations the 20 Hz quadratic programme of ``safenav.motion.flyer`` commands
(paper, Section VII). A door is two leaves on hinges with damping, wide open only where somebody has
pushed it by contact; a region of uncertainty has no body, and is noticed beside it; anything else
is a box that its action takes away. Metres, radians, seconds of
simulated time. Several threads may call it; ``step`` alone moves anything.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import cos, hypot, inf, pi, sin, tau
from typing import Any

import mujoco
import numpy as np

from safenav.fleet.place import Places, turned
from safenav.motion.flyer.tracking import DRAG, HORIZON, LAG, AxisTracker
from safenav.motion.flyer.tracking import STEP as PERIOD
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.motion import resolved
from safenav.world.map import Region

STEP = 0.005
NEAR, SLOW, ALIGNED = 0.03, 0.05, 0.05
"""Metres, metres per second, radians: within these a robot has reached its goal."""
STUCK = 3.0
"""Seconds without progress after which a goal is aborted."""
PROGRESS = 0.02
"""Metres or radians that count as progress."""
FORCE = 2.5
"""Highest acceleration of a robot on the ground, m/s^2."""
LEAF_MASS, LEAF_DAMPING, LEAF_FRICTION = 8.0, 3.0, 4.0
"""A leaf of a door: kg, N m s/rad, N m: more than a drone's thrust moves."""
OPEN = 1.2
"""Radians from which on a leaf counts as open."""
RAYS, FAR = 72, 8.0
"""Rays of a lidar, and metres that they reach."""
ACTING = 2.0
"""Seconds that an action on a box takes."""
HEIGHT, TALL = 1.2, 3.0
"""Metres of a robot on the ground without its round ends; of walls and doors."""


@dataclass
class SimulatedBody:
    """One robot. ``way``: goals that are left, the first one now; ``end``: how the last of them
    ended, told once; ``stay``: where it holds its place without a goal; ``pull``: commanded
    accelerations, which ``thrust`` follows with a lag; ``acts``: what it performs, if it does."""

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


@dataclass
class Handling:
    """An action under way on ``obstacle`` (None: nothing to act on)."""

    obstacle: Obstacle | None
    until: float
    result: str | None = None


class Physics:
    """A world in MuJoCo. ``contacts`` counts the steps of each pair that touched, as names of
    robots, ``wall`` and obstacles."""

    def __init__(
        self, places: Places, robots: Iterable[Robot], obstacles: Iterable[Obstacle]
    ) -> None:
        self.lock = threading.RLock()
        self._places = places
        self._side = min(places.frame.resolution)
        self._bodies = {robot.name: _body(robot) for robot in robots}
        starts = {robot.name: robot.start for robot in robots}
        self._obstacles = {o.name: o for o in obstacles}
        self._model: Any = mujoco.MjModel.from_xml_string(self._text())
        self._data: Any = mujoco.MjData(self._model)
        self._leaves: dict[str, list[int]] = {}
        self.contacts: dict[tuple[str, str], int] = {}
        for name, body in self._bodies.items():
            axes = "xyza" if body.flies else "xya"
            joints = [self._model.joint(f"{name}.{axis}") for axis in axes]
            body.dofs = tuple(int(joint.dofadr[0]) for joint in joints)
            yaw = places.yaw(starts[name])
            self._data.qpos[body.dofs[-1]] = 0.0 if yaw is None else yaw
            for i, value in enumerate(places.centre(starts[name].region)):
                self._data.qpos[body.dofs[i]] = value
            x, y, _ = self._at(body)
            body.stay = self._at(body)[:2]
            body.begun = (*body.stay, -inf)
            if body.flies:
                self._data.qpos[body.dofs[2]] = body.height
                body.trackers = (AxisTracker(x, body.tilt), AxisTracker(y, body.tilt))
        for name, obstacle in self._obstacles.items():
            if _is_door(obstacle):
                self._leaves[name] = [
                    int(self._model.joint(f"{name}.{i}").qposadr[0]) for i in (0, 1)
                ]
        mujoco.mj_forward(self._model, self._data)

    # What drives it

    @property
    def now(self) -> float:
        return float(self._data.time)

    def send(self, name: str, x: float, y: float, yaw: float | None) -> None:
        """Give a robot a goal in place of the one it has."""
        with self.lock:
            self._begin(self._bodies[name], [(x, y, yaw)])

    def stop(self, name: str) -> None:
        """Cancel a robot's goal: it brakes."""
        with self.lock:
            body = self._bodies[name]
            if body.way:
                body.stay = self._at(body)[:2]
                body.begun = (*body.stay, self.now)
                body.way, body.end = [], "canceled"

    def perform(self, name: str, action: str) -> None:
        """Let a robot act on an obstacle in its region or beside it that takes this action."""
        with self.lock:
            body = self._bodies[name]
            x, y, yaw = self._at(body)
            here = self._places.region(x, y)
            near = set() if here is None else {here, *self._places.world.neighbours(here)}
            found = next(
                (
                    o
                    for o in self._obstacles.values()
                    if o.region in near and any(n.action == action for n in o.needs)
                ),
                None,
            )
            body.acts = Handling(found, self.now + ACTING)
            if found is not None and _is_door(found):
                cx, cy = self._places.centre(found.region)
                far = hypot(cx - x, cy - y)
                ux, uy = (cx - x, cy - y) if far > 0.3 * self._side else (cos(yaw), sin(yaw))
                size = hypot(ux, uy)
                ux, uy = ux / size, uy / size
                deep = 0.5 * self._side - body.radius - 0.02
                side = deep - 0.1  # a leaf that is wide open is between the robot and the wall
                spots = [(0.0, 0.0), (deep, 0.0), (deep, side), (deep, -side), (deep, 0.0)]
                way = [(cx + a * ux - b * uy, cy + a * uy + b * ux, None) for a, b in spots]
                home = self._places.centre(here) if here is not None else (x, y)
                self._begin(body, [*way, (*home, yaw)])
                body.acts.until = inf

    def state(self, name: str) -> dict[str, Any]:
        """Where a robot is, and how its goal or action ended, each told once."""
        with self.lock:
            body = self._bodies[name]
            x, y, yaw = self._at(body)
            acted = None
            if body.acts is not None and body.acts.result is not None:
                acted, body.acts = body.acts.result, None
            end, body.end = (None, body.end) if body.acts is not None else (body.end, None)
            moving = bool(body.way)
            return {
                "now": self.now,
                "x": x,
                "y": y,
                "yaw": yaw,
                "goal": moving or None,
                "end": end,
                "acted": acted,
            }

    def scan(self, name: str) -> tuple[float, list[float]]:
        """The stamp and ranges of a lidar, counter-clockwise from the robot's front."""
        with self.lock:
            body = self._bodies[name]
            x, y, yaw = self._at(body)
            origin = np.array([x, y, body.height if body.flies else 0.5])
            own = self._model.body(name).id
            hit = np.zeros(1, dtype=np.int32)
            found = []
            for index in range(RAYS):
                angle = yaw + tau * index / RAYS
                ray = np.array([cos(angle), sin(angle), 0.0])
                far = mujoco.mj_ray(self._model, self._data, origin, ray, None, 1, own, hit)
                found.append(float(far) if 0 <= far <= FAR else inf)
            return self.now, found

    def noticed(self, name: str) -> list[str]:
        """The uncertain regions beside a robot, as names of obstacles."""
        with self.lock:
            here = self._places.region(*self._at(self._bodies[name])[:2])
            near = () if here is None else self._places.world.neighbours(here)
            return [
                o.name for o in self._obstacles.values() if o.type.has_truth and o.region in near
            ]

    def log(self) -> dict[str, Any]:
        """Contacts, doors that are closed, and where robots are."""
        with self.lock:
            return {
                "contacts": {" ".join(pair): count for pair, count in self.contacts.items()},
                "closed": sorted(n for n in self._leaves if not self._is_open(n)),
                "regions": {
                    name: self._places.region(*self._at(body)[:2])
                    for name, body in self._bodies.items()
                },
                "moving": sorted(name for name, body in self._bodies.items() if body.way),
            }

    def step(self, seconds: float) -> None:
        """Let time pass, to the nearest step of the simulation."""
        with self.lock:
            for _ in range(max(1, round(seconds / STEP))):
                self._step()

    # Steps

    def _begin(self, body: SimulatedBody, way: list[tuple[float, float, float | None]]) -> None:
        body.way, body.end = way, None
        body.begun = (*self._at(body)[:2], self.now)
        body.best, body.since = inf, self.now

    def _step(self) -> None:
        self._data.qfrc_applied[:] = 0.0
        thinks = round(self.now / STEP) % round(PERIOD / STEP) == 0
        for body in self._bodies.values():
            (self._fly if body.flies else self._drive)(body, thinks)
        mujoco.mj_step(self._model, self._data)
        self._note_contacts()
        for body in self._bodies.values():
            self._judge(body)

    def _drive(self, body: SimulatedBody, _: bool) -> None:
        """Towards the goal, with limited speed and force; without a goal, keep the place."""
        x, y, yaw = self._at(body)
        vx, vy, turn = (float(self._data.qvel[dof]) for dof in body.dofs)
        gx, gy, to = body.way[0] if body.way else (*body.stay, None)
        far = hypot(gx - x, gy - y)
        fast = min(body.speed, (2 * 0.5 * FORCE * far) ** 0.5) / far if far > 1e-6 else 0.0
        wanted = turned(to - yaw) if to is not None else 0.0
        spin = max(-body.turning, min(body.turning, 3.0 * wanted))
        for dof, speed, now, weight in (
            (body.dofs[0], (gx - x) * fast, vx, body.mass),
            (body.dofs[1], (gy - y) * fast, vy, body.mass),
            (body.dofs[2], spin, turn, body.mass * body.radius**2 / 2),
        ):
            pull = max(-FORCE, min(FORCE, (speed - now) / 0.1))
            if dof == body.dofs[2]:
                pull = max(-10.0, min(10.0, (speed - now) / 0.1))
            self._data.qfrc_applied[dof] = weight * pull

    def _fly(self, body: SimulatedBody, thinks: bool) -> None:
        """The quadratic programme at 20 Hz for x and y; altitude and yaw are held."""
        x, y, yaw = self._at(body)
        if thinks:
            goal = body.way[0][:2] if body.way else body.stay
            pulls = []
            for i, tracker in enumerate(body.trackers):
                tracker.observe((x, y)[i])
                wanted = self._reference(body, i, goal[i])
                low = min(body.begun[i], goal[i]) - self._side / 2 + body.radius
                high = max(body.begun[i], goal[i]) + self._side / 2 - body.radius
                pulls.append(tracker.command(wanted, np.full(HORIZON, low), np.full(HORIZON, high)))
            body.pull = (pulls[0], pulls[1])
        for i in (0, 1):
            speed = float(self._data.qvel[body.dofs[i]])
            body.thrust[i] += (body.pull[i] - body.thrust[i]) * STEP / LAG
            self._data.qfrc_applied[body.dofs[i]] = body.mass * (body.thrust[i] - DRAG * speed)
        z, up = (float(a[body.dofs[2]]) for a in (self._data.qpos, self._data.qvel))
        self._data.qfrc_applied[body.dofs[2]] = body.mass * (9 * (body.height - z) - 5 * up)
        turn = float(self._data.qvel[body.dofs[3]])
        to = body.way[0][2] if body.way else None
        off = turned(to - yaw) if to is not None else 0.0
        self._data.qfrc_applied[body.dofs[3]] = 0.02 * (4 * off - 4 * turn)

    def _reference(self, body: SimulatedBody, axis: int, goal: float) -> Any:
        """Position, velocity, acceleration after each step of the horizon: a quintic from where the
        goal was given, from rest to rest."""
        start, began = body.begun[axis], body.begun[2]
        across = body.way[0][:2] if body.way else body.begun[:2]
        other = across[1 - axis] - body.begun[1 - axis]
        way = hypot(goal - start, other)
        lasts = max(1.875 * way / body.speed, (10 / 3**0.5 * way / (body.tilt / 2)) ** 0.5, PERIOD)
        rows = np.zeros((HORIZON, 3))
        for k in range(HORIZON):
            s = min(1.0, max(0.0, (self.now - began + (k + 1) * PERIOD) / lasts))
            rows[k, 0] = start + (goal - start) * (10 * s**3 - 15 * s**4 + 6 * s**5)
            rows[k, 1] = (goal - start) * (30 * s**2 - 60 * s**3 + 30 * s**4) / lasts
            rows[k, 2] = (goal - start) * (60 * s - 180 * s**2 + 120 * s**3) / lasts**2
        return rows

    def _judge(self, body: SimulatedBody) -> None:
        """End a goal that is reached, or that makes no progress; end an action."""
        act = body.acts
        if body.way:
            x, y, yaw = self._at(body)
            gx, gy, to = body.way[0]
            far, off = hypot(gx - x, gy - y), 0.0 if to is None else abs(turned(to - yaw))
            speed = hypot(*(float(self._data.qvel[dof]) for dof in body.dofs[:2]))
            if far < NEAR and speed < SLOW and off < ALIGNED:
                self._next(body, "succeeded")
            elif far + off < body.best - PROGRESS:
                body.best, body.since = far + off, self.now
            elif self.now - body.since > STUCK:
                self._next(body, "aborted")
        elif act is not None and act.result is None and act.until == inf:
            assert act.obstacle is not None
            opened = self._is_open(act.obstacle.name)
            act.result = "done" if opened and body.end == "succeeded" else "failed"
            body.end = None
        elif act is not None and act.result is None and self.now >= act.until:
            act.result = "nothing"
            if act.obstacle is not None:
                passable = not act.obstacle.type.has_truth or act.obstacle.traversable
                act.result = "done" if passable else "untraversable"
                self._take_away(act.obstacle)

    def _next(self, body: SimulatedBody, end: str) -> None:
        """Begin the next goal, or end the way: an action also goes home when it fails."""
        left = body.way[1:] if end == "succeeded" or body.acts is not None else []
        if left:
            self._begin(body, left)
        else:
            body.stay = body.way[0][:2] if end == "succeeded" else self._at(body)[:2]
            body.way, body.end = [], end
        if end == "aborted" and body.flies:  # its estimate took the obstacle for wind
            x, y, _ = self._at(body)
            body.trackers = (AxisTracker(x, body.tilt), AxisTracker(y, body.tilt))

    def _at(self, body: SimulatedBody) -> tuple[float, float, float]:
        """x, y, yaw; joints count from the origin of the world."""
        x, y, yaw = (float(self._data.qpos[body.dofs[i]]) for i in (0, 1, -1))
        return x, y, yaw

    def _is_open(self, name: str) -> bool:
        return all(abs(float(self._data.qpos[joint])) >= OPEN for joint in self._leaves[name])

    def _take_away(self, obstacle: Obstacle) -> None:
        del self._obstacles[obstacle.name]
        if obstacle.type.has_truth:
            return
        geom = self._model.geom(obstacle.name)
        geom.contype, geom.conaffinity, geom.group = 0, 0, 5
        self._model.geom_pos[geom.id][2] = -10.0

    def _note_contacts(self) -> None:
        for index in range(self._data.ncon):
            pair = self._data.contact[index].geom
            names = sorted(self._named(int(geom)) for geom in pair)
            if any(name in self._bodies for name in names):
                key = (names[0], names[1])
                self.contacts[key] = self.contacts.get(key, 0) + 1

    def _named(self, geom: int) -> str:
        name = str(self._model.geom(geom).name)
        return name.split(".")[0]

    # The model

    def _text(self) -> str:
        parts = [self._wall(region) for region in sorted(self._places.world.walls)]
        solid = [o for o in self._obstacles.values() if not o.type.has_truth]
        parts += [self._door(o) if _is_door(o) else self._box(o) for o in solid]
        parts += [self._robot(body) for body in self._bodies.values()]
        return (
            f'<mujoco><option timestep="{STEP}" integrator="implicitfast" gravity="0 0 0"/>'
            f"<worldbody>{''.join(parts)}</worldbody></mujoco>"
        )

    def _wall(self, region: Region) -> str:
        x, y = self._places.centre(region)
        dx, dy = (side / 2 for side in self._places.frame.resolution)
        return (
            f'<geom name="wall.{region}" type="box" pos="{x} {y} {TALL / 2}" '
            f'size="{dx} {dy} {TALL / 2}" euler="0 0 {self._places.frame.yaw * 180 / pi}"/>'
        )

    def _box(self, obstacle: Obstacle) -> str:
        x, y = self._places.centre(obstacle.region)
        half = 0.3 * self._side
        return (
            f'<geom name="{obstacle.name}" type="box" pos="{x} {y} {TALL / 2}" '
            f'size="{half} {half} {TALL / 2}"/>'
        )

    def _door(self, obstacle: Obstacle) -> str:
        """Two leaves across the passage, hinged at the sides of their region."""
        world = self._places.world
        x, y = self._places.centre(obstacle.region)
        beside = world.neighbours(obstacle.region)
        row = world.position(obstacle.region)[0]
        along = 0.0 if any(world.position(r)[0] == row for r in beside) else pi / 2
        along += self._places.frame.yaw
        text = ""
        for index, sign in enumerate((1, -1)):
            reach = 0.48 * self._side
            across = along + sign * pi / 2
            hx, hy = x + reach * cos(across), y + reach * sin(across)
            half = reach / 2
            text += (
                f'<body name="{obstacle.name}.{index}" pos="{hx} {hy} {TALL / 2}" '
                f'euler="0 0 {(across + pi) * 180 / pi}">'
                f'<joint name="{obstacle.name}.{index}" type="hinge" axis="0 0 1" '
                f'damping="{LEAF_DAMPING}" frictionloss="{LEAF_FRICTION}" range="-100 100" '
                f'limited="true"/><geom name="{obstacle.name}.leaf{index}" type="box" '
                f'pos="{half} 0 0" size="{half} 0.025 {TALL / 2}" mass="{LEAF_MASS}" '
                'contype="2" conaffinity="1"/></body>'
            )
        return text

    def _robot(self, body: SimulatedBody) -> str:
        slides = f'<joint name="{body.name}.x" type="slide" axis="1 0 0"/>'
        slides += f'<joint name="{body.name}.y" type="slide" axis="0 1 0"/>'
        shape, z = f'type="capsule" size="{body.radius} {HEIGHT / 2}"', HEIGHT / 2 + body.radius
        if body.flies:
            slides += f'<joint name="{body.name}.z" type="slide" axis="0 0 1"/>'
            shape, z = f'type="sphere" size="{body.radius}"', 0.0
        return (
            f'<body name="{body.name}" pos="0 0 {z}">{slides}'
            f'<joint name="{body.name}.a" type="hinge" axis="0 0 1"/>'
            f'<geom name="{body.name}" {shape} mass="{body.mass}" friction="0.05" priority="1"/>'
            "</body>"
        )


def _body(robot: Robot) -> SimulatedBody:
    """The measures of a robot, from its model's motion."""
    model = robot.model
    motion = resolved(model.motion, model.size, model.speed, model.layer) or {}
    flies = motion.get("kind") == "flyer"

    def number(key: str, default: float) -> float:
        value = motion.get(key, default)
        assert isinstance(value, float | int)
        return float(value)

    return SimulatedBody(
        robot.name,
        number("size", 0.5) / 2,
        number("speed", 0.5),
        number("altitude", 2.2) if flies else 0.0,
        flies,
        number("turning", 1.5),
        0.5 if flies else 45.0,
        number("tilt", 3.4),
    )


def _is_door(obstacle: Obstacle) -> bool:
    return any(need.action == "push" for need in obstacle.needs)
