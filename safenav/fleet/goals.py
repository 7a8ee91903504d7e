"""Goals of driven robots: how they are sent, monitored and retried, and the ends of steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from safenav.errors import UsageError, needing
from safenav.fleet.file import Station
from safenav.fleet.robots import STALE, DrivenRobot, FleetTask, Phase
from safenav.fleet.sensing import Sensing
from safenav.fleet.transport import GoalEnd, GoalEnded, GoalPoint, Places, Streamer, Transport
from safenav.runtime.worlds import protocol
from safenav.scenario.model import Obstacle, Scenario
from safenav.world.map import Frame, Region
from safenav.world.poses import Mobility, Pose

FRESH = 1.0
"""Seconds for which an arrival waits for a reading taken after it."""
LATE = 1.8
"""Maximum delay of odometry after a result, in seconds."""
SETTLING = 5.0
"""Seconds that every goal may take beyond the time for its distance, for acceptance, turns and
brakes."""
STOPPING = 5.0
"""Seconds within which a cancelled goal must end."""
PAUSE, RETURNING = 1.0, 20.0
"""Seconds between attempts of a failed return, and seconds during which they are repeated. A robot
with a pressed emergency stop, or whose navigation restarts, rejects every goal immediately."""


def frame_of(scenario: Scenario) -> Frame:
    """Return the frame of the map in metres. Raises UsageError if the scenario has none."""
    if scenario.map.frame is None:
        problem = "the map has no size in metres: add 'resolution: 1.0' (metres per region)"
        raise UsageError(f"{problem} to 'map', or take the map from map_server with 'ros:'")
    return scenario.map.frame


class Goals:
    """The owner and only sender of all goals. It executes each robot's command (``bodies``) from
    its start until the event that ends it (``events``)."""

    def __init__(
        self, scenario: Scenario, stations: Mapping[str, Station], transport: Streamer
    ) -> None:
        self.scenario = scenario
        self.places = Places(scenario.map, frame_of(scenario))
        self.transport: Transport = transport
        self._seconds_left: Callable[[str], float] = lambda _: 0.0
        """Seconds until the reference of a robot ends."""
        if any(station.follow is not None for station in stations.values()):
            with needing("'follow' of a robot", "motion"):
                from safenav.fleet.following import Following
            following = Following(transport, scenario.robots, self.places, stations)
            self.transport, self._seconds_left = following, following.left
        self.now = transport.now
        self.bodies = {
            robot.name: DrivenRobot(robot, stations[robot.name], robot.start)
            for robot in scenario.robots
        }
        self.events: list[protocol.WorldEvent] = []
        self.sensing = Sensing(scenario, self.places, self.bodies, self._sensed)
        self._goals = 0

    def _sensed(self, obstacle: Obstacle, robot: str | None, there: bool) -> None:
        self.events.append(protocol.Sensed(self.now(), obstacle, robot, there=there))

    def begins_elsewhere(self, body: DrivenRobot) -> str | None:
        """Return an error if a robot is not where the run begins or continues, else None."""
        at, pose, name = body.place, body.pose, body.robot.name
        assert at is not None
        found = self.places.region(at.x, at.y)
        if found != pose.region:
            where = "off the map" if found is None else f"in region {found}"
            x, y = self.places.centre(pose.region)
            problem = f"{name} is {where} ({at.x:.2f}, {at.y:.2f} m); the run begins with it in "
            problem += f"{pose.region} ({x:.2f}, {y:.2f} m)"
        elif pose.heading is not None and (facing := self.places.heading(at.yaw)) != pose.heading:
            problem = f"{name} faces {facing.label}; the run begins with it facing "
            problem += pose.heading.label
        else:
            return None
        return f"{problem}\n    odometry has to be in the frame of the map (its 'origin')"

    def number(self) -> int:
        """Return a number for the next goal or action that is unique in this run."""
        self._goals += 1
        return self._goals

    def send(self, body: DrivenRobot, task: FleetTask, pose: Pose) -> None:
        body.view = {}
        x, y = self.places.centre(pose.region)
        task.goal, task.sent = self.number(), self.now()
        far = self._metres_to(body, pose.region)
        task.due = task.sent + SETTLING + body.station.timeout * far / body.station.speed
        short = task.phase is Phase.GOING and self.sensing.at(pose.region) is not None
        goal = GoalPoint(task.goal, x, y, self.places.yaw(pose), short)
        self.transport.navigate(body.robot.name, goal)
        task.due = max(task.due, self.now() + SETTLING + self._seconds_left(body.robot.name))

    def _metres_to(self, body: DrivenRobot, region: Region) -> float:
        at = body.place
        x, y = (at.x, at.y) if at is not None else self.places.centre(body.pose.region)
        return self.places.distance(region, x, y)

    def goal_ended(self, body: DrivenRobot, message: GoalEnded) -> None:
        task = body.task
        if task is None or message.number != task.goal:
            return  # a late message about an abandoned goal
        moving = task.phase in (Phase.GOING, Phase.STOPPING, Phase.RETURNING)
        if moving and message.end is GoalEnd.SUCCEEDED:  # the goal may have ended before the stop
            self._look(body, task)
        elif task.phase is Phase.GOING:
            self._go_back(body, task, message.reason or message.end.value)
        elif task.phase is Phase.STOPPING:
            self._go_back(body, task, task.reason)
        elif task.phase is Phase.RETURNING:
            self._return_failed(body, task, message.reason or message.end.value)

    def _return_failed(self, body: DrivenRobot, task: FleetTask, why: str) -> None:
        """Schedule another attempt to return. Declare the robot lost if attempts have failed for
        too long or odometry is old."""
        if self.now() < task.since + RETURNING and self.now() - body.heard <= STALE:
            task.goal, task.due = 0, self.now() + PAUSE
        else:
            self.lose(body, task, f"{task.reason}; its return ended: {why}")

    def overdue(self, body: DrivenRobot, task: FleetTask) -> None:
        """Handle a command whose present phase has reached its time limit."""
        late = f"did not end within {self.now() - task.sent:.1f} s"
        if task.phase is Phase.LOOKING:
            self.looked(body, task)
        elif task.phase is Phase.STOPPING:
            self._go_back(body, task, task.reason)
        elif not task.goal:
            self.send(body, task, task.start)
        elif task.phase is Phase.GOING:
            self.stop(body, task, f"the goal {late}")
        else:
            self.transport.cancel(body.robot.name)
            self.lose(body, task, f"{task.reason}; its return {late}")

    def stop(self, body: DrivenRobot, task: FleetTask, reason: str) -> None:
        task.reason, task.phase = reason, Phase.STOPPING
        task.due = self.now() + STOPPING + self._seconds_left(body.robot.name)
        self.transport.cancel(body.robot.name)

    def watch(self, body: DrivenRobot) -> None:
        """Stop a robot that leaves the regions of its step, since its own planner may lead it
        around an obstacle, through regions that other robots may enter. A robot that still passes
        the centre of another region is lost. For a follower, the reference is monitored instead."""
        task, off = body.task, self.sensing.off(body)
        if task is None or body.station.follow is not None:
            return
        if task.phase is Phase.GOING and off > body.station.tolerance:
            self.stop(body, task, f"{off:.2f} m outside the regions of its step")
        midst = self.places.frame.resolution / 2
        if task.phase in (Phase.STOPPING, Phase.RETURNING) and off > midst + body.station.tolerance:
            self.transport.cancel(body.robot.name)
            self.lose(body, task, f"{off:.2f} m outside the regions of its step")

    def _go_back(self, body: DrivenRobot, task: FleetTask, reason: str) -> None:
        if not task.back:
            task.back, task.since = True, self.now()
        task.phase, task.reason = Phase.RETURNING, reason
        self.send(body, task, task.start)

    def _came_back(self, body: DrivenRobot, task: FleetTask) -> None:
        pose = self.pose_now(body)
        if pose is None or not self._is_well_inside(body, pose.region):
            between = "it reported its return, but stands between regions"
            self.lose(body, task, f"{task.reason}; {between}")
            return
        seen = self.sensing.at(task.to.region)
        if pose.region != task.start.region:
            self.end(body, protocol.Elsewhere, pose)
        elif seen is not None:
            self.end(body, protocol.Blocked, pose, seen)
        else:
            self.end(body, protocol.Failed, pose, task.reason)

    def _look(self, body: DrivenRobot, task: FleetTask) -> None:
        """Wait until odometry, which may be later, confirms a reported arrival or return. Then wait
        up to ``FRESH`` seconds (longer while rays may hit something that has left) for a reading of
        the robot's sensors from there."""
        task.phase, task.there, task.due = Phase.LOOKING, False, self.now() + LATE
        self.confirm(body, task)

    def confirm(self, body: DrivenRobot, task: FleetTask) -> None:
        """Record the reported arrival or return if the newest odometry shows the robot there."""
        to = task.start if task.back else task.to
        if task.there or self.pose_now(body) != to or not self._near(body, to.region):
            return
        assert body.place is not None
        task.there, task.since, body.arrived = True, self.now(), body.place.stamp
        task.due = task.since + FRESH
        if body.station.scan is None:
            self.looked(body, task)

    def looked(self, body: DrivenRobot, task: FleetTask) -> None:
        (self._came_back if task.back else self._arrive)(body, task)

    def _arrive(self, body: DrivenRobot, task: FleetTask) -> None:
        pose, region = self.pose_now(body), task.to.region
        if pose is None:
            self.lose(body, task)
        elif pose == task.to and self._near(body, region):
            body.pose = pose
            self.end(body, protocol.Arrived, task.reason)
        elif pose != task.to and pose.region == region and self._is_well_inside(body, region):
            self.end(body, protocol.Elsewhere, pose)
        else:
            off = self._metres_to(body, region)
            far = f"it reported its arrival {off:.2f} m from the centre of {region}"
            self._go_back(body, task, far)

    def _near(self, body: DrivenRobot, region: Region, least: float = 0.0) -> bool:
        """Return whether a robot is within its tolerance, or ``least`` metres, of a region's
        centre. A follower always counts as near, since its reference has ended there."""
        far = self._metres_to(body, region)
        return body.station.follow is not None or far <= max(body.station.tolerance, least)

    def _is_well_inside(self, body: DrivenRobot, region: Region) -> bool:
        return self._near(body, region, self.places.frame.resolution / 4)

    def lose(self, body: DrivenRobot, task: FleetTask, reason: str = "") -> None:
        """Declare the robot lost for this ``reason``, or since its odometry is old or places it in
        no free region."""
        regions = frozenset((task.start.region, task.to.region))
        at = self.pose_now(body)
        if at is not None:
            regions |= {at.region}
        elif (old := self.now() - body.heard) > STALE:
            reason = f"its odometry is {old:.1f} s old"
        else:
            reason = "its odometry places it outside all free regions"
        body.lost = regions
        self.end(body, protocol.Lost, regions, reason)

    def end(
        self, body: DrivenRobot, kind: Callable[..., protocol.WorldEvent], *about: object
    ) -> None:
        """End a command by an event of this kind. The robot gets the event's pose, if any."""
        assert body.task is not None
        event = kind(self.now(), body.robot.name, *about, command=body.task.command)
        body.pose, body.task = getattr(event, "pose", body.pose), None
        self.events.append(event)

    def pose_now(self, body: DrivenRobot) -> Pose | None:
        """Return the robot's pose by its newest odometry; None if that is old or places the robot
        in no free region."""
        at = body.place
        if at is None or self.now() - body.heard > STALE:
            return None
        region = self.places.region(at.x, at.y)
        if region is None or not self.scenario.map.is_free(region):
            return None
        turns = body.robot.model.mobility is Mobility.HEADING
        return Pose(region, self.places.heading(at.yaw) if turns else None)
