"""The process of a live run: it steps a mission on request and writes its trace.

In a separate process, a synthesis blocks no page and the run can be stopped at any moment: SIGINT
ends it at the next opportunity, as in ``safenav run``.

Messages are JSON, one object per line. To the process: a ``RunOrder`` first, then ``{"do":
"step"}``, ``{"do": "change", ...}``, ``{"do": "end"}``. From it: the lines of the trace, and lines
whose ``type`` begins with ``~``: ``~done`` (a tick has ended), ``~refused`` (an invalid change),
``~failed`` (the run ended in an error).
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import time
from asyncio.subprocess import DEVNULL, PIPE, Process
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from msgspec import Struct, convert, to_builtins
from msgspec.structs import replace

from safenav.errors import SafenavError, UsageError
from safenav.lines import json_line, line_output
from safenav.runtime.interventions import intervention
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.scenario.yaml.findings import ReadableFolder
from safenav.trace.writing import as_data

LIMIT = 32 * 2**20
"""Largest line of a process, in bytes."""
DONE, REFUSED, FAILED = "~done", "~refused", "~failed"


class RunOrder(Struct, frozen=True):
    """A scenario to run. ``folder``: the folder whose files it may read; None: any, since the user
    named it. ``seed`` and ``clock`` override its own."""

    text: str
    file: str
    folder: str | None = None
    seed: int | None = None
    clock: str | None = None

    @property
    def reach(self) -> ReadableFolder | None:
        """The files that the scenario may name."""
        return None if self.folder is None else ReadableFolder(Path(self.folder))

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


def main() -> None:
    """Serve one run over standard input and output."""
    say = line_output()
    try:
        _serve(sys.stdin, say)
    except SafenavError as error:
        say({"type": FAILED, "message": str(error)})
    except BrokenPipeError:
        os._exit(1)  # the server has ended
    except Exception as error:
        say({"type": FAILED, "message": f"internal error: {type(error).__name__}: {error}"})
        raise


def _serve(orders: IO[str], say: Any) -> None:
    order = RunOrder.read(orders.readline())
    scenario = load_scenario_text(order.text, order.file, reach=order.reach)
    if order.seed is not None:
        scenario = replace(scenario, seed=order.seed)
    if order.clock is not None:
        scenario = replace(scenario, clock=Clock(order.clock))

    mission = Mission(scenario, listeners=[lambda record: say(as_data(record))], attended=True)

    def interrupt(*_: object) -> None:
        if mission.stopping:
            raise KeyboardInterrupt
        mission.stop("ended by the user")

    signal.signal(signal.SIGINT, interrupt)
    mission.start()
    say({"type": DONE, "tick": 0})
    while mission.result is None:
        rested = time.monotonic()
        line = orders.readline()
        mission.exclude_idle_time(time.monotonic() - rested)
        if not line:
            break
        data = json.loads(line)
        if data["do"] == "step":
            mission.step()
            say({"type": DONE, "tick": mission.tick})
        elif data["do"] == "change":
            try:
                mission.intervene(intervention(data, mission.scenario))
            except UsageError as error:
                say({"type": REFUSED, "message": str(error)})
        else:
            mission.give_up("ended by the user")
            say({"type": DONE, "tick": mission.tick})


if __name__ == "__main__":
    main()
