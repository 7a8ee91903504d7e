"""A limit on the passes of a live run at one moment of its clock."""

from __future__ import annotations

from msgspec import Struct, field

from safenav.trace import records
from safenav.trace.words import counted, listed

MOST_PASSES = 500, 50
"""The most passes at one moment without another round: in all, plus per robot."""


class Instant(Struct):
    """One moment of a run; a trace listener. ``rounds``: the most counted so far; ``lines``: the
    kinds of each robot's trace lines after the first pass."""

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
        """Count a pass. Return the robots that decide endlessly, with the kinds of their lines;
        empty below the limit."""
        if time != self.time or rounds > self.rounds:
            self.time, self.rounds, self.passes = time, rounds, 0
            self.lines.clear()
        self.passes += 1
        most, each = MOST_PASSES
        if self.passes <= most + each * robots:
            return ""
        who = [f"{name} ({', '.join(kinds)})" for name, kinds in self.lines.items()]
        passes, self.passes = self.passes, 0  # restart, as an operator may help
        return (
            f"no time passes in {counted(passes, 'pass', 'passes')} of {listed(who) or 'the team'}"
        )
