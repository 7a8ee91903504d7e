"""Write the trace: JSON Lines, each line flushed when the event happens (docs/trace.md)."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from safenav.errors import UsageError
from safenav.runtime.events import Event
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.motion import resolved
from safenav.scenario.objective import to_data
from safenav.world.map import RegionMap

Listener = Callable[[Event], None]


def scenario_record(scenario: Scenario, truths: Mapping[str, bool | None] | None) -> dict[str, Any]:
    """The scenario as it stands in a trace header, fully resolved.

    ``truths`` maps an obstacle's name to what this run's seed made of ``traversable``; None
    stands for a world that is not simulated, of which nobody knows any truth beforehand.
    """
    world = scenario.map
    robots = {
        robot.name: {
            "model": robot.model.name,
            "mobility": robot.model.mobility.value,
            "layer": robot.model.layer,
            "capabilities": sorted(robot.capabilities),
            "vision": robot.model.vision,
            "motion": resolved(robot.model.motion, robot.model.size, robot.model.speed),
            "conflicts": [
                other.name
                for other in scenario.robots
                if other is not robot and scenario.conflict(robot, other)
            ],
            "start": robot.start.region,
            "heading": robot.start.heading.label if robot.start.heading is not None else None,
            "objective": to_data(robot.objective),
        }
        for robot in scenario.robots
    }
    return {
        "name": scenario.name,
        "map": _map_record(world),
        "robots": robots,
        "world": "external" if truths is None else "simulated",
        "obstacles": [
            obstacle_record(o, scenario, None if truths is None else truths[o.name])
            for o in scenario.obstacles
        ],
        "until": {"rounds": scenario.until.rounds},
        "limits": {"ticks": scenario.limits.ticks},
        "seed": scenario.seed,
        "coordination": scenario.coordination.value,
    }


def _map_record(world: RegionMap) -> dict[str, Any]:
    """Its metres only if they are known."""
    record = {"rows": world.rows, "cols": world.cols, "grid": world.grid_rows()}
    if world.frame is None:
        return record
    origin = [*world.frame.origin, world.frame.yaw]
    return {**record, "resolution": list(world.frame.resolution), "origin": origin}


def obstacle_record(
    obstacle: Obstacle, scenario: Scenario, truth: bool | None = None
) -> dict[str, Any]:
    """An obstacle as it stands in a trace, ``truth`` being what resolving it will reveal."""
    return {
        "type": obstacle.type.name,
        "name": obstacle.name,
        "region": obstacle.region,
        "action": obstacle.type.action,
        "resolution_regions": list(obstacle.resolution_regions(scenario.map)),
        "blocks": [robot.name for robot in scenario.robots if obstacle.blocks(robot)],
        "traversable": truth,
    }


class TraceWriter:
    """A listener that appends each event to a file and flushes it.

    Raises UsageError when the file cannot be opened or written: a run whose trace is lost
    must not go on as if nothing had happened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file: IO[str] = path.open("w", encoding="utf-8")
        except OSError as error:
            raise self._failure(error) from error

    def __call__(self, event: Event) -> None:
        try:
            self._file.write(json.dumps(event.record(), separators=(",", ":")) + "\n")
            self._file.flush()
        except OSError as error:
            raise self._failure(error) from error

    def _failure(self, error: OSError) -> UsageError:
        return UsageError(f"cannot write the trace {self._path}: {error.strerror}")

    def __enter__(self) -> TraceWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self._file.close()
        except OSError as failure:
            if kind is None:
                raise self._failure(failure) from failure
