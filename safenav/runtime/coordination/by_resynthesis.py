"""Telling by resynthesis: a robot that is to do something else gets a new strategy for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from safenav.runtime.coordination.strategies import Answer, Attempt, Errand, Strategies
from safenav.runtime.team import RobotState, TeamState
from safenav.trace import vocabulary


@dataclass(frozen=True)
class ByResynthesis:
    """Changes what robots do by new specifications and new strategies."""

    state: TeamState
    strategies: Strategies

    def attempt(self, errands: Mapping[str, Errand], *, always: bool = False) -> Attempt:
        stale = {
            name: errand
            for name, errand in errands.items()
            if always or self.strategies.outdated(name, errand)
        }
        return self.strategies.attempt(stale)

    def install(
        self, attempt: Attempt, errands: Mapping[str, Errand], reason: vocabulary.Reason
    ) -> None:
        """All assignments first, so that each line of the trace is true when it is written."""
        for name, errand in errands.items():
            self.state.robots[name].assign(errand.assignment)
        for answer in attempt.answers.values():
            self.strategies.install(answer, reason)
        for robot in self.state.robots.values():
            if not robot.begun and robot.transit is None:
                self.strategies.begin(robot)

    def announce(self, answer: Answer, reason: vocabulary.Reason) -> None:
        self.strategies.announce(answer, reason)

    def signal(self, robot: RobotState) -> dict[str, int]:
        """Nothing: everything that a robot is told stands in its specification."""
        del robot
        return {}
