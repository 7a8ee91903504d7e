"""The world of a mission that drives real robots (World, protocol 2), whatever the transport.

A command becomes a goal in metres, and ends by one event that is true: after a failure the robot is
first sent back to the middle of the region where it set out, since one that stands between two
regions occupies both. A robot that cannot be brought back, or has no fresh odometry, is lost in
either of them. Arrivals are reported when the robot's sensors have seen its new surroundings:
a reading from the way there says nothing about what stands before it now.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from enum import Enum, auto
from math import cos, hypot, inf, isfinite, pi, sin

from safenav.dataclass import dataclass
from safenav.errors import ExitCode, SafenavError
from safenav.fleet.fleet_file import Station
from safenav.fleet.place import Places, turned
from safenav.fleet.transport import (
    GoalEnd,
    GoalEnded,
    GoalPoint,
    Located,
    Message,
    Performed,
    Reported,
    Scanned,
    Transport,
)
from safenav.runtime.protocol import (
    Acted,
    Arrived,
    Blocked,
    Elsewhere,
    Failed,
    Lost,
    Sensed,
    WorldEvent,
)
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.frame import Frame
from safenav.world.map import Region
from safenav.world.moves import Mobility, Pose

FRESH = 1.0
"""Seconds for which an arrival waits for a reading that was taken after it."""
STALE = 2.0
"""Seconds without odometry after which nobody knows where a robot is."""
SETTLING = 5.0
"""Seconds that every goal may take beyond its distance: to accept it, to turn, to brake."""
STOPPING = 5.0
"""Seconds in which a cancelled goal has to end."""


class FleetError(SafenavError):
    """A fleet cannot be driven: a transport is missing, or a robot does not answer."""

    exit_code = ExitCode.BAD_INPUT


class Phase(Enum):
    """A phase of a command."""

    GOING = auto()
    STOPPING = auto()
    RETURNING = auto()
    LOOKING = auto()
    ACTING = auto()


@dataclass
class Errand:
    """A command under way. ``left``: times that its goal may be sent again; ``due``: when its
    present phase is to be over, on the world's clock."""

    command: int
    start: Pose
    to: Pose
    left: int
    phase: Phase
    goal: int = 0
    due: float = inf
    reason: str = ""
    since: float = -inf
    results: dict[str, ActResult] = field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()


@dataclass
class DrivenRobot:
    """The state of a robot. ``heard``: when its newest odometry came, on the world's clock;
    ``looked``: the stamp of its newest reading."""

    robot: Robot
    station: Station
    pose: Pose
    place: Located | None = None
    heard: float = -inf
    looked: float = -inf
    errand: Errand | None = None


class FleetWorld:
    """A fleet behind a transport. Open it before the mission; close it whatever happens."""

    def __init__(
        self,
        scenario: Scenario,
        stations: Mapping[str, Station],
        transport: Transport,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        frame = self.check(scenario)
        self._scenario = scenario
        self._places = Places(scenario.map, frame)
        self._transport = transport
        self._clock = clock
        self._begun = clock()
        self._messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._bodies = {
            robot.name: DrivenRobot(robot, stations[robot.name], robot.start)
            for robot in scenario.robots
        }
        self._goals = 0
        self._seen: dict[Region, Obstacle] = {}
        self._resolved_at: dict[Region, dict[str, float]] = {}
        self._events: list[WorldEvent] = []

    @staticmethod
    def check(scenario: Scenario) -> Frame:
        """Where the map lies in metres. Raises FleetError if the scenario does not say."""
        if scenario.map.frame is None:
            said = "the scenario's map has no metres: add 'resolution: 1.0' (metres a region)"
            raise FleetError(f"{said} to 'map', or take the map from map_server with 'ros:'")
        return scenario.map.frame

    # The protocol

    @property
    def idle(self) -> bool:
        return all(body.errand is None for body in self._bodies.values())

    def now(self) -> float:
        return self._clock() - self._begun

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        del robot  # what one robot has seen, all know
        return self._seen.get(region)

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        body = self._bodies[robot.name]
        errand = Errand(command, body.pose, pose, body.station.retries, Phase.GOING)
        body.errand = errand
        self._send(body, errand, pose)
        return None

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> WorldEvent | None:
        body = self._bodies[robot.name]
        errand = Errand(command, body.pose, body.pose, 0, Phase.ACTING, obstacles=tuple(obstacles))
        body.errand = errand
        if not obstacles:
            body.errand = None
            return Acted(self.now(), robot.name, (), command=command)
        self._act_on_next(body, errand)
        return None

    def cancel(self, robot: Robot) -> None:
        body = self._bodies[robot.name]
        if body.errand is not None and body.errand.phase is Phase.GOING:
            self._stop(body, body.errand, "cancelled")

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        end = inf if timeout is None else self.now() + timeout
        while True:
            self._check_times()
            self._take_all()
            if self._events or self.now() >= end:
                found, self._events = self._events, []
                return found
            dues = [body.errand.due for body in self._bodies.values() if body.errand]
            pause = min([end, *dues]) - self.now()
            self._take_next(min(max(pause, 0.0), 0.25))

    # Life

    def open(self, patience: float = 10.0) -> None:
        """Connect, and wait until each robot answers and says where it is, which must be where the
        scenario has it begin. Raises FleetError."""
        self._transport.open(self._messages.put)
        end = self.now() + patience
        while silent := self._silent():
            if self.now() >= end:
                raise FleetError(f"no answer in {patience:g} s from {', '.join(silent)}")
            self._take_next(0.1)
        for body in self._bodies.values():
            assert body.place is not None
            found = self._places.region(body.place.x, body.place.y)
            if found != body.pose.region:
                where = "off the map" if found is None else f"in region {found}"
                said = f"{body.robot.name} is {where} ({body.place.x:.2f}, {body.place.y:.2f} m)"
                raise FleetError(f"{said}; the scenario has it begin in {body.pose.region}")

    def _silent(self) -> list[str]:
        bodies = self._bodies.values()
        quiet = [f"{body.station.namespace}/odom" for body in bodies if body.place is None]
        return quiet or self._transport.missing()

    def close(self) -> None:
        """Cancel every goal, and disconnect."""
        self._transport.close()

    # Messages

    def _take_next(self, pause: float) -> None:
        try:
            self._take(self._messages.get(timeout=pause))
        except queue.Empty:
            return
        self._take_all()

    def _take_all(self) -> None:
        while True:
            try:
                self._take(self._messages.get_nowait())
            except queue.Empty:
                return

    def _take(self, message: Message) -> None:
        body = self._bodies.get(message.robot)
        if body is None:
            return
        match message:
            case Located():
                if body.place is None or message.stamp >= body.place.stamp:
                    body.place, body.heard = message, self.now()
            case Scanned():
                self._scan(body, message)
            case Reported():
                self._report(body, message)
            case GoalEnded():
                self._goal_ended(body, message)
            case Performed():
                self._performed(body, message)

    # Steps

    def _send(self, body: DrivenRobot, errand: Errand, pose: Pose) -> None:
        self._goals += 1
        x, y = self._places.centre(pose.region)
        errand.goal = self._goals
        far = self._metres_to(body, pose.region)
        errand.due = self.now() + SETTLING + body.station.timeout * far / body.station.speed
        goal = GoalPoint(self._goals, x, y, self._places.yaw(pose))
        self._transport.navigate(body.robot.name, goal)

    def _metres_to(self, body: DrivenRobot, region: Region) -> float:
        at = body.place
        x, y = (at.x, at.y) if at is not None else self._places.centre(body.pose.region)
        return self._places.distance(region, x, y)

    def _goal_ended(self, body: DrivenRobot, message: GoalEnded) -> None:
        errand = body.errand
        if errand is None or message.number != errand.goal:
            return  # late: of a goal that was given up
        if errand.phase is Phase.GOING and message.end is GoalEnd.SUCCEEDED:
            self._look(body, errand)
        elif errand.phase is Phase.GOING:
            self._again_or_back(body, errand, message.reason or message.end.value)
        elif errand.phase is Phase.STOPPING:
            self._go_back(body, errand)
        elif errand.phase is Phase.RETURNING and message.end is GoalEnd.SUCCEEDED:
            self._came_back(body, errand)
        elif errand.phase is Phase.RETURNING:
            self._lose(body, errand)

    def _again_or_back(self, body: DrivenRobot, errand: Errand, reason: str) -> None:
        errand.reason = reason
        if errand.left and self._seen.get(errand.to.region) is None:
            errand.left -= 1
            self._send(body, errand, errand.to)
        else:
            self._go_back(body, errand)

    def _stop(self, body: DrivenRobot, errand: Errand, reason: str) -> None:
        errand.reason, errand.phase = reason, Phase.STOPPING
        errand.due = self.now() + STOPPING
        self._transport.cancel(body.robot.name)

    def _go_back(self, body: DrivenRobot, errand: Errand) -> None:
        errand.phase = Phase.RETURNING
        self._send(body, errand, errand.start)

    def _came_back(self, body: DrivenRobot, errand: Errand) -> None:
        pose = self._pose_now(body)
        if pose is None:
            self._lose(body, errand)
            return
        seen = self._seen.get(errand.to.region)
        if pose.region != errand.start.region:
            self._end(
                body, pose, Elsewhere(self.now(), body.robot.name, pose, command=errand.command)
            )
        elif seen is not None:
            blocked = Blocked(self.now(), body.robot.name, pose, seen, command=errand.command)
            self._end(body, pose, blocked)
        else:
            failed = Failed(
                self.now(), body.robot.name, pose, errand.reason, command=errand.command
            )
            self._end(body, pose, failed)

    def _look(self, body: DrivenRobot, errand: Errand) -> None:
        """The robot says that it has arrived: wait until its sensors have looked from there."""
        errand.phase, errand.due = Phase.LOOKING, self.now() + FRESH
        errand.since = body.place.stamp if body.place is not None else -inf
        if body.station.scan is None:
            self._arrive(body, errand)

    def _arrive(self, body: DrivenRobot, errand: Errand) -> None:
        pose = self._pose_now(body)
        if pose is None:
            self._lose(body, errand)
        elif pose == errand.to and self._metres_to(body, pose.region) <= body.station.tolerance:
            self._end(body, pose, Arrived(self.now(), body.robot.name, command=errand.command))
        elif pose.region == errand.to.region and pose != errand.to:
            self._end(
                body, pose, Elsewhere(self.now(), body.robot.name, pose, command=errand.command)
            )
        else:
            off = self._metres_to(body, errand.to.region)
            far = f"it says that it arrived, {off:.2f} m from the middle of {errand.to.region}"
            errand.phase = Phase.GOING
            self._again_or_back(body, errand, far)

    def _lose(self, body: DrivenRobot, errand: Errand) -> None:
        regions = frozenset((errand.start.region, errand.to.region))
        at = self._pose_now(body)
        if at is not None:
            regions |= {at.region}
        event = Lost(self.now(), body.robot.name, regions, command=errand.command)
        self._end(body, body.pose, event)

    def _end(self, body: DrivenRobot, pose: Pose, event: WorldEvent) -> None:
        body.pose, body.errand = pose, None
        self._events.append(event)

    def _pose_now(self, body: DrivenRobot) -> Pose | None:
        """Where the robot is by its newest odometry; None if that is old, or in no free region."""
        at = body.place
        if at is None or self.now() - body.heard > STALE:
            return None
        region = self._places.region(at.x, at.y)
        if region is None or not self._scenario.map.is_free(region):
            return None
        turns = body.robot.model.mobility is Mobility.HEADING
        return Pose(region, self._places.heading(at.yaw) if turns else None)

    def _check_times(self) -> None:
        now = self.now()
        for body in self._bodies.values():
            errand = body.errand
            if errand is None or now < errand.due:
                continue
            if errand.phase is Phase.LOOKING:
                self._arrive(body, errand)
            elif errand.phase is Phase.GOING:
                self._stop(body, errand, f"no end of the goal in {errand.due:.1f} s")
            elif errand.phase is Phase.STOPPING:
                self._go_back(body, errand)
            elif errand.phase is Phase.RETURNING:
                self._transport.cancel(body.robot.name)
                self._lose(body, errand)
            else:
                self._performed(
                    body,
                    Performed(body.robot.name, errand.goal, ActResult.FAILED, "no answer in time"),
                )

    # Actions

    def _act_on_next(self, body: DrivenRobot, errand: Errand) -> None:
        """Ask for the action on the next obstacle, or end the command."""
        for obstacle in errand.obstacles:
            if obstacle.name in errand.results:
                continue
            action = next((n.action for n in obstacle.needs if n.action in body.station.act), None)
            if action is None:
                errand.results[obstacle.name] = ActResult.FAILED
                continue
            self._goals += 1
            errand.goal = self._goals
            errand.due = self.now() + max(30.0, SETTLING * body.station.timeout)
            service = body.station.act[action]
            self._transport.perform(body.robot.name, service, obstacle.name, errand.goal)
            return
        found = [(o, errand.results[o.name]) for o in errand.obstacles]
        self._end(
            body, body.pose, Acted(self.now(), body.robot.name, found, command=errand.command)
        )

    def _performed(self, body: DrivenRobot, message: Performed) -> None:
        errand = body.errand
        if errand is None or errand.phase is not Phase.ACTING or message.number != errand.goal:
            return
        obstacle = next(o for o in errand.obstacles if o.name not in errand.results)
        errand.results[obstacle.name] = message.result
        if message.result in (ActResult.DONE, ActResult.UNTRAVERSABLE, ActResult.NOTHING):
            self._forget(obstacle.region)
        self._act_on_next(body, errand)

    # Sensing

    def _forget(self, region: Region) -> None:
        """An obstacle is resolved: readings that were taken before are of the past."""
        self._seen.pop(region, None)
        self._resolved_at[region] = {
            name: body.place.stamp if body.place is not None else -inf
            for name, body in self._bodies.items()
        }

    def _new(self, body: DrivenRobot, region: Region, stamp: float) -> bool:
        """Whether a reading is younger than the last resolution there."""
        return stamp > self._resolved_at.get(region, {}).get(body.robot.name, -inf)

    def _saw(self, body: DrivenRobot, region: Region, kind: str, stamp: float) -> None:
        world = self._scenario.map
        if region in self._seen or not world.is_free(region) or not self._new(body, region, stamp):
            return
        listed = [o for o in self._scenario.obstacles if (o.region, o.type.name) == (region, kind)]
        obstacle = (
            listed[0] if listed else Obstacle(self._scenario.catalogue.obstacles[kind], region)
        )
        self._seen[region] = obstacle
        self._events.append(Sensed(self.now(), obstacle, body.robot.name))

    def _gone(self, body: DrivenRobot, region: Region, stamp: float) -> None:
        obstacle = self._seen.get(region)
        if obstacle is not None and self._new(body, region, stamp):
            del self._seen[region]
            self._events.append(Sensed(self.now(), obstacle, body.robot.name, there=False))

    def _report(self, body: DrivenRobot, message: Reported) -> None:
        """``door@47`` or ``-door@47``; any other text is ignored."""
        there = not message.text.startswith("-")
        kind, _, place = message.text.removeprefix("-").strip().partition("@")
        region = self._scenario.map.names.get(place)
        if region is None and place.isdecimal() and len(place) < 10:
            region = int(place)
        if region is None or kind not in self._scenario.catalogue.obstacles or body.place is None:
            return
        if there:
            self._saw(body, region, kind, body.place.stamp)
        else:
            self._gone(body, region, body.place.stamp)

    def _scan(self, body: DrivenRobot, scan: Scanned) -> None:
        """Look into the regions beside the robot, while it stands still."""
        use, errand = body.station.scan, body.errand
        moving = errand is not None and errand.phase not in (Phase.LOOKING, Phase.ACTING)
        fresh = errand is None or scan.stamp > errand.since
        if use is None or body.place is None or moving or scan.stamp <= body.looked or not fresh:
            return
        body.looked = scan.stamp
        for region in self._scenario.map.neighbours(self._here(body)):
            hit = self._nearest(body, scan, region)
            limit = self._metres_to(body, region) + use.beyond
            if hit is None or self._somebody_at(body, region):
                continue
            if hit <= limit:
                self._saw(body, region, use.obstacle, scan.stamp)
            elif region in self._seen and self._seen[region].type.name == use.obstacle:
                self._gone(body, region, scan.stamp)
        if errand is not None and errand.phase is Phase.LOOKING:
            self._arrive(body, errand)

    def _here(self, body: DrivenRobot) -> Region:
        assert body.place is not None
        found = self._places.region(body.place.x, body.place.y)
        return body.pose.region if found is None else found

    def _nearest(self, body: DrivenRobot, scan: Scanned, region: Region) -> float | None:
        """The shortest of the rays that end near the line to the middle of a region, in metres;
        None if none goes there."""
        at = body.place
        assert at is not None
        bearing = self._places.bearing(region, at.x, at.y) - at.yaw
        width = 0.1 * min(self._places.frame.resolution)
        found: float | None = None
        for index, metres in enumerate(scan.ranges):
            off = turned(scan.first + index * scan.step - bearing)
            far = metres if isfinite(metres) else self._metres_to(body, region)
            if abs(off) < pi / 2 and abs(far * sin(off)) <= width:
                ahead = metres * cos(off) if isfinite(metres) else inf
                found = ahead if found is None else min(found, ahead)
        return found

    def _somebody_at(self, body: DrivenRobot, region: Region) -> bool:
        """Whether another robot may be what a ray has hit: it is in a region, or bound for it, or
        less than a region away from its middle."""
        size = max(self._places.frame.resolution)
        for other in self._bodies.values():
            if other is body:
                continue
            held = {other.pose.region}
            if other.errand is not None:
                held |= {other.errand.start.region, other.errand.to.region}
            at = other.place
            x, y = self._places.centre(region)
            if region in held or (at is not None and hypot(at.x - x, at.y - y) < size):
                return True
        return False
