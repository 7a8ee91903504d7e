"""The seconds of runs with one command after the other, in the tree of safenav on the path.

For ``one_clock.py --before``: reads a list of ``[scenario file, draw, speeds]`` from standard
input, and prints one line of JSON for each, ``[outcome, seconds]``. The durations are those of the
live simulation: 1 s over the speed for a step, five times as long for a tenth of them, 2 s over
the slowest speed for an action. It relies on little, so that old trees can run it.
"""

import json
import random
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario

LATE, FACTOR, ACTION = 0.1, 5.0, 2.0
PLACES = ("safenav.runtime.worlds.world", "safenav.runtime.world")
"""Where the simulated world is, and was."""


def simulated_world(scenario: Any) -> Any:
    for place in PLACES:
        with suppress(ModuleNotFoundError):
            return import_module(place).SimulatedWorld(scenario)
    raise AssertionError(f"no simulated world in {' or '.join(PLACES)}")


class Serial:
    """The scenario's own world by three blocking calls; ``seconds``: how long they took."""

    def __init__(self, scenario: Any, draw: int, speeds: Mapping[str, float]) -> None:
        self._truth: Any = simulated_world(scenario)
        self._speeds, self.seconds = speeds, 0.0
        self._draws = {r.name: random.Random(f"{draw}/{r.name}") for r in scenario.robots}
        self._poses = {robot.name: robot.start for robot in scenario.robots}
        self.sense = self._truth.sense

    def move(self, robot: Any, pose: Any) -> None:
        name = robot.name
        if self._poses[name] == pose:
            return
        draws, timing = self._draws[name], robot.model.timing
        draws.randint(timing.least, timing.most)
        late = FACTOR if draws.random() < LATE else 1.0
        self.seconds += late / self._speeds[name]
        self._poses[name] = pose
        self._truth.move(robot, pose)

    def act(self, robot: Any) -> Any:
        works = list(self._truth._works.open.values())
        before = [(work.need, work.done) for work in works]
        found = self._truth.act(robot)
        for work, (need, done) in zip(works, before, strict=True):
            if (work.need, work.done) != (need, done):
                together = work.need > need and work.obstacle.needs[need].together
                group = work.groups[need] if together else (robot.name,)
                self.seconds += ACTION / min(self._speeds[name] for name in group)
        return found


def main() -> None:
    for file, draw, speeds in json.load(sys.stdin):
        try:
            scenario = load_scenario(Path(file))
            world = Serial(scenario, draw, speeds)
            outcome = str(Mission(scenario, world=world).run().outcome.value)
            print(json.dumps([outcome, world.seconds]), flush=True)
        except Exception as error:  # a tree that cannot read the scenario
            print(json.dumps([f"{type(error).__name__}: {error}", 0.0]), flush=True)


if __name__ == "__main__":
    main()
