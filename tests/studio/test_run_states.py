"""What pages are told of the state of a run, whoever asks for it."""

import asyncio
import os
import signal
from typing import Any

import pytest

from safenav.studio.run import live
from safenav.studio.run.live import StudioRun
from safenav.studio.run.orders import RunOrder
from studio.serving import MINUTES, SCENARIOS

DOOR = SCENARIOS / "case_study_1.yaml"


@pytest.mark.parametrize("asked_for", ["pause", "nothing"])
def test_the_end_of_a_long_tick_is_told(monkeypatch: pytest.MonkeyPatch, asked_for: str) -> None:
    """Also where a pause has told that the tick takes long, before the regular look did."""
    told: list[dict[str, Any]] = []
    processes: list[asyncio.subprocess.Process] = []

    async def started(module: str, order: RunOrder) -> asyncio.subprocess.Process:
        processes.append(await start(module, order))
        return processes[-1]

    start = live.started
    monkeypatch.setattr(live, "started", started)

    async def story() -> None:
        run = StudioRun(RunOrder(DOOR.read_text(), str(DOOR)), told.append, trace=None)
        await run.start()
        await until(lambda: run.state["phase"] == "paused")
        os.kill(processes[0].pid, signal.SIGSTOP)
        run.step()
        await until(lambda: run.state["busy"])  # no other task has had a turn since it became so
        if asked_for == "pause":
            run.pause()
        await until(lambda: shown(told)["busy"])
        os.kill(processes[0].pid, signal.SIGCONT)
        await until(lambda: not shown(told)["busy"])
        assert shown(told)["phase"] == "paused"
        await run.end()

    asyncio.run(story())


def shown(told: list[dict[str, Any]]) -> dict[str, Any]:
    """The state that a page shows."""
    states: list[dict[str, Any]] = [message["state"] for message in told if "state" in message]
    return states[-1]


async def until(condition: Any) -> None:
    async with asyncio.timeout(MINUTES):
        while not condition():
            await asyncio.sleep(0)
