"""The seconds of each robot with and without a command, as the lines of a live run show them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from safenav.trace import records


class CommandTimes:
    """Sums of the durations of commands: a listener to records. A command counts when its end is
    recorded; the run may end before that in the same moment."""

    def __init__(self) -> None:
        self._begun: dict[str, float] = {}
        self._busy: dict[str, float] = {}
        self._over = 0.0

    def __call__(self, record: records.Record) -> None:
        """Process records of commands that begin or end."""
        match record:
            case records.Depart() | records.Act():
                self._begun[record.robot] = record.t or 0.0
            case records.Arrive() | records.ActionEnd():
                self._over, name = record.t or 0.0, record.robot
                took = self._over - self._begun.pop(name, self._over)
                self._busy[name] = self._busy.get(name, 0.0) + took
            case _:
                pass

    def fields(self, robots: Iterable[str]) -> dict[str, Any]:
        """The fields of the outcome: the time at which the last command ended, and the seconds of
        each robot with and without one until then."""
        over, busy = self._over, {name: self._busy.get(name, 0.0) for name in robots}
        waiting = {name: max(0.0, over - seconds) for name, seconds in busy.items()}
        return {"makespan": over, "busy": busy, "waiting": waiting}
