"""Whole runs of teams, measured: wall and CPU seconds, syntheses, and every search for a plan.

The random missions are those of the campaigns (``tests/campaigns``), by family and seed.
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any
from unittest.mock import patch

import yaml
from floors import benchmark, maps_folder, mission
from floors import mirrored as mirrored_team
from measuring import cpu_seconds

from safenav.plan.search import Answer, Search
from safenav.runtime.run.mission import Mission, default_synthesizer
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.synthesis.cache import Cache

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Run:
    """Results and costs of one run. ``cpu``: of safenav and its synthesizers; ``searches``: seconds
    of each search for a joint plan."""

    outcome: str
    wall: float
    cpu: float
    syntheses: int
    searches: tuple[float, ...]


def run(scenario: str | Mapping[str, Any]) -> Run:
    """Run a shipped scenario by name, or a mission's data, with an empty cache, verified."""
    if isinstance(scenario, str):
        read = load_scenario(ROOT / "scenarios" / f"{scenario}.yaml")
    else:
        read = load_scenario_text(yaml.safe_dump(dict(scenario), sort_keys=False))
    synthesizer = default_synthesizer(read)
    synthesizer.cache = Cache(None)
    begun, spent = time.perf_counter(), cpu_seconds()
    with _searches() as searches:
        result = Mission(read, synthesizer=synthesizer).run()
    wall, cpu = time.perf_counter() - begun, cpu_seconds() - spent
    return Run(result.outcome.value, wall, cpu, result.syntheses, tuple(searches))


def crowd(seed: int) -> Run:
    """Robots in rooms, some with headings, with hidden obstacles."""
    return run(mission("crowd_hidden", seed))


def mirrored(quadcopters: int) -> Run:
    """Quadcopters that go to mirrored places on the other side of an open floor."""
    return run(mirrored_team(quadcopters))


def large(robots: int, flyers: int, doors: int, seed: int = 0) -> Run | None:
    """Robots on random-32-32-10, half of them with headings; None where the map is missing."""
    return run(benchmark(robots, flyers, doors, seed)) if maps_folder() else None


@contextmanager
def _searches() -> Iterator[list[float]]:
    """The CPU seconds of each search while the block runs."""
    seconds: list[float] = []
    search = Search.run

    @wraps(search)
    def timed(self: Search) -> Answer:
        begun = time.process_time()
        try:
            return search(self)
        finally:
            seconds.append(time.process_time() - begun)

    with patch.object(Search, "run", timed):
        yield seconds
