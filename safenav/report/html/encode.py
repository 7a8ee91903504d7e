"""A replay as the compact data that the page carries (its types: front/src/run.ts).

Values that change now and then are lists of [tick, value...]; ways are lists of regions and a
letter for each heading: a thousand ticks of a robot take about five kilobytes.
"""

from __future__ import annotations

from typing import Any

from safenav.report.picture_glyphs import EVENT_MARKS, NOSE, STATUS_MARKS, looks
from safenav.report.replay import Changes, Replay, Track
from safenav.report.replay_wording import objective_words, seconds_words
from safenav.scenario.objective import Objective, targets_of


def encoded(replay: Replay, source: str) -> dict[str, Any]:
    """The data of the page. ``source`` is the name of the trace, for its reader."""
    ending = replay.ending
    index = {track.name: i for i, track in enumerate(replay.robots)}
    style = looks([track.name for track in replay.robots])
    return {
        "name": replay.name,
        "source": source,
        "version": replay.version,
        "rows": replay.map.rows,
        "cols": replay.map.cols,
        "grid": replay.map.grid_rows(),
        "last": replay.last,
        "robots": [
            {**_robot(replay, track), "look": vars(look)}
            for track, look in zip(replay.robots, style, strict=True)
        ],
        "obstacles": [
            {
                "name": hidden.name,
                "type": hidden.type,
                "region": hidden.region,
                "action": hidden.action,
                "blocks": hidden.blocks,
                "status": _changes(replay.statuses[hidden.name], lambda status: [status.value]),
            }
            for hidden in replay.hidden
        ],
        "stack": _changes(
            replay.stack, lambda frames: [[[f.about, f.requester, f.helper] for f in frames]]
        ),
        "events": [
            [
                event.tick,
                event.kind.value,
                event.text,
                index.get(event.robot or "", -1),
                -1 if event.region is None else event.region,
            ]
            for event in replay.events
        ],
        "ending": ending
        and {
            "outcome": ending.outcome,
            "explanation": ending.explanation,
            "seconds": seconds_words(ending.seconds),
            "syntheses": ending.syntheses,
            "synthesisSeconds": seconds_words(ending.synthesis_seconds),
        },
        "nose": NOSE,
        "marks": {
            "status": {
                status.value: {"path": mark.path, "meaning": status.meaning}
                for status, mark in STATUS_MARKS.items()
            },
            "event": {kind.value: mark.path for kind, mark in EVENT_MARKS.items()},
        },
    }


def _robot(replay: Replay, track: Track) -> dict[str, Any]:
    facing = [heading.name[0] for heading in track.headings if heading is not None]
    progress = replay.progress[track.name]
    return {
        "name": track.name,
        "model": track.model,
        "layer": track.layer,
        "can": track.capabilities,
        "path": track.regions,
        "headings": "".join(facing) if len(facing) == len(track.regions) else None,
        "tasks": _changes(replay.objectives[track.name], _task),
        "progress": _changes(
            progress, lambda p: [p.rounds, -1 if p.reached is None else p.reached]
        ),
    }


def _task(objective: Objective | None) -> list[Any]:
    targets = targets_of(objective) if objective is not None else ()
    return [objective_words(objective), sorted(set().union(*targets))]


def _changes(changes: Changes[Any], value: Any) -> list[list[Any]]:
    pairs = zip(changes.ticks, changes.values, strict=True)
    return [[max(0, tick), *value(held)] for tick, held in pairs]
