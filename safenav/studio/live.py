"""A run that pages show, with its process, its trace and its pace.

All messages to pages go through ``tell``; their requests arrive by the methods. All pages show the
same run: a page that joins later receives ``whole``.
"""

import asyncio
import json
import signal
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import IO, Any

from safenav.errors import UsageError
from safenav.files import json_line
from safenav.report.page.html import LiveRun
from safenav.studio.process import DONE, FAILED, REFUSED, RunOrder, kill, started
from safenav.trace.fields import convert
from safenav.trace.records import KINDS, Header, Inputs, Move, Record

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
PATIENCE = 1.0
"""Seconds after a request to end the run until its processes are killed."""
IDLE = 0.1
"""Seconds until the next tick after one without a trace line: the run waits for its operator."""
BUSY = 0.3
"""Seconds after which pages show a tick as long."""
Tell = Callable[[dict[str, Any]], None]


class LivePhase(StrEnum):
    """Phase of a live run."""

    STARTING = "starting"
    PAUSED = "paused"
    RUNNING = "running"
    ENDED = "ended"


class StudioRun:
    """One run. ``lines``: its trace so far."""

    def __init__(
        self, order: RunOrder, tell: Tell, *, speed: float = 4.0, trace: Path | None
    ) -> None:
        self.order = order
        self.lines: list[bytes] = []
        self.phase = LivePhase.STARTING
        self.speed = speed
        self.failure: str | None = None
        self._news: list[Record] = []  # the lines of the incomplete tick
        self._tell = tell
        self._live: LiveRun | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._listening: asyncio.Task[None] | None = None
        self._ready = False  # the process waits for a request
        self._busy = False  # the current tick has taken more than BUSY seconds
        self._late: asyncio.TimerHandle | None = None
        self._ending = False  # a user has requested its end
        self._playing = False
        self._begun = False
        self._steps = 0
        self._due = 0.0
        self._shown, self._seen = 0.0, 0
        self._path = trace or Path()
        self._file = None if trace is None else opened(trace)

    @property
    def state(self) -> dict[str, Any]:
        """The state that pages show beside the run itself."""
        run = None if self._live is None else self._live.run
        return {
            "phase": self.phase.value,
            "speed": self.speed,
            "seed": self.order.seed,
            "failure": self.failure,
            "outcome": run and run.ending and run.ending.outcome.value,
            "inputs": {} if run is None else run.inputs,
            "busy": self._busy,
        }

    @property
    def whole(self) -> dict[str, Any] | None:
        """The run up to the last complete tick; None before its first line."""
        return None if self._live is None else self._live.whole()

    @property
    def trace(self) -> bytes:
        """The trace so far."""
        return b"".join(self.lines)

    async def start(self) -> None:
        """Start the process, which synthesizes and then waits for ticks."""
        self._process = await started("run", self.order)
        self._listening = asyncio.create_task(self._listen())
        self._wait()
        self._tell_state()

    def play(self) -> None:
        """Run tick after tick until ``pause``."""
        self._playing, self._due = True, time.monotonic()
        self._set(LivePhase.RUNNING)
        self._advance()

    def pause(self) -> None:
        """Stop after the current tick."""
        self._playing = False
        self._set(LivePhase.PAUSED)

    def set_speed(self, speed: float) -> None:
        """Set the speed, in ticks per second."""
        self.speed = min(SPEEDS, key=lambda known: abs(known - speed))
        self._tell_state()

    def step(self) -> None:
        """Run one tick, then pause."""
        self.pause()
        self._steps += 1
        self._advance()

    def change(self, data: Mapping[str, Any]) -> None:
        """Change the world before the next tick."""
        if self.phase is not LivePhase.ENDED:
            self._send({**data, "do": "change"})

    async def end(self) -> None:
        """End the run within a second; its trace is kept."""
        process = self._process
        if process is None or self.phase is LivePhase.ENDED:
            return
        self._playing, self._ending = False, True
        if self._ready:
            self._send({"do": "end"})
        else:
            with suppress(ProcessLookupError):
                process.send_signal(signal.SIGINT)
        try:
            await asyncio.wait_for(process.wait(), PATIENCE)
        except TimeoutError:
            kill(process)
            await process.wait()
        assert self._listening is not None
        with suppress(TimeoutError):
            await asyncio.wait_for(self._listening, PATIENCE)

    def _advance(self) -> None:
        """Request the next tick, at its time, if one is wanted and the last one has ended."""
        now = time.monotonic()
        if self._process is None or not self._ready or not (self._steps or self._playing):
            return
        if self._steps:
            self._steps -= 1
        elif self._due > now:
            asyncio.get_running_loop().call_later(self._due - now, self._advance)
            return
        else:
            self._due = max(now - 0.2, self._due) + self._pause()
        self._ready = False
        self._wait()
        self._send({"do": "step"})

    def _wait(self) -> None:
        """Wait for the process; after ``BUSY`` seconds pages show that the tick takes long."""
        self._late = asyncio.get_running_loop().call_later(BUSY, self._set_busy, True)

    def _set_busy(self, busy: bool) -> None:
        if self._late is not None:
            self._late.cancel()
        if busy is not self._busy:
            self._busy = busy
            self._tell_state()

    def _pause(self) -> float:
        """Return the seconds until the next tick: the length of the last one, at the set speed."""
        before, now = self._shown, 0.0 if self._live is None else self._live.time
        idle, self._seen = len(self.lines) == self._seen, len(self.lines)
        self._shown = now
        if idle:
            return IDLE
        timed = self._live is not None and self._live.run.clock.unit == "second"
        took = now - before if timed else 1.0
        return took / self.speed

    async def _listen(self) -> None:
        """Take the lines that the process writes, until it ends."""
        process = self._process
        assert process is not None and process.stdout is not None
        try:
            async for line in process.stdout:
                if line.endswith(b"\n"):  # else the process was killed while it wrote
                    self._take(line)
        except ValueError:
            self.failure = "a line of the trace is too long"
            kill(process)
        except UsageError as error:
            self.failure = str(error)
            kill(process)
        status = await process.wait()
        if status != 0 and self.failure is None and not self._ending:
            self.failure = _death(status)
        self._process_ended()

    def _take(self, line: bytes) -> None:
        data = json.loads(line)
        kind = data["type"]
        if kind == DONE:
            self._done()
        elif kind == REFUSED:
            self._tell({"is": "refused", "message": data["message"]})
        elif kind == FAILED:
            self.failure = data["message"]
        else:
            self._record(KINDS.get(kind, Header), data, line)

    def _record(self, kind: type[Record], data: dict[str, Any], line: bytes) -> None:
        self.lines.append(line)
        if self._file is not None:
            try:
                self._file.write(line)
                self._file.flush()
            except OSError as error:
                raise _unwritable(self._path, error) from error
        if kind is Header:
            header: Header = convert(Header, {"tick": 0, **data})
            self._live = LiveRun(header, Path(self.order.file).name)
            self._tell({"is": "run", "run": self.whole, "state": self.state})
        else:
            self._news.append(convert(kind, data))

    def _done(self) -> None:
        """Handle the end of a tick."""
        live, switched = self._complete_tick()
        self._set_busy(False)
        if not self._begun:
            self._begun = True
            self._set(LivePhase.RUNNING if self._playing else LivePhase.PAUSED)
        elif switched:
            self._tell_state()
        self._tell({"is": "news", "news": live.news()})
        self._ready = True
        self._advance()

    def _complete_tick(self) -> tuple[LiveRun, bool]:
        """Show the lines of a tick together, so that neither open pages nor one that opens during
        the tick miss a line. Return also whether the inputs changed in it."""
        assert self._live is not None
        new, self._news = self._news, []
        for record in new:
            self._live.append(record)
        return self._live, any(isinstance(record, Inputs) for record in new)

    def _process_ended(self) -> None:
        """Handle the end of the process."""
        self.phase, self._ready = LivePhase.ENDED, False
        self._set_busy(False)
        if self._file is not None:
            with suppress(OSError):  # a full disk: the failed write has reported it
                self._file.close()
        if self._live is not None:
            self._complete_tick()
            self._tell({"is": "run", "run": self.whole, "state": self.state})
        else:
            self._tell_state()

    def _set(self, phase: LivePhase) -> None:
        if self._begun and self.phase is not LivePhase.ENDED:
            self.phase = phase
        self._tell_state()

    def _tell_state(self) -> None:
        self._tell({"is": "state", "state": self.state})

    def _send(self, data: Mapping[str, Any]) -> None:
        assert self._process is not None and self._process.stdin is not None
        with suppress(ConnectionError, RuntimeError):
            self._process.stdin.write(json_line(data).encode())


def opened(path: Path) -> IO[bytes]:
    """Return an open file for a trace. Raises UsageError if it cannot be written."""
    try:
        return path.open("wb")
    except OSError as error:
        raise _unwritable(path, error) from error


def _unwritable(path: Path, error: OSError) -> UsageError:
    return UsageError(f"cannot write the trace {path}: {error.strerror}")


def _death(status: int) -> str:
    """Return the message about a process that ended before its run did."""
    if status == -signal.SIGKILL:
        return "the process of the run was killed (SIGKILL), perhaps because memory ran out"
    if status < 0:
        return f"the process of the run was ended by {signal.Signals(-status).name}"
    return f"the process of the run ended with exit status {status}"


_SETTLED = 0.05
"""Seconds without a trace line after which pages receive a complete tick."""


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
