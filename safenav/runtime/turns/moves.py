"""The steps of robots: begun, in transit, ended, and the goals that they meet. A robot whose step
fails tries again, reports an obstacle, or is out of service."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.runtime.characterization import ForbiddenMove, characterize
from safenav.runtime.coordination import events
from safenav.runtime.coordination.events import Event
from safenav.runtime.failures import Reaction, lost, unknown
from safenav.runtime.progress import Progress
from safenav.runtime.team import DecidedStep, RobotState, TeamState
from safenav.runtime.turns.actions import Actions
from safenav.runtime.turns.move_recorder import MoveRecorder
from safenav.runtime.turns.relocation import Relocation
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.protocol import Arrived, Blocked, Elsewhere, Ended, Failed, Lost
from safenav.scenario.guarantees import guarantees_of, values_of
from safenav.scenario.model import Obstacle
from safenav.scenario.objective import Ltl
from safenav.trace.vocabulary import ChangeCause, PlanEndReason
from safenav.world.map import Region
from safenav.world.moves import Pose

Values = Mapping[str, int]
StepValues = tuple[Values, Values]
"""The values of a specification's variables before and after a step."""


class Moves(Struct, frozen=True):
    """Carries out steps in the world."""

    state: TeamState
    world: Commands
    recorder: MoveRecorder
    relocation: Relocation
    actions: Actions

    def begin(self, robot: RobotState, step: DecidedStep) -> Iterator[Event]:
        """Begin a step; one that has ended when the command returns is processed immediately."""
        if self.state.live and step.pose == robot.pose:
            self.recorder.stays(robot, step)
            around = self._values_around(robot, robot.pose, step.before)
            if not self._has_counted(robot, around):
                self._count(robot, robot.progress, around)
            return
        robot.transit, robot.recalls = step, self._remembers_after(robot, step)
        robot.stood.clear()
        self.relocation.traffic.set_out()
        event = robot.moved or self.world.start(robot.robot, robot.pose, step.pose)
        robot.moved = None
        if event is not None and not self.state.live:
            yield from self._arrive(robot, step, event, step)
            return
        number = self.world.number(robot.name) if event is None else event.command or 0
        self.state.moved()
        self.recorder.begun(robot, step, number, self.world.expected(robot.robot))
        if not self.state.live:
            yield from self.actions.act(robot)
        elif event is not None:
            yield from self._arrive(robot, step, event, step)

    def travel(self, robot: RobotState, step: DecidedStep) -> Iterator[Event]:
        """The turn of a robot in transit: the end of its step, if it has ended."""
        given_up = not self.state.live and self._is_closed(robot, step.pose.region)
        event = (given_up and self.world.give_up(robot.robot)) or self.world.ended(robot.robot)
        if event is None:
            self.recorder.begun(robot, None)
            if not self.state.live:
                yield from self.actions.act(robot)
            return
        yield from self._arrive(robot, step, event, step if step.planned else None)
        if not self.relocation.traffic.plan.active:
            yield from self.relocation.go_on(robot)

    def _is_closed(self, robot: RobotState, region: Region) -> bool:
        """Whether a robot must not enter the region of its step any longer: another robot has ended
        its own step there, or an obstacle is known or sensed there."""
        return region in self.state.had_by_others(robot.robot) or bool(
            characterize(self.world, self.state, robot.robot, robot.pose, region)
        )

    def _arrive(
        self, robot: RobotState, step: DecidedStep, event: Ended, recorded: DecidedStep | None
    ) -> Iterator[Event]:
        """Process the end of a step: let the robot act there, and count its progress. ``recorded``:
        the step as recorded by a lockstep trace."""
        start, pose, progress = robot.pose, step.pose, robot.progress
        robot.transit, robot.claims = None, {}
        self.state.moved()
        if isinstance(event, Arrived):
            robot.pose = pose
        elif not isinstance(event, Lost):
            robot.pose = event.pose
        strayed = robot.pose != pose
        if robot.pose.region != start.region:
            robot.came = None if strayed else start
        moved = strayed and isinstance(event, Elsewhere)  # perhaps free of what it waits for
        self.state.outdated |= moved and self.state.waiting is not None
        reaction, violation = self._judge(robot, start, pose, event)
        self.recorder.ended(robot, start.region, recorded, event)
        if not strayed:
            self.state.failures.arrived(robot.name)
            if step.planned:
                self.relocation.traffic.plan.arrived(robot.name)
        around = self._values_around(robot, start, step.before, strayed=strayed)
        robot.arriving, robot.asked = step.planned, False
        if not self.state.live:
            yield from self.actions.act(robot)
        robot.arriving = False
        self._count(robot, progress, around, strayed=strayed)
        if reaction is not None:
            yield from self._react(robot, reaction, violation, event)
        elif strayed:
            yield from self.relocation.go_on_from_elsewhere(robot)
        elif step.planned and not self.relocation.traffic.plan.active:
            yield from self.relocation.go_on(robot)

    def _values_around(
        self, robot: RobotState, start: Pose, before: Values, *, strayed: bool = False
    ) -> StepValues:
        """Return the variables of formulas before and after a step that has just ended, and update
        the formula memory. If it was not the strategy's step, they are the poses, inputs and
        memory, which changes by the formulas if these allow the step."""
        own, progress = robot.robot.objective, robot.progress
        if not isinstance(progress.objective, Ltl):
            return before, {}
        after: Values = robot.planner.values()
        if strayed or not (before and after):
            memory = later = robot.memory.values
            if isinstance(own, Ltl) and not own.memory.keys() <= memory.keys():
                return {}, {}  # no strategy yet: nothing to count
            then, now = self.state.inputs_before, self.state.inputs
            if isinstance(own, Ltl) and robot.pose != start:
                found = guarantees_of(own).remembered(memory, start, robot.pose, (then, now))
                later = found or memory
            before = {**values_of(start), **memory, **then}
            after = {**values_of(robot.pose), **later, **now}
        progress.remember(after)
        return before, after

    def _remembers_after(self, robot: RobotState, step: DecidedStep) -> Values:
        """Return the memory of a robot's formulas after a step that it begins."""
        own, memory = robot.robot.objective, robot.memory.values
        if not (isinstance(own, Ltl) and isinstance(robot.progress.objective, Ltl)):
            return memory
        chosen = robot.planner.values()
        if step.before and own.memory.keys() <= chosen.keys():
            return {name: chosen[name] for name in own.memory}
        if not own.memory.keys() <= memory.keys():
            return memory  # it has had no strategy yet
        inputs = self.state.inputs, self.state.inputs
        return guarantees_of(own).remembered(memory, robot.pose, step.pose, inputs) or memory

    def _count(
        self, robot: RobotState, progress: Progress, around: StepValues, *, strayed: bool = False
    ) -> None:
        """Count the goals that the robot met in its turn, unless its assignment has changed."""
        done = self.state.rounds_counted(robot)
        if not robot.begun:
            self.relocation.strategies.begin(robot)
        elif robot.progress is progress and not (strayed or self.state.has_had_turn(robot)):
            self.state.tell_goals(robot, progress.arrive(robot.pose.region, *around))
        self.state.changes += self.state.rounds_counted(robot) != done

    def _has_counted(self, robot: RobotState, around: StepValues) -> bool:
        """Live: whether a robot that meets all its goals by staying has met them as often as
        required. A pass takes no time, so counting every pass would fill the trace."""
        wanted = self.state.scenario.until.rounds if robot.progress is robot.own else 1
        enough = robot.begun and robot.progress.rounds >= wanted
        return enough and robot.progress.met_by_staying(robot.pose.region, *around)

    def _judge(
        self, robot: RobotState, start: Pose, pose: Pose, event: Ended
    ) -> tuple[Reaction | None, ForbiddenMove | None]:
        """Return the policy for a failed step (None: it did not fail), and the obstacle that counts
        as encountered."""
        region, obstacle = pose.region, None
        match event:
            case Elsewhere() if robot.pose.region != start.region and (
                robot.pose.region in self.state.had_by_others(robot.robot)
            ):
                return Reaction.OUT_OF_SERVICE, None  # it slid into another robot's region
            case Arrived() | Elsewhere():
                return None, None
            case Lost():
                return Reaction.OUT_OF_SERVICE, None
            case Blocked(obstacle=found) if found is None or self._stops(
                robot, found, self.world.at(event)
            ):
                reaction, obstacle = Reaction.OBSTACLE, found
            case _:
                fatal = isinstance(event, Failed) and event.fatal
                policy = self.state.scenario.failures
                reaction = self.state.failures.move_failed(policy, robot.name, region, fatal=fatal)
        if reaction is not Reaction.OBSTACLE or robot.pose.region != start.region:
            given_up = reaction is Reaction.OUT_OF_SERVICE
            return reaction if given_up else Reaction.RETRY, None
        violation = ForbiddenMove(
            robot.robot, start.region, region, obstacle or unknown(robot.robot, region)
        )
        self.recorder.encounter(robot, violation)
        return reaction, violation

    def _stops(self, robot: RobotState, obstacle: Obstacle, at: float) -> bool:
        """Whether an obstacle that a robot encountered stops it, and was not opened afterwards."""
        if self.state.failures.is_late(obstacle.name, at):
            self.recorder.late("blocked", "the obstacle was opened later", robot.name, obstacle, at)
            return False
        return self.state.knowledge.closed_to(obstacle, robot.robot)

    def _react(
        self, robot: RobotState, reaction: Reaction, violation: ForbiddenMove | None, event: Ended
    ) -> Iterator[Event]:
        """Apply a failed step: the robot is off its strategy; the region that it could not
        enter is an obstacle, or the robot is out of service."""
        robot.planner.node = None
        if violation is not None:
            yield from self.relocation.request_help(violation)
        elif reaction is Reaction.OUT_OF_SERVICE:
            why = f": {event.reason}" if isinstance(event, Failed | Lost) and event.reason else ""
            kind = "lost" if isinstance(event, Lost) else "its moves fail"
            self.state.failures.out[robot.name] = f"{kind}{why}"
            if isinstance(event, Lost):
                yield from self._lost(robot, event)
            yield from self.relocation.serve(robot, active=False, cause=ChangeCause.WORLD)
        else:
            yield from self.relocation.go_on_from_elsewhere(robot)

    def close_vacated(self, robot: RobotState) -> Iterator[Event]:
        """Close the regions of a lost robot that others have left."""
        for encountered in self.close(robot):
            yield from self.relocation.leave_plan(PlanEndReason.VIOLATION)
            yield encountered
            yield events.HelpRequested(encountered.violation)

    def _lost(self, robot: RobotState, event: Lost) -> Iterator[Event]:
        """Close all regions in which a lost robot may be, except its last one, which it blocks
        itself. If it may be in a zone that it does not block there, close the whole zone to the
        zone's other robots."""
        others = frozenset(other.name for other in self.state.in_conflict(robot.robot))
        here = robot.pose.region
        closed = dict.fromkeys(event.regions - {here}, others)
        for zone in self.state.scenario.never_together:
            if robot.name not in zone.robots or here in zone.regions:
                continue
            for region in zone.regions if zone.regions & event.regions else ():
                closed[region] = closed.get(region, frozenset()) | zone.robots - {robot.name}
        robot.claims = closed
        yield from self.relocation.leave_plan(PlanEndReason.VIOLATION)
        # The caller takes it out of service, which requests help, unless it already is.
        yield from self.close(robot) if robot.active else self.close_vacated(robot)

    def close(self, robot: RobotState) -> Iterator[events.ObstacleEncountered]:
        """Close the regions that a lost robot claims and in which no other robot is."""
        occupied = {n: each.occupied for n, each in self.state.robots.items() if each is not robot}
        for region, names in sorted(robot.claims.items()):
            if any(region in occupied[name] for name in names):
                continue
            robot.claims = {r: them for r, them in robot.claims.items() if r != region}
            obstacle = lost(robot.robot, names, region)
            violation = ForbiddenMove(robot.robot, robot.pose.region, region, obstacle)
            self.recorder.encounter(robot, violation)
            yield events.ObstacleEncountered(violation)
