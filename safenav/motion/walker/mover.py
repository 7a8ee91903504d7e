"""A walker as a mover: it strings primitives together, each at the absolute pose of a region."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import pi

import numpy as np

from safenav.errors import UsageError
from safenav.motion.file.records import Foothold, Moving, Phase, Piece, Segment, Swing
from safenav.motion.geometry import Floor, rotation, turn, yaw
from safenav.motion.mover import Errand, Mover, Values
from safenav.motion.pendulum import Array
from safenav.motion.walker import primitives
from safenav.motion.walker.gait import Walker, gait_on
from safenav.motion.walker.primitives import LEFT, Primitive

LIMITS = {"step": 0.65, "aside": 0.2, "friction": 0.45, "swing": 3.0}
"""Longest step (m), least lateral distance of the feet (m), most friction needed, and fastest
swing foot (m/s)."""


class WalkerMover(Mover):
    """A walker that stands, or is at a walking pose with ``foot`` on the ground."""

    def __init__(
        self,
        robot: str,
        floor: Floor,
        region: int,
        heading: str | None,
        size: float,
        values: Values,
    ) -> None:
        super().__init__(robot, floor, region, heading or "east", size, values)
        names = ("speed", "height", "foot", "clearance")
        walker = Walker(size, *(values[name] for name in names))
        try:
            self.gait = gait_on(floor.side, walker)
            for primitive in (primitives.walk, primitives.start):
                for way in (0, 1, -1):
                    primitive(self.gait, way, LEFT)
        except UsageError as error:
            raise UsageError(f"{robot}: {error}") from error
        except ValueError as error:
            raise UsageError(
                f"{robot}: a walker {walker.height:g} m high at {walker.speed:g} m/s cannot make "
                f"the turns of regions of {floor.side:g} m\n"
                "    change 'speed' or 'height' of its model"
            ) from error
        self.foot = 0

    @property
    def rolling(self) -> bool:
        return self.foot != 0

    def limits(self) -> Mapping[str, float]:
        walker = self.gait.walker
        own = {"size": self.size, "omega": self.gait.omega, "height": walker.height}
        return {**own, "foot": walker.foot, "clearance": walker.clearance, **LIMITS}

    def move(self, errand: Errand) -> list[Moving]:
        assert self.heading is not None
        way = turn(self.heading, errand.heading)
        if self.foot:
            primitive = primitives.walk(self.gait, way, self.foot)
        else:
            then = turn(errand.heading, errand.then) if errand.then else 0
            primitive = primitives.start(self.gait, way, then or LEFT)
        return [self._carried_out(primitive, errand.tick, errand.to, errand.heading)]

    def halt(self, tick: int) -> list[Moving]:
        if not self.foot:
            return []
        stop = primitives.stop(self.gait, self.foot)
        assert self.heading is not None
        return [self._carried_out(stop, tick, self.region, self.heading)]

    def rest(self, tick: int, until: float) -> list[Moving]:
        assert not self.foot, "a walker in mid-step cannot rest"
        assert self.heading is not None
        stand = primitives.stand(self.gait, until - self.time)
        return [self._carried_out(stand, tick, self.region, self.heading, until)]

    def _carried_out(
        self, primitive: Primitive, tick: int, to: int, heading: str, until: float | None = None
    ) -> Segment:
        assert self.heading is not None
        end = self.time + primitive.seconds if until is None else until
        place = Placing(self.floor, self.region, self.heading)
        who = Piece(self.robot, tick, primitive.name, self.region, to, self.time, end)
        segment = place.segment(who, primitive)
        self.region, self.heading, self.foot, self.time = to, heading, primitive.foot, end
        return segment


class Placing:
    """Moves a primitive from its local frame to where it begins: the middle of the side by which
    a heading enters a region."""

    def __init__(self, floor: Floor, region: int, heading: str) -> None:
        self._rotation = rotation(heading)
        x, y = floor.centre(region)
        self._origin = np.array([x, y]) - self._rotation[:, 0] * (floor.side / 2)
        self._yaw = yaw(heading)

    def segment(self, who: Piece, primitive: Primitive) -> Segment:
        """The primitive in the frame of the map."""
        points = self._points(primitive.pressures)
        phases = zip(primitive.durations.tolist(), points.tolist(), strict=True)
        begin, end = primitive.turning
        return Segment(
            who.robot,
            who.tick,
            who.primitive,
            who.origin,
            who.to,
            who.t0,
            who.t1,
            phases=tuple(Phase(seconds, x, y) for seconds, (x, y) in phases),
            feet=tuple(self._foot(hold) for hold in primitive.footholds),
            swings=tuple(self._swing(swing) for swing in primitive.swings),
            turning=(self._yaw, self._yaw + primitive.turn * pi / 2, begin, end),
            start=self._state(primitive.start),
            goal=self._state(primitive.goal),
        )

    def _points(self, points: Array) -> Array:
        placed: Array = points @ self._rotation.T + self._origin
        return placed

    def _state(self, state: Array) -> tuple[float, float, float, float]:
        x, y = (self._rotation @ state[:2] + self._origin).tolist()
        vx, vy = (self._rotation @ state[2:]).tolist()
        return x, y, vx, vy

    def _foot(self, hold: Foothold) -> Foothold:
        x, y = self._points(np.array([hold.x, hold.y])).tolist()
        return replace(hold, x=x, y=y, yaw=hold.yaw + self._yaw)

    def _swing(self, swing: Swing) -> Swing:
        return replace(swing, start=self._passed(swing.start), goal=self._passed(swing.goal))

    def _passed(self, state: tuple[float, ...]) -> tuple[float, ...]:
        x, y, yaw, vx, vy, turning = state
        there = self._state(np.array([x, y, vx, vy]))
        return (*there[:2], yaw + self._yaw, *there[2:], turning)
