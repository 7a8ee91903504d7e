"""Runs with their lines and their state."""

import json

from safenav.runtime.run.loop import Run
from safenav.runtime.run.mission import Mission, RunResult
from safenav.runtime.worlds.protocol import BlockingWorld, World
from safenav.scenario.model import Scenario
from safenav.trace.records import Record
from safenav.trace.writing import as_data


def play(
    scenario: Scenario, *, world: World | BlockingWorld | None = None
) -> tuple[RunResult, list[Record], Run]:
    """The result of a run, the lines of its trace, and the run itself."""
    lines = list[Record]()
    mission = Mission(scenario, world=world, listeners=[lines.append])
    return mission.run(), lines, mission._run


def text_of(lines: list[Record]) -> list[str]:
    return [json.dumps(as_data(line)) + "\n" for line in lines]
