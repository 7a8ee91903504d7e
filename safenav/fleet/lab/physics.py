"""Robots, walls, doors and boxes in MuJoCo: a lab without real robots, for rehearsals and tests.

Robots track references; a goal is one as well, straight to its place. A robot on the ground is a
capsule that slides and turns under limited forces; a quadcopter is a point mass whose
accelerations the 20 Hz quadratic programme of ``safenav.motion.flyer`` commands (paper, Section
VII). A door is two leaves on hinges with damping, which opens wide only if a robot pushes it by
contact; an uncertain region has no body, and is noticed from adjacent regions; any other obstacle
is a box that its action removes, and that appears and disappears at the times of the scenario.
Metres, radians, seconds of simulated time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import cos, hypot, inf, sin, tau
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct, field

from safenav.fleet.lab.model import (
    STEP,
    Dimensions,
    LabObstacle,
    body_of,
    lab_obstacles,
    model_text,
    passage,
)
from safenav.fleet.setpoints import TABLE, Array, Setpoints
from safenav.fleet.transport import Places, turned
from safenav.motion.flyer import DRAG, HORIZON, LAG, PERIOD, AxisTracker
from safenav.motion.geometry import derivative, quintic, values
from safenav.scenario.model import Obstacle, Robot
from safenav.world.map import Region

FORCE, TORQUE = 2.5, 20.0
"""Highest accelerations of a robot on the ground, m/s^2 and rad/s^2."""
STIFF = 10.0
"""Gain (1/s) with which a robot on the ground tracks its reference."""
NEAR, SLOW, ALIGNED = 0.03, 0.05, 0.05
"""Metres, metres per second, radians: within these a robot has reached its goal."""
STUCK = 3.0
"""Seconds without progress after which a goal is aborted."""
PROGRESS = 0.02
"""Metres or radians that count as progress."""
OPEN = 1.2
"""Angle in radians from which a leaf counts as open."""
DEEP = 0.27
"""Share of a region's side behind its middle up to which a robot walks to push a door open."""
RAYS, FAR = 72, 8.0
"""Number of rays of a lidar, and their range in metres."""
ACTING, WAITING = 2.0, 2.0
"""Seconds of an action on a box, and of the wait for other robots that lift it."""
Goal = tuple[float, float, float | None]
"""x, y and yaw; None: any yaw."""


class Handling(Struct):
    """An action under way on ``obstacle`` (None: nothing to act on); ``until``: time from which it
    may end (seconds; infinite while the robot pushes a door)."""

    action: str
    obstacle: LabObstacle | None
    until: float
    result: str | None = None


class SimulatedBody(Struct):
    """One robot. ``reference``: what it tracks; ``path``: remaining goals, the present one first;
    ``end``: result of the last goal, reported once; ``best``, ``since``: when it was nearest to its
    goal; ``pull``: commanded accelerations, which ``thrust`` follows with a lag; ``acts``: its
    present action, if any."""

    kind: Dimensions
    dofs: tuple[int, ...]
    reference: Setpoints
    trackers: tuple[AxisTracker, ...]
    path: list[Goal] = field(default_factory=list)
    end: str | None = None
    best: float = inf
    since: float = 0.0
    pull: list[float] = field(default_factory=lambda: [0.0, 0.0])
    thrust: list[float] = field(default_factory=lambda: [0.0, 0.0])
    acts: Handling | None = None


class Physics:
    """A world in MuJoCo. ``begin``: x, y and yaw of robots that do not start in the centre of their
    region."""

    def __init__(
        self,
        places: Places,
        robots: Sequence[Robot],
        obstacles: Iterable[Obstacle],
        begin: Mapping[str, tuple[float, float, float]] = MappingProxyType({}),
    ) -> None:
        self._places = places
        self._side = min(places.frame.resolution)
        known = lab_obstacles(obstacles, robots)
        kinds = [body_of(robot) for robot in robots]
        self._model: Any = mujoco.MjModel.from_xml_string(model_text(places, known, kinds))
        self._data: Any = mujoco.MjData(self._model)
        # Views that stay valid: reading from them takes a tenth of the time of a lookup.
        self._coordinate, self._velocity = self._data.qpos.item, self._data.qvel.item
        self._force = self._data.qfrc_applied
        self._bodies: dict[str, SimulatedBody] = {}
        for robot, kind in zip(robots, kinds, strict=True):
            middle = (*places.centre(robot.start.region), places.yaw(robot.start) or 0.0)
            self._bodies[robot.name] = self._placed(kind, begin.get(robot.name, middle))
        self._listed = frozenset(one.obstacle.name for one in known)
        self._later = [one for one in known if one.obstacle.appears is not None]
        self.standing = {o.obstacle.name: o for o in known if o.obstacle.appears is None}
        """The obstacles present now, by name."""
        for one in known:
            self._find_shapes(one)
        mujoco.mj_forward(self._model, self._data)

    def _placed(self, kind: Dimensions, at: tuple[float, float, float]) -> SimulatedBody:
        """Return the body of a robot, at rest at x, y and yaw."""
        axes = "xyza" if kind.flies else "xya"
        joints = [self._model.joint(f"{kind.name}.{axis}") for axis in axes]
        dofs = tuple(int(joint.dofadr[0]) for joint in joints)
        for dof, value in zip((*dofs[:2], dofs[-1]), at, strict=True):
            self._data.qpos[dof] = value
        if kind.flies:
            self._data.qpos[dofs[2]] = kind.height
        return SimulatedBody(kind, dofs, straight(0.0, at, at), _trackers(kind, at))

    def _find_shapes(self, one: LabObstacle) -> None:
        """Find the shapes of an obstacle in the model; hide it until it appears."""
        parts = [one.key] if one.touches else []
        if one.is_door:
            parts = [f"{one.key}.{number}" for number in (0, 1)]
            one.leaves = [int(self._model.joint(part).qposadr[0]) for part in parts]
        for geom in map(self._model.geom, parts):
            height = float(self._model.geom_pos[geom.id][2])
            one.shapes.append((geom, height, int(geom.contype[0]), int(geom.conaffinity[0])))
        if one.obstacle.appears is not None:
            one.show(self._model, there=False)

    @property
    def now(self) -> float:
        return float(self._data.time)

    # Robots

    def _track(self, body: SimulatedBody, _: bool) -> None:
        """Track the reference on the ground: its acceleration, and corrections, with limited
        forces."""
        at, row = self._at(body), body.reference.at(self.now).tolist()
        speeds = [*map(self._velocity, body.dofs)]
        for axis in (0, 1):
            off = STIFF**2 * (row[axis] - at[axis]) + 2 * STIFF * (row[axis + 3] - speeds[axis])
            pull = max(-FORCE, min(FORCE, row[axis + 6] + off))
            self._force[body.dofs[axis]] = body.kind.mass * pull
        spin = 36.0 * turned(row[9] - at[2]) - 12.0 * speeds[2]
        inertia = body.kind.mass * body.kind.radius**2 / 2
        self._force[body.dofs[2]] = inertia * max(-TORQUE, min(TORQUE, spin))

    def _fly(self, body: SimulatedBody, thinks: bool) -> None:
        """Fly by the quadratic programme at 20 Hz in x and y; hold altitude and yaw."""
        at, kind, reference = self._at(body), body.kind, body.reference
        if thinks:
            wanted = reference.ahead(self.now + PERIOD).rows
            for axis, tracker in enumerate(body.trackers):
                tracker.observe(at[axis])
                ends = reference.rows[[0, -1], axis]
                room = self._side / 2 - kind.radius
                low, high = (np.full(HORIZON, end) for end in (min(ends) - room, max(ends) + room))
                body.pull[axis] = tracker.command(wanted[:, [axis, axis + 3, axis + 6]], low, high)
        speeds = [*map(self._velocity, body.dofs)]
        for axis in (0, 1):
            body.thrust[axis] += (body.pull[axis] - body.thrust[axis]) * STEP / LAG
            thrust = body.thrust[axis] - DRAG * speeds[axis]
            self._force[body.dofs[axis]] = kind.mass * thrust
        z = self._coordinate(body.dofs[2])
        self._force[body.dofs[2]] = kind.mass * (9 * (kind.height - z) - 5 * speeds[2])
        off = turned(float(reference.at(self.now)[9]) - at[2])
        self._force[body.dofs[3]] = 0.02 * (4 * off - 4 * speeds[3])

    def _at(self, body: SimulatedBody) -> tuple[float, float, float]:
        """Return x, y and yaw; joint positions are relative to the origin of the world."""
        dofs, at = body.dofs, self._coordinate
        return at(dofs[0]), at(dofs[1]), at(dofs[-1])

    def _moves(self, name: str) -> bool:
        body = self._bodies[name]
        return bool(body.path) or self.now < body.reference.end

    # Commands

    def send(self, name: str, x: float, y: float, yaw: float | None) -> None:
        """Replace the goal of a robot (metres, radians; None: any yaw)."""
        self._begin(self._bodies[name], [(x, y, yaw)])

    def follow(self, name: str, reference: Setpoints) -> None:
        """Let a robot track a reference, on the clock of the simulation, from now on. During an
        action its own controller moves it."""
        body = self._bodies[name]
        if body.acts is None:
            body.path, body.reference = [], reference

    def stop(self, name: str) -> None:
        """Cancel a robot's goal or reference: it brakes."""
        body = self._bodies[name]
        if body.path:
            body.end = "canceled"
        self._hold(body)

    def perform(self, name: str, action: str) -> None:
        """Let a robot act on an obstacle that needs this action, in its region or beside it."""
        body = self._bodies[name]
        x, y, yaw = self._at(body)
        here = self._places.region(x, y)
        found = None if here is None else self._reached(here, action)
        body.acts = Handling(action, found, self.now + ACTING)
        if found is None or not found.is_door or action != "push":
            return
        if found.need.action != action:
            body.acts.result = "failed"  # another action is needed first
            return
        region = found.obstacle.region
        cx, cy = self._places.centre(region)
        far = hypot(cx - x, cy - y)
        amid = far <= 0.3 * self._side
        ux, uy = self._ahead(found) if amid else ((cx - x) / far, (cy - y) / far)
        scale = min(1.0, self._side)
        room = 0.5 * self._side - body.kind.radius
        deep = min(room - 0.02 * scale, DEEP * self._side)  # a leaf may push it onwards
        side = room - 0.12 * scale  # a leaf that is wide open is between robot and wall
        spots = [(0.0, 0.0), (deep, 0.0), (deep, side), (deep, -side), (deep, 0.0)]
        path: list[Goal] = [(cx + a * ux - b * uy, cy + a * uy + b * ux, None) for a, b in spots]
        self._begin(body, [*path, (x, y, yaw)])
        body.acts.until = inf

    def bring(self, obstacle: Obstacle) -> None:
        """Add an unlisted obstacle without a body that the team itself has created: an operator's
        order, or a robot with an empty battery."""
        if obstacle.type.blocks == frozenset() and obstacle.name not in self._listed:
            self.standing.setdefault(obstacle.name, LabObstacle(obstacle, obstacle.name))

    def state(self, name: str) -> dict[str, Any]:
        """Return a robot's position, whether it moves, and the end of its goal or action, each
        reported once."""
        body = self._bodies[name]
        x, y, yaw = self._at(body)
        acted = end = None
        if body.acts is None:
            end, body.end = body.end, None
        elif body.acts.result is not None:
            acted, body.acts = body.acts.result, None
        return {
            "now": self.now,
            "x": x,
            "y": y,
            "yaw": yaw,
            "moves": self._moves(name),
            "end": end,
            "acted": acted,
        }

    def scan(self, name: str) -> tuple[float, list[float]]:
        """Return the stamp (seconds) and ranges (metres) of a lidar, counter-clockwise from the
        robot's front."""
        body = self._bodies[name]
        x, y, yaw = self._at(body)
        origin = np.array([x, y, body.kind.height if body.kind.flies else 0.5])
        own = self._model.body(name).id
        hit = np.zeros(1, dtype=np.int32)
        found = []
        for index in range(RAYS):
            angle = yaw + tau * index / RAYS
            ray = np.array([cos(angle), sin(angle), 0.0])
            far = mujoco.mj_ray(self._model, self._data, origin, ray, None, 1, own, hit)
            found.append(float(far) if 0 <= far <= FAR else inf)
        return self.now, found

    def noticed(self, name: str, *, bodies: bool = False) -> dict[Region, str | None]:
        """Return the adjacent regions with the name of what the robot sees there: an uncertain
        region or, with ``bodies``, any obstacle."""
        here = self._places.region(*self._at(self._bodies[name])[:2])
        near = () if here is None else self._places.world.neighbours(here)
        found: dict[Region, str | None] = dict.fromkeys(near)
        for one in self.standing.values():
            closed = one.touches and not self.is_open(one)
            seen = one.obstacle.type.has_truth or (closed and bodies)
            if seen and one.obstacle.region in found:
                found[one.obstacle.region] = one.obstacle.name
        return found

    def step(self, seconds: float) -> None:
        """Advance the simulation by a time, to the nearest step."""
        for _ in range(max(1, round(seconds / STEP))):
            self._step()

    # Steps

    def _step(self) -> None:
        self._change(self.now)
        self._force[:] = 0.0
        thinks = round(self.now / STEP) % round(PERIOD / STEP) == 0
        for body in self._bodies.values():
            (self._fly if body.kind.flies else self._track)(body, thinks)
        mujoco.mj_step(self._model, self._data)
        for body in self._bodies.values():
            self._judge(body)

    def _begin(self, body: SimulatedBody, path: list[Goal]) -> None:
        """Begin a sequence of goals: each is a reference, straight to it, from rest to rest, at the
        robot's speed on average."""
        x, y, yaw = self._at(body)
        gx, gy, to = path[0]
        goal = (gx, gy, yaw if to is None else yaw + turned(to - yaw))
        kind, far = body.kind, hypot(gx - x, gy - y)
        pull = (kind.tilt if kind.flies else FORCE) / 2
        turns = abs(goal[2] - yaw) / kind.turning
        lasts = max(far / kind.speed, (10 / 3**0.5 * far / pull) ** 0.5, turns)
        body.reference = straight(self.now, (x, y, yaw), goal, lasts)
        body.path, body.end, body.best, body.since = path, None, inf, self.now

    def _hold(self, body: SimulatedBody) -> None:
        """Let a robot rest where it is."""
        at = self._at(body)
        body.path, body.reference = [], straight(self.now, at, at)

    def _judge(self, body: SimulatedBody) -> None:
        """End a goal that is reached, or that makes no progress; end an action."""
        act = body.acts
        if body.path:
            x, y, yaw = self._at(body)
            gx, gy, to = body.path[0]
            far, off = hypot(gx - x, gy - y), 0.0 if to is None else abs(turned(to - yaw))
            near = self.now >= body.reference.end and far < NEAR and off < ALIGNED
            if near and hypot(*map(self._velocity, body.dofs[:2])) < SLOW:
                self._next(body, "succeeded")
            elif far + off < body.best - PROGRESS:
                body.best, body.since = far + off, self.now
            elif self.now - body.since > STUCK:
                self._next(body, "aborted")
        elif act is not None and act.result is None and act.until == inf:
            assert act.obstacle is not None
            opened = not self._stands(act.obstacle) or self.is_open(act.obstacle)
            act.result = "done" if opened and body.end == "succeeded" else "failed"
            body.end = None
        elif act is not None and act.result is None and self.now >= act.until:
            self._worked(body.kind.name, act)

    def _next(self, body: SimulatedBody, end: str) -> None:
        """Begin the next goal, or end the sequence of goals; after a failed action the robot also
        returns."""
        left = body.path[1:] if end == "succeeded" or body.acts is not None else []
        if left:
            self._begin(body, left)
        else:
            body.path, body.end = [], end
            if end == "aborted":
                self._hold(body)
        if end == "aborted":  # the estimator of a flyer has taken the obstacle for wind
            body.trackers = _trackers(body.kind, self._at(body))

    # Obstacles

    def _stands(self, one: LabObstacle) -> bool:
        return self.standing.get(one.obstacle.name) is one

    def _change(self, now: float) -> None:
        """Let obstacles appear and disappear at their times. None appears in a region in which a
        robot is, or to which it is in transit."""
        for one in [*self.standing.values()]:
            if one.obstacle.goes is not None and one.obstacle.goes <= now:
                self._remove(one)
        for one in [o for o in self._later if (o.obstacle.appears or 0) <= now]:
            gone = one.obstacle.goes is not None and one.obstacle.goes <= now
            if not gone and one.touches and self._busy(one.obstacle.region):
                continue
            self._later.remove(one)
            if gone:
                continue
            for other in [*self.standing.values()]:  # an open door, which the new one replaces
                if other.touches and one.touches and other.obstacle.region == one.obstacle.region:
                    self._remove(other)
            self.standing[one.obstacle.name] = one
            one.show(self._model, there=True)

    def _remove(self, one: LabObstacle) -> None:
        del self.standing[one.obstacle.name]
        one.show(self._model, there=False)

    def _busy(self, region: Region) -> bool:
        """Return whether a robot overlaps a region or is in transit to it."""
        return any(
            self._places.outside(region, x, y) <= body.kind.radius
            for body in self._bodies.values()
            for x, y in (
                self._at(body)[:2],
                body.reference.rows[-1, :2].tolist(),
                *(goal[:2] for goal in body.path),
            )
        )

    def _reached(self, here: Region, action: str) -> LabObstacle | None:
        """Return the obstacle on which a robot acts: one whose next need is fulfilled there, or one
        in its region or an adjacent one that needs the action."""
        world, beside = self._places.world, None
        near = {here, *world.neighbours(here)}
        for one in self.standing.values():
            if not any(need.action == action for need in one.obstacle.needs):
                continue
            due = one.need.action == action
            if due and here in one.obstacle.resolution_regions(world, one.stage):
                return one
            elsewhere = due and isinstance(one.need.at, frozenset)
            if beside is None and one.obstacle.region in near and not elsewhere:
                beside = one
        return beside

    def _worked(self, name: str, act: Handling) -> None:
        """End the work of a robot: it fulfils a need if enough robots have worked; otherwise it
        fails after a wait."""
        one = act.obstacle
        if one is None or not self._stands(one):
            act.result = "nothing"
            return
        need = one.need
        if need.action != act.action:
            act.result = "failed"
            return
        team = [act]
        if need.together:
            acts = [body.acts for body in self._bodies.values() if body.acts is not None]
            same = (a for a in acts if a.obstacle is one and a.action == act.action)
            team = [a for a in same if a.result is None and self.now >= a.until]
        one.parts.add(name)
        done = len(team) if need.together else len(one.parts)
        if done < need.robots:
            late = need.together and self.now < act.until + WAITING
            act.result = None if late else "failed" if need.together else "done"
            return
        passable = not one.obstacle.type.has_truth or one.obstacle.traversable
        for each in team:
            each.result = "done" if passable else "untraversable"
        one.stage, one.parts = one.stage + 1, set()
        if one.stage >= len(one.obstacle.needs):
            self._remove(one)

    def _ahead(self, door: LabObstacle) -> tuple[float, float]:
        """Return the direction through a door for a robot within it: the one in which its leaves
        already lean."""
        first, second = (float(self._data.qpos[leaf]) for leaf in door.leaves)
        along = passage(self._places, door.obstacle.region)
        side = 1.0 if first >= second else -1.0
        return side * cos(along), side * sin(along)

    def is_open(self, one: LabObstacle) -> bool:
        """Return whether an obstacle is a door with both leaves wide open."""
        angles = [abs(float(self._data.qpos[leaf])) for leaf in one.leaves]
        return one.is_door and min(angles) >= OPEN


def straight(
    begin: float, start: Sequence[float], goal: Sequence[float], seconds: float = 0.0
) -> Setpoints:
    """Return the reference of a straight way between x, y and yaw: quintics from rest to rest."""
    count = int(seconds / TABLE) + 1
    times: Array = TABLE * np.arange(count, dtype=np.float64)
    path = quintic(max(count - 1, 1) * TABLE, 0.0, 0.0, 1.0, 0.0)
    place, speed, pull = (values(derivative(path, order), times) for order in range(3))
    rows = np.zeros((count, 10))
    for column, axis in ((0, 0), (1, 1), (9, 2)):
        rows[:, column] = start[axis] + place * (goal[axis] - start[axis])
    for axis in (0, 1):
        rows[:, axis + 3] = speed * (goal[axis] - start[axis])
        rows[:, axis + 6] = pull * (goal[axis] - start[axis])
    return Setpoints(begin, TABLE, rows)


def _trackers(kind: Dimensions, at: Sequence[float]) -> tuple[AxisTracker, ...]:
    """Return the trackers of a flyer's two axes, at rest at a place."""
    return tuple(AxisTracker(at[axis], kind.tilt) for axis in (0, 1) if kind.flies)
