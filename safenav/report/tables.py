"""A run as tables: moves, events and syntheses, one CSV file each.

Times are ticks, or seconds where the run has a clock."""

from __future__ import annotations

from collections.abc import Iterable

from safenav.lines import csv_text
from safenav.run.run import Run
from safenav.run.values import StoryKind

Row = Iterable[object]


def tables(run: Run) -> dict[str, str]:
    """Return the CSV text (RFC 4180, one heading line) of each table by its name."""
    when = run.clock.column
    moves = (when, "robot", "region", "row", "col", "name", "heading")
    events = (when, "kind", "robot", "region", "obstacle", "text")
    results = ("robot", "reason", "verdict", "seconds", "states", "cached", "verified")
    return {
        "moves": csv_text(moves, _moves(run)),
        "events": csv_text(events, _events(run)),
        "syntheses": csv_text(
            (when, *results),
            ((each.time, *(getattr(each, key) for key in results)) for each in run.syntheses),
        ),
    }


def _moves(run: Run) -> Iterable[Row]:
    for tick in range(run.last + 1):
        for track in run.robots:
            region, heading = track.regions[tick], track.headings[tick]
            row, col = run.map.position(region)
            facing = None if heading is None else heading.label
            yield run.time(tick), track.name, region, row, col, run.map.named.get(region), facing


def _events(run: Run) -> Iterable[Row]:
    for e in run.told:
        if e.kind is not StoryKind.SYNTHESIS:
            yield run.time(e.tick), e.kind.value, e.robot, e.region, e.obstacle, e.told
