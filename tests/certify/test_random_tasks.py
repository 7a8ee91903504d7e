"""Controllers of random robots under random circumstances are accepted, whatever their verdict.

Among the tests the campaign is short; SAFENAV_FUZZ=1000 tries as many others.
"""

import os
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from certify.tasks import Circumstances, scenario_of, verdict_of
from safenav.errors import ResourceLimitError
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Patrol, Visit
from safenav.spec.task import NO_MEMORY, Memory

COUNT = int(os.environ.get("SAFENAV_FUZZ", "40"))
FIRST = 0 if "SAFENAV_FUZZ" not in os.environ else 100_000


def random_scenario(source: Random) -> Scenario:
    """A scenario that has room for a robot."""
    while (found := _scenario(source)) is None:
        pass
    return found


def _scenario(source: Random) -> Scenario | None:
    """A small room with walls, one to three robots, perhaps an obstacle that is known; None where
    the walls leave no room for a robot."""
    rows, cols = source.randint(2, 4), source.randint(3, 6)
    border = source.random() < 0.8
    cells = [["#" if source.random() < 0.15 else "." for _ in range(cols)] for _ in range(rows)]
    if border:
        rows, cols = rows + 2, cols + 2
        cells = [list("#" * cols), *(["#", *row, "#"] for row in cells), list("#" * cols)]
    free = [(r, c) for r in range(rows) for c in range(cols) if cells[r][c] == "."]
    source.shuffle(free)
    if len(free) < 3:
        return None
    tracks = source.choice([False, True])
    robots, names = [], [f"r{n}" for n in range(min(source.choice([1, 1, 2, 2, 3]), len(free) - 2))]
    for number, name in enumerate(names):
        row, col = free[number]
        model = source.choice(["rover", "walker"])
        heading = f", heading: {source.choice(['north', 'east', 'south', 'west'])}"
        vision = f", vision: {source.randint(1, 4)}" if tracks else ""
        others = [other for other in names if other != name and tracks]
        known = f"avoids: [], tracks: [{', '.join(others)}]{vision}"
        robots.append(
            f"{name}: {{model: {model}, {known}, start: [{row}, {col}]"
            f"{heading if model == 'walker' else ''}, objective: {_objective(source, free, cols)}}}"
        )
    row, col = free[-1]
    obstacle = f"obstacles:\n  - {{type: door, region: {row * cols + col}}}\n"
    return scenario_of("\n".join(map("".join, cells)), "\n".join(robots), obstacle)


def _objective(source: Random, free: list[tuple[int, int]], cols: int) -> str:
    kind = source.choice(["patrol", "visit", "visit", "cover", "hold", "ltl"])
    count = 2 if kind == "patrol" else source.randint(1, min(3, len(free)))
    wanted = source.sample(free, count)
    if kind == "ltl":
        (a, b), (c, d) = wanted[0], wanted[-1]
        return (
            "{ltl: {memory: {seen: bool}, init: '!seen', "
            f'safety: "seen\' <-> (seen | region = {a * cols + b})", '
            f"liveness: [\"region' = {c * cols + d} & (seen' | heading_free)\"]}}}}"
        ).replace(" | heading_free", "")
    if kind == "hold":
        return f"{{hold: [{wanted[0][0]}, {wanted[0][1]}]}}"
    listed = ", ".join(f"[{row}, {col}]" for row, col in wanted)
    return f"{{{kind}: [{listed}]}}"


def random_circumstances(source: Random, scenario: Scenario) -> Circumstances:
    robot = scenario.robots[0]
    memory = NO_MEMORY
    if isinstance(robot.objective, Visit | Patrol):
        memory = Memory(source.randrange(len(robot.objective.targets)))
    hidden = scenario.obstacles[0].region
    taken = {other.start.region for other in scenario.robots}
    closed = (hidden,) if source.random() < 0.4 and hidden not in taken else ()
    return Circumstances(closed, memory)


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_the_controller_of_a_random_robot_is_accepted(
    seed: int, tmp_path: Path, played: Callable[[], None]
) -> None:
    source = Random(seed)
    scenario = random_scenario(source)
    about = random_circumstances(source, scenario)
    try:
        assert verdict_of(scenario, tmp_path / "bundle", about) == "", about
    except ResourceLimitError as limit:  # a strategy may be too large for the checker
        pytest.skip(str(limit))
    played()
