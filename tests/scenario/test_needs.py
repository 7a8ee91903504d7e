"""Obstacles that need several actions or robots, and that come and go, as they are written."""

from __future__ import annotations

import pytest

from safenav.errors import InputError
from safenav.scenario.model import Need, ResolveAt, Scenario
from safenav.scenario.reading.loader import load_scenario_text

SCENARIO = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
robots:
  a: {model: digit, start: [1, 1], heading: east, objective: {hold: [1, 1]}}
  q: {model: quadcopter, start: [2, 1], objective: {hold: [2, 1]}}
catalogue:
  obstacles:
    vault: {needs: NEEDS}
obstacles: OBSTACLES
"""
VAULT = "[{type: vault, region: [1, 4]}]"


def load(needs: str, obstacles: str = VAULT) -> Scenario:
    return load_scenario_text(SCENARIO.replace("NEEDS", needs).replace("OBSTACLES", obstacles))


def test_needs_are_read_in_their_order() -> None:
    scenario = load("[{action: sense, at: neighbours}, {action: push, robots: 2, together: true}]")
    assert scenario.obstacles[0].needs == (
        Need("sense", 1, ResolveAt.NEIGHBOURS),
        Need("push", 2, ResolveAt.SELF, together=True),
    )


def test_an_obstacle_blocks_those_that_lack_an_action_of_what_is_left() -> None:
    scenario = load("[{action: sense, at: neighbours}, {action: push}]")
    vault, digit, quad = scenario.obstacles[0], scenario.robot("a"), scenario.robot("q")
    assert [vault.blocks(digit, need) for need in (0, 1)] == [True, False]
    assert [vault.blocks(quad, need) for need in (0, 1)] == [True, True]


@pytest.mark.parametrize(
    ("needs", "obstacles", "found"),
    [
        ("[]", VAULT, "is empty"),
        ("[{robots: 2}]", VAULT, "'action'"),
        ("[{action: push, robots: 0}]", VAULT, "'robots' of need 1"),
        ("[{action: push, at: nowhere}]", VAULT, "'at' of need 1"),
        (
            "[{action: push}], action: push",
            VAULT,
            "both 'needs' and 'action'",
        ),
        (
            "[{action: push}]",
            "[{type: vault, region: [1, 4], from: 9, until: 9}]",
            "goes before it appears",
        ),
        (
            "[{action: push}]",
            "[{type: vault, region: [1, 4], until: 9}, {type: door, region: [1, 4], from: 8}]",
            "is in this region already",
        ),
    ],
)
def test_what_cannot_be_is_refused(needs: str, obstacles: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        load(needs, obstacles)


def test_a_region_may_hold_one_obstacle_after_the_other() -> None:
    after = "[{type: door, region: [1, 4], until: 9}, {type: door, region: [1, 4], from: 9}]"
    assert [o.appears for o in load("[{action: push}]", after).obstacles] == [None, 9]
