"""Robots, walls, doors and boxes in MuJoCo: a lab without real robots, for rehearsals and tests.

A robot on the ground is a capsule that slides and turns under limited forces; a quadcopter is a
point mass whose accelerations the 20 Hz quadratic programme of ``safenav.motion.flyer`` commands
(paper, Section VII). A door is two leaves on hinges with damping, which opens wide only if a robot
pushes it by contact; an uncertain region has no body, and is noticed from adjacent regions; any
other obstacle is a box that its action removes. Metres, radians, seconds of simulated time. Several
threads may call it; only ``step`` moves bodies.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from math import cos, hypot, inf, sin, tau
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np

from safenav.fleet.lab.model import (
    STEP,
    Handling,
    LabObstacle,
    SimulatedBody,
    Standing,
    body_of,
    lab_obstacles,
    model_text,
    passage,
)
from safenav.fleet.setpoints import Setpoints
from safenav.fleet.transport import Places, turned
from safenav.motion.flyer import DRAG, HORIZON, LAG, PERIOD, AxisTracker
from safenav.motion.geometry import derivative, quintic, values
from safenav.scenario.model import Obstacle, Robot
from safenav.world.map import Region

FORCE = 2.5
"""Highest acceleration of a robot on the ground, m/s^2."""
AHEAD = PERIOD * np.arange(1, HORIZON + 1)
"""Times of the steps of the horizon, in seconds."""
STIFF = 6.0
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
        self.lock = threading.RLock()
        self._places = places
        self._side = min(places.frame.resolution)
        self._bodies = {robot.name: body_of(robot) for robot in robots}
        starts = {robot.name: robot.start for robot in robots}
        known = lab_obstacles(obstacles, robots)
        self._model: Any = mujoco.MjModel.from_xml_string(
            model_text(places, known, self._bodies.values())
        )
        self._obstacles = Standing(self._model, known)
        self._data: Any = mujoco.MjData(self._model)
        # Views that stay valid: reading from them takes a tenth of the time of a lookup.
        self._coordinate, self._velocity = self._data.qpos.item, self._data.qvel.item
        self._force = self._data.qfrc_applied
        self._leaves: dict[str, list[int]] = {}
        self._parts: dict[str, set[str]] = {}
        for name, body in self._bodies.items():
            axes = "xyza" if body.flies else "xya"
            joints = [self._model.joint(f"{name}.{axis}") for axis in axes]
            body.dofs = tuple(int(joint.dofadr[0]) for joint in joints)
            middle = (*places.centre(starts[name].region), places.yaw(starts[name]) or 0.0)
            x, y, yaw = begin.get(name, middle)
            for dof, value in zip((*body.dofs[:2], body.dofs[-1]), (x, y, yaw), strict=True):
                self._data.qpos[dof] = value
            body.stay = (x, y)
            body.begun = (*body.stay, -inf)
            if body.flies:
                self._data.qpos[body.dofs[2]] = body.height
                body.trackers = (AxisTracker(x, body.tilt), AxisTracker(y, body.tilt))
        for one in known:
            if one.is_door:
                self._leaves[one.key] = [
                    int(self._model.joint(f"{one.key}.{i}").qposadr[0]) for i in (0, 1)
                ]
        mujoco.mj_forward(self._model, self._data)

    @property
    def now(self) -> float:
        return float(self._data.time)

    def _moves(self, name: str) -> bool:
        body = self._bodies[name]
        return bool(body.path) or (body.reference is not None and self.now < body.reference.end)

    def _drive(self, body: SimulatedBody, _: bool) -> None:
        """Drive towards the goal with limited speed and force; without a goal, track the reference,
        else hold the position."""
        x, y, yaw = self._at(body)
        vx, vy, turn = map(self._velocity, body.dofs)
        if body.reference is not None and not body.path:
            self._track(body, body.reference, (x, y, vx, vy), yaw, turn)
            return
        gx, gy, to = body.path[0] if body.path else (*body.stay, None)
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
            self._force[dof] = weight * pull

    def _track(
        self,
        body: SimulatedBody,
        reference: Setpoints,
        state: tuple[float, float, float, float],
        yaw: float,
        turn: float,
    ) -> None:
        """Track the reference: its acceleration, and limited corrections."""
        row = reference.at(self.now)
        off = STIFF**2 * (row[:2] - state[:2]) + 2 * STIFF * (row[3:5] - state[2:])
        pull = np.clip(row[6:8] + off, -FORCE, FORCE).tolist()
        for dof, share in zip(body.dofs[:2], pull, strict=True):
            self._force[dof] = body.mass * share
        spin = 36.0 * turned(float(row[9]) - yaw) - 12.0 * turn
        inertia = body.mass * body.radius**2 / 2
        self._force[body.dofs[2]] = inertia * max(-20.0, min(20.0, spin))

    def _fly(self, body: SimulatedBody, thinks: bool) -> None:
        """Fly by the quadratic programme at 20 Hz in x and y; hold altitude and yaw."""
        x, y, yaw = self._at(body)
        follows = None if body.path else body.reference
        to = body.path[0][2] if body.path else None
        if follows is not None:
            to = float(follows.at(self.now)[9])
        if thinks:
            goal = body.path[0][:2] if body.path else body.stay
            ahead = None if follows is None else follows.ahead(self.now + PERIOD).rows
            pulls = []
            for i, tracker in enumerate(body.trackers):
                tracker.observe((x, y)[i])
                if follows is None or ahead is None:
                    wanted, ends = self._reference(body, i, goal[i]), (body.begun[i], goal[i])
                else:
                    wanted = ahead[:, [i, i + 3, i + 6]]
                    ends = float(follows.rows[0, i]), float(follows.rows[-1, i])
                low = min(ends) - self._side / 2 + body.radius
                high = max(ends) + self._side / 2 - body.radius
                pulls.append(tracker.command(wanted, np.full(HORIZON, low), np.full(HORIZON, high)))
            body.pull = (pulls[0], pulls[1])
        for i in (0, 1):
            speed = self._velocity(body.dofs[i])
            body.thrust[i] += (body.pull[i] - body.thrust[i]) * STEP / LAG
            self._force[body.dofs[i]] = body.mass * (body.thrust[i] - DRAG * speed)
        z, up = self._coordinate(body.dofs[2]), self._velocity(body.dofs[2])
        self._force[body.dofs[2]] = body.mass * (9 * (body.height - z) - 5 * up)
        turn = self._velocity(body.dofs[3])
        off = turned(to - yaw) if to is not None else 0.0
        self._force[body.dofs[3]] = 0.02 * (4 * off - 4 * turn)

    def _reference(self, body: SimulatedBody, axis: int, goal: float) -> Any:
        """Return position, velocity and acceleration after each step of the horizon: a quintic,
        rest to rest, from where the goal was given."""
        start, began = body.begun[axis], body.begun[2]
        across = body.path[0][:2] if body.path else body.begun[:2]
        other = across[1 - axis] - body.begun[1 - axis]
        far = hypot(goal - start, other)
        lasts = max(1.875 * far / body.speed, (10 / 3**0.5 * far / (body.tilt / 2)) ** 0.5, PERIOD)
        times = np.minimum(np.maximum(self.now - began + AHEAD, 0.0), lasts)
        path = quintic(lasts, start, 0.0, goal, 0.0)
        speed = derivative(path)
        return np.array([values(each, times) for each in (path, speed, derivative(speed))]).T

    def _at(self, body: SimulatedBody) -> tuple[float, float, float]:
        """Return x, y and yaw; joint positions are relative to the origin of the world."""
        dofs, at = body.dofs, self._coordinate
        return at(dofs[0]), at(dofs[1]), at(dofs[-1])

    # Commands

    def send(self, name: str, x: float, y: float, yaw: float | None) -> None:
        """Replace the goal of a robot (metres, radians; None: any yaw)."""
        with self.lock:
            self._begin(self._bodies[name], [(x, y, yaw)])

    def follow(self, name: str, reference: Setpoints) -> None:
        """Let a robot track a reference, on the clock of the simulation, from now on."""
        with self.lock:
            self._bodies[name].reference = reference

    def stop(self, name: str) -> None:
        """Cancel a robot's goal or reference: it brakes."""
        with self.lock:
            body = self._bodies[name]
            if body.reference is not None:
                body.reference, body.stay = None, self._at(body)[:2]
            if body.path:
                body.stay = self._at(body)[:2]
                body.begun = (*body.stay, self.now)
                body.path, body.end = [], "canceled"

    def perform(self, name: str, action: str) -> None:
        """Let a robot act on an obstacle that needs this action, in its region or beside it."""
        with self.lock:
            body = self._bodies[name]
            x, y, yaw = self._at(body)
            here = self._places.region(x, y)
            found = None if here is None else self._reached(here, action)
            body.acts = Handling(action, found, self.now + ACTING)
            stands = None if found is None else self._obstacles.stands(found)
            if found is not None and stands is not None and stands.is_door and action == "push":
                if self._obstacles.need(found).action != action:
                    body.acts.result = "failed"  # another action is needed first
                    return
                cx, cy = self._places.centre(found.region)
                far = hypot(cx - x, cy - y)
                amid = far <= 0.3 * self._side
                ux, uy = self._ahead(stands) if amid else ((cx - x) / far, (cy - y) / far)
                scale = min(1.0, self._side)
                room = 0.5 * self._side - body.radius
                deep = min(room - 0.02 * scale, DEEP * self._side)  # a leaf may push it onwards
                side = room - 0.12 * scale  # a leaf that is wide open is between robot and wall
                spots = [(0.0, 0.0), (deep, 0.0), (deep, side), (deep, -side), (deep, 0.0)]
                path = [(cx + a * ux - b * uy, cy + a * uy + b * ux, None) for a, b in spots]
                home = (x, y)
                if here is not None and body.reference is None:
                    home = self._places.centre(here)
                self._begin(body, [*path, (*home, yaw)])
                body.acts.until = inf

    def bring(self, obstacle: Obstacle) -> None:
        """Add an obstacle that the team has created, if it has no body."""
        with self.lock:
            if obstacle.type.blocks == frozenset():
                self._obstacles.bring(obstacle)

    def state(self, name: str) -> dict[str, Any]:
        """Return a robot's position, and the end of its goal or action, each reported once."""
        with self.lock:
            body = self._bodies[name]
            x, y, yaw = self._at(body)
            acted = None
            if body.acts is not None and body.acts.result is not None:
                acted, body.acts = body.acts.result, None
            end, body.end = (None, body.end) if body.acts is not None else (body.end, None)
            return {
                "now": self.now,
                "x": x,
                "y": y,
                "yaw": yaw,
                "goal": self._moves(name) or None,
                "end": end,
                "acted": acted,
            }

    def scan(self, name: str) -> tuple[float, list[float]]:
        """Return the stamp (seconds) and ranges (metres) of a lidar, counter-clockwise from the
        robot's front."""
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

    def noticed(self, name: str, *, bodies: bool = False) -> dict[Region, str | None]:
        """Return the adjacent regions with the name of what the robot sees there: an uncertain
        region or, with ``bodies``, any obstacle."""
        with self.lock:
            here = self._places.region(*self._at(self._bodies[name])[:2])
            near = () if here is None else self._places.world.neighbours(here)
            found: dict[Region, str | None] = dict.fromkeys(near)
            for one in self._obstacles.now.values():
                closed = one.touches and not (one.is_door and self._is_open(one))
                seen = one.obstacle.type.has_truth or (closed and bodies)
                if seen and one.obstacle.region in found:
                    found[one.obstacle.region] = one.obstacle.name
            return found

    def step(self, seconds: float) -> None:
        """Advance the simulation by a time, to the nearest step."""
        with self.lock:
            for _ in range(max(1, round(seconds / STEP))):
                self._step()

    # Steps

    def _begin(self, body: SimulatedBody, path: list[tuple[float, float, float | None]]) -> None:
        body.path, body.end = path, None
        body.begun = (*self._at(body)[:2], self.now)
        body.best, body.since = inf, self.now

    def _reached(self, here: Region, action: str) -> Obstacle | None:
        """Return the obstacle on which a robot acts: one whose next need is fulfilled there, or one
        in its region or an adjacent one that needs the action."""
        near = {here, *self._places.world.neighbours(here)}
        able = [o for o in self._obstacles if any(need.action == action for need in o.needs)]
        beside = None
        for one in able:
            need, stage = self._obstacles.need(one), self._obstacles.stage(one)
            if need.action == action and here in one.resolution_regions(self._places.world, stage):
                return one
            elsewhere = need.action == action and isinstance(need.at, frozenset)
            if beside is None and one.region in near and not elsewhere:
                beside = one
        return beside

    def _busy(self, region: Region) -> bool:
        """Return whether a robot overlaps a region or is in transit to it."""
        for body in self._bodies.values():
            ends = [self._at(body)[:2], *((x, y) for x, y, _ in body.path)]
            if body.reference is not None:
                ends.append((float(body.reference.rows[-1, 0]), float(body.reference.rows[-1, 1])))
            if any(self._places.outside(region, x, y) <= body.radius for x, y in ends):
                return True
        return False

    def _step(self) -> None:
        self._obstacles.passes(self.now, self._busy)
        self._force[:] = 0.0
        thinks = round(self.now / STEP) % round(PERIOD / STEP) == 0
        for body in self._bodies.values():
            (self._fly if body.flies else self._drive)(body, thinks)
        mujoco.mj_step(self._model, self._data)
        for body in self._bodies.values():
            self._judge(body)

    def _judge(self, body: SimulatedBody) -> None:
        """End a goal that is reached, or that makes no progress; end an action."""
        act = body.acts
        if body.path:
            x, y, yaw = self._at(body)
            gx, gy, to = body.path[0]
            far, off = hypot(gx - x, gy - y), 0.0 if to is None else abs(turned(to - yaw))
            near = far < NEAR and off < ALIGNED
            if near and hypot(*map(self._velocity, body.dofs[:2])) < SLOW:
                self._next(body, "succeeded")
            elif far + off < body.best - PROGRESS:
                body.best, body.since = far + off, self.now
            elif self.now - body.since > STUCK:
                self._next(body, "aborted")
        elif act is not None and act.result is None and act.until == inf:
            assert act.obstacle is not None
            stands = self._obstacles.stands(act.obstacle)
            opened = stands is None or self._is_open(stands)
            act.result = "done" if opened and body.end == "succeeded" else "failed"
            body.end = None
        elif act is not None and act.result is None and self.now >= act.until:
            self._worked(body.name, act)

    def _worked(self, name: str, act: Handling) -> None:
        """End the work of a robot: it fulfils a need if enough robots have worked; otherwise it
        fails after a wait."""
        obstacle = act.obstacle
        if obstacle is None or self._obstacles.stands(obstacle) is None:
            act.result = "nothing"
            return
        need = self._obstacles.need(obstacle)
        if need.action != act.action:
            act.result = "failed"
            return
        team = [a for a in self._at_work(obstacle, act.action) if self.now >= a.until]
        if not need.together:
            self._parts.setdefault(obstacle.name, set()).add(name)
            team = [act]
        done = len(team) if need.together else len(self._parts[obstacle.name])
        if done < need.robots:
            late = need.together and self.now < act.until + WAITING
            act.result = None if late else "failed" if need.together else "done"
            return
        passable = not obstacle.type.has_truth or obstacle.traversable
        for one in team:
            one.result = "done" if passable else "untraversable"
        self._obstacles.stages[obstacle.name] = stage = self._obstacles.stage(obstacle) + 1
        self._parts.pop(obstacle.name, None)
        if stage >= len(obstacle.needs):
            self._obstacles.remove(obstacle)

    def _at_work(self, obstacle: Obstacle, action: str) -> list[Handling]:
        """Return the actions of this kind under way on an obstacle."""
        acts = [body.acts for body in self._bodies.values() if body.acts is not None]
        return [a for a in acts if (a.obstacle, a.action, a.result) == (obstacle, action, None)]

    def _next(self, body: SimulatedBody, end: str) -> None:
        """Begin the next goal, or end the sequence of goals; after a failed action the robot also
        returns."""
        left = body.path[1:] if end == "succeeded" or body.acts is not None else []
        if left:
            self._begin(body, left)
        else:
            body.stay = body.path[0][:2] if end == "succeeded" else self._at(body)[:2]
            body.path, body.end = [], end
        if end == "aborted" and body.flies:  # its estimator has taken the obstacle for wind
            x, y, _ = self._at(body)
            body.trackers = (AxisTracker(x, body.tilt), AxisTracker(y, body.tilt))

    def _ahead(self, door: LabObstacle) -> tuple[float, float]:
        """Return the direction through a door for a robot within it: the one in which its leaves
        already lean."""
        first, second = (float(self._data.qpos[joint]) for joint in self._leaves[door.key])
        along = passage(self._places, door.obstacle.region)
        side = 1.0 if first >= second else -1.0
        return side * cos(along), side * sin(along)

    def _is_open(self, door: LabObstacle) -> bool:
        return all(abs(float(self._data.qpos[joint])) >= OPEN for joint in self._leaves[door.key])
