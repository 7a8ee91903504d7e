"""A run as tables: moves, events and syntheses, one CSV file each."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

from safenav.report.replay.timeline import Replay, StoryKind
from safenav.trace import records
from safenav.trace.trace import Trace

Row = Iterable[object]


def tables(trace: Trace, replay: Replay) -> dict[str, str]:
    """Return the name of each table and its CSV text (RFC 4180, one heading line)."""
    return {
        "moves": _csv(("tick", "robot", "region", "row", "col", "name", "heading"), _moves(replay)),
        "events": _csv(("tick", "kind", "robot", "region", "obstacle", "text"), _events(replay)),
        "syntheses": _csv(
            ("tick", "robot", "reason", "verdict", "seconds", "states", "cached", "verified"),
            _syntheses(trace),
        ),
    }


def _moves(replay: Replay) -> Iterable[Row]:
    names = {region: name for name, region in reversed([*replay.map.names.items()])}
    for tick in range(replay.last + 1):
        for track in replay.robots:
            region, heading = track.regions[tick], track.headings[tick]
            row, col = replay.map.position(region)
            facing = None if heading is None else heading.label
            yield tick, track.name, region, row, col, names.get(region), facing


def _events(replay: Replay) -> Iterable[Row]:
    for e in replay.events:
        if e.kind is not StoryKind.SYNTHESIS:
            yield e.tick, e.kind.value, e.robot, e.region, e.obstacle, e.text


def _syntheses(trace: Trace) -> Iterable[Row]:
    for line in trace.records:
        if isinstance(line, records.Synthesis):
            yield (
                line.tick,
                line.robot,
                line.reason.value,
                line.verdict.value,
                line.seconds,
                line.states,
                line.cached,
                line.verified,
            )


def _csv(headings: Row, rows: Iterable[Row]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(headings)
    writer.writerows(rows)
    return text.getvalue()
