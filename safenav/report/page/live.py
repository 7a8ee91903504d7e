"""A run for the page while it happens: the whole of it so far, and later news.

Fed with the records of a run one after the other. ``whole`` is what ``encode.encoded`` gives for
the lines so far; ``news`` only what came after the last ``news``, so that a tick costs the same
however long the run is. What the page does with both: front/src/live/merge.ts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from safenav.report.page.encode import PageKnowledge, encoded, grown, steps_data, written
from safenav.report.replay.perception import SightCache
from safenav.report.replay.reading import ReplayBuilder
from safenav.report.replay.timeline import Replay, RobotTrack
from safenav.trace import records
from safenav.trace.trace import Trace
from safenav.world.map import Region

T = TypeVar("T")


class LiveRun:
    """A run in the making. ``source`` names it where a page names its trace."""

    def __init__(self, header: records.Header, source: str) -> None:
        self._source = source
        self._builder = ReplayBuilder(Trace(source, header, (), False, 0))
        self.replay = self._builder.replay
        self._sent = _OpenPages(self.replay)
        self.tell = self._builder.tell
        self.news()

    @property
    def time(self) -> float:
        """Return the last tick, or the seconds on the clock of the run."""
        return self.replay.time(self.replay.last)

    def whole(self) -> dict[str, Any]:
        """Return all that a page needs to show the run so far."""
        return encoded(self.replay, self._source)

    def news(self) -> dict[str, Any]:
        """Return the news since the last call, in the shapes of the whole: entries to append, but
        for the ``steps`` of a robot, which replace those from the number before them on, and sets
        of regions, which stand for themselves."""
        return grown(self.replay, self._sent)


class _OpenPages(PageKnowledge):
    """The open pages, which have all that they were sent."""

    def __init__(self, replay: Replay) -> None:
        self._counts: dict[tuple[str, ...], int] = {}
        self._views: dict[str, list[Region] | None] = {}
        self._sight = SightCache(replay.map)

    def new(self, entries: Sequence[T], *key: str) -> Sequence[T]:
        begin = self._counts.get(key, 0)
        self._counts[key] = len(entries)
        return entries[begin:]

    def steps(self, track: RobotTrack) -> Any:
        kept = max(0, self._counts.get(("steps", track.name), 0) - 1)  # the last one may continue
        self._counts["steps", track.name] = len(track.steps)
        return [kept, steps_data(track.steps[kept:])]

    def sight(self, replay: Replay, viewer: str) -> Iterable[tuple[int, list[Region]]]:
        view = self._sight.after(replay, viewer, replay.last)
        if view is not None and view != self._views.get(viewer):
            self._views[viewer] = view
            yield replay.last, view

    def placed(self, regions: Iterable[Region]) -> str:
        return written(regions)
