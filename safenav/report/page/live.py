"""A run for the page while it happens: the whole of it so far, and later news.

Fed with the records of a run one after the other. ``whole`` is what ``encode.encoded`` gives for
the lines so far; ``news`` only what came after the last ``news`` or ``whole``, so that a tick costs
the same however long the run is. What the page does with both: front/src/live/merge.ts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from safenav.report.page import encode
from safenav.report.page.encode import written
from safenav.report.replay.perception import CLOSED, SightCache
from safenav.report.replay.reading import ReplayBuilder
from safenav.report.replay.timeline import Hidden
from safenav.trace import records
from safenav.trace.trace import Trace


class LiveRun:
    """A run in the making. ``source`` names it where a page names its trace."""

    def __init__(self, header: records.Header, source: str) -> None:
        self._source = source
        self._version = header.safenav
        self._telling = ReplayBuilder(Trace(source, header, (), False, 0))
        self._index = {name: i for i, name in enumerate(self._telling.paths.tracks)}
        self._sent: dict[tuple[str, ...], int] = {}
        self._known: dict[str, Hidden] = {}
        self._sight: dict[str, str] = {}
        self._seen = SightCache(self._telling.map).seen
        self._catch_up()

    @property
    def last(self) -> int:
        """Return the last tick that is complete."""
        return self._telling.paths.last

    @property
    def timed(self) -> bool:
        """Whether the run has a clock."""
        return self._telling.paths.times is not None

    @property
    def time(self) -> float:
        """Return the last tick, or the seconds on the clock of the run."""
        times = self._telling.paths.times
        return float(self.last) if times is None else times[-1]

    def tell(self, record: records.Record) -> None:
        """Receive the next record of the run."""
        self._telling.tell(record)

    def whole(self) -> dict[str, Any]:
        """Return all that a page needs to show the run so far."""
        self._catch_up()
        return encode.encoded(self._telling.replay(self._version), self._source)

    def news(self) -> dict[str, Any]:
        """Return the news since the last call, in the shapes of the whole: entries to append, but
        for the ``steps`` of a robot, which replace those from the number before them on."""
        telling, last = self._telling, self.last
        return {
            "last": last,
            "times": [round(time, 3) for time in self._new(telling.paths.times or (), "times")],
            "robots": [self._robot_news(name, last) for name in telling.paths.tracks],
            "obstacles": self._new_obstacles(),
            "status": {
                name: encode.changed(self._new(told, "s", name), encode.status_data)
                for name, told in telling.obstacles.statuses.items()
            },
            "met": {
                name: encode.changed(new, encode.met_data)
                for name, told in telling.obstacles.met.items()
                if (new := self._new(told, "met", name))
            },
            "carried": {
                name: encode.changed(new, lambda who: encode.carriers_data(who, self._index))
                for name, told in telling.obstacles.loads.items()
                if (new := self._new(told, "carried", name))
            },
            "stack": encode.changed(
                self._new(telling.stack, "stack"),
                lambda frames: encode.stack_data(frames, telling.map),
            ),
            "events": [encode.event_data(e, self._index) for e in self._new_events()],
            "deadlines": [*map(encode.slack_data, self._new(telling.deadlines, "deadlines"))],
        }

    def _robot_news(self, name: str, last: int) -> dict[str, Any]:
        telling = self._telling
        path = self._new(telling.paths.regions[name][: last + 1], "path", name)
        facing = self._new(telling.paths.headings[name][: last + 1], "headings", name)
        steps = telling.paths.steps(name, last)
        kept = max(0, self._sent.get(("steps", name), 0) - 1)  # the last one may continue
        self._sent["steps", name] = len(steps)
        return {
            "path": path,
            "headings": "".join(heading.name[0] for heading in facing if heading is not None),
            "steps": [kept, encode.steps_data(steps[kept:])],
            "tasks": encode.changed(
                self._new(telling.objectives[name], "tasks", name),
                lambda objective: encode.task_data(objective, telling.map),
            ),
            "progress": encode.changed(
                self._new(telling.progress[name], "progress", name), encode.progress_data
            ),
            "charge": self._new(telling.percent.get(name, ()), "charge", name),
            "view": self._view_news(name, last),
        }

    def _view_news(self, name: str, last: int) -> dict[str, Any] | None:
        """Return new sight and beliefs, with sets as texts."""
        beliefs = []
        for (viewer, other), told in self._telling.beliefs.items():
            if viewer != name:
                continue
            for tick, belief in self._new(told, "belief", viewer, other):
                seen, text = encode.belief_data(belief, written)
                beliefs.append([self._index[other], tick, seen, text])
        sight = self._sight_now(name, last)
        if sight is None and not beliefs:
            return None
        changed = sight is not None and self._sight.get(name) != sight
        if sight is not None:
            self._sight[name] = sight
        return {"sight": [[last, sight]] if changed else [], "beliefs": beliefs}

    def _sight_now(self, name: str, last: int) -> str | None:
        telling = self._telling
        vision = telling.paths.tracks[name].vision
        if vision is None:
            return None
        told = (
            (h.region, telling.obstacles.statuses[h.name][-1:])
            for h in telling.obstacles.hidden.values()
        )
        closed = frozenset(r for r, status in told if status and status[0][1] in CLOSED)
        return written(self._seen(vision, closed, telling.paths.regions[name][last]))

    def _new_obstacles(self) -> list[dict[str, Any]]:
        """Return the obstacles that are new, or that have just appeared."""
        found = [h for h in self._telling.obstacles.hidden.values() if self._known.get(h.name) != h]
        self._known.update((hidden.name, hidden) for hidden in found)
        return [encode.obstacle_data(hidden, self._telling.map) for hidden in found]

    def _new_events(self) -> Sequence[Any]:
        return self._new(self._telling.events, "events")

    def _new(self, entries: Sequence[Any], *key: str) -> Sequence[Any]:
        """Return the entries that were not sent yet; they count as sent from now on."""
        begin = self._sent.get(key, 0)
        self._sent[key] = max(begin, len(entries))
        return entries[begin:]

    def _catch_up(self) -> None:
        """Count all that there is as sent."""
        self.news()
