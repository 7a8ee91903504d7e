"""Measure the gain of robots that move at the same time.

    python benchmarks/one_clock.py                          # shipped teams, rooms, large floors
    python benchmarks/one_clock.py --draws 5 --only floor-20
    python benchmarks/one_clock.py --only floor --long-plans   # joint plans as they are found

Each draw gives every robot a speed from 0.5 to 2 steps per second; a tenth of the steps takes
five times as long; an action takes 2 s over the speed. ``rooms``: three to six robots in rooms
with doors one region wide, two rounds; ``closed``: one round, some doors closed, some on hinges;
``floor-N``: N robots to a target and back on random-32-32-10, with starts and targets of its
``.scen`` (a floor like it, where the map is missing).

``serial``: each command waits for the one before; ``live``: a live run; ``bound``: the longest
robot alone on the floor, without obstacles, its objective in the form in which it shares a floor.
Seconds of the simulated clock, medians.
``serial/bound`` is what ``serial/live`` can be at most: runs in which nobody waits for anybody.
``ms``: CPU milliseconds of the runtime for each step of the live run, without syntheses. Nothing
here is a test: it reports.
"""

import random
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any
from unittest.mock import patch

import click
import yaml
from floors import benchmark_map, crowd, maps_folder, mission, scattered
from msgspec.structs import replace

from runtime.worlds import Uneven
from safenav import Acted, ActResult, Arrived, Mission, Obstacle, Pose, Robot, Scenario, WorldEvent
from safenav.errors import Outcome
from safenav.pace.robot import Pace
from safenav.plan import ask
from safenav.plan.order import plan_of
from safenav.report.terminal.layout import table
from safenav.runtime.control.answers import Answers
from safenav.runtime.run.mission import default_synthesizer
from safenav.scenario.objective import Patrol, Visit
from safenav.scenario.reading.loader import load_scenario_text
from safenav.team.floor import Floor, Joint
from safenav.team.state import Plan
from safenav.trace.records import Record
from safenav.world.map import Region

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

    def __init__(self, world: Uneven) -> None:
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
        event: WorldEvent | None = self._world.act(robot, (), 0)
        if event is None:
            (event,) = self._world.wait(None)
        assert isinstance(event, Acted)
        for obstacle, result in event.found:
            done = result is ActResult.DONE
            yield obstacle, done if obstacle.type.has_truth else None if done else False


def speeds_of(scenario: Scenario, draw: int) -> dict[str, float]:
    rng = random.Random(f"speeds {draw}")
    return {robot.name: rng.uniform(0.5, 2) for robot in scenario.robots}


def simulation(scenario: Scenario, draw: int, speeds: Mapping[str, float]) -> Uneven:
    world = Uneven(scenario, speeds, delayed=0.1, seed=draw)
    world._paces = {robot.name: Pace(scenario.map.cols, SIDE, None) for robot in scenario.robots}
    return world


def measure(text: str, draw: int) -> Draw | None:
    """None if a run is not completed."""
    scenario = load_scenario_text(text)
    speeds = speeds_of(scenario, draw)
    serial, live = simulation(scenario, draw, speeds), simulation(scenario, draw, speeds)
    first = Mission(scenario, world=Serial(serial)).run()
    synthesizer = default_synthesizer(scenario)
    mission = Mission(scenario, synthesizer, world=live)
    apart = 0.0
    original = Answers.strategies

    def apart_from_the_rest(answers: Answers, specs: Any) -> Any:
        nonlocal apart
        begun = time.process_time()
        found = original(answers, specs)
        apart += time.process_time() - begun
        return found

    moves = 0

    def count(record: Record) -> None:
        nonlocal moves
        moves += record.type == "depart"

    mission.listeners = (count,)
    begun = time.process_time()
    with patch.object(Answers, "strategies", apart_from_the_rest):
        second = mission.run()
    spent = time.process_time() - begun - apart
    if {first.outcome, second.outcome} != {Outcome.COMPLETED}:
        return None
    bound = 0.0
    for robot in scenario.robots:
        shared = robot.objective
        if isinstance(shared, Patrol) and any(
            robot.conflicts(other) for other in scenario.robots if other is not robot
        ):
            shared = Visit(shared.targets, avoid=shared.avoid, always=shared.always)
        robot = replace(robot, objective=shared)
        alone = replace(scenario, robots=(robot,), obstacles=(), changes=())
        world = simulation(alone, draw, speeds)
        bound = max(bound, Mission(alone, world=world).run().makespan or 0.0)
    return Draw(serial.now(), second.makespan or 0.0, bound, 1000 * spent / max(1, moves))


def floor(robots: int, seed: int, side: int = 32) -> str:
    """A floor of ``side`` x ``side`` with a wall in a tenth of its regions, all in one piece."""
    rng = random.Random(f"floor {seed}")
    grid = scattered(rng, side, side, 0.1)
    free = [[r, c] for r, row in enumerate(grid) for c, cell in enumerate(row) if cell == "."]
    places = rng.sample(free, 2 * robots)
    return team_of_carts(grid, list(zip(places[::2], places[1::2], strict=True)))


def team_of_carts(grid: list[str], tasks: Sequence[tuple[list[int], list[int]]]) -> str:
    """Carts to a target each and back."""
    cart = {"mobility": "free", "layer": "ground", "capabilities": []}
    team = {
        f"r{k}": {"model": "cart", "start": start, "objective": {"visit": [[*goal], [*start]]}}
        for k, (start, goal) in enumerate(tasks)
    }
    data: dict[str, object] = {"safenav": 1, "map": {"grid": grid}, "robots": team}
    data |= {"catalogue": {"robots": {"cart": cart}}, "until": {"rounds": 1}}
    return written(data | {"limits": {"ticks": 4000}})


def benchmark_floor(robots: int, draw: int) -> str:
    """random-32-32-10 with other starts and targets in each of 23 draws of 20 robots."""
    folder = maps_folder()
    if folder is None:
        return floor(robots, draw)
    rows, tasks = benchmark_map(folder)
    first = draw * robots % (len(tasks) - 2 * robots)
    team: list[tuple[list[int], list[int]]] = []
    taken: list[list[int]] = []
    for x, y, goal_x, goal_y in tasks[first:]:
        start, goal = [y, x], [goal_y, goal_x]
        if len(team) < robots and start != goal and start not in taken and goal not in taken:
            taken += [start, goal]
            team.append((start, goal))
    return team_of_carts(rows, team)


def rooms(draws: int) -> Iterator[tuple[str, int]]:
    """The first crowds of the campaigns with three to six robots, and their seeds."""
    found, seed = 0, 0
    while found < draws:
        data = mission("crowd_hidden", seed)
        if 3 <= len(data["robots"]) <= 6:
            found += 1
            yield written(data), seed
        seed += 1


def closed(seed: int) -> str:
    """Three to six robots in rooms with doors, some of them closed."""
    return written(crowd(seed, 3 + seed % 4))


def written(data: dict[str, object]) -> str:
    return str(yaml.safe_dump(data, sort_keys=False))


def families(draws: int) -> dict[str, Iterable[tuple[str, int]]]:
    """The scenarios and draws of each line."""
    found: dict[str, Iterable[tuple[str, int]]] = {}
    for name in ("team_of_six", "warehouse"):
        shipped = (SCENARIOS / f"{name}.yaml").read_text()
        found[name] = [(shipped, draw) for draw in range(draws)]
    found["rooms"] = rooms(draws)
    found["closed"] = ((closed(d), d) for d in range(draws))
    for robots in (4, 20):
        numbered = enumerate([robots] * draws)
        found[f"floor-{robots}"] = ((benchmark_floor(n, d), d) for d, n in numbered)
    return found


def _as_found(on: Floor, states: Sequence[Joint], *_: object) -> Plan:
    """The plan of a search, without shortening it."""
    return plan_of(on, states[0], [joint.poses for joint in states[1:]])


@click.command()
@click.option("--draws", default=20, show_default=True, help="Runs of each line.")
@click.option("--only", help="Only lines with this in their name.")
@click.option("--long-plans", is_flag=True, help="Follow joint plans without shortening them.")
def main(draws: int, only: str | None, long_plans: bool) -> None:
    """Print a line for each team."""
    if long_plans:
        patch.object(ask, "shortened", _as_found).start()
    rows = []
    for name, cases in families(draws).items():
        if only is not None and only not in name:
            continue
        found = [m for text, draw in cases if (m := measure(text, draw)) is not None]
        if not found:
            continue
        keys = ("serial", "live", "bound", "milliseconds")
        middle = {key: median(getattr(d, key) for d in found) for key in keys}
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
