"""Matrix files: combinations of settings, and errors reported at their position."""

from typing import Any

import pytest

from safenav.batch.matrix import read_matrix, varied
from safenav.scenario.reading.loader import load_scenario_text

HEAD = "batch: 1\nscenarios: [a.yaml]\n"


def settings(text: str) -> list[dict[str, Any]]:
    return list(read_matrix(HEAD + text, "m.yaml").settings)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", [{}]),
        ("matrix: {seed: [3, 4]}", [{"seed": 3}, {"seed": 4}]),
        ("matrix: {seed: {from: 8, to: 10}}", [{"seed": 8}, {"seed": 9}, {"seed": 10}]),
        (
            "matrix: {seed: [0, 1], limits.ticks: [5, 6]}\nexclude: [{seed: 1, limits.ticks: 5}]",
            [
                {"seed": 0, "limits.ticks": 5},
                {"seed": 0, "limits.ticks": 6},
                {"seed": 1, "limits.ticks": 6},
            ],
        ),
        (
            "matrix: {seed: [0]}\ninclude: [{seed: 7, expect.outcome: tick_limit}]",
            [{"seed": 0}, {"seed": 7, "expect.outcome": "tick_limit"}],
        ),
        ("include: [{coordination: assignable}]", [{"coordination": "assignable"}]),
        (
            "matrix: {robots.quad: [{model: digit, start: [1, 2]}]}",
            [{"robots.quad": {"model": "digit", "start": [1, 2]}}],
        ),
    ],
)
def test_every_combination_but_the_excluded_and_the_included(
    text: str, expected: list[dict[str, Any]]
) -> None:
    assert settings(text) == expected


SCENARIO = """\
safenav: 1
map: {grid: ['#####', '#...#', '#####']}
robots: {quad: {model: quadcopter, start: 6, objective: {patrol: [6, 8]}}}
obstacles: [{type: door, region: 7}]
"""


def load(changes: dict[str, Any]) -> Any:
    return load_scenario_text(SCENARIO, "s.yaml", lambda root, told: varied(root, changes, told))


def test_settings_reach_keys_items_and_what_is_not_there_yet() -> None:
    changes = {
        "limits.ticks": 7,
        "robots.quad.start": [1, 3],
        "obstacles.0.type": "uncertainty",
        "obstacles.0.traversable": False,
        "expect": {"outcome": "completed"},
        "coordination": "assignable",
    }
    scenario = load(changes)
    assert scenario.limits.ticks == 7
    assert scenario.robots[0].start.region == 8
    assert scenario.obstacles[0].name == "uncertainty@7"
    assert scenario.obstacles[0].traversable is False
    assert scenario.expect.outcome == "completed"
    assert scenario.coordination == "assignable"
    assert load({}).limits.ticks == 1000
