"""A run of a scenario: ``python -m safenav.runtime.run.mission FILE [TRACE]``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from safenav.runtime.control.coordinate import End
from safenav.runtime.control.tasks import Answers
from safenav.runtime.run.loop import Run
from safenav.runtime.run.record import Recorder
from safenav.runtime.run.world import Seconds, Ticks
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.synthesis.slugs import Synthesizer
from safenav.team.team import Team, team_of
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


def play(scenario: Scenario, *, live: bool = False, seed: int = 0) -> tuple[End, list[Record], Run]:
    """The end of a run, the lines of its trace, and the run itself."""
    team: Team = team_of(scenario)
    world = Seconds(team, seed) if live else Ticks(team)
    lines: list[Record] = []
    run = Run(team, world, answers_for(scenario), Recorder(team, world.truths, lines.append))
    return run.run(), lines, run


def text_of(lines: list[Record]) -> list[str]:
    return [json.dumps(as_data(line)) + "\n" for line in lines]


if __name__ == "__main__":
    end, lines, _ = play(load_scenario(sys.argv[1]), live="--live" in sys.argv)
    if len(sys.argv) > 2 and not sys.argv[2].startswith("--"):
        Path(sys.argv[2]).write_text("".join(text_of(lines)))
    print(end.outcome, end.cause or "", end.why, lines[-1].tick, "ticks")
