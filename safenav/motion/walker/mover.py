"""A walker as a mover: it joins primitives, each at the absolute pose of a region."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.motion.file import Foothold, FootState, Moving, Piece, PressurePhase, Segment, Swing
from safenav.motion.geometry import MetricFloor, between, derivative, turn, unit_vector, values
from safenav.motion.mover import Crossing, Mover, Start
from safenav.motion.walker import primitives
from safenav.motion.walker.primitives import LEFT, Array, Primitive, advanced
from safenav.pace.gait import Walker, gait_on
from safenav.pace.robot import WALKER, YAW

BUILD = {
    "step": 0.65,
    "aside": 0.2,
    "friction": 0.45,
    "swing": 3.0,
    "stance": 0.45,
    "sole_length": 0.2,
    "sole_width": 0.09,
    "least_double": 0.15,
    "most_double": 0.25,
}
"""The limits of a walker in the header of a motion (docs/models.md): the longest step (m), the
least distance by which a foot lands on its own side of the other (m), the friction needed (of the
ground's normal force), the fastest swing (m/s), the farthest that the mass gets from a foot that
carries it (m, on the ground); the size of a sole (m); bounds of the share of walking in which both
feet are on the ground."""


class WalkerMover(Mover):
    """A walker that stands, or is at a walking pose with ``foot`` on the ground, 0 if it stands."""

    def __init__(self, start: Start) -> None:
        super().__init__(start)
        self.heading = start.heading or "east"
        self.foot = 0
        walker = Walker(*(self.values[name] for name in WALKER))
        try:
            self.gait = gait_on(self.floor.side, walker)
        except UsageError as error:
            raise UsageError(f"{self.robot}: {error}") from error

    def limits(self) -> Mapping[str, float]:
        return {**self.values, "omega": self.gait.omega, **BUILD}

    @property
    def _facing(self) -> str:
        assert self.heading is not None, "a walker has one"
        return self.heading

    def move(self, crossing: Crossing) -> list[Moving]:
        quarters = turn(self._facing, crossing.heading)
        if self.foot:
            primitive = primitives.walk(self.gait, quarters, self.foot)
        else:
            primitive = primitives.start(self.gait, quarters, LEFT)
        return [self._carried_out(primitive, crossing.tick, crossing.to, crossing.heading)]

    def halt(self, tick: int) -> list[Moving]:
        if not self.foot:
            return []
        stop = primitives.stop(self.gait, self.foot)
        return [self._carried_out(stop, tick, self.region, self._facing)]

    def rest(self, tick: int, until: float) -> list[Moving]:
        assert not self.foot, "a walker in mid-step cannot rest"
        stand = primitives.stand(self.gait, until - self.time)
        return [self._carried_out(stand, tick, self.region, self._facing, until)]

    def _carried_out(
        self, primitive: Primitive, tick: int, to: int, heading: str, until: float | None = None
    ) -> Segment:
        end = self.time + primitive.seconds if until is None else until
        place = Placing(self.floor, self.region, self._facing)
        who = Piece(self.robot, tick, primitive.name, self.region, to, self.time, end)
        segment = place.segment(who, primitive)
        self.region, self.heading, self.foot, self.time = to, heading, primitive.foot, end
        return segment


class Placing:
    """Transform of a primitive from its local frame to the middle of the side by which a heading
    enters a region."""

    def __init__(self, floor: MetricFloor, region: int, heading: str) -> None:
        self._cos, self._sin = unit_vector(heading)
        x, y = floor.centre(region)
        half = floor.side / 2
        self._x, self._y = x - self._cos * half, y - self._sin * half
        self._yaw = YAW[heading]

    def segment(self, who: Piece, primitive: Primitive) -> Segment:
        """The primitive in the frame of the map."""
        begin, end = primitive.turning
        return Segment(
            who.robot,
            who.tick,
            who.primitive,
            who.origin,
            who.to,
            who.t0,
            who.t1,
            phases=tuple(
                PressurePhase(
                    phase.seconds,
                    *self._point(phase.x, phase.y),
                    *self._point(phase.to_x, phase.to_y),
                )
                for phase in primitive.phases
            ),
            feet=tuple(self._foot(hold) for hold in primitive.footholds),
            swings=tuple(self._swing(swing) for swing in primitive.swings),
            turning=(self._yaw, self._yaw + primitive.turn * pi / 2, begin, end),
            start=self._state(primitive.start),
            goal=self._state(primitive.goal),
        )

    def _point(self, x: float, y: float) -> tuple[float, float]:
        return self._x + self._cos * x - self._sin * y, self._y + self._sin * x + self._cos * y

    def _turned(self, x: float, y: float) -> tuple[float, float]:
        return self._cos * x - self._sin * y, self._sin * x + self._cos * y

    def _state(self, state: Array) -> tuple[float, float, float, float]:
        x, y, vx, vy = state.tolist()
        return (*self._point(x, y), *self._turned(vx, vy))

    def _foot(self, hold: Foothold) -> Foothold:
        x, y = self._point(hold.x, hold.y)
        return Foothold(x, y, hold.yaw + self._yaw, hold.side, hold.down, hold.up)

    def _swing(self, swing: Swing) -> Swing:
        start, goal = self._passed(swing.start), self._passed(swing.goal)
        return Swing(swing.side, swing.t0, swing.t1, swing.u0, swing.u1, start, goal)

    def _passed(self, state: FootState) -> FootState:
        x, y, yaw, vx, vy, turning, ax, ay, bending = state
        speed, pull = (*self._turned(vx, vy), turning), (*self._turned(ax, ay), bending)
        return (*self._point(x, y), yaw + self._yaw, *speed, *pull)


def cut_off(segment: Segment, at: float, omega: float) -> Segment:
    """Return a segment until an instant within it (seconds since its start)."""
    state = np.array(segment.start)
    phases: list[PressurePhase] = []
    begin = 0.0
    for phase in segment.phases:
        if begin < at:
            lasting = min(begin + phase.seconds, at) - begin
            here, there = np.array([phase.x, phase.y]), np.array([phase.to_x, phase.to_y])
            there = here + (there - here) * lasting / phase.seconds
            x, y = there.tolist()
            phases.append(replace(phase, seconds=lasting, to_x=x, to_y=y))
            state = advanced(state, here, there, lasting, omega)
        begin += phase.seconds
    return replace(
        segment,
        t1=segment.t0 + at,
        phases=tuple(phases),
        feet=tuple(replace(f, up=min(f.up, at)) for f in segment.feet if f.down < at),
        swings=tuple(_cut(swing, at) for swing in segment.swings if swing.t0 < at),
        goal=tuple(state.tolist()),
    )


def _cut(swing: Swing, at: float) -> Swing:
    if swing.t1 <= at:
        return swing
    since = np.array([at - swing.t0])
    paths = between(swing.t1 - swing.t0, swing.start, swing.goal)
    speeds = [derivative(path) for path in paths]
    pulls = [derivative(speed) for speed in speeds]
    state = tuple(float(values(path, since)[0]) for path in (*paths, *speeds, *pulls))
    u = swing.u0 + (swing.u1 - swing.u0) * float(since[0]) / (swing.t1 - swing.t0)
    return replace(swing, t1=at, u1=u, goal=state)
