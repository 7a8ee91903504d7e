"""The processes of the studio: ``run`` steps a mission on request and writes its trace; ``robots``
checks the realizability of each robot of a drawn scenario.

In a separate process, a synthesis blocks no page and can be stopped at any moment. SIGINT ends a
run at the next opportunity, as in ``safenav run``. A changed text kills a check; only the synthesis
cache remains.

Messages are JSON, one object per line. To the process: first a ``RunOrder``, then for a run
``{"do": "step"}``, ``{"do": "change", ...}``; the end of the input ends the run. From a run: the
lines of the trace, and lines with a ``type`` that begins with ``~``: ``~done`` (a tick has ended),
``~refused`` (an invalid change), ``~failed`` (the run ended in an error). From a check: the verdict
and reason of a robot.
"""

import asyncio
import json
import os
import signal
import sys
import time
from asyncio.subprocess import DEVNULL, PIPE, Process
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from msgspec import Struct
from msgspec.json import decode, encode
from msgspec.structs import replace

from safenav.errors import SafenavError, UsageError
from safenav.files import json_line
from safenav.runtime.run.mission import Mission, default_synthesizer, first_results
from safenav.scenario.model import Clock, Scenario
from safenav.scenario.reading.loader import load_draft, load_scenario_text
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.file import as_data

LIMIT = 32 * 2**20
"""Maximum length of a line of a process, in bytes."""
DONE, REFUSED, FAILED = "~done", "~refused", "~failed"


class RunOrder(Struct, frozen=True):
    """A scenario to run. ``folder``: the folder whose files the scenario may name; None: any files,
    since the user named it. ``seed`` and ``clock`` override those of the scenario."""

    text: str
    file: str
    folder: str | None = None
    seed: int | None = None
    clock: str | None = None

    @property
    def reach(self) -> Path | None:
        """The folder whose files the scenario may name; None: any."""
        return None if self.folder is None else Path(self.folder)


async def started(job: str, order: RunOrder) -> Process:
    """Start a process of the studio in its own session and send it the order. Return it."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", __name__, job),
        stdin=PIPE,
        stdout=PIPE,
        stderr=DEVNULL,
        limit=LIMIT,
        start_new_session=True,
    )
    assert process.stdin is not None
    process.stdin.write(encode(order) + b"\n")
    return process


def kill(process: Process) -> None:
    """Kill a process and its children."""
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)


CALM = 0.25
"""Seconds without a change of the text before the check of the robots."""


class RealizabilityQueue:
    """The owner of the checking process. ``verdicts``: by robot, for the present text."""

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        self.verdicts: dict[str, dict[str, Any]] = {}
        self._tell = tell
        self._task: asyncio.Task[None] | None = None

    def check(self, order: RunOrder | None) -> None:
        """Check the text of an order instead of the previous one; None: check no text."""
        self.verdicts = {}
        if self._task is not None:
            self._task.cancel()
        self._task = None if order is None else asyncio.create_task(self._check(order))

    async def close(self) -> None:
        """End the running check."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    async def _check(self, order: RunOrder) -> None:
        await asyncio.sleep(CALM)
        process = await started("robots", order)
        assert process.stdout is not None
        try:
            async for line in process.stdout:
                verdict = json.loads(line)
                self.verdicts[verdict["robot"]] = verdict
                self._tell({"is": "verdicts", "verdicts": self.verdicts})
        finally:
            kill(process)
            with suppress(asyncio.CancelledError):
                await process.wait()


def main() -> None:
    """Execute a job, ``run`` or ``robots``, over standard input and output."""
    say, order = _line_output(), decode(sys.stdin.readline(), type=RunOrder)
    if sys.argv[1] == "robots":
        return _check(order, say)
    try:
        _serve(order, sys.stdin, say)
    except SafenavError as error:
        say({"type": FAILED, "message": str(error)})
    except Exception as error:
        say({"type": FAILED, "message": f"internal error: {type(error).__name__}: {error}"})


def _line_output() -> Callable[[Any], None]:
    """Return a function that prints data as a line of JSON to the present standard output. Redirect
    all other output to standard error."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def write(data: Any) -> None:
        out.write(json_line(data))
        out.flush()

    return write


def _serve(order: RunOrder, requests: IO[str], say: Any) -> None:
    scenario = load_scenario_text(order.text, order.file, reach=order.reach)
    if order.seed is not None:
        scenario = replace(scenario, seed=order.seed)
    if order.clock is not None:
        scenario = replace(scenario, clock=Clock(order.clock))

    mission = Mission(scenario, listeners=[lambda record: say(as_data(record))], attended=True)
    signal.signal(signal.SIGINT, lambda *_: mission.stop("ended by the user"))
    mission.start()
    say({"type": DONE, "waits": mission.waiting is not None})
    while mission.result is None:
        rested = time.monotonic()
        line = requests.readline()
        mission.exclude_idle_time(time.monotonic() - rested)
        data = json.loads(line or "{}")
        if data.get("do") == "change":
            try:
                mission.intervene({key: value for key, value in data.items() if key != "do"})
            except UsageError as error:
                say({"type": REFUSED, "message": str(error)})
            continue
        if line:
            mission.step()
        else:
            mission.give_up("ended by the user")
        say({"type": DONE, "waits": mission.waiting is not None})


def _check(order: RunOrder, say: Any) -> None:
    """Check the robots of a text. Write all verdicts first, then the reasons."""
    scenario = load_draft(order.text, order.file, order.reach, reachable=False).scenario
    if scenario is None:
        return
    synthesizer = default_synthesizer(scenario)
    unrealizable = []
    for robot in scenario.robots:
        found = _verdict(scenario, robot.name, synthesizer)
        say({"robot": robot.name} | found)
        if found["verdict"] == "unrealizable":
            unrealizable.append(robot.name)
    for name in unrealizable:
        reason = _reason(scenario, name, synthesizer)
        say({"robot": name, "verdict": "unrealizable"} | reason)


def _verdict(scenario: Scenario, name: str, synthesizer: Synthesizer) -> dict[str, Any]:
    try:
        answer = first_results(scenario, synthesizer, names=[name])[name]
    except SafenavError as error:  # a limit or a broken synthesizer
        return {"verdict": "unknown", "because": str(error)}
    if not answer.realizable:
        return {"verdict": "unrealizable", "because": "looking for the reason ..."}
    return {"verdict": "realizable", "allows": answer.allows(scenario.map.word)}


def _reason(scenario: Scenario, name: str, synthesizer: Synthesizer) -> dict[str, Any]:
    from safenav.report.terminal.explanation_text import cause_words
    from safenav.review.postmortem import explain_team

    try:
        (found,) = explain_team(scenario, synthesizer, [name])
    except SafenavError as error:
        return {"because": str(error)}
    return {"because": cause_words(found, scenario.map)}


if __name__ == "__main__":
    main()
