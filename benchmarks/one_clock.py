"""Measure the gain of robots that move at the same time.

    python benchmarks/one_clock.py                          # team_of_six, warehouse, crowds, floors
    python benchmarks/one_clock.py --draws 5 --only floor-20

Each draw gives every robot a speed from 0.5 to 2 steps per second; a tenth of the steps takes five
times as long. ``serial``: each command waits for the one before; ``live``: a live run; ``bound``:
the longest robot alone on the floor, without obstacles. Seconds of the simulated clock, medians.
``serial/bound`` is what ``serial/live`` can be at most: runs in which nobody waits for anybody.
``ms``: CPU milliseconds of the runtime for each step of the live run, without syntheses. Nothing
here is a test: it reports.
"""

from __future__ import annotations

import random
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import click
import yaml
from msgspec.structs import replace

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from live.missions import crowd
from safenav.outcome import Outcome
from safenav.pace.robot import TickPace
from safenav.report.terminal.table import table
from safenav.runtime.mission import Mission, default_synthesizer
from safenav.runtime.worlds.protocol import Acted, Arrived
from safenav.runtime.worlds.simulation import LiveSimulation
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.moves import Pose

SCENARIOS = Path(__file__).parents[1] / "scenarios"
HEADINGS = (
    *("team", "runs", "serial s", "live s", "bound s"),
    *("serial/live", "live/bound", "serial/bound", "ms"),
)
SIDE = 2.7


@dataclass(frozen=True)
class Draw:
    """The three times of one draw, and the CPU milliseconds of a step of the live run."""

    serial: float
    live: float
    bound: float
    milliseconds: float


class Serial:
    """A world in which each command is over before the next begins."""

    def __init__(self, world: LiveSimulation) -> None:
        self._world = world
        self._poses: dict[str, Pose] = {}

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self._world.sense(robot, region)

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        if self._poses.get(robot.name, robot.start) == pose:
            return None
        self._poses[robot.name] = pose
        self._world.start(robot, pose, 0)
        (event,) = self._world.wait(None)
        assert isinstance(event, Arrived)
        return None

    def act(self, robot: Robot) -> Iterator[tuple[Obstacle, bool | None]]:
        event = self._world.act(robot, (), 0)
        if event is None:
            (event,) = self._world.wait(None)  # type: ignore[assignment]
        assert isinstance(event, Acted)
        for obstacle, result in event.found:
            done = result is ActResult.DONE
            yield obstacle, done if obstacle.type.has_truth else None if done else False


class Steps(TickPace):
    """One step per second, whatever the timing of the model."""

    def step(
        self, now: float, origin: int, to: int, _: int | None = None, slower: float = 1.0
    ) -> float:
        return super().step(now, origin, to, None, slower)


def simulation(scenario: Scenario, draw: int) -> LiveSimulation:
    rng = random.Random(f"speeds {draw}")
    speeds = {robot.name: rng.uniform(0.5, 2) for robot in scenario.robots}
    paces = {robot.name: Steps(scenario.map.cols, SIDE, None) for robot in scenario.robots}
    return LiveSimulation(scenario, speeds=speeds, delayed=0.1, seed=draw, paces_of=paces)


def measure(scenario: Scenario, draw: int) -> Draw | None:
    """None if a run is not completed."""
    serial, live = simulation(scenario, draw), simulation(scenario, draw)
    first = Mission(scenario, world=Serial(serial)).run()
    synthesizer = default_synthesizer(scenario)
    mission = Mission(scenario, synthesizer, world=live)
    apart = 0.0
    search = mission._search
    original = search.synthesize

    def apart_from_the_rest(ladders):  # type: ignore[no-untyped-def]
        nonlocal apart
        begun = time.process_time()
        found = original(ladders)
        apart += time.process_time() - begun
        return found

    search.synthesize = apart_from_the_rest  # type: ignore[method-assign]
    moves = 0

    def count(record) -> None:  # type: ignore[no-untyped-def]
        nonlocal moves
        moves += record.type == "depart"

    mission.state.listeners = (*mission.state.listeners, count)
    begun = time.process_time()
    second = mission.run()
    spent = time.process_time() - begun - apart
    if {first.outcome, second.outcome} != {Outcome.COMPLETED}:
        return None
    bound = 0.0
    for robot in scenario.robots:
        alone = replace(scenario, robots=(robot,), obstacles=(), changes=())
        world = simulation(scenario, draw)
        world = LiveSimulation(
            alone, speeds=world._speeds, delayed=0.1, seed=draw, paces_of=world._paces
        )
        bound = max(bound, Mission(alone, world=world).run().makespan or 0.0)
    return Draw(serial.now(), second.makespan or 0.0, bound, 1000 * spent / max(1, moves))


def floor(robots: int, seed: int, side: int = 32) -> Scenario:
    """A floor of ``side`` x ``side`` with a wall in a tenth of its regions."""
    rng = random.Random(f"floor {seed}")
    grid = [["#" if rng.random() < 0.1 else "." for _ in range(side)] for _ in range(side)]
    free = [(r, c) for r in range(side) for c in range(side) if grid[r][c] == "."]
    known = {free[len(free) // 2]}
    new = list(known)
    while new:  # what is in one piece
        row, col = new.pop()
        for r, c in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
            if (r, c) not in known and 0 <= r < side and 0 <= c < side and grid[r][c] == ".":
                known.add((r, c))
                new.append((r, c))
    places = rng.sample(sorted(known), 2 * robots)
    lines = ["safenav: 1", f"name: floor of {robots}", "map:", "  grid: |"]
    lines += ["    " + "".join(row) for row in grid]
    lines += ["catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}"]
    lines += ["robots:"]
    for i in range(robots):
        start, goal = list(places[2 * i]), list(places[2 * i + 1])
        lines.append(
            f"  r{i}: {{model: cart, start: {start}, objective: {{visit: [{goal}, {start}]}}}}"
        )
    lines += ["until: {rounds: 1}", "limits: {ticks: 2000}"]
    return load_scenario_text("\n".join(lines) + "\n")


def rooms(seed: int) -> Scenario:
    """Three to six robots in rooms with doors, some of them closed."""
    return load_scenario_text(yaml.safe_dump(crowd(seed, 3 + seed % 4), sort_keys=False))


def families(draws: int) -> dict[str, Iterable[tuple[Scenario, int]]]:
    """The scenarios and draws of each line."""
    found: dict[str, Iterable[tuple[Scenario, int]]] = {}
    for name in ("team_of_six", "warehouse"):
        shipped = load_scenario(SCENARIOS / f"{name}.yaml")
        found[name] = [(shipped, draw) for draw in range(draws)]
    found["crowds"] = ((rooms(d), d) for d in range(draws))
    for robots in (4, 20):
        found[f"floor-{robots}"] = ((floor(n, d), d) for d, n in enumerate([robots] * draws))
    return found


@click.command()
@click.option("--draws", default=20, show_default=True, help="Runs of each line.")
@click.option("--only", help="Only lines with this in their name.")
def main(draws: int, only: str | None) -> None:
    """Print a line for each team."""
    rows = []
    for name, cases in families(draws).items():
        if only is not None and only not in name:
            continue
        found = [m for scenario, draw in cases if (m := measure(scenario, draw)) is not None]
        if not found:
            continue
        middle = {key: median(getattr(d, key) for d in found) for key in Draw.__annotations__}
        rows.append(
            (
                name,
                str(len(found)),
                *(f"{middle[key]:.0f}" for key in ("serial", "live", "bound")),
                f"{median(d.serial / d.live for d in found):.1f}",
                f"{median(d.live / d.bound for d in found):.2f}",
                f"{median(d.serial / d.bound for d in found):.1f}",
                f"{middle['milliseconds']:.2f}",
            )
        )
        click.echo(" ".join(rows[-1]))
    for line in table(HEADINGS, rows):
        click.echo(line)


if __name__ == "__main__":
    main()
