"""Messages between the server and the process of a run: JSON, one object per line.

To the process: a ``RunOrder`` first, then ``{"do": "step"}``, ``{"do": "change", ...}``, ``{"do":
"end"}``. From it: the lines of the trace, and lines whose ``type`` begins with ``~``: ``~done``
(a tick has ended), ``~refused`` (an invalid change), ``~failed`` (the run ended in an error).
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from asyncio.subprocess import DEVNULL, PIPE, Process
from contextlib import suppress
from pathlib import Path

from msgspec import Struct, convert, to_builtins

from safenav.lines import json_line
from safenav.scenario.yaml.findings import ReadableFolder

LIMIT = 32 * 2**20
"""Largest line of a process, in bytes."""
DONE, REFUSED, FAILED = "~done", "~refused", "~failed"


class RunOrder(Struct, frozen=True):
    """A scenario to run. ``folder``: the folder whose files it may read (None: none); ``trusted``:
    it may read any file, since the user named it. ``seed`` and ``clock`` override its own.
    ``first``: robots whose realizability is checked first."""

    text: str
    file: str
    folder: str | None = None
    trusted: bool = False
    seed: int | None = None
    first: tuple[str, ...] = ()
    clock: str | None = None

    @property
    def reach(self) -> ReadableFolder | None:
        """The files that the scenario may name."""
        if self.trusted:
            return None
        return ReadableFolder(None if self.folder is None else Path(self.folder))

    def line(self) -> str:
        return json_line(to_builtins(self))

    @classmethod
    def read(cls, line: str) -> RunOrder:
        return convert(json.loads(line), cls)


async def started(module: str, order: RunOrder) -> Process:
    """Start a process of the studio in its own session, and send its order."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", module),
        stdin=PIPE,
        stdout=PIPE,
        stderr=DEVNULL,
        limit=LIMIT,
        start_new_session=True,
    )
    assert process.stdin is not None
    process.stdin.write(order.line().encode())
    return process


def kill(process: Process) -> None:
    """Kill a process and its children."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
