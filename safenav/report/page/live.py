"""A live run as data of the page: the whole run so far, and news.

It takes the records of a run one after the other. ``whole`` is the data of ``encode.encoded`` for
the lines so far; ``news`` has only the entries since the last ``news``, so that the cost of a tick
does not grow with the run. The page merges both in front/src/live/merge.ts."""

from __future__ import annotations

from typing import Any

from safenav.report.page.encode import PageKnowledge, encoded, grown
from safenav.run.reading import Beginning, RunReader


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
