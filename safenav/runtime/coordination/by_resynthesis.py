"""Telling by resynthesis: a robot that is to do something else gets a new strategy for it."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.dataclass import dataclass
from safenav.runtime.coordination.asking import Answer, Asking, Attempt
from safenav.runtime.coordination.ladder import Errand
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.team import RobotState
from safenav.trace import vocabulary


@dataclass(frozen=True)
class ByResynthesis:
    """Changes what robots do by new specifications and new strategies."""

    asking: Asking
    strategies: Strategies

    def attempt(self, errands: Mapping[str, Errand], *, always: bool = False) -> Attempt:
        return self.asking.attempt(self.strategies.stale(errands, always=always))

    def install(
        self, attempt: Attempt, errands: Mapping[str, Errand], reason: vocabulary.Reason
    ) -> None:
        self.strategies.install_all(attempt, errands, reason)

    def announce(self, answer: Answer, reason: vocabulary.Reason) -> None:
        self.strategies.announce(answer, reason)

    def signal(self, robot: RobotState) -> dict[str, int]:
        """Nothing: everything that a robot is told stands in its specification."""
        del robot
        return {}
