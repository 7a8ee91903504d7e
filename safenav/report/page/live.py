"""A live run as data of the page: the whole run so far, and news.

It takes the records of a run one after the other. ``whole`` is the data of ``encode.encoded`` for
the lines so far; ``news`` has only the entries since the last ``news``, so that the cost of a tick
does not grow with the run. The page merges both in front/src/live/merge.ts."""

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
    """A live run. ``source``: its name on the page, in place of a trace file."""

    def __init__(self, header: records.Header, source: str) -> None:
        self._source = source
        self._builder = ReplayBuilder(Trace(source, header, (), False, 0))
        self.replay = self._builder.replay
        self._sent = _OpenPages(self.replay)
        self.tell = self._builder.tell
        self.news()

    @property
    def time(self) -> float:
        """The last tick, or the seconds on the clock of the run."""
        return self.replay.time(self.replay.last)

    def whole(self) -> dict[str, Any]:
        """Return the data of a page that shows the run so far."""
        return encoded(self.replay, self._source)

    def news(self) -> dict[str, Any]:
        """Return the entries since the last call, in the form of ``whole``, to be appended. Two
        differ: ``steps`` of a robot are [number, steps], which replace those from that number on,
        and sets of regions are texts instead of references."""
        return grown(self.replay, self._sent)


class _OpenPages(PageKnowledge):
    """The open pages, which have all entries sent so far."""

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
