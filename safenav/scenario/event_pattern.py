"""Patterns of events, as expectations write them: ``resolved door@47``, ``goal quad 58``."""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from safenav.world.map import Region


class EventKind(StrEnum):
    """Events that a pattern can name: line types of the trace (docs/trace.md)."""

    SYNTHESIS = "synthesis"
    VIOLATION = "violation"
    BACKTRACK = "backtrack"
    REQUEST = "request"
    PUSH = "push"
    POP = "pop"
    TOLD = "told"
    MET = "met"
    RESOLVED = "resolved"
    BLOCKED = "blocked"
    GOAL = "goal"
    ASSUMPTION = "assumption"
    APPEARED = "appeared"
    GONE = "gone"
    PLAN = "plan"


class EventPattern(Struct, frozen=True):
    """Matches the events of a kind that involve all these robots, this obstacle and one of these
    regions; None and the empty set match any."""

    kind: EventKind
    robots: frozenset[str] = frozenset()
    obstacle: str | None = None
    regions: frozenset[Region] = frozenset()

    def __str__(self) -> str:
        words = [self.kind.value, *sorted(self.robots)]
        if self.obstacle is not None:
            words.append(self.obstacle)
        if self.regions:
            words.append("|".join(map(str, sorted(self.regions))))
        return " ".join(words)
