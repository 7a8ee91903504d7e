"""Realizability of each robot while a scenario is drawn, checked in a separate process.

The process reads a ``RunOrder`` from standard input, and writes JSON objects with the verdict and
reason of a robot. It is killed when the text changes; only the synthesis cache remains.
"""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from safenav.errors import ResourceLimitError, SafenavError
from safenav.lines import line_output
from safenav.report.terminal.explanation_text import explanation_data
from safenav.review.postmortem import explain_team
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_draft
from safenav.studio.process import RunOrder, kill, started

CALM = 0.25
"""Seconds without a change before the robots are checked."""


class RealizabilityQueue:
    """Owner of the checking process. ``verdicts``: verdicts by robot, for the present text."""

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        self.verdicts: dict[str, dict[str, Any]] = {}
        self._tell = tell
        self._task: asyncio.Task[None] | None = None

    def check(self, order: RunOrder | None) -> None:
        """Check a text instead of the previous one; None: check none."""
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
        process = await started("safenav.studio.editing.realizability", order)
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
    """Check the robots of one text."""
    say = line_output()
    order = RunOrder.read(sys.stdin.readline())
    scenario = load_draft(order.text, order.file, order.reach, reachable=False).scenario
    if scenario is None:
        return
    verdicts: dict[str, dict[str, Any]] = {}
    for robot in scenario.robots:
        verdicts[robot.name] = _verdict(scenario, robot.name)
        if verdicts[robot.name]["verdict"] != "unrealizable":
            say(verdicts[robot.name])
        else:  # the verdict first, the reason later
            say({**verdicts[robot.name], "because": "looking for the reason ..."})
    for name, verdict in verdicts.items():
        if verdict["verdict"] == "unrealizable":
            say(verdict | _reason(scenario, name))


def _verdict(scenario: Scenario, name: str) -> dict[str, Any]:
    try:
        answer = first_results(scenario, default_synthesizer(scenario), None, [name])[name]
    except ResourceLimitError as error:
        return {"robot": name, "verdict": "limit", "because": str(error)}
    found = {"robot": name, "verdict": "realizable" if answer.realizable else "unrealizable"}
    allows = answer.allows(scenario.map.word) if answer.realizable else None
    return {**found, "allows": allows} if allows else found


def _reason(scenario: Scenario, name: str) -> dict[str, Any]:
    try:
        found = [*explain_team(scenario, default_synthesizer(scenario), [name])]
    except SafenavError as error:
        return {"because": str(error)}
    if not found:
        return {}
    data = explanation_data(found[0], scenario)
    return {
        "because": data["because"],
        "confined": data["confined"],
        "lost": sorted({region for target in data["lost"] for region in target}),
        "repairs": [
            {"kind": repair.kind.value, "change": [list(pair) for pair in repair.change]}
            for repair in found[0].repairs
        ],
    }


if __name__ == "__main__":
    main()
