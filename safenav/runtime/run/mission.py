"""A run of a scenario: ``python -m safenav.runtime.run.mission FILE [TRACE]``."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

from msgspec.structs import replace

from safenav.runtime.control.coordinate import End
from safenav.runtime.control.tasks import Answers
from safenav.runtime.run.loop import Run
from safenav.runtime.run.record import Recorder
from safenav.runtime.run.world import World
from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.synthesis.slugs import Synthesizer
from safenav.team.team import team_of
from safenav.trace.records import Record
from safenav.trace.writing import as_data
from safenav.verify.verification import first_failure


def answers_for(scenario: Scenario) -> Answers:
    limits = scenario.limits
    return Answers(
        Synthesizer(
            seconds=limits.synthesis_seconds,
            memory_mb=limits.synthesis_memory,
            verifier=first_failure,
        )
    )


def mission(
    scenario: Scenario,
    world: protocol.World | protocol.BlockingWorld | None,
    listener: Callable[[Record], None],
) -> Run:
    """Return a run that has not begun. ``world``: None for a simulation with the scenario's
    clock; ``listener`` receives the lines of its trace."""
    if world is None:
        live = scenario.clock is Clock.LIVE
        world = LiveSimulation(scenario) if live else SimulatedWorld(scenario)
    truth = world.truth if isinstance(world, LiveSimulation) else world
    truths = truth.truths if isinstance(truth, SimulatedWorld) else None
    team, running = team_of(scenario), World(scenario, world)
    recorder = Recorder(team, truths, listener, live=running.live)
    return Run(team, running, answers_for(scenario), recorder)


def play(
    scenario: Scenario, *, world: protocol.World | protocol.BlockingWorld | None = None
) -> tuple[End, list[Record], Run]:
    """The end of a run, the lines of its trace, and the run itself."""
    lines = list[Record]()
    run = mission(scenario, world, lines.append)
    return run.run(), lines, run


def text_of(lines: list[Record]) -> list[str]:
    return [json.dumps(as_data(line)) + "\n" for line in lines]


if __name__ == "__main__":
    scenario = load_scenario(sys.argv[1])
    if "--live" in sys.argv:
        scenario = replace(scenario, clock=Clock.LIVE)
    end, lines, _ = play(scenario)
    if len(sys.argv) > 2 and not sys.argv[2].startswith("--"):
        Path(sys.argv[2]).write_text("".join(text_of(lines)))
    print(end.outcome, end.cause or "", end.why, lines[-1].tick, "ticks")
