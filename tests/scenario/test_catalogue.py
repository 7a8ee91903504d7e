"""The catalogue: what is built in, and what a scenario adds to it."""

from pathlib import Path

import pytest

from safenav.errors import InputError
from safenav.scenario.model import ObstacleType, ResolveAt, RobotModel
from safenav.scenario.reading.loader import load_scenario
from safenav.world.moves import Mobility
from scenario.rooms import ROOMS, load

ROVER = """\
robots:
  rover: {mobility: free, layer: ground, capabilities: [push, clear], vision: 4}
obstacles:
  debris: {action: clear, resolve_at: neighbours, blocks: [ground, quadcopter]}
  airlock: {action: push, resolve_at: [%s]}
"""
USE = """\
robots: {ann: {model: rover, start: 8, objective: {hold: 9}}}
obstacles: [{type: debris, region: 17}, {type: airlock, region: 11}]
"""


def test_a_scenario_extends_the_catalogue_in_place() -> None:
    inline = "".join(f"  {line}\n" for line in (ROVER % "dock, [1, 1]").splitlines())
    scenario = load(USE + "catalogue:\n" + inline)
    assert scenario.robots[0].model == RobotModel(
        "rover", Mobility.FREE, "ground", frozenset({"push", "clear"}), 4.0
    )
    debris, airlock = (obstacle.type for obstacle in scenario.obstacles)
    blocks = frozenset({"ground", "quadcopter"})
    assert debris == ObstacleType("debris", "clear", ResolveAt.NEIGHBOURS, blocks)
    assert airlock == ObstacleType("airlock", "push", frozenset({9, 8}))


def test_mistakes_in_a_catalogue_file_follow_those_of_the_scenario(tmp_path: Path) -> None:
    catalogue = tmp_path / "more.yaml"
    catalogue.write_text("robots:\n  rover: {mobility: free, layer: ground, wheels: 4}\n")
    file = tmp_path / "scenario.yaml"
    file.write_text(
        ROOMS + USE.replace("debris", "rubble") + "catalogue: more.yaml\nseed: -1\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError) as caught:
        load_scenario(file)
    places = [(Path(d.file).name, d.line) for d in caught.value.diagnostics]
    assert places == [
        ("scenario.yaml", 11),  # rubble and airlock are unknown; the broken rover is not
        ("scenario.yaml", 11),
        ("scenario.yaml", 13),
        ("more.yaml", 2),
    ]
