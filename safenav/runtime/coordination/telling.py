"""How robots are told what to do: one protocol, two ways (paper, Section V-D)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from safenav.runtime.coordination.asking import Answer, Attempt
from safenav.runtime.coordination.ladder import Errand
from safenav.runtime.team import RobotState
from safenav.trace import vocabulary


class Telling(Protocol):
    """Duties, plans and outcomes are the same either way; only the telling differs."""

    def attempt(self, errands: Mapping[str, Errand], *, always: bool = False) -> Attempt:
        """Strategies for the robots whose present one does not do (``always``: for all)."""
        ...

    def install(
        self, attempt: Attempt, errands: Mapping[str, Errand], reason: vocabulary.Reason
    ) -> None:
        """Put errands in force, with the strategies that were found for them."""
        ...

    def announce(self, answer: Answer, reason: vocabulary.Reason) -> None:
        """Tell of a synthesis that was not installed."""
        ...

    def signal(self, robot: RobotState) -> dict[str, int]:
        """What a robot's strategy is told by its inputs now."""
        ...
