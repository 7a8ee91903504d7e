"""A run as its world and its operator see it."""

from __future__ import annotations

from typing import Protocol

from safenav.runtime.control.answers import Answers
from safenav.runtime.control.coordinate import Control
from safenav.team.state import State
from safenav.team.team import Team


class Running(Protocol):
    """The run to which events are reported, as it is at this moment."""

    @property
    def team(self) -> Team: ...
    @property
    def state(self) -> State: ...
    @property
    def control(self) -> Control: ...
    @property
    def answers(self) -> Answers: ...
    def waits(self) -> bool: ...
    def until(self) -> float | None: ...
