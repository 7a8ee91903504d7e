"""A map file without a scenario: drawn, and begun upon."""

from pathlib import Path

import pytest

from cli.conftest import Command
from safenav.errors import Outcome
from safenav.motion.making import check_movable
from safenav.runtime.run.mission import Mission
from safenav.scenario.beginning import scenario_on
from safenav.scenario.lint import cramped, oversized
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.trace.records import Record, Resolved
from safenav.world.map import RegionMap

MAPS = Path(__file__).parents[1] / "maps"
FORMS = [
    ["rooms.png", "--rows", "7", "--cols", "13"],
    ["rooms.pgm", "--rows", "7", "--cols", "13"],
    ["office.yaml", "--side", "0.5"],
    ["rooms.map"],
]


@pytest.mark.parametrize("file", FORMS, ids=lambda file: file[0])
def test_a_scenario_is_begun_on_a_map_and_runs(
    file: list[str], safenav: Command, tmp_path: Path
) -> None:
    name, *division = file
    folder = tmp_path / "deep" / "folder"
    folder.mkdir(parents=True)
    made = safenav("new", "deep/folder/s.yaml", "--map", MAPS / name, *division)
    assert made.returncode == 0, made.stderr
    scenario = load_scenario(str(folder / "s.yaml"))
    assert len({robot.start.region for robot in scenario.robots}) == len(scenario.robots) == 2
    if scenario.map.frame is not None:
        check_movable(scenario)
        assert not [*oversized(scenario), *cramped(scenario)]
    run = safenav("run", "deep/folder/s.yaml", "--no-map")
    assert run.returncode == 0, run.stdout + run.stderr
    assert "patrol home <-> away" in run.stdout


@pytest.mark.parametrize(
    "grid",
    [
        ["......"],
        ["...#...", "...#...", ".......", "...#..."],
        ["..", ".."],
    ],
    ids=["corridor", "doorway", "closet"],
)
def test_the_suggested_obstacle_is_discovered_and_resolved(grid: list[str]) -> None:
    """A newcomer who uncomments it sees a request for help, whatever the map."""
    lines = ["grid: |", *(f"  {row}" for row in grid)]
    text = scenario_on(RegionMap.from_grid(grid), lines, "new")
    assert text is not None
    told = text.replace("# obstacles:", "obstacles:").replace(
        "#   - {type: door", "  - {type: door"
    )
    records: list[Record] = []
    result = Mission(load_scenario_text(told), listeners=[records.append]).run()
    assert result.outcome is Outcome.COMPLETED
    assert sum(isinstance(each, Resolved) for each in records) == 1


def test_a_name_with_quotes_stays_a_name() -> None:
    world = RegionMap.from_grid(["......"])
    text = scenario_on(world, ["grid: ['......']"], 'it\'s "here"')
    assert text is not None
    grid = text.replace("grid: ['......']", "grid: |\n    ......")
    assert load_scenario_text(grid).name == 'it\'s "here"'


def test_a_map_with_too_little_floor_has_no_start() -> None:
    assert scenario_on(RegionMap.from_grid([".#.", "#.#", ".#."]), [], "dots") is None
