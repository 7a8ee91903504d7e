"""The trace lines of a turn: moves, obstacles that stopped them, needs fulfilled, observations that
no strategy input represents."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.knowledge import NeedMet
from safenav.runtime.team import DecidedStep, RobotState, TeamState
from safenav.runtime.worlds.protocol import Arrived, Blocked, Elsewhere, Ended, Failed, Lost
from safenav.scenario.model import Obstacle
from safenav.spec.other_robots.belief import watch_for
from safenav.spec.other_robots.knowledge import Knowledge
from safenav.spec.task import Task
from safenav.trace import records, vocabulary
from safenav.world.map import Region

_HOLDS = {
    vocabulary.MovedBy.STRATEGY: vocabulary.HoldReason.STRATEGY,
    vocabulary.MovedBy.PLAN: vocabulary.HoldReason.PLAN,
}


class MoveRecorder:
    """Emits the lines of turns; remembers each robot's last recorded signal and beliefs."""

    def __init__(self, state: TeamState) -> None:
        self._state = state
        self._looked: tuple[Task, Mapping[str, Knowledge]] | None = None
        self._told: dict[tuple[str, str], Knowledge] = {}
        self._signals: dict[str, records.Signal | None] = {}
        self._holds: dict[str, tuple[vocabulary.HoldReason, tuple[Region, ...] | None]] = {}

    def begun(
        self,
        robot: RobotState,
        step: DecidedStep | None,
        command: int = 0,
        seconds: float | None = None,
    ) -> None:
        """Record that a robot is in transit. ``step``: None in its later ticks. ``seconds``: its
        expected duration."""
        transit = robot.transit
        assert transit is not None
        if not self._state.live:
            self._move(robot, robot.pose.region, step, transit.pose.region)
            return
        self._holds.pop(robot.name, None)
        if step is not None:
            node = robot.planner.node if step.by is vocabulary.MovedBy.STRATEGY else None
            way = robot.pose.region, *transit.pose.place
            told = tuple(sorted(step.shown)) or None, self._signal(robot)
            expected = None if seconds is None else round(seconds, 3)
            who = self._state.tick, command, robot.name
            self._state.emit(records.Depart(*who, *way, step.by, node, *told, expected))
        self._beliefs(robot)

    def ended(
        self, robot: RobotState, start: Region, step: DecidedStep | None, event: Ended
    ) -> None:
        """Record the end of a step, which began at ``start``. ``step``: None if its strategy began
        it in an earlier tick."""
        if not self._state.live:
            strayed = vocabulary.MoveEnd.ELSEWHERE if isinstance(event, Elsewhere) else None
            self._move(robot, start, step, result=strayed)
            return
        result, reason, regions = vocabulary.MoveEnd.ARRIVED, None, None
        match event:
            case Arrived():
                reason = event.reason or None
            case Elsewhere():
                result = vocabulary.MoveEnd.ELSEWHERE
            case Blocked():
                result = vocabulary.MoveEnd.BLOCKED
            case Failed():
                result, reason = vocabulary.MoveEnd.FAILED, event.reason
            case Lost(regions=found):
                result, regions = vocabulary.MoveEnd.LOST, tuple(sorted(found))
                reason = event.reason or None
        who = self._state.tick, event.command or 0, robot.name
        self._state.emit(records.Arrive(*who, *robot.pose.place, result, reason, regions))
        self._beliefs(robot)

    def stays(self, robot: RobotState, step: DecidedStep) -> None:
        """Live: record that a robot stays where it is."""
        why = step.why or _HOLDS.get(step.by, vocabulary.HoldReason.HELD)
        signal = self._signal(robot)
        told = why, tuple(sorted(step.shown)) or None
        if signal is not None or self._holds.get(robot.name) != told:
            self._holds[robot.name] = told
            self._state.emit(records.Held(self._state.tick, robot.name, why, signal, told[1]))
        self._beliefs(robot)

    def looked(self, task: Task, known: Mapping[str, Knowledge]) -> None:
        """Keep the result of a robot's look, to be recorded after its move."""
        self._looked = (task, known)

    def _beliefs(self, robot: RobotState) -> None:
        """Record the beliefs that the last look changed, after the resulting move."""
        if self._looked is None:
            return
        (task, knowledge), self._looked = self._looked, None
        for other, known in knowledge.items():
            if self._told.get((robot.name, other)) == known:
                continue
            self._told[robot.name, other] = known
            regions = frozenset({known}) if isinstance(known, int) else None
            if regions is None:
                regions = watch_for(task, self._state.scenario.map).possible(known)
            seen = isinstance(known, int)
            self._state.emit(records.Belief(self._state.tick, robot.name, other, seen, regions))

    def _move(
        self,
        robot: RobotState,
        start: Region,
        step: DecidedStep | None,
        toward: Region | None = None,
        result: vocabulary.MoveEnd | None = None,
    ) -> None:
        """The line of a robot's turn in a tick."""
        by, shown = (None, None) if step is None else (step.by, tuple(sorted(step.shown)) or None)
        way = start, *robot.pose.place, toward
        self._state.emit(
            records.Move(self._state.tick, robot.name, *way, by, self._signal(robot), shown, result)
        )
        self._beliefs(robot)

    def _signal(self, robot: RobotState) -> records.Signal | None:
        """Return the command inputs of an assignable strategy if they have changed, else None."""
        planner = robot.planner
        if planner.switch is None or planner.node is None:
            return None
        values = planner.values()
        told = records.Signal(bool(values["request"]), values["assigned"], bool(values["wait"]))
        if self._signals.get(robot.name) == told:
            return None
        self._signals[robot.name] = told
        return told

    def violation(self, robot: RobotState, violation: ForbiddenMove) -> None:
        """Record the obstacle that the robot must not enter, and the action of its next need."""
        obstacle = violation.obstacle
        self._state.introduce(obstacle)
        action = obstacle.needs[self._state.knowledge.need_of(obstacle)].action
        way = violation.at, violation.proposed
        self._state.emit(
            records.Violation(self._state.tick, robot.name, *way, obstacle.name, action)
        )

    def encounter(self, robot: RobotState, violation: ForbiddenMove) -> None:
        """Record an obstacle that keeps a robot where it is."""
        self.violation(robot, violation)
        self._state.emit(records.Backtrack(self._state.tick, robot.name, robot.pose.region))

    def late(
        self,
        event: str,
        reason: str,
        robot: str | None,
        obstacle: Obstacle | None,
        at: float | None,
    ) -> None:
        """Record a report of the world, or an intervention, that is dropped."""
        name = None if obstacle is None else obstacle.name
        at = None if at is None else round(max(at, 0.0), 9)
        self._state.emit(records.Late(self._state.tick, event, reason, robot, name, at=at))

    def met(self, robot: RobotState, met: NeedMet) -> None:
        """Record that ``robot`` has fulfilled a need of an obstacle, alone or with others."""
        need = met.obstacle.name, met.need, met.obstacle.needs[met.need].action
        group = met.group if len(met.group) > 1 else None
        who = robot.name, robot.pose.region, group
        self._state.emit(records.Met(self._state.tick, *need, *who))

    def no_answer(self, robot: RobotState, observed: Mapping[str, int]) -> None:
        """Record that the strategy has no successor although no single assumption is violated: its
        inputs cannot represent the observation."""
        where = ", ".join(f"{name} = {value}" for name, value in observed.items())
        name = f"movement of the other robots (observed: {where})"
        self._state.emit(records.Assumption(self._state.tick, robot.name, name))
