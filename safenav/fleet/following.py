"""Robots that track references: they receive their goals as motions of ``safenav.motion``.

This layer is between the fleet's world and a transport, for robots whose station has ``follow``;
goals of other robots pass through. A goal succeeds when its reference has ended and the robot is
there. It is aborted as soon as odometry deviates from the reference by more than the tolerance; the
plan then continues from the measured position, at rest. A cancelled robot completes its step first.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import hypot
from threading import RLock

from msgspec import Struct

from safenav.fleet import transport
from safenav.fleet.file import Station
from safenav.fleet.setpoints import Setpoints, reference_of
from safenav.motion.file import Moving
from safenav.motion.geometry import MetricFloor
from safenav.motion.making import mover
from safenav.motion.mover import Glider
from safenav.scenario.model import Robot
from safenav.world.map import Region

LEAD = 0.1
"""Seconds between a decision to move and the start of the motion, which the robot receives in
advance."""


class Follower(Struct):
    """A robot that follows references. ``mover``: its plan, on the transport's clock and in the
    frame of the map; ``goal``, ``action``: the numbers of its present goal and action, if any."""

    name: str
    mover: Glider
    tolerance: float
    reference: Setpoints | None = None
    goal: int | None = None
    action: int | None = None
    place: transport.Located | None = None


class Following:
    """A transport that turns followers' goals into references, which another transport streams."""

    def __init__(
        self,
        inner: transport.Streamer,
        robots: Iterable[Robot],
        places: transport.Places,
        stations: Mapping[str, Station],
    ) -> None:
        self._inner, self._places = inner, places
        self.now, self.step = inner.now, inner.step
        self._lock = RLock()
        self._post: Callable[[transport.Message], None] = print  # set by ``open``
        self.followers = {
            robot.name: Follower(robot.name, mover_of(robot, places), station.tolerance)
            for robot in robots
            if (station := stations[robot.name]).follow is not None
        }

    # The transport

    def open(self, post: Callable[[transport.Message], None]) -> None:
        self._post = post
        self._inner.open(self._heard)

    def missing(self) -> list[str]:
        return self._inner.missing()

    def navigate(self, robot: str, goal: transport.GoalPoint) -> None:
        if robot not in self.followers:
            self._inner.navigate(robot, goal)
            return
        with self._lock:
            self._go(self.followers[robot], goal)

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        if robot in self.followers:
            self.followers[robot].action = number
        self._inner.perform(robot, action, obstacle, number)

    def cancel(self, robot: str) -> None:
        if robot not in self.followers:
            self._inner.cancel(robot)

    def close(self) -> None:
        self._inner.close()

    # References

    def left(self, robot: str) -> float:
        """Return the seconds until a robot's reference ends; 0 without a reference."""
        follower = self.followers.get(robot)
        if follower is None or follower.reference is None:
            return 0.0
        return max(0.0, follower.reference.end - self.now())

    def _go(self, follower: Follower, goal: transport.GoalPoint) -> None:
        to = self._places.region(goal.x, goal.y)
        assert to is not None
        refused = self._resynchronized(follower)
        pieces = [] if refused else self._moved(follower, to, short=goal.short)
        if not pieces:
            reason = refused or f"no motion leads from region {follower.mover.region} to {to}"
            self._post(
                transport.GoalEnded(follower.name, goal.number, transport.GoalEnd.ABORTED, reason)
            )
            return
        follower.goal, follower.action = goal.number, None  # only one of them is awaited
        self._send(follower, pieces)

    def _moved(self, follower: Follower, to: Region, *, short: bool) -> list[Moving]:
        """Return a follower's motion to its own or an adjacent region; none for other regions."""
        body = follower.mover
        body.time = max(body.time, self.now() + LEAD)
        if to == body.region:
            return body.resume(0) or body.rest(0, body.time + LEAD)
        if to not in self._places.world.neighbours(body.region):
            return []
        first = body.resume(0) if body.kind == "rover" else []  # a rover first drives to the centre
        return [*first, *body.move(0, to, short=short)]

    def _send(self, follower: Follower, pieces: list[Moving]) -> None:
        frame = self._places.frame
        follower.reference = reference_of(pieces, follower.mover.values, frame)
        self._inner.follow(follower.name, follower.reference)

    def _resynchronized(self, follower: Follower) -> str:
        """Restart the plan at the measured position if a robot at rest is too far from its plan.
        Return the reason why that is impossible, or an empty text."""
        at = follower.place
        assert at is not None
        off = _off(self._places.frame.in_world(*follower.mover.place), at)
        why = f"{off:.2f} m away from its position at rest"
        return "" if off <= follower.tolerance else self._reset(follower, at, why)

    def _reset(self, follower: Follower, at: transport.Located, reason: str) -> str:
        """Restart the plan at the measured position, at rest. Return the reason why that is
        impossible, or an empty text."""
        body, frame = follower.mover, self._places.frame
        region = self._places.region(at.x, at.y)
        if region is None or not self._places.world.is_free(region):
            return f"{reason}, outside every free region"
        body.place, body.facing = frame.on_map(at.x, at.y), at.yaw - frame.yaw
        body.region, body.time = region, self.now()
        return ""

    # Messages

    def _heard(self, message: transport.Message) -> None:
        follower = self.followers.get(message.robot)
        if follower is None:
            self._post(message)
            return
        with self._lock:
            if isinstance(message, transport.Located):
                follower.place = message
            self._post(message)
            if isinstance(message, transport.Performed) and message.number == follower.action:
                follower.action = None
            if isinstance(message, transport.Located):
                self._judge(follower, message)

    def _judge(self, follower: Follower, at: transport.Located) -> None:
        reference, now = follower.reference, self.now()
        if reference is None or follower.action is not None:
            return  # during an action the robot's own controller moves it
        if follower.goal is None:  # at rest it must only stay in its region
            out = self._places.outside(follower.mover.region, at.x, at.y)
            if out > follower.tolerance:
                self._hold(follower, at, f"{out:.2f} m outside the region in which it rests")
            return
        off = _off(reference.at(now).tolist(), at)
        if off > follower.tolerance:
            reason = f"{off:.2f} m off its reference"
            reason = self._hold(follower, at, reason) or reason
            self._end(follower, transport.GoalEnd.ABORTED, reason)
        elif now >= reference.end:
            self._end(follower, transport.GoalEnd.SUCCEEDED)

    def _hold(self, follower: Follower, at: transport.Located, reason: str) -> str:
        """Stop a robot at its measured position. Return the reason why its plan cannot continue
        there, or an empty text."""
        refused = self._reset(follower, at, reason)
        if refused:
            self._inner.cancel(follower.name)
        else:
            body = follower.mover
            self._send(follower, body.rest(0, body.time + LEAD))
        return refused

    def _end(self, follower: Follower, end: transport.GoalEnd, reason: str = "") -> None:
        assert follower.goal is not None
        number, follower.goal = follower.goal, None
        self._post(transport.GoalEnded(follower.name, number, end, reason))


def mover_of(robot: Robot, places: transport.Places) -> Glider:
    """Return the mover of a robot at rest in its start region."""
    figures = robot.model.figures
    assert figures is not None, "`load_fleet` refuses robots that cannot follow references"
    floor = MetricFloor(places.world.rows, places.world.cols, places.frame.resolution)
    found = mover(robot.name, floor, *robot.start.place, figures)
    assert isinstance(found, Glider)
    return found


def _off(there: Sequence[float], at: transport.Located) -> float:
    """Return the distance in metres between a point and a robot's measured position."""
    return hypot(at.x - float(there[0]), at.y - float(there[1]))
