"""Replays as self-contained HTML files with style, program and run. They need no network.

The program is built from ``front/`` (TypeScript, Preact, esbuild) and committed, since users of
safenav have no Node. A content security policy in the page forbids every request.

The run is compact data (its types: front/src/run/run.ts). Values over time are lists of [tick,
value...]; paths are lists of regions and a letter for each heading. A thousand ticks of a robot
take about five kilobytes. Only ``_Rows`` writes the parts that grow during a run: all entries, or
those since a tick, which replace those of a page (front/src/live/player.ts). A set of regions is
written once, as runs of consecutive regions: the gap before each run and its length, as in
``14,3,7,2``.
"""

import json
from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import Any, TypeVar

from msgspec.structs import asdict

from safenav.report.picture.svg import GLYPHS, obstacle_pictogram, opened_pictogram
from safenav.run import values
from safenav.run.reading import Beginning, RunReader, run_of
from safenav.run.run import Run
from safenav.run.tracks import LongStep, RobotTrack
from safenav.scenario.objective import Objective, target_regions
from safenav.trace.file import Trace
from safenav.trace.words import obstacle_words
from safenav.world.map import Region, RegionMap

_DOCUMENT = """\
<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="safenav">
<link rel="icon" href="data:,">
<title>{title}</title>
{head}
</head>
<body>
<div id="app"><noscript>This page needs JavaScript.</noscript></div>
{scripts}
</body>
</html>
"""

_ALONE = """\
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:">
<style>
{style}</style>"""


def page_of(trace: Trace, source: str) -> str:
    """Return the replay of a trace as an HTML document. ``source``: the name of the trace."""
    run = run_of(trace)
    return document(f"{run.name}: replay", data_element("run", encoded(run, source)))


def document(title: str, *data: str) -> str:
    """Return a self-contained page with a content security policy. ``data``: script elements."""
    head = _ALONE.format(style=asset("page.css"))
    return framed(title, head, *data, f"<script>\n{asset('page.js')}</script>")


def framed(title: str, head: str, *scripts: str) -> str:
    """Return a page with ``head`` in its head and ``scripts`` after the element ``app``."""
    return _DOCUMENT.format(title=escape(title), head=head, scripts="\n".join(scripts))


def data_element(name: str, data: object) -> str:
    """Return a script element with data that the page's program reads by this id."""
    return f'<script type="application/json" id="{name}">{embedded(data)}</script>'


def embedded(data: object) -> str:
    """Return JSON that is safe in a script element, for any strings.

    It has no ``<``, hence no ``</script>`` and no ``<!--``; ``ensure_ascii`` escapes the two line
    separators of Unicode."""
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def asset(name: str) -> str:
    """Return the text of a built file of a page."""
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")


T = TypeVar("T")


Sets = dict[str, int]
"""Sets of regions as texts, with their numbers."""


def written(regions: Iterable[Region]) -> str:
    """Return a set of regions (in ascending order) as gaps and lengths of its runs."""
    numbers: list[int] = []
    end = 0
    for region in regions:
        if numbers and region == end:
            numbers[-1] += 1
        else:
            numbers += [region - end, 1]
        end = region + 1
    return ",".join(map(str, numbers))


def encoded(run: Run, source: str, sets: Sets | None = None) -> dict[str, Any]:
    """Return a run as data of the page. ``source``: the name of the trace; ``sets``: sets of
    regions that pages already have."""
    ending, now = run.ending, _Rows(run, {} if sets is None else sets).since(0)
    both = zip(run.robots, now["robots"], strict=True)
    now["robots"] = [_robot(track) | rows for track, rows in both]
    return {
        "name": run.name,
        "source": source,
        "version": run.version,
        "rows": run.map.rows,
        "cols": run.map.cols,
        "grid": run.map.grid_rows(),
        "names": run.map.named,
        "areas": {name: sorted(area) for name, area in run.map.areas.items()},
        "chargers": list(run.chargers),
        "exclusions": [[sorted(each.robots), sorted(each.regions)] for each in run.exclusions],
        "charger": GLYPHS.charger,
        "opens": run.last if run.failed else 0,
        **now,
        "ending": ending and {"outcome": ending.outcome, "explanation": ending.explanation},
        "nose": GLYPHS.nose,
        "marks": {
            "status": {
                status.value: {"path": mark.path, "meaning": status.meaning}
                for status, mark in GLYPHS.status.items()
            },
            "event": {kind.value: path for kind, path in GLYPHS.events.items()},
            "load": GLYPHS.obstacles["crate"],
        },
    }


class _Rows:
    """The growing entries of a run: each change of a value as [tick, value...]."""

    def __init__(self, run: Run, sets: Sets) -> None:
        self._run, self._sets = run, sets
        self._index = {track.name: i for i, track in enumerate(run.robots)}
        self._begin = 0

    def since(self, tick: int) -> dict[str, Any]:
        """Return the entries from a tick on (0: all of them). An obstacle has all its entries, or
        is omitted if none of them is new."""
        run, self._begin = self._run, tick
        first = bisect_left(run.events, tick, key=lambda event: event.tick)
        return {
            "last": run.last,
            "times": run.seconds and [round(time, 3) for time in run.seconds[tick:]],
            "robots": [self._robot(track) for track in run.robots],
            "obstacles": [*filter(None, map(self._obstacle, run.hidden.values()))],
            "stack": self._changes(run.stack, self._stack),
            "events": [self._event(e) for e in run.events[first:] if e.kind in GLYPHS.events],
            "sets": [*self._sets],
        }

    def _changes(
        self, changes: values.Changes[T], value: Callable[[T], list[Any]], whole: bool = False
    ) -> list[list[Any]]:
        """Return ticks, each with the value (by ``value``) that holds from then on."""
        begin = 0 if whole else self._begin
        new = changes.after(begin - 1) if begin else changes
        return [[tick, *value(held)] for tick, held in {max(0, t): v for t, v in new}.items()]

    def _robot(self, track: RobotTrack) -> dict[str, Any]:
        begin, end = self._begin, self._run.last + 1
        headings = track.headings[begin:end]
        facing = [heading.name[0] for heading in headings if heading is not None]
        return {
            "path": track.regions[begin:end],
            "steps": [
                [step.first, step.last, step.toward, round(step.begin, 3), round(step.end, 3)]
                for step in track.steps[bisect_left(track.steps, begin - 1, key=_last) :]
            ],
            "headings": "".join(facing) if len(facing) == len(headings) else None,
            "tasks": self._changes(track.objectives, self._task),
            "progress": self._changes(track.progress, self._progress),
            "charge": self._changes(track.charge, lambda percent: [percent]) or None,
            "out": self._changes(track.out, lambda out: [out]),
            "beliefs": {
                self._index[of]: self._changes(beliefs, self._belief)
                for of, beliefs in track.beliefs.items()
            },
        }

    def _task(self, objective: Objective | None) -> list[Any]:
        avoid = () if objective is None else objective.avoid
        return [self._run.doing(objective), sorted(target_regions(objective)), sorted(avoid)]

    def _set(self, regions: Iterable[Region]) -> int:
        """Return the index of a set of regions (in ascending order). Add a new set."""
        return self._sets.setdefault(written(regions), len(self._sets))

    def _belief(self, held: values.RobotBelief | None) -> list[Any]:
        return [0, -1] if held is None else [int(held.seen), self._set(sorted(held.regions))]

    def _obstacle(self, hidden: values.Hidden) -> dict[str, Any]:
        histories = (hidden.status, hidden.met, hidden.loads)
        if self._begin and max(changes[-1][0] for changes in histories) < self._begin:
            return {}
        return {
            **_obstacle(hidden, self._run.map),
            "status": self._changes(hidden.status, lambda status: [status.value], whole=True),
            "met": self._changes(hidden.met, lambda needs: [needs], whole=True),
            "carried": self._changes(
                hidden.loads, lambda by: [[self._index[name] for name in by]], whole=True
            ),
        }

    def _stack(self, stack: Sequence[values.StackRow]) -> list[Any]:
        word = self._run.map.word
        return [
            [[obstacle_words(row.obstacle, word), row.requester, [*row.helpers]] for row in stack]
        ]

    @staticmethod
    def _progress(done: values.RobotProgress) -> list[Any]:
        return [done.rounds, -1 if done.reached is None else done.reached]

    def _event(self, event: values.Event) -> list[Any]:
        return [
            min(event.tick, self._run.last),
            event.kind.value,
            event.text,
            self._index.get(event.robot or "", -1),
            -1 if event.region is None else event.region,
        ]


def _last(step: LongStep) -> int:
    return step.last


def _obstacle(hidden: values.Hidden, world: RegionMap) -> dict[str, Any]:
    return {
        "name": hidden.name,
        "label": obstacle_words(hidden.name, world.word),
        "type": hidden.type,
        "shape": obstacle_pictogram(hidden.type),
        "opened": opened_pictogram(hidden.type),
        "region": hidden.region,
        "action": hidden.actions[0],
        "needs": [*map(hidden.open_needs, range(len(hidden.actions)))],
        "ordered": hidden.ordered,
    }


def _robot(track: RobotTrack) -> dict[str, Any]:
    return {
        "name": track.name,
        "model": track.model,
        "can": track.capabilities,
        "look": asdict(track.look),
    }


class LiveRun:
    """A live run. ``source``: its name on the page, in place of a trace file."""

    def __init__(self, header: Beginning, source: str) -> None:
        self._source, self._sets = source, Sets()
        reader = RunReader(header)
        self.run, self.append = reader.run, reader.append
        self._rows = _Rows(self.run, self._sets)
        self._told = self._told_sets = 0

    @property
    def time(self) -> float:
        """The time of the run so far: its last tick, or the seconds on its clock."""
        return self.run.time(self.run.last)

    def whole(self) -> dict[str, Any]:
        """Return the data of a page that shows the run so far."""
        return encoded(self.run, self._source, self._sets)

    def news(self) -> dict[str, Any]:
        """Return the entries since the last tick of the previous call, to replace those of pages,
        and the new sets of regions. The form is that of ``whole``."""
        since, known = self._told, self._told_sets
        new = self._rows.since(since)
        self._told, self._told_sets = self.run.last, len(self._sets)
        return {"since": since, "known": known} | new | {"sets": new["sets"][known:]}
