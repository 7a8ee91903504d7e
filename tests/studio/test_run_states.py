"""The run states that pages receive, whichever page requests them."""

import asyncio
import os
import signal
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from safenav.studio import live
from safenav.studio.live import StudioRun
from safenav.studio.process import RunOrder
from studio.serving import MINUTES, SCENARIOS

DOOR = SCENARIOS / "case_study_1.yaml"


Processes = list[asyncio.subprocess.Process]


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch) -> Processes:
    """The processes of the runs of a test."""
    found: Processes = []
    start = live.started

    async def started(module: str, order: RunOrder) -> asyncio.subprocess.Process:
        found.append(await start(module, order))
        return found[-1]

    monkeypatch.setattr(live, "started", started)
    return found


@pytest.mark.parametrize("asked_for", ["pause", "whole", "nothing"])
def test_pages_learn_that_a_long_tick_has_ended(processes: Processes, asked_for: str) -> None:
    """Also where something else has told that the tick takes long before the regular look did: a
    pause, or a page that was just opened."""
    told: list[dict[str, Any]] = []

    async def story(run: StudioRun) -> None:
        os.kill(processes[0].pid, signal.SIGSTOP)
        run.step()
        await until(lambda: run.state["busy"])  # no other task has had a turn since it became so
        if asked_for == "pause":
            run.pause()
        if asked_for == "whole":
            told.append({"is": "run", "state": run.state})
            os.kill(processes[0].pid, signal.SIGCONT)
        await until(lambda: shown(told)["busy"])
        os.kill(processes[0].pid, signal.SIGCONT)
        await until(lambda: not shown(told)["busy"])
        assert shown(told)["phase"] == "paused"

    play(story, told)


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (signal.SIGKILL, "was killed (SIGKILL), perhaps because memory ran out"),
        (signal.SIGTERM, "was ended by SIGTERM"),
    ],
)
def test_a_run_whose_process_is_killed_has_failed(
    processes: Processes, number: signal.Signals, words: str
) -> None:
    """It does not look like one that a user has ended; the ticks before it are kept."""
    told: list[dict[str, Any]] = []

    async def story(run: StudioRun) -> None:
        os.kill(processes[0].pid, number)
        await until(lambda: shown(told)["phase"] == "ended")
        assert shown(told)["failure"] == f"the process of the run {words}"
        assert run.whole is not None

    play(story, told)


def test_a_user_who_ends_a_run_sees_no_failure(processes: Processes) -> None:
    told: list[dict[str, Any]] = []

    async def story(run: StudioRun) -> None:
        os.kill(processes[0].pid, signal.SIGSTOP)  # so that it has to be killed
        await run.end()
        assert shown(told)["phase"] == "ended"
        assert shown(told)["failure"] is None

    play(story, told)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_ends_the_run_and_is_named() -> None:
    told: list[dict[str, Any]] = []

    async def story() -> None:
        run = StudioRun(RunOrder(DOOR.read_text(), str(DOOR)), told.append, trace=Path("/dev/full"))
        await run.start()
        await until(lambda: shown(told)["phase"] == "ended")
        found = shown(told)["failure"]
        assert found == "cannot write the trace /dev/full: No space left on device"
        await run.end()  # as another run does first

    asyncio.run(story())


def play(story: Callable[[StudioRun], Awaitable[None]], told: list[dict[str, Any]]) -> None:
    """A run that has begun and waits, and what happens to it."""

    async def main() -> None:
        run = StudioRun(RunOrder(DOOR.read_text(), str(DOOR)), told.append, trace=None)
        await run.start()
        await until(lambda: run.state["phase"] == "paused")
        await story(run)
        await run.end()

    asyncio.run(main())


def shown(told: list[dict[str, Any]]) -> dict[str, Any]:
    """The state that a page shows."""
    states: list[dict[str, Any]] = [message["state"] for message in told if "state" in message]
    return states[-1]


async def until(condition: Any) -> None:
    async with asyncio.timeout(MINUTES):
        while not condition():
            await asyncio.sleep(0)
