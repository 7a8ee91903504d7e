"""Matrix files: combinations of settings, and errors reported at their position."""

from typing import Any

import pytest

from safenav.batch.matrix import read_matrix, varied
from safenav.errors import InputError
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("batch: 1\n", "1:1: the batch: the key 'scenarios' is missing"),
        (
            "scenarios: [s.yaml]\nmatrix: {seed: [0]}\n",
            "1:1: the batch: the key 'batch' is missing\n(.*\n)*.*begin the file with 'batch: 1'",
        ),
        (
            "batch: 1\nscenarios: [s.yaml]\nmatrix: {seed: 0-99}\n",
            "found the text '0-99'(.*\n)*.*write {from: 0, to: 99}",
        ),
        ("batch: 1\nscenarios: []\n", "2:12: 'scenarios' is empty"),
        (
            HEAD + "matrix: {sed: [1]}\n",
            "3:10: 'sed' is not a path into a scenario\n(.*\n)*.*'seed'",
        ),
        (HEAD + "matrix: {seed: 1}\n", "3:16: 'seed' of 'matrix': found the number 1"),
        (HEAD + "matrix: {seed: []}\n", "3:16: 'seed' of 'matrix': a list of no values"),
        (HEAD + "matrix: {seed: {from: 2, to: 1}}\n", "3:16: .*from 2 to 1 is empty"),
        (HEAD + "matrix: {seed: {from: 0, to: 999999}}\n", "3:16: .*more than 100000"),
        (
            HEAD + "matrix: {seed: {from: 1, to: 999}, limits.ticks: {from: 1, to: 999}}\n",
            "3:9: the matrix has 998001 combinations",
        ),
        (
            HEAD + "matrix: {seed: [1]}\nexclude: [{seed: 2}]\n",
            "4:11: .*2 is not a value of 'seed'",
        ),
        (HEAD + "matrix: {seed: [1]}\nexclude: [{limits: 2}]\n", "4:11: .*not in the matrix"),
        (HEAD + "matrix: {seed: [1]}\nexclude: [{seed: 1}]\n", "every combination is excluded"),
        (HEAD + "matrx: {seed: [1]}\n", "3:1: unknown key 'matrx'.*\n(.*\n)*.*'matrix'"),
        ("batch: 1\nscenarios: [", "not YAML"),
    ],
)
def test_mistakes_of_a_matrix_are_reported_at_their_place(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_matrix(text, "m.yaml")


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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robots.quad.start": 0}, "s.yaml:3:43: .*region 0.* is a wall"),
        ({"obstacles.1.region": 7}, "4:12: 'obstacles.1.region' of the matrix leads nowhere"),
        ({"robots.quad.start.x": 7}, "s.yaml:3:43: .*leads nowhere: there is no 'x' here"),
        ({"limits.tics": 7}, "unknown key 'tics' in limits\n(.*\n)*.*'ticks'"),
        ({"map.grid": "#####\n#..#\n"}, "s.yaml:2:"),
    ],
)
def test_a_variation_is_checked_as_if_it_stood_in_the_file(
    changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        load(changes)
