"""Motion of robots in MuJoCo: control to a goal or along a reference."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from math import hypot, inf
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np

from safenav.fleet.lab.model import STEP, SimulatedBody, body_of, model_text
from safenav.fleet.lab.obstacles import Standing, lab_obstacles
from safenav.fleet.place import Places, turned
from safenav.fleet.setpoints import Setpoints
from safenav.motion.flyer import DRAG, HORIZON, LAG, PERIOD, AxisTracker
from safenav.motion.geometry import derivative, quintic, values
from safenav.scenario.model import Obstacle, Robot

FORCE = 2.5
"""Highest acceleration of a robot on the ground, m/s^2."""
AHEAD = PERIOD * np.arange(1, HORIZON + 1)
"""Times of the steps of the horizon, in seconds."""
STIFF = 6.0
"""Gain (1/s) with which a robot on the ground tracks its reference."""


class Dynamics:
    """Robots and obstacles of a lab as bodies, with a controller for each robot."""

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
        self.contacts: dict[tuple[str, str], int] = {}
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

    def _note_contacts(self) -> None:
        for index in range(self._data.ncon):
            pair = self._data.contact[index].geom
            names = sorted(self._named(int(geom)) for geom in pair)
            if any(name in self._bodies for name in names):
                key = (names[0], names[1])
                self.contacts[key] = self.contacts.get(key, 0) + 1

    def _named(self, geom: int) -> str:
        name = str(self._model.geom(geom).name)
        return name.split(".")[0].split("~")[0]
