"""Streams of references to robots behind a middleware: one thread, 20 messages a second a robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from safenav.fleet.setpoints import Setpoints

PERIOD = 0.05
"""Seconds between two messages."""


class Streams:
    """The references of all robots that follow; ``send`` gets what is ahead, in a thread. A stream
    continues after the end of its reference: its silence tells a robot that safenav has died."""

    def __init__(self, send: Callable[[str, Setpoints], None]) -> None:
        self._send = send
        self._references: dict[str, Setpoints] = {}
        self._lock = Lock()
        self._end = Event()
        self._thread: Thread | None = None

    def follow(self, robot: str, reference: Setpoints) -> None:
        """Stream this reference from now on. Its times are those of ``time.monotonic``."""
        with self._lock:
            self._references[robot] = reference
            if self._thread is None:
                self._thread = Thread(target=self._run, daemon=True)
                self._thread.start()

    def stop(self, robot: str) -> bool:
        """End the stream of a robot; whether it had one."""
        with self._lock:
            return self._references.pop(robot, None) is not None

    def close(self) -> None:
        self._end.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        due = time.monotonic()
        while not self._end.wait(max(0.0, due - time.monotonic())):
            with self._lock:
                now = list(self._references.items())
            for robot, reference in now:
                self._send(robot, reference.ahead(time.monotonic()))
            due = max(due + PERIOD, time.monotonic())
