"""Progress of a robot with its objective: the only definition of counting goals."""

from __future__ import annotations

from dataclasses import dataclass, replace

from safenav.judge.lines import Objective


@dataclass(unsafe_hash=True)
class Progress:
    """Progress of a robot with its own objective since the last resolution. ``goals``: the number
    of goals met in turn, or of rounds of goals in any order; ``turn``: the next target (None: the
    first); ``seen``: a bit mask of the goals met in a round in any order; ``stayed``: ticks at the
    last target; ``since``: without goals, the tick after which each tick counts."""

    goals: int = 0
    turn: int | None = None
    seen: int = 0
    stayed: int = 0
    since: int = 0

    def rounds(self, own: Objective, tick: int) -> int:
        """Return how often the robot has completed its objective."""
        if own.settles:
            return self.stayed
        if not own.count:
            return tick - self.since
        return int(self.goals // own.count) if own.ordered else self.goals

    def after(self, own: Objective, goal: int) -> Progress:
        """Return the progress after a goal is met. It is unchanged if the goal is out of turn."""
        if not own.ordered:
            seen = self.seen | 1 << goal
            whole = seen + 1 == 1 << own.count
            return replace(self, goals=self.goals + whole, seen=0 if whole else seen)
        if goal != (self.turn or 0) and not (own.strict and not self.goals):
            return self
        turn = goal + 1 if own.ends else (goal + 1) % own.count
        return replace(self, goals=self.goals + 1, turn=turn)

    def ended(self, own: Objective) -> bool:
        return own.ends and self.turn == own.count

    def begun(self, own: Objective, first: int, region: int) -> Progress:
        """Return the progress of a robot in ``region`` that continues with the target ``first``. A
        patrol loses its incomplete round if its next target was another one."""
        if not own.strict or self.turn is None:
            return self
        first = min(first, own.count - 1)
        if self.turn in (first, (first + (region in own.targets[first])) % own.count):
            return self
        return Progress(self.goals - self.goals % own.count, turn=first)

    def anew(self) -> Progress:
        """Return the progress with zero completed rounds and the same next target."""
        return Progress(turn=self.turn)
