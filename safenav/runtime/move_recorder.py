"""The trace lines of a turn: the move, the obstacle that stopped it, the needs that it met, what a
strategy did not know."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.runtime.belief_recorder import BeliefRecorder
from safenav.runtime.characterization import Violation
from safenav.runtime.knowledge import Met
from safenav.runtime.team import RobotState, TeamState
from safenav.trace import records, vocabulary
from safenav.trace.header import heading_in_trace
from safenav.world.map import Region


class MoveRecorder:
    """Emits the lines of turns; remembers the signal that each robot's moves recorded last."""

    def __init__(self, state: TeamState, sightings: BeliefRecorder) -> None:
        self._state = state
        self._sightings = sightings
        self._signals: dict[str, records.Signal | None] = {}

    def move(
        self,
        robot: RobotState,
        start: Region,
        by: vocabulary.MovedBy | None,
        shown: frozenset[Region] = frozenset(),
    ) -> None:
        """Record the move of this tick: towards the target while in transit, then to it.
        ``shown``: regions that were shown to the strategy as occupied although no robot is there.
        """
        transit = robot.transit
        now = robot.pose
        signal = self._signal(robot)
        self._state.emit(
            records.Move(
                self._state.tick,
                robot.name,
                start,
                now.region,
                heading_in_trace(now),
                transit.pose.region if transit is not None else None,
                by,
                signal,
                tuple(sorted(shown)) or None,
            )
        )
        self._sightings.tell(robot)

    def _signal(self, robot: RobotState) -> records.Signal | None:
        """Return the command inputs of an assignable strategy if they have changed, else None."""
        planner = robot.planner
        if planner is None or planner.switch is None or planner.node is None:
            return None
        values = planner.values()
        told = records.Signal(bool(values["request"]), values["assigned"], bool(values["wait"]))
        if self._signals.get(robot.name) == told:
            return None
        self._signals[robot.name] = told
        return told

    def violation(self, robot: RobotState, violation: Violation) -> None:
        """Record the obstacle that the robot must not enter, and the action of its next need."""
        obstacle = violation.obstacle
        self._state.introduce(obstacle)
        action = obstacle.needs[self._state.knowledge.need_of(obstacle)].action
        self._state.emit(
            records.Violation(
                self._state.tick,
                robot.name,
                violation.at,
                violation.proposed,
                obstacle.name,
                action,
            )
        )

    def met(self, robot: RobotState, met: Met) -> None:
        """``robot`` has met one of the needs of an obstacle, with others or alone."""
        self._state.emit(
            records.Met(
                self._state.tick,
                met.obstacle.name,
                met.need,
                met.obstacle.needs[met.need].action,
                robot.name,
                robot.pose.region,
                robots=met.group if len(met.group) > 1 else None,
            )
        )

    def no_answer(self, robot: RobotState, observed: Mapping[str, int]) -> None:
        """Record that the strategy has no successor, and no single violated assumption is the
        reason: its inputs cannot represent the observation."""
        where = ", ".join(f"{name} = {value}" for name, value in observed.items())
        name = f"movement of the other robots (observed: {where})"
        self._state.emit(records.Assumption(self._state.tick, robot.name, name))
