"""A whole trace, as it was read."""

from __future__ import annotations

from msgspec import Struct

from safenav.trace.records import (
    Act,
    ActionEnd,
    Arrive,
    Depart,
    Discovered,
    End,
    Header,
    Record,
)
from safenav.trace.setting import ObstacleHeader


class Trace(Struct, frozen=True):
    """A whole trace. ``cut_off``: its last line was incomplete (the writer was killed).
    ``ignored`` counts the lines of types that this version does not know; ``digest``: sha256 of
    its file."""

    source: str
    header: Header
    records: tuple[Record, ...]
    cut_off: bool
    ignored: int
    digest: str = ""

    @property
    def outcome(self) -> End | None:
        """The end of the run, or None if the trace does not record it."""
        return next((r for r in reversed(self.records) if isinstance(r, End)), None)

    @property
    def obstacles(self) -> dict[str, ObstacleHeader]:
        """Return all obstacles by name: those of the header, and those discovered later."""
        found = [r.obstacle for r in self.records if isinstance(r, Discovered)]
        return {o.name: o for o in (*self.header.scenario.obstacles, *found)}

    @property
    def steps(self) -> list[tuple[Depart, Arrive | None]]:
        """The steps of a live run, each with its end: None if it was under way when the run
        ended."""
        ends = {r.command: r for r in self.records if isinstance(r, Arrive)}
        return [(r, ends.get(r.command)) for r in self.records if isinstance(r, Depart)]

    @property
    def acts(self) -> list[tuple[Act, ActionEnd | None]]:
        """The actions of a live run, likewise."""
        ends = {r.command: r for r in self.records if isinstance(r, ActionEnd)}
        return [(r, ends.get(r.command)) for r in self.records if isinstance(r, Act)]
