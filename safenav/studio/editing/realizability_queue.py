"""Realizability checks in the background; the next change ends a running one."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from safenav.studio.run.orders import RunOrder, kill, started

CALM = 0.25
"""Seconds without a change before the robots are checked."""


class RealizabilityQueue:
    """Owner of the checking process. ``verdicts``: of each robot, for the present text."""

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        self.verdicts: dict[str, dict[str, Any]] = {}
        self._tell = tell
        self._task: asyncio.Task[None] | None = None

    def check(self, order: RunOrder | None) -> None:
        """Check this text; None ends the check of the one before."""
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
        process = await started("safenav.studio.editing.realizability_check", order)
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
