"""The world of a mission that drives real robots (World, protocol 2), whatever the transport.

A command becomes a goal in metres, and ends by one event that is true: after a failure the robot is
first sent back to the middle of the region where it set out, since one that stands between two
regions occupies both. A robot that cannot be brought back, or has no fresh odometry, is lost in
either of them. Arrivals are reported when the robot's sensors have seen its new surroundings:
a reading from the way there says nothing about what stands before it now.
"""

from __future__ import annotations

import queue
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from math import inf

from safenav.extras import missing
from safenav.fleet import transport
from safenav.fleet.acting import TeamAction
from safenav.fleet.fleet_file import FleetFile, TransportKind
from safenav.fleet.place import Places
from safenav.fleet.sensing import PASSED, Sighting
from safenav.fleet.steps import (
    FRESH,
    SETTLING,
    DrivenRobot,
    FleetClock,
    FleetError,
    FleetSteps,
    FleetTask,
    Phase,
    TrailPoint,
)
from safenav.fleet.transport import DriveRecording, Transport
from safenav.runtime.failures import lost
from safenav.runtime.worlds.protocol import Acted, Lost, Sensed, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.records import Depart, Record
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.moves import Pose


class FleetWorld(FleetSteps):
    """A fleet behind a transport. Open it before the mission; close it whatever happens."""

    # The protocol

    @property
    def idle(self) -> bool:
        return all(body.task is None for body in self._bodies.values())

    @property
    def pauses(self) -> bool:
        return self._clock.step is not None

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        seen = self._sensing.at(region)  # what one robot has seen, all know
        return self._stray(robot, region) if seen is None else seen

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        body = self._bodies[robot.name]
        found = self._pose_now(body)
        if found is not None and found.region != body.pose.region:  # moved by something else
            regions = frozenset((body.pose.region, found.region))
            return Lost(self.now(), robot.name, regions, command=command)
        task = FleetTask(command, body.pose, pose, body.station.retries, Phase.GOING)
        body.task = task
        self._untold[robot.name] = task
        return None

    def _stray(self, robot: Robot, region: Region) -> Obstacle | None:
        """The obstacle that another robot is, measured in a region that it was not sent to: it has
        left its way, or a person has moved it."""
        for body in self._bodies.values():
            at = body.place
            if at is None or not self._scenario.conflict(robot, body.robot):
                continue
            held = body.regions
            off = min(self.places.outside(one, at.x, at.y) for one in held)
            if off > body.station.tolerance and self.places.region(at.x, at.y) == region:
                team = self._scenario.robots
                rivals = [o.name for o in team if self._scenario.conflict(o, body.robot)]
                found = lost(body.robot, frozenset(rivals), region)
                return self._strays.setdefault(body.robot.name, found)
        return None

    def _stray_moved(self, body: DrivenRobot) -> None:
        """Report a robot that is no longer where it was an obstacle."""
        at, found = body.place, self._strays.get(body.robot.name)
        if found is None or at is None or self.places.region(at.x, at.y) == found.region:
            return
        del self._strays[body.robot.name]
        self._events.append(Sensed(self.now(), found, there=False))

    def inputs(self, tick: int) -> Mapping[str, bool]:
        """The inputs of the environment, as far as they were heard."""
        del tick
        return self._inputs

    def told(self, record: Record) -> None:
        """Take a line of the trace: a robot sets out when its ``depart`` is written, not before. A
        listener of the mission, after that which writes the trace; without it, robots set out when
        the mission waits."""
        if isinstance(record, Depart) and record.robot in self._untold:
            self._set_out(record.robot)

    def _set_out(self, robot: str) -> None:
        task = self._untold.pop(robot)
        self._send(self._bodies[robot], task, task.to)

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> WorldEvent | None:
        body = self._bodies[robot.name]
        team_action = TeamAction(robot, tuple(obstacles), self._progress)
        task = FleetTask(command, body.pose, body.pose, 0, Phase.ACTING, team_action=team_action)
        body.task = task
        self._sensing.acted_on |= {obstacle.region for obstacle in obstacles}
        if not obstacles:
            body.task = None
            return Acted(self.now(), robot.name, (), command=command)
        self._act_on_next(body, task, team_action)
        return None

    def placed(self, robot: Robot, pose: Pose) -> None:
        """An operator has put a robot somewhere; ``start`` compares that with its odometry."""
        self._bodies[robot.name].pose = pose
        self._strays.pop(robot.name, None)

    def cleared(self, obstacle: Obstacle) -> None:
        """An operator has resolved an obstacle."""
        self._forget(obstacle)

    def cancel(self, robot: Robot) -> None:
        body = self._bodies[robot.name]
        if robot.name in self._untold:
            self._set_out(robot.name)
        if body.task is not None and body.task.phase is Phase.GOING:
            self._stop(body, body.task, "cancelled")

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        end = inf if timeout is None else self.now() + timeout
        for name in list(self._untold):
            self._set_out(name)
        while True:
            self._check_times()
            self._take_all()
            if self._events or self.now() >= end:
                found, self._events = self._events, []
                return found
            dues = [body.task.due for body in self._bodies.values() if body.task]
            pause = min([end, *dues]) - self.now()
            self._take_next(min(max(pause, 0.0), 0.25))

    # Life

    def open(self, patience: float = 10.0) -> None:
        """Connect, and wait until each robot answers and says where it is, which must be where the
        scenario has it begin; then for what its lidar has found there. Raises FleetError."""
        self._transport.open(self._heard)
        end = self.now() + patience
        while silent := self._silent():
            if self.now() >= end:
                raise FleetError(f"no answer in {patience:g} s from {', '.join(silent)}")
            self._take_next(0.1)
        for body in self._bodies.values():
            assert body.place is not None
            found = self.places.region(body.place.x, body.place.y)
            if found != body.pose.region:
                where = "off the map" if found is None else f"in region {found}"
                said = f"{body.robot.name} is {where} ({body.place.x:.2f}, {body.place.y:.2f} m)"
                raise FleetError(f"{said}; the scenario has it begin in {body.pose.region}")
            astray = None if self._following is None else self._following.astray(body.robot.name)
            if astray is not None:
                raise FleetError(astray)
        end = self.now() + FRESH
        while self.now() < end and any(
            body.station.scan is not None and body.looked == -inf for body in self._bodies.values()
        ):
            self._take_next(0.1)

    def _silent(self) -> list[str]:
        bodies = self._bodies.values()
        quiet = [f"{body.station.namespace}/odom" for body in bodies if body.place is None]
        return quiet or self._transport.missing()

    def close(self) -> None:
        """Cancel every goal, and disconnect."""
        self._transport.close()

    # Messages

    def _heard(self, message: transport.Message) -> None:
        if self.recording is not None:
            self.recording.heard(message, self._clock.now())
        self._messages.put(message)

    def _take_next(self, pause: float) -> None:
        if self._clock.step is not None:
            self._clock.step()
        else:
            with suppress(queue.Empty):
                self._take(self._messages.get(timeout=pause))
        self._take_all()

    def _take_all(self) -> None:
        with suppress(queue.Empty):
            while True:
                self._take(self._messages.get_nowait())

    def _take(self, message: transport.Message) -> None:
        if isinstance(message, transport.InputHeard):
            self._inputs[message.name] = message.on
            return
        body = self._bodies.get(message.robot)
        if body is None:
            return
        match message:
            case transport.Located():
                if body.place is None or message.stamp >= body.place.stamp:
                    body.place, body.heard = message, self.now()
                    self._remember(body, message)
                    self._watch(body)
                    self._stray_moved(body)
            case transport.Scanned():
                self._scan(body, message)
            case transport.Reported() if body.place is not None:
                self._sighted(body, self._sensing.report(message, body.place.stamp))
            case transport.GoalEnded():
                self._goal_ended(body, message)
            case transport.Performed():
                self._performed(message)

    # Steps

    def _check_times(self) -> None:
        now = self.now()
        for body in self._bodies.values():
            task = body.task
            if task is None or now < task.due:
                continue
            if task.phase is Phase.LOOKING:
                self._looked(body, task)
            elif task.phase is Phase.GOING:
                self._stop(body, task, f"the goal did not end within {task.due:.1f} s")
            elif task.phase is Phase.STOPPING:
                self._go_back(body, task)
            elif task.phase is Phase.RETURNING:
                self._transport.cancel(body.robot.name)
                self._lose(body, task)
            else:
                for name in task.team_action.silent if task.team_action is not None else ():
                    self._performed(
                        transport.Performed(name, task.goal, ActResult.FAILED, "too late")
                    )

    # Actions

    def _act_on_next(self, body: DrivenRobot, task: FleetTask, team_action: TeamAction) -> None:
        """Ask all that take part for the next action, or end the command."""
        stations = {name: other.station for name, other in self._bodies.items()}
        services = team_action.next(self._idle(task), stations)
        if not services:
            found = team_action.found
            failed = any(result is ActResult.FAILED for _, result in found)
            why = "; ".join(team_action.reasons) if failed else ""
            ended = Acted(self.now(), body.robot.name, found, why, command=task.command)
            self._end(body, body.pose, ended)
            return
        assert team_action.on is not None
        self._goals += 1
        task.goal = self._goals
        task.due = self.now() + max(30.0, SETTLING * body.station.timeout)
        for name, service in services.items():
            self._transport.perform(name, service, team_action.on.name, task.goal)

    def _idle(self, task: FleetTask) -> dict[str, Region]:
        """Regions of robots that can take part in an action: those without another command."""
        bodies = self._bodies.values()
        return {b.robot.name: b.pose.region for b in bodies if b.task in (None, task)}

    def _performed(self, message: transport.Performed) -> None:
        """Take the answer of one of those who act."""
        for leader in self._bodies.values():
            task = leader.task
            if task is None or task.team_action is None or task.goal != message.number:
                continue
            told = message.robot, message.result, self._idle(task), message.reason
            if task.team_action.answer(*told):
                if task.team_action.resolved is not None:
                    self._forget(task.team_action.resolved)
                self._act_on_next(leader, task, task.team_action)
            return

    # Sensing

    def _forget(self, obstacle: Obstacle) -> None:
        """An obstacle is resolved: readings that were taken before are of the past."""
        self._progress.forget(obstacle)
        places = {name: body.place for name, body in self._bodies.items()}
        self._sensing.forget(
            obstacle.region, {n: -inf if p is None else p.stamp for n, p in places.items()}
        )

    def _sighted(self, body: DrivenRobot, found: Sequence[Sighting]) -> None:
        now, name = self.now(), body.robot.name
        self._events += [Sensed(now, one.obstacle, name, there=one.there) for one in found]

    def _scan(self, body: DrivenRobot, scan: transport.Scanned) -> None:
        """Look into the regions beside the robot, while it stands still."""
        use, task, at = body.station.scan, body.task, body.place
        moving = task is not None and task.phase not in (Phase.LOOKING, Phase.ACTING)
        if use is None or at is None or moving or scan.stamp <= max(body.looked, body.arrived):
            return
        body.looked = scan.stamp
        found = self.places.region(at.x, at.y)
        here = body.pose.region if found is None else found
        now = self.now()
        busy, left = partial(self._somebody_at, body), partial(self._somebody_left, body)
        look = self._sensing.scan(use, scan, at, here, busy, left, now)
        self._sighted(body, look.found)
        if task is not None and task.phase is Phase.LOOKING:
            if look.sure:
                self._looked(body, task)
            else:  # what it has hit may have left: look again before somebody enters
                task.due = now + PASSED

    def _remember(self, body: DrivenRobot, place: transport.Located) -> None:
        now = self.now()
        body.trail.append(TrailPoint(now, place, body.regions))
        while now - body.trail[0].at > PASSED:
            body.trail.popleft()

    def _somebody_at(self, body: DrivenRobot, region: Region) -> bool:
        """Whether another robot may be what a ray has hit: it is in a region, or bound for it, or
        less than a region away from its middle."""
        others = (other for other in self._bodies.values() if other is not body)
        return any(
            region in other.regions
            or (other.place is not None and self._near_to(region, other.place))
            for other in others
        )

    def _somebody_left(self, body: DrivenRobot, region: Region) -> bool:
        """Whether that held for another robot in the last ``PASSED`` seconds."""
        oldest = self.now() - PASSED
        trails = (other.trail for other in self._bodies.values() if other is not body)
        return any(
            one.at >= oldest and (region in one.regions or self._near_to(region, one.place))
            for trail in trails
            for one in trail
        )

    def _near_to(self, region: Region, place: transport.Located) -> bool:
        size = max(self.places.frame.resolution)
        return self.places.distance(region, place.x, place.y) < size


def fleet_world(
    scenario: Scenario, fleet: FleetFile, recording: DriveRecording | None = None
) -> FleetWorld:
    """Return the world, not yet open; ``recording`` takes what is sent and measured.

    Raises UsageError if the transport's library is missing."""
    stations = fleet.stations
    if fleet.transport is TransportKind.SIMULATION:
        from safenav.fleet.simulation import SimulationTransport

        FleetWorld.check(scenario)
        simulated = SimulationTransport(scenario, stations, fleet.simulation)
        clock = FleetClock(lambda: simulated.physics.now, simulated.step)
        return FleetWorld(scenario, stations, simulated, clock, recording)
    transport: Transport
    if fleet.transport is TransportKind.ROS1:
        from safenav.fleet.ros1 import Ros1Transport

        transport = Ros1Transport(fleet.network, stations, fleet.inputs)
    elif fleet.transport is TransportKind.PYROBOSIM:
        from safenav.fleet.pyrobosim.transport import PyrobosimTransport

        assert fleet.pyrobosim is not None
        places = Places(scenario.map, FleetWorld.check(scenario))
        transport = PyrobosimTransport(places, stations, fleet.pyrobosim)
    else:
        try:
            from safenav.fleet.ros2.transport import Ros2Transport
        except ImportError as error:
            raise missing("transport ros2", "cyclonedds", "ros2") from error
        transport = Ros2Transport(fleet.network, stations, fleet.inputs)
    return FleetWorld(scenario, stations, transport, recording=recording)
