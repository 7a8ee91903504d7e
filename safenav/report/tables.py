"""A run as tables: moves, events and syntheses, one CSV file each.

Times are ticks, or seconds where the run has a clock."""

from __future__ import annotations

from collections.abc import Iterable

from safenav.lines import csv_text
from safenav.report.replay.timeline import Replay, StoryKind
from safenav.trace import records
from safenav.trace.reading import Trace

Row = Iterable[object]


def tables(trace: Trace, replay: Replay) -> dict[str, str]:
    """Return the CSV text (RFC 4180, one heading line) of each table by its name."""
    when = "tick" if replay.times is None else "t"
    return {
        "moves": csv_text(
            (when, "robot", "region", "row", "col", "name", "heading"), _moves(replay)
        ),
        "events": csv_text((when, "kind", "robot", "region", "obstacle", "text"), _events(replay)),
        "syntheses": csv_text(
            (when, "robot", "reason", "verdict", "seconds", "states", "cached", "verified"),
            _syntheses(trace),
        ),
    }


def _moves(replay: Replay) -> Iterable[Row]:
    for tick in range(replay.last + 1):
        for track in replay.robots:
            region, heading = track.regions[tick], track.headings[tick]
            row, col = replay.map.position(region)
            facing = None if heading is None else heading.label
            name = replay.map.named.get(region)
            yield _when(replay, tick), track.name, region, row, col, name, facing


def _events(replay: Replay) -> Iterable[Row]:
    for e in replay.events:
        if e.kind is not StoryKind.SYNTHESIS:
            yield _when(replay, e.tick), e.kind.value, e.robot, e.region, e.obstacle, e.text


def _syntheses(trace: Trace) -> Iterable[Row]:
    for line in trace.records:
        if isinstance(line, records.Synthesis):
            yield (
                line.tick if line.t is None else line.t,
                line.robot,
                line.reason.value,
                line.verdict.value,
                line.seconds,
                line.states,
                line.cached,
                line.verified,
            )


def _when(replay: Replay, tick: int) -> float:
    return tick if replay.times is None else replay.times[tick]
