"""Obstacles that need several actions or robots, and that come and go, as they are written."""

import pytest

from safenav.errors import InputError
from safenav.scenario.model import Need, ResolveAt, Scenario
from safenav.scenario.reading.loader import load_scenario_text

SCENARIO = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
robots:
  a: {model: digit, start: [1, 1], heading: east, objective: {hold: [1, 1]}}
  b: {model: digit, start: [1, 3], heading: east, objective: {hold: [1, 3]}}
  q: {model: quadcopter, start: [2, 1], objective: {hold: [2, 1]}}
catalogue:
  obstacles:
    vault: {needs: NEEDS}
obstacles: OBSTACLES
"""
VAULT, PUSH = "[{type: vault, region: [1, 4]}]", "[{action: push}]"
AFTER = "[{type: vault, region: [1, 4], until: 9}, {type: door, region: [1, 4], from: 9}]"


def load(needs: str, obstacles: str = VAULT) -> Scenario:
    return load_scenario_text(SCENARIO.replace("NEEDS", needs).replace("OBSTACLES", obstacles))


def test_needs_are_read_in_their_order() -> None:
    scenario = load("[{action: sense, at: neighbours}, {action: push, robots: 2, together: true}]")
    assert scenario.obstacles[0].needs == (
        Need("sense", 1, ResolveAt.NEIGHBOURS),
        Need("push", 2, ResolveAt.SELF, together=True),
    )


@pytest.mark.parametrize(
    ("needs", "blocks", "closed"),
    [
        ("[{action: push}]", "", ({"q"}, None)),
        ("[{action: push, at: neighbours}]", "", ({"a", "b", "q"}, None)),
        ("[{action: push, at: [[1, 1]]}]", "", ({"a", "b", "q"}, None)),
        ("[{action: push, at: [[1, 4], [1, 1]]}]", "", ({"q"}, None)),
        ("[{action: push, robots: 2}]", "", ({"a", "b", "q"}, None)),
        ("[{action: sense, at: neighbours}, {action: push}]", "", ({"a", "b", "q"}, {"q"})),
        ("[{action: push}, {action: push}]", "", ({"a", "b", "q"}, {"q"})),
        ("[{action: push}, {action: sense}]", "", ({"a", "b", "q"}, {"a", "b"})),
        ("[{action: push, at: neighbours}]", "blocks: [ground]", ({"a", "b"}, None)),
        ("[{action: push, at: neighbours}]", "blocks: [quadcopter]", ({"q"}, None)),
        ("[{action: push, at: neighbours}]", "blocks: [b, q]", ({"b", "q"}, None)),
        ("[{action: push, at: neighbours}]", "blocks: []", (set(), None)),
        ("[{action: push}]", "blocks: [a]", (set(), None)),
    ],
)
def test_robots_keep_out_unless_they_resolve_by_entering(
    needs: str, blocks: str, closed: tuple[set[str], set[str] | None]
) -> None:
    """The robots to which the obstacle is closed while all needs are left, and while the last is:
    those that it physically stops, unless entering meets the only need that is left."""
    scenario = load(f"{needs}{', ' + blocks if blocks else ''}")
    vault = scenario.obstacles[0]
    for need, names in enumerate(closed):
        if names is not None:
            assert {r.name for r in scenario.robots if vault.closed_to(r, need)} == names


@pytest.mark.parametrize(
    ("needs", "obstacles", "found"),
    [
        ("[{action: push}], action: push", VAULT, "both 'needs' and 'action'"),
        (PUSH, VAULT.replace("}", ", from: 9, until: 9}"), "disappears before it appears"),
        (PUSH, AFTER.replace("from: 9", "from: 8"), "the region already contains"),
    ],
)
def test_impossible_needs_are_refused(needs: str, obstacles: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        load(needs, obstacles)


def test_a_region_may_hold_one_obstacle_after_the_other() -> None:
    assert [o.appears for o in load(PUSH, AFTER).obstacles] == [None, 9]
