"""Warnings about a valid scenario that is probably mistaken."""

from contextlib import nullcontext
from typing import Any

import pytest

from once import beside, from_yaml
from safenav import InputError, UsageError, load_scenario_text
from safenav.motion.making import check_movable
from safenav.scenario.lint import imprecise, lint

SCENARIO = beside(__file__, "scenarios/lint.txt")
"""With words in braces, which the rows of lint.yaml replace."""
PLAIN, *WARNINGS = from_yaml(beside(__file__, "lint.yaml"))


@pytest.mark.parametrize("row", WARNINGS, ids=[row["what"] for row in WARNINGS])
def test_a_scenario_gets_its_warnings(row: dict[str, Any]) -> None:
    scenario = load_scenario_text(SCENARIO.format(**PLAIN | row["changes"]))
    assert list(lint(scenario)) == row["said"]


@pytest.mark.parametrize(
    ("model", "side", "fits"), [("digit", 1.79, False), ("digit", 1.81, True), ("husky", 1.3, True)]
)
def test_lint_and_motion_refuse_the_same_bodies(model: str, side: float, fits: bool) -> None:
    scenario = load_scenario_text(
        f'safenav: 1\nmap: {{resolution: {side}, grid: ["####", "#..#", "#..#", "####"]}}\n'
        f"robots: {{a: {{model: {model}, start: 5, heading: east, objective: {{hold: 6}}}}}}\n"
    )
    assert any("has no room" in told for told in lint(scenario)) == (not fits)
    with nullcontext() if fits else pytest.raises((InputError, UsageError)):
        check_movable(scenario)


@pytest.mark.parametrize(
    ("side", "off", "said"),
    [
        (2.0, 0.7, ""),
        (1.0, 0.3, "reaches 0.10 m into the next one, where other robots may be; set its"),
        (0.6, 0.3, "reaches 0.30 m into the next one, where other robots may be; give the map"),
        (0.5, 0.3, ""),  # larger than a region, which is reported
    ],
)
def test_a_robot_that_arrives_beside_the_middle_reaches_into_the_next_region(
    side: float, off: float, said: str
) -> None:
    scenario = load_scenario_text(
        f'safenav: 1\nmap: {{resolution: {side}, grid: ["####", "#..#", "####"]}}\n'
        "catalogue: {robots: {cart: {mobility: free, layer: ground, size: 0.6, speed: 1}}}\n"
        "robots: {a: {model: cart, start: 5, objective: {visit: [6, 5]}}}\n"
    )
    found = list(imprecise(scenario, {"a": off}))
    assert len(found) == bool(said) and said in "".join(found)
