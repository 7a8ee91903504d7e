"""The world of a mission with real robots (``runtime.worlds.protocol.World``), for any transport.

A command becomes a goal in metres and ends with one confirmed event. After a failure the robot is
first sent back to the centre of its departure region, since a robot between two regions occupies
both. A robot that cannot be brought back, or has no fresh odometry, is lost in the two regions. An
arrival waits at most a few seconds for a reading of the new surroundings, since an earlier reading
does not show what is in front of the robot now.
"""

import queue
from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import inf

from safenav.errors import UsageError, needing
from safenav.fleet import robots, transport
from safenav.fleet.file import FleetFile, Station, TransportKind
from safenav.fleet.goals import FRESH, LATE, SETTLING, Goals
from safenav.runtime.run.checkpoint import Resumption
from safenav.runtime.worlds.protocol import Acted, Blocked, Failed, Lost, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.poses import Pose


class FleetWorld:
    """The world of a fleet behind a transport. Open it before the mission; always close it.
    ``goals`` executes the commands. ``begun``: the run that the drive continues."""

    def __init__(
        self,
        scenario: Scenario,
        stations: Mapping[str, Station],
        middleware: transport.Streamer,
        begun: Resumption | None = None,
    ) -> None:
        self.goals = Goals(scenario, stations, middleware)
        self.now = self.goals.now
        self._bodies, self._sensing = self.goals.bodies, self.goals.sensing
        self._places = self.goals.places
        self._messages: queue.SimpleQueue[tuple[float, transport.Message]] = queue.SimpleQueue()
        self._progress = robots.FleetProgress(scenario, begun)
        self._untold: dict[str, robots.FleetTask] = {}
        self._inputs: dict[str, bool] = {}
        self.pauses = middleware.step is not None

    # The protocol

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        self._take_all()
        seen = self._sensing.at(region)  # all robots share sightings
        return self._sensing.stray(robot, region) if seen is None else seen

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        known = self._sensing.at(pose.region)  # obstacles that ``sense`` has reported to the team
        self._take_all()
        body = self._bodies[robot.name]
        found = self.goals.pose_now(body)
        if found is not None and found.region != body.pose.region:  # moved, but not by a command
            body.lost = frozenset((body.pose.region, found.region))
            return Lost(self.now(), robot.name, body.lost, self._moved(found), command=command)
        task = robots.FleetTask(command, body.pose, pose, robots.Phase.INSPECTING, known=known)
        body.task = self._untold[robot.name] = task
        return None

    def _moved(self, pose: Pose) -> str:
        where = self._places.world.label(pose.region)
        return f"its odometry places it in {where}, to which it was not sent"

    def inputs(self, tick: int) -> Mapping[str, bool]:
        """Return the received inputs of the environment."""
        del tick
        return self._inputs

    def _set_out(self, robot: str) -> None:
        body, task = self._bodies[robot], self._untold.pop(robot)
        task.due = self.now() + robots.PASSED + FRESH
        self._send_if_clear(body, task)

    def _send_if_clear(self, body: robots.DrivenRobot, task: robots.FleetTask) -> None:
        """Send a robot if its lidar confirms the team's knowledge of the next region or cannot see
        that region. A robot that has just found an obstacle does not depart."""
        if body.robot.name in self._untold:
            return
        region, pose = task.to.region, self.goals.pose_now(body)
        known, view = self._sensing.at(region), body.view.get(region)
        if body.station.scan is None or region == task.start.region:
            view = robots.View.SEEN
        elif self.now() - body.viewed > robots.STALE:
            view = None
        if pose is not None and pose.region != task.start.region:  # moved, but not by a command
            self.goals.lose(body, task, self._moved(pose))
            return
        if pose is None or view in (None, robots.View.DOUBT, robots.View.BEFORE):
            return
        known = known or self._sensing.stray(body.robot, region)
        meets = view is robots.View.ROBOT and not self._sensing.is_shared(body, region)
        if known is None and meets:
            return
        if known is not None and known is not task.known:
            self.goals.end(body, Blocked, task.start, known)
            return
        task.phase = robots.Phase.GOING
        self.goals.send(body, task, task.to)

    def _peered(self, body: robots.DrivenRobot, task: robots.FleetTask) -> None:
        """End a step before departure, since no scan has shown a free next region in time."""
        pose, region = self.goals.pose_now(body), task.to.region
        if pose is None:
            self.goals.lose(body, task)
            return
        where = self._places.world.label(region)
        why = f"its lidar has not seen {where} since it arrived here"
        if body.view.get(region) is not None:
            why = f"its lidar hits something at {where}, perhaps another robot"
        self.goals.end(body, Failed, task.start, why)

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> WorldEvent | None:
        body = self._bodies[robot.name]
        every = (*obstacles, *self._passed(robot, obstacles))
        if not every:
            return Acted(self.now(), robot.name, (), command=command)
        team_action, here = robots.TeamAction(robot, every, self._progress), body.pose
        task = robots.FleetTask(command, here, here, robots.Phase.ACTING, team_action=team_action)
        body.task, body.view = task, {}
        self._sensing.acted_on |= {obstacle.region for obstacle in every}
        self._act_on_next(body, task, team_action)
        return None

    def _passed(self, robot: Robot, known: Sequence[Obstacle]) -> list[Obstacle]:
        """Return the obstacles unknown to the team that a robot resolves alone, by one action from
        its region: for example, a door that it has found and entered."""
        idle = self._idle(None)
        return [
            one
            for one in self._sensing.seen()
            if one not in known
            and len(one.needs) == 1
            and self._progress.group(one, robot.name, idle) == (robot.name,)
        ]

    def placed(self, robot: Robot, pose: Pose) -> None:
        """Record that an operator has placed a robot. ``start`` compares this with odometry."""
        body = self._bodies[robot.name]
        body.pose, body.lost, body.view = pose, frozenset(), {}
        self._sensing.placed(robot.name)

    def cleared(self, obstacle: Obstacle) -> None:
        """Discard a resolved obstacle, since earlier readings of it are outdated."""
        self._progress.forget(obstacle)
        places = {name: body.place for name, body in self._bodies.items()}
        stamps = {n: -inf if place is None else place.stamp for n, place in places.items()}
        self._sensing.forget(obstacle.region, stamps, self.now())

    def cancel(self, robot: Robot) -> None:
        body = self._bodies[robot.name]
        task = body.task
        self._untold.pop(robot.name, None)
        if task is not None and task.phase is robots.Phase.INSPECTING:  # the robot has not departed
            self.goals.end(body, Failed, task.start, "cancelled")
        elif task is not None and task.phase is robots.Phase.GOING:
            self.goals.stop(body, task, "cancelled")
        elif task is not None and task.phase is robots.Phase.LOOKING and task.there:
            self.goals.looked(body, task)

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        end = inf if timeout is None else self.now() + timeout
        self._take_all()
        for name in list(self._untold):
            self._set_out(name)
        while True:
            self._take_all()  # many messages may arrive during a long computation
            self._check_times()
            if self.goals.events or self.now() >= end:
                found, self.goals.events = self.goals.events, []
                return found
            dues = [body.task.due for body in self._bodies.values() if body.task]
            pause = min([end, *dues]) - self.now()
            self._take_next(min(max(pause, 0.0), 0.25))

    # Connection

    def open(self, patience: float = 10.0) -> None:
        """Connect, wait for all robots, and check their start poses by odometry. Then wait at most
        ``FRESH`` seconds for the first reading of each lidar. Raises UsageError."""
        self.goals.transport.open(self._heard)
        end = self.now() + patience
        while silent := self._silent():
            if self.now() >= end:
                raise UsageError(f"no answer in {patience:g} s from {', '.join(silent)}")
            self._take_next(0.1)
        for body in self._bodies.values():
            if (astray := self.goals.begins_elsewhere(body)) is not None:
                raise UsageError(astray)
        end, see = self.now() + FRESH, [b for b in self._bodies.values() if b.station.scan]
        while self.now() < end and any(body.looked == -inf for body in see):
            self._take_next(0.1)

    def _silent(self) -> list[str]:
        bodies = self._bodies.values()
        quiet = [body.station.pose_topic for body in bodies if body.place is None]
        return quiet or self.goals.transport.missing()

    def close(self) -> None:
        """Cancel every goal and disconnect."""
        self.goals.transport.close()

    # Messages

    def _heard(self, message: transport.Message) -> None:
        self._messages.put((self.now(), message))

    def _take_next(self, pause: float) -> None:
        if (step := self.goals.transport.step) is not None:
            step()
        else:
            with suppress(queue.Empty):
                self._take(*self._messages.get(timeout=pause))
        self._take_all()

    def _take_all(self) -> None:
        with suppress(queue.Empty):
            while True:
                self._take(*self._messages.get_nowait())

    def _take(self, heard: float, message: transport.Message) -> None:
        """Process a message received at a time (seconds)."""
        if isinstance(message, transport.InputHeard):
            self._inputs[message.name] = message.on
            return
        if (body := self._bodies.get(message.robot)) is None:
            return
        match message:
            case transport.Located():
                self._located(body, message, heard)
            case transport.Scanned():
                self._sensing.keep(body, message, heard)
                self._read(body, heard)
            case transport.Reported() if body.place is not None:
                self._sensing.report(message, body.place.stamp, heard)
            case transport.GoalEnded():
                self.goals.goal_ended(body, message)
            case transport.Performed():
                self._performed(message)

    def _located(self, body: robots.DrivenRobot, place: transport.Located, heard: float) -> None:
        if body.place is not None and place.stamp < body.place.stamp:
            return  # an older message
        body.place, body.heard = place, heard
        body.trail.append(robots.TrailPoint(heard, place, body.regions))
        while len(body.trail) > 2 and heard - body.trail[0].at > robots.PASSED + robots.STALE:
            body.trail.popleft()
        task = body.task
        if task is not None and task.phase is robots.Phase.LOOKING:
            self.goals.confirm(body, task)
        elif task is not None and task.over is not None:
            self._acted(body, task)
        elif task is not None and task.phase is robots.Phase.INSPECTING:
            self._send_if_clear(body, task)
        self._read(body, heard)
        self.goals.watch(body)
        self._sensing.stray_left(body)
        self._keep_clear(body)

    def _keep_clear(self, body: robots.DrivenRobot) -> None:
        """Stop robots in transit to a region into which a person has moved another robot."""
        at = body.place
        if body.task is not None or at is None or not self._sensing.is_astray(body):
            return
        region = self._places.region(at.x, at.y)
        why = f"{body.robot.name} is in region {region}, to which it was not sent"
        for other in self._bodies.values():
            task = other.task
            if task is None or task.phase is not robots.Phase.GOING or task.to.region != region:
                continue
            if other.robot.conflicts(body.robot):
                self.goals.stop(other, task, why)

    # Steps

    def _check_times(self) -> None:
        now = self.now()
        for body in self._bodies.values():
            task = body.task
            if task is None or now < task.due:
                continue
            if task.phase is robots.Phase.INSPECTING:
                self._peered(body, task)
            elif task.phase is not robots.Phase.ACTING:
                self.goals.overdue(body, task)
            elif task.over is not None:
                self._end_action(body, task)
            else:
                for name in task.team_action.silent if task.team_action is not None else ():
                    late = transport.Performed(name, task.goal, ActResult.FAILED, "too late")
                    self._performed(late)

    # Actions

    def _act_on_next(
        self, body: robots.DrivenRobot, task: robots.FleetTask, team_action: robots.TeamAction
    ) -> None:
        """Start the next action of a command for all participants, or end the command."""
        stations = {name: other.station for name, other in self._bodies.items()}
        services = team_action.next(self._idle(task), stations)
        if not services:
            found = team_action.found
            failed = any(end is ActResult.FAILED for _, end in found)
            why = "; ".join(team_action.reasons) if failed else ""
            task.over, task.due = (found, why), self.now() + LATE
            self._acted(body, task)
            return
        assert team_action.on is not None
        task.goal = self.goals.number()
        task.due = self.now() + max(30.0, SETTLING * body.station.timeout)
        for name, service in services.items():
            self.goals.transport.perform(name, service, team_action.on.name, task.goal)

    def _acted(self, body: robots.DrivenRobot, task: robots.FleetTask) -> None:
        """End the actions of a command when odometry shows the robot in its own region. A robot
        that opens a door enters its region, and odometry may be later than the result."""
        pose = self.goals.pose_now(body)
        if pose is not None and pose.region == body.pose.region:
            self._end_action(body, task)

    def _end_action(self, body: robots.DrivenRobot, task: robots.FleetTask) -> None:
        assert task.team_action is not None and task.over is not None and body.place is not None
        self._sensing.acted_on -= {one.region for one in task.team_action.obstacles}
        body.arrived = body.place.stamp
        self.goals.end(body, Acted, *task.over)

    def _idle(self, task: robots.FleetTask | None) -> dict[str, Region]:
        """Return the regions of the robots that can take part in an action of this command, since
        they have no other command."""
        bodies = self._bodies.values()
        return {b.robot.name: b.pose.region for b in bodies if b.task in (None, task)}

    def _performed(self, message: transport.Performed) -> None:
        """Process the reply of a participant of an action."""
        for leader in self._bodies.values():
            task = leader.task
            if task is None or task.team_action is None or task.goal != message.number:
                continue
            answer = message.robot, message.result, self._idle(task), message.reason
            if task.team_action.answer(*answer):
                if task.team_action.resolved is not None:
                    self.cleared(task.team_action.resolved)
                self._act_on_next(leader, task, task.team_action)
            return

    # Sensing

    def _read(self, body: robots.DrivenRobot, now: float) -> None:
        """Evaluate the scans whose poses are now known from odometry."""
        for _ in self._sensing.read(body, now):
            task = body.task
            if task is not None and task.phase is robots.Phase.LOOKING and task.there:
                if robots.View.DOUBT not in body.view.values():
                    self.goals.looked(body, task)
                else:  # the robot or obstacle hit by a ray may have left: scan again
                    task.due = max(task.due, task.since + robots.PASSED + FRESH)
            elif task is not None and task.phase is robots.Phase.INSPECTING:
                self._send_if_clear(body, task)


def fleet_world(scenario: Scenario, fleet: FleetFile, begun: Resumption | None) -> FleetWorld:
    """Return a world that is not yet open. ``begun``: the run that the drive continues. Raises
    UsageError if the transport's library is missing."""
    scenario = begun.standing(scenario) if begun else scenario
    if fleet.transport is TransportKind.SIMULATION:
        from safenav.fleet.lab.simulation import SimulationTransport

        simulation = SimulationTransport(scenario, fleet, begun)
        return FleetWorld(scenario, fleet.stations, simulation, begun)
    with needing("transport ros2", "ros2", "cyclonedds"):
        from safenav.fleet.ros2.transport import Ros2Transport
    robots = Ros2Transport(fleet.network, fleet.stations, fleet.inputs)
    return FleetWorld(scenario, fleet.stations, robots, begun)
