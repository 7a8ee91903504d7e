"""Runs on pages, with their process, trace and pace.

All messages to pages pass ``tell``; requests of pages are method calls. All pages show the same
run: a page that joins later receives ``whole``.
"""

import asyncio
import json
import signal
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import Any

from safenav.errors import UsageError
from safenav.files import json_line
from safenav.report.page.html import LiveRun
from safenav.studio.process import DONE, FAILED, REFUSED, RunOrder, kill, started
from safenav.trace.fields import convert
from safenav.trace.file import TraceWriter, as_data
from safenav.trace.records import KINDS, End, Header, Move, Record

PATIENCE = 1.0
"""Seconds from a request to end the run until its processes are killed."""
IDLE = 0.1
"""Seconds until the next tick after one without time, in which the run waits for help."""
BUSY = 0.3
"""Seconds after which pages show a long tick."""
Tell = Callable[[dict[str, Any]], None]


class StudioRun:
    """A run. ``lines``: its trace so far."""

    def __init__(
        self, order: RunOrder, tell: Tell, *, speed: float = 4.0, trace: Path | None
    ) -> None:
        self.order = order
        self.lines: list[bytes] = []
        self.speed = speed
        self.failure: str | None = None
        self._tell = tell
        self._file = None if trace is None else TraceWriter(trace)
        self._live: LiveRun | None = None
        self._news: list[Record] = []  # the lines of the incomplete tick
        self._process: asyncio.subprocess.Process | None = None
        self._listening: asyncio.Task[None] | None = None
        self._ready = False  # the process waits for a request
        self._busy = False  # the current tick has taken more than BUSY seconds
        self._late: asyncio.TimerHandle | None = None
        self._begun = False  # the first tick is complete
        self._playing = False
        self._ending = False  # a user has requested its end
        self._ended = False
        self._steps = 0
        self._due = 0.0
        self._took = 0.0  # the length of the last tick, in ticks or seconds
        self._pause = 0.0  # the pause after a tick without length, in seconds

    @property
    def phase(self) -> str:
        if self._ended:
            return "ended"
        if not self._begun:
            return "starting"
        return "running" if self._playing else "paused"

    @property
    def state(self) -> dict[str, Any]:
        """The state that pages show besides the run."""
        run = None if self._live is None else self._live.run
        return {
            "phase": self.phase,
            "speed": self.speed,
            "failure": self.failure,
            "outcome": run and run.ending and run.ending.outcome.value,
            "inputs": {} if run is None else run.inputs,
            "busy": self._busy,
        }

    @property
    def whole(self) -> dict[str, Any] | None:
        """The run's data up to its last complete tick; None before its first line."""
        return None if self._live is None else self._live.whole()

    @property
    def trace(self) -> bytes:
        """The trace so far."""
        return b"".join(self.lines)

    async def start(self) -> None:
        """Start the process, which synthesizes and then waits for requests of ticks."""
        self._process = await started("run", self.order)
        self._listening = asyncio.create_task(self._listen())
        self._wait()
        self._tell_state()

    def play(self) -> None:
        """Run tick after tick until ``pause``."""
        self._playing, self._due = True, time.monotonic()
        self._tell_state()
        self._advance()

    def pause(self) -> None:
        """Stop after the current tick."""
        self._playing = False
        self._tell_state()

    def set_speed(self, speed: float) -> None:
        """Set the speed, in ticks per second."""
        self.speed = speed
        self._tell_state()

    def step(self) -> None:
        """Run one tick, then pause."""
        self.pause()
        self._steps += 1
        self._advance()

    def change(self, data: Mapping[str, Any]) -> None:
        """Change the world before the next tick."""
        if not self._ended:
            self._send({**data, "do": "change"})

    async def end(self) -> None:
        """End the run within a second; its trace is kept."""
        process = self._process
        if process is None or self._ended:
            return
        assert self._listening is not None and process.stdin is not None
        self._playing, self._ending = False, True
        process.stdin.close()
        with suppress(ProcessLookupError):
            process.send_signal(signal.SIGINT)
        _, running = await asyncio.wait([self._listening], timeout=PATIENCE)
        if running:
            kill(process)
            await asyncio.wait(running, timeout=PATIENCE)

    def _advance(self) -> None:
        """Request the next tick when it is due if the run continues and no tick is unfinished."""
        now = time.monotonic()
        if self._process is None or not self._ready or not (self._steps or self._playing):
            return
        if self._steps:
            self._steps -= 1
        elif self._due > now:
            asyncio.get_running_loop().call_later(self._due - now, self._advance)
            return
        else:
            self._due = max(now - 0.2, self._due) + (self._took / self.speed or self._pause)
        self._ready = False
        self._wait()
        self._send({"do": "step"})

    def _wait(self) -> None:
        """Let pages show a long tick after ``BUSY`` seconds."""
        self._late = asyncio.get_running_loop().call_later(BUSY, self._show_busy)

    def _show_busy(self) -> None:
        self._busy = True
        self._tell_state()

    async def _listen(self) -> None:
        """Read the lines that the process prints until it ends."""
        process = self._process
        assert process is not None and process.stdout is not None
        file: AbstractContextManager[object] = self._file or nullcontext()
        try:
            with file:
                async for line in process.stdout:
                    if line.endswith(b"\n"):  # else the process was killed while it wrote
                        self._take(line)
        except (UsageError, ValueError) as error:  # a full disk or a line above the limit
            self.failure = str(error)
            kill(process)
        status = await process.wait()
        if status != 0 and self.failure is None and not self._ending:
            how = signal.Signals(-status).name if status < 0 else f"exit status {status}"
            self.failure = f"the process of the run ended ({how}), perhaps because memory ran out"
        self._end()

    def _take(self, line: bytes) -> None:
        """Process one line that the process has printed."""
        data = json.loads(line)
        kind = data["type"]
        if kind == DONE:
            self._done(waits=data["waits"])
        elif kind == REFUSED:
            self._tell({"is": "refused", "message": data["message"]})
        elif kind == FAILED:
            self.failure = data["message"]
        else:
            self._record(convert(KINDS[kind], {"tick": 0, **data}), line)  # a header has no tick

    def _record(self, record: Record, line: bytes) -> None:
        self.lines.append(line)
        if self._file is not None:
            self._file(record)
        if isinstance(record, Header):
            self._live = LiveRun(record, Path(self.order.file).name)
            self._tell({"is": "run", "run": self.whole, "state": self.state})
        else:
            self._news.append(record)

    def _done(self, *, waits: bool = False) -> None:
        """Show an ended tick. ``waits``: whether the run waits for help."""
        assert self._live is not None
        before = self._live.time
        self._rest()
        self._took = self._live.time - before
        self._pause = IDLE if waits else 0.0
        self._begun = self._ready = True
        self._tell_state()
        self._tell({"is": "news", "news": self._live.news()})
        self._advance()

    def _rest(self) -> None:
        """Show the lines of a tick together, so that all pages have all of them, even a page opened
        during the tick."""
        if self._late is not None:
            self._late.cancel()
        self._busy = False
        new, self._news = self._news, []
        for record in new:
            assert self._live is not None
            self._live.append(record)

    def _end(self) -> None:
        """Show the end of the process."""
        self._ended, self._ready = True, False
        self._rest()
        if self._live is not None:
            self._tell({"is": "run", "run": self.whole, "state": self.state})
        else:
            self._tell_state()

    def _tell_state(self) -> None:
        self._tell({"is": "state", "state": self.state})

    def _send(self, data: Mapping[str, Any]) -> None:
        assert self._process is not None and self._process.stdin is not None
        with suppress(ConnectionError, RuntimeError):
            self._process.stdin.write(json_line(data).encode())


_SETTLED = 0.05
"""Seconds without a trace line after which pages receive a complete tick."""


class WatchedRun(StudioRun):
    """A run without its own process: a program supplies its lines."""

    _settling: asyncio.TimerHandle | None = None

    def hear(self, record: Record) -> None:
        """Add a line of the trace. Pages get the lines of a tick when the next one begins, or when
        the tick is complete and no line has followed for ``_SETTLED`` seconds."""
        self._playing = True
        if self._settling is not None:
            self._settling.cancel()
        if self._news and record.tick > self._news[-1].tick:
            self._done()
        self._record(record, json_line(as_data(record)).encode())
        if isinstance(record, End):
            self._end()
        elif self._is_tick_complete():
            self._settling = asyncio.get_running_loop().call_later(_SETTLED, self._done)

    def _is_tick_complete(self) -> bool:
        """Return whether the new lines can be shown: they move all robots or none, or there is a
        clock."""
        assert self._live is not None
        run, moved = self._live.run, sum(isinstance(line, Move) for line in self._news)
        return run.seconds is not None or moved in (0, len(run.robots))
