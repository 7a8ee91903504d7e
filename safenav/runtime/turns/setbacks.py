"""Failed steps: the robot tries again, reports an obstacle, or is out of service."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination import events
from safenav.runtime.coordination.events import Event
from safenav.runtime.failures import Reaction, lost, unknown
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.turns.move_recorder import MoveRecorder
from safenav.runtime.turns.relocation import Relocation
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.protocol import Arrived, Blocked, Elsewhere, Ended, Failed, Lost
from safenav.scenario.model import Obstacle
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause, PlanEndReason
from safenav.world.moves import Pose


class Setbacks(Struct, frozen=True):
    """Decides what a failed step means, and applies it."""

    state: TeamState
    world: Commands
    tell: MoveRecorder
    relocation: Relocation

    def judge(
        self, robot: RobotState, start: Pose, pose: Pose, event: Ended
    ) -> tuple[Reaction | None, ForbiddenMove | None]:
        """Return the policy for a failed step (None: it did not fail), and the obstacle that counts
        as encountered."""
        region, obstacle = pose.region, None
        match event:
            case Elsewhere() if robot.pose.region in self.state.taken(robot.robot):
                return Reaction.OUT_OF_SERVICE, None  # it slid to where another robot is
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
        self.encounter(robot, violation)
        return reaction, violation

    def _stops(self, robot: RobotState, obstacle: Obstacle, at: float) -> bool:
        """Whether an obstacle that a robot has met stops it, and was not opened after that."""
        if self.state.failures.is_late(obstacle.name, at):
            self.tell.late("blocked", "the obstacle was opened later", robot.name, obstacle, at)
            return False
        return self.state.knowledge.closed_to(obstacle, robot.robot)

    def encounter(self, robot: RobotState, violation: ForbiddenMove) -> None:
        """Record an obstacle that keeps a robot where it is."""
        self.tell.violation(robot, violation)
        self.state.emit(records.Backtrack(self.state.tick, robot.name, robot.pose.region))

    def react(
        self, robot: RobotState, reaction: Reaction, violation: ForbiddenMove | None, event: Ended
    ) -> Iterator[Event]:
        """Apply a failed step: the robot is off its strategy; the region that it could not
        enter is an obstacle, or the robot is out of service."""
        robot.planner.node = None
        if violation is not None:
            yield from self.relocation.leave_plan(PlanEndReason.VIOLATION)
            yield events.ObstacleEncountered(violation)
            yield events.HelpRequested(violation)
        elif reaction is Reaction.OUT_OF_SERVICE:
            if isinstance(event, Lost):
                yield from self._lost(robot, event)
            yield from self.relocation.serve(robot, active=False, cause=ChangeCause.WORLD)
        else:
            yield from self.relocation.go_on_from_elsewhere(robot)

    def _lost(self, robot: RobotState, event: Lost) -> Iterator[Event]:
        """Close all regions but one in which a lost robot may be: it blocks that one itself. Where
        it may be in a zone that it does not hold by that, close all of this to the others."""
        rivals = frozenset(other.name for other in self.state.rivals(robot.robot))
        yield from self.relocation.leave_plan(PlanEndReason.VIOLATION)
        here, at = robot.pose.region, {n: each.occupied for n, each in self.state.robots.items()}
        free = event.regions - {here} - self.state.taken(robot.robot)
        closed = dict.fromkeys(free, rivals)
        for zone in self.state.scenario.never_together:
            if robot.name not in zone.robots or here in zone.regions:
                continue
            others = zone.robots - {robot.name}
            standing = frozenset().union(*(at[name] for name in others))
            for region in zone.regions - standing if zone.regions & event.regions else ():
                closed[region] = closed.get(region, frozenset()) | others
        for region in sorted(closed):
            obstacle = lost(robot.robot, closed[region], region)
            violation = ForbiddenMove(robot.robot, robot.pose.region, region, obstacle)
            self.encounter(robot, violation)
            yield events.ObstacleEncountered(violation)
