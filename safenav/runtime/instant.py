"""The passes of a live run at one moment of its clock, so that no run decides without end."""

from __future__ import annotations

from msgspec import Struct, field

from safenav.trace import records
from safenav.trace.words import counted, listed

MOST_PASSES = 500, 50
"""The most passes at one moment in which no further round is counted, and more for each robot."""


class Instant(Struct):
    """A moment of a run; a listener. ``rounds``: the most that were counted; ``lines``: kinds of
    the lines of each robot that decides again."""

    time: float = -1.0
    rounds: int = 0
    passes: int = 0
    lines: dict[str, list[str]] = field(default_factory=dict)

    def __call__(self, record: records.Record) -> None:
        name = getattr(record, "robot", None)
        if name is not None and self.passes > 1:
            found, kind = self.lines.setdefault(name, []), type(record).__struct_config__.tag
            if kind not in found:
                found.append(str(kind))

    def livelock(self, time: float, rounds: int, robots: int) -> str:
        """Count a pass. Return who decides without end, and what; an empty text below the limit."""
        if time != self.time or rounds > self.rounds:
            self.time, self.rounds, self.passes = time, rounds, 0
            self.lines.clear()
        self.passes += 1
        most, each = MOST_PASSES
        if self.passes <= most + each * robots:
            return ""
        who = [f"{name} ({', '.join(kinds)})" for name, kinds in self.lines.items()]
        passes, self.passes = self.passes, 0  # an operator may help
        return (
            f"no time passes in {counted(passes, 'pass', 'passes')} of {listed(who) or 'the team'}"
        )
