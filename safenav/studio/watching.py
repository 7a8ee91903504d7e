"""A live view of a run that a user's program drives; pages only watch it."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Mapping
from concurrent.futures import Future
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from safenav.errors import UsageError
from safenav.lines import json_line
from safenav.scenario.model import Scenario
from safenav.studio.live import StudioRun
from safenav.studio.process import RunOrder
from safenav.studio.session import Studio
from safenav.trace.records import Move, Record
from safenav.trace.writing import as_data

if TYPE_CHECKING:
    from safenav.studio.server import Server

_PAUSE = 0.2
_SETTLED = 0.05
"""Seconds without a trace line after which pages receive a complete tick."""
_GONE = 2.0
"""Seconds without an open page after which ``wait`` ends; a reload is shorter."""


class LiveView:
    """A listener that shows a running mission in a browser.

    ::

        with LiveView(scenario) as view:
            Mission(scenario, world=fleet, listeners=[view]).run()
            view.wait()

    Pages follow the run and can step back in it; they change nothing. ``browser``: open one.
    Raises UsageError, when entered, if the port is not available.
    """

    def __init__(
        self, scenario: Scenario, *, port: int | None = None, browser: bool = True
    ) -> None:
        self.address = ""
        """Address of the page, once the view has been entered."""
        self._scenario = scenario
        self._port = port
        self._browser = browser
        self._ready: Future[Server] = Future()
        self._thread = threading.Thread(target=self._serve, name="safenav live", daemon=True)

    def __enter__(self) -> LiveView:
        self._thread.start()
        self._server = self._ready.result()
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(RuntimeError):  # the server has ended already
            self._loop.call_soon_threadsafe(self._server.stop)
        self._thread.join()

    def __call__(self, record: Record) -> None:
        """Take the next line of the trace, in the thread of the mission."""
        studio = self._server.studio
        assert isinstance(studio, _Watching)
        with suppress(RuntimeError):  # the server has ended
            self._loop.call_soon_threadsafe(studio.hear, as_data(record))

    def wait(self) -> None:
        """Serve until the last page has been closed, or Ctrl-C."""
        last = time.monotonic()
        with suppress(KeyboardInterrupt):
            while self._thread.is_alive() and time.monotonic() - last < _GONE:
                time.sleep(_PAUSE)
                if self._server.studio.pages:
                    last = time.monotonic()

    def _serve(self) -> None:
        try:
            asyncio.run(self._served())
        except BaseException as error:
            if not self._ready.done():
                self._ready.set_exception(error)

    async def _served(self) -> None:
        from safenav.studio.server import Server

        self._loop = asyncio.get_running_loop()
        server = Server(_Watching(self._scenario), port=self._port)

        def ready(address: str) -> None:
            self.address = address
            self._ready.set_result(server)

        await server.serve(browser=self._browser, ready=ready)


class _Watching(Studio):
    """The session of a run that a program drives: it refuses requests of pages."""

    def __init__(self, scenario: Scenario) -> None:
        order = RunOrder("", scenario.source or f"{scenario.name}.yaml", seed=scenario.seed)
        super().__init__(order, scenario.catalogue)
        self.run = watched = WatchedRun(order, self.tell, trace=None)
        self.hear = watched.hear

    async def take(self, _: Mapping[str, Any]) -> None:
        raise UsageError("this page watches: the program that called the mission drives the run")

    def _hello(self) -> dict[str, Any]:
        return {**super()._hello(), "watches": True}


class WatchedRun(StudioRun):
    """A run without a process of its own: a program supplies its lines."""

    _settling: asyncio.TimerHandle | None = None

    def hear(self, data: dict[str, Any]) -> None:
        """Take one line of the trace. Pages get the news of a tick when the next one begins, or
        when it is complete and no line follows for ``_SETTLED`` seconds."""
        self._playing = True
        tick = int(data.get("tick", 0))
        if self._settling is not None:
            self._settling.cancel()
        if self._news and tick > self._news[-1].tick:
            self._done()
        self._take(json_line(data).encode())
        if data["type"] == "outcome":
            self._done()
            self._process_ended()
        elif self._is_tick_complete():
            self._settling = asyncio.get_running_loop().call_later(_SETTLED, self._done)

    def _is_tick_complete(self) -> bool:
        """Return whether the lines can be shown: each robot has moved since the last ones, or none,
        or the run has a clock."""
        assert self._live is not None
        run, moved = self._live.run, sum(isinstance(line, Move) for line in self._news)
        return run.seconds is not None or moved in (0, len(run.robots))
