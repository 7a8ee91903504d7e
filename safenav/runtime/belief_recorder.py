"""Records in the trace what robots newly observe or believe about each other."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.runtime.team import RobotState, TeamState
from safenav.spec.other_robots.belief import watch_for
from safenav.spec.other_robots.knowledge import Knowledge
from safenav.spec.task import Task
from safenav.trace import records


class BeliefRecorder:
    """Remembers the last record of each robot about each other robot."""

    def __init__(self, state: TeamState) -> None:
        self._state = state
        self._looked: tuple[Task, Mapping[str, Knowledge]] | None = None
        self._told: dict[tuple[str, str], Knowledge] = {}

    def looked(self, task: Task, known: Mapping[str, Knowledge]) -> None:
        """A robot has looked, with this result."""
        self._looked = (task, known)

    def tell(self, robot: RobotState) -> None:
        """Emit what is new of the last look, after the move that it led to."""
        if self._looked is None:
            return
        task, knowledge = self._looked
        self._looked = None
        for other, known in knowledge.items():
            if self._told.get((robot.name, other)) == known:
                continue
            self._told[robot.name, other] = known
            seen = isinstance(known, int)
            regions = (
                frozenset({known})
                if isinstance(known, int)
                else watch_for(task, self._state.scenario.map).possible(known)
            )
            self._state.emit(records.Belief(self._state.tick, robot.name, other, seen, regions))
