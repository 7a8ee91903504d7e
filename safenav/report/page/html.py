"""One self-contained HTML file: style, program and run. It needs no network.

The program is built from ``front/`` (TypeScript, Preact, esbuild) and committed, since users of
safenav have no Node. A content security policy in the page forbids every request.

The run is compact data (its types: front/src/run/run.ts). Values over time are lists of
[tick, value...]; paths are lists of regions and a letter for each heading: a thousand ticks of a
robot take about five kilobytes. ``grown`` alone writes the parts that grow during a run: all
entries, or those that a page lacks. A set of regions is written once, as runs of consecutive
regions: the gap before each run and its length, as in ``14,3,7,2``. The page merges the news of a
live run (front/src/live/player.ts).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from html import escape
from importlib.resources import files
from typing import Any, TypeVar

from msgspec.structs import asdict

from safenav.errors import SafenavError
from safenav.report.picture.svg import (
    EVENT_MARKS,
    GLYPHS,
    obstacle_pictogram,
    opened_pictogram,
    robot_pictogram,
)
from safenav.run import values
from safenav.run.reading import Beginning, RunReader, run_of
from safenav.run.run import Run, SightCache, viewers
from safenav.scenario.objective import Objective, target_regions
from safenav.trace.file import Trace
from safenav.world.map import Region, RegionMap


def curves_of(trace: Trace) -> list[dict[str, object]]:
    """Return a curve for each requirement of a trace's scenario. They need the run's motion: where
    there is none, or a requirement cannot be evaluated, all are undecided and give the reason."""
    requirements = trace.header.scenario.requirements
    if not requirements:
        return []
    try:
        from safenav.motion.check.requirements import curves
        from safenav.motion.making import motion_of

        return curves(motion_of(trace), trace)
    except ModuleNotFoundError as error:
        why = f"it needs the extra 'motion' ({error.name} is not installed)"
    except SafenavError as error:
        why = str(error).partition("\n")[0]
    return [
        {"name": name, "told": f"{text}: not evaluated: {why}", "verdict": "undecided"}
        | {"points": [[0, 0]]}
        for name, text in requirements.items()
    ]


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


def page_of(run: Run, source: str, curves: Sequence[Mapping[str, object]] = ()) -> str:
    """Return the replay as an HTML document. ``source``: the name of its trace; ``curves``: those
    of its requirements (``curves_of``)."""
    return document(
        f"{run.name}: replay",
        data_element("run", encoded(run, source) | {"curves": list(curves)}),
    )


def page_of_trace(trace: Trace, source: str) -> str:
    """Return the page of a trace, with the curves of its requirements."""
    return page_of(run_of(trace), source, curves_of(trace))


def document(title: str, *data: str) -> str:
    """Return a self-contained page with its policy and elements with its data."""
    head = _ALONE.format(style=asset("page.css"))
    return framed(title, head, *data, f"<script>\n{asset('page.js')}</script>")


def framed(title: str, head: str, *scripts: str) -> str:
    """Return a page with ``head`` in its head, and ``scripts`` after the element ``app``."""
    return _DOCUMENT.format(title=escape(title), head=head, scripts="\n".join(scripts))


def data_element(name: str, data: object) -> str:
    """Return a script element with data that the page's program reads by this id."""
    return f'<script type="application/json" id="{name}">{embedded(data)}</script>'


def embedded(data: object) -> str:
    """Return JSON that is safe in a script element for any strings.

    No ``<`` is left, hence no ``</script>`` and no ``<!--``; the two line separators of Unicode
    are escaped by ``ensure_ascii``."""
    text = json.dumps(data, ensure_ascii=True, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


@cache
def asset(name: str) -> str:
    """Return the text of a built file of a page."""
    return files(__package__).joinpath("assets", name).read_text(encoding="utf-8")


T = TypeVar("T")


class PageKnowledge:
    """The entries that pages have; at first none. ``numbered``: sets of regions are numbers in
    ``texts``, else their texts."""

    def __init__(self, world: RegionMap, *, numbered: bool) -> None:
        self.texts: dict[str, int] = {}
        self._numbered = numbered
        self._counts: dict[tuple[str, ...], int] = {}
        self._views: dict[str, list[Region]] = {}
        self._sight = SightCache(world)

    def new(self, entries: Sequence[T], *key: str) -> Sequence[T]:
        """Return the entries of a series that pages lack; ``key`` identifies the series."""
        begin = self._counts.get(key, 0)
        self._counts[key] = len(entries)
        return entries[begin:]

    def steps(self, track: values.RobotTrack) -> list[Any]:
        """Return the number of the first step that pages lack, and the steps from it on; the last
        one may still continue."""
        begin = max(0, self._counts.get(("steps", track.name), 0) - 1)
        self._counts["steps", track.name] = len(track.steps)
        new = track.steps[begin:]
        times = [[s.first, s.last, s.toward, round(s.begin, 3), round(s.end, 3)] for s in new]
        return [begin, times]

    def sight(self, run: Run, viewer: str) -> Iterable[tuple[int, list[Region]]]:
        """Yield the changes of a robot's sight that pages lack: the tick, and the regions seen."""
        for tick in range(self._counts.get(("sight", viewer), 0), run.last + 1):
            view = self._sight.after(run, viewer, tick)
            if view is not None and view != self._views.get(viewer):
                self._views[viewer] = view
                yield tick, view
        self._counts["sight", viewer] = run.last  # more lines of this tick may follow

    def placed(self, regions: Iterable[Region]) -> int | str:
        """Return the number or the text of a set of regions (ascending)."""
        text = written(regions)
        return self.texts.setdefault(text, len(self.texts)) if self._numbered else text


def written(regions: Iterable[Region]) -> str:
    """Return regions, ascending, as gaps and lengths of runs."""
    numbers: list[int] = []
    end = 0
    for region in regions:
        if numbers and region == end:
            numbers[-1] += 1
        else:
            numbers += [region - end, 1]
        end = region + 1
    return ",".join(map(str, numbers))


def encoded(run: Run, source: str) -> dict[str, Any]:
    """Return the data of the page. ``source``: the name of the trace."""
    ending, known = run.ending, PageKnowledge(run.map, numbered=True)
    now = grown(run, known)
    style = values.looks([track.name for track in run.robots])
    now["robots"] = [
        {**_robot(track), **new, "steps": new["steps"][1], "look": asdict(look)}
        for track, new, look in zip(run.robots, now["robots"], style, strict=True)
    ]
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
        "within": run.within,
        "opens": run.last if run.failed else 0,
        **now,
        "sets": [*known.texts],
        "ending": ending
        and {
            "outcome": ending.outcome,
            "explanation": ending.explanation,
        },
        "nose": GLYPHS.nose,
        "marks": {
            "status": {
                status.value: {"path": mark.path, "meaning": status.meaning}
                for status, mark in GLYPHS.status.items()
            },
            "event": {kind.value: mark.path for kind, mark in GLYPHS.events.items()},
        },
    }


def grown(run: Run, known: PageKnowledge) -> dict[str, Any]:
    """Return the entries that grow with the ticks of a run and are not ``known``; obstacles without
    new entries are left out."""
    growth = _Growth(run, known)
    times = run.seconds and [round(time, 3) for time in known.new(run.seconds, "times")]
    events = (event for event in known.new(run.events, "events") if event.kind in EVENT_MARKS)
    return {
        "last": run.last,
        "times": times,
        "robots": [growth.robot(track) for track in run.robots],
        "obstacles": [*filter(None, map(growth.obstacle, run.hidden.values()))],
        "stack": growth.changes(run.stack, growth.rows, "stack"),
        "events": [growth.event(event) for event in events],
    }


class _Growth:
    def __init__(self, run: Run, known: PageKnowledge) -> None:
        self._run, self._known = run, known
        self._index = {track.name: i for i, track in enumerate(run.robots)}
        self._viewers = viewers(run)

    def changes(
        self, changes: values.Changes[T], value: Callable[[T], list[Any]], *key: str
    ) -> list[list[Any]]:
        """Return new ticks with the value that holds from each on; the last of a tick counts."""
        latest = dict(self._known.new(changes, *key))
        return [[max(0, tick), *value(held)] for tick, held in latest.items()]

    def robot(self, track: values.RobotTrack) -> dict[str, Any]:
        run, name, charge = self._run, track.name, self._run.charges.get(track.name)
        path = self._known.new(track.regions, "path", name)
        headings = self._known.new(track.headings, "headings", name)
        facing = [heading.name[0] for heading in headings if heading is not None]
        return {
            "path": [*path],
            "steps": self._known.steps(track),
            "headings": "".join(facing) if len(facing) == len(path) else None,
            "tasks": self.changes(
                run.objectives[name], partial(task_data, run, name), "tasks", name
            ),
            "progress": self.changes(run.progress[name], self._progress, "progress", name),
            "charge": charge and self.changes(charge, lambda percent: [percent], "charge", name),
            "view": self._view(track) if name in self._viewers else None,
        }

    def _view(self, track: values.RobotTrack) -> dict[str, Any]:
        """Return a robot's sight and beliefs."""
        sight = self._known.sight(self._run, track.name)
        return {
            "vision": track.vision,
            "sight": [[tick, self._known.placed(view)] for tick, view in sight],
            "beliefs": [
                [self._index[of], self.changes(beliefs, self._belief, "belief", viewer, of)]
                for (viewer, of), beliefs in self._run.beliefs.items()
                if viewer == track.name
            ],
        }

    def _belief(self, held: values.RobotBelief | None) -> list[Any]:
        if held is None:
            return [0, -1]
        return [int(held.seen), self._known.placed(sorted(held.regions))]

    def obstacle(self, hidden: values.Hidden) -> dict[str, Any]:
        run, name = self._run, hidden.name
        new = {
            "status": self.changes(run.statuses[name], lambda s: [s.value], "status", name),
            "met": self.changes(run.met[name], lambda needs: [needs], "met", name),
            "carried": self.changes(run.loads[name], self._carriers, "carried", name),
        }
        return {**_obstacle(hidden, run.map), **new} if any(new.values()) else {}

    def _carriers(self, robots: Sequence[str]) -> list[Any]:
        return [[self._index[robot] for robot in robots]]

    def rows(self, stack: Sequence[values.StackRow]) -> list[Any]:
        word = self._run.map.word
        return [[[row.about(word), row.roles, row.requester, [*row.helpers]] for row in stack]]

    @staticmethod
    def _progress(done: values.RobotProgress) -> list[Any]:
        return [done.rounds, -1 if done.reached is None else done.reached]

    def event(self, event: values.Event) -> list[Any]:
        return [
            min(event.tick, self._run.last),
            event.kind.value,
            event.text,
            self._index.get(event.robot or "", -1),
            -1 if event.region is None else event.region,
        ]


def _obstacle(hidden: values.Hidden, world: RegionMap) -> dict[str, Any]:
    return {
        "name": hidden.name,
        "label": hidden.label(world),
        "type": hidden.type,
        "shape": obstacle_pictogram(hidden.type),
        "opened": opened_pictogram(hidden.type),
        "region": hidden.region,
        "action": hidden.actions[0],
        "needs": [*map(hidden.open_needs, range(len(hidden.actions)))],
        "ordered": hidden.ordered,
    }


def _robot(track: values.RobotTrack) -> dict[str, Any]:
    return {
        "name": track.name,
        "model": track.model,
        "shape": robot_pictogram(track.model),
        "can": track.capabilities,
    }


def task_data(run: Run, robot: str, objective: Objective | None) -> list[Any]:
    avoid = () if objective is None else objective.avoid
    return [run.doing(robot, objective), sorted(target_regions(objective)), sorted(avoid)]


class LiveRun:
    """A live run. ``source``: its name on the page, in place of a trace file."""

    def __init__(self, header: Beginning, source: str) -> None:
        self._source = source
        reader = RunReader(header)
        self.run, self.append = reader.run, reader.append
        self._sent = PageKnowledge(self.run.map, numbered=False)
        self.news()

    @property
    def time(self) -> float:
        """The last tick, or the seconds on the clock of the run."""
        return self.run.time(self.run.last)

    def whole(self) -> dict[str, Any]:
        """Return the data of a page that shows the run so far."""
        return encoded(self.run, self._source)

    def news(self) -> dict[str, Any]:
        """Return the entries since the last call, in the form of ``whole``, to be appended. Two
        differ: ``steps`` of a robot are [number, steps], which replace those from that number on,
        and sets of regions are texts instead of references."""
        return grown(self.run, self._sent)
