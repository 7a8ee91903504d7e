"""Deadlines of the mission that are refused before the start."""

import pytest

from runtime.played import play

CORRIDOR = """
safenav: 1
map: {grid: ["#########", "#.......#", "#########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground}}}
robots: {cart: {model: cart, start: [1, %d], objective: {%s}}}
until: {rounds: %d, by: %d}
"""


@pytest.mark.parametrize(
    ("start", "objective", "rounds", "ticks"),
    [
        (1, "visit: [[1, 1], [1, 5]]", 1, 4),  # it starts on its first target
        (1, "visit: [[1, 1], [1, 5]]", 3, 20),
        (3, "visit: [[1, 3]]", 2, 1),
        (2, "visit: [[1, 1], [1, 5]]", 1, 5),
        (5, "patrol: [[1, 1], [1, 5]]", 1, 4),  # it begins with the second, on which it starts
        (6, "patrol: [[1, 1], [1, 5]]", 1, 5),  # ... which it would have to cross
        (5, "patrol: [[1, 1], [1, 5]], form: literal", 2, 12),
        (3, "patrol: [[1, 3], [1, 7]]", 1, 4),
        (1, "once: [[1, 1], [1, 5]]", 1, 4),
        (3, "once: [[1, 1], [1, 5]]", 3, 8),  # each tick at the last one is a round
        (7, "hold: [1, 5]", 3, 4),
        (5, "hold: [1, 5]", 3, 2),
    ],
)
def test_by_is_refused_just_below_the_minimum_of_a_robot_alone(
    start: int, objective: str, rounds: int, ticks: int
) -> None:
    kept = play(CORRIDOR % (start, objective, rounds, ticks))
    assert (kept.outcome["outcome"], kept.outcome["late"]) == ("completed", [])
    assert kept.outcome["tick"] == ticks
    if ticks > 1:
        refused = play(CORRIDOR % (start, objective, rounds, ticks - 1))
        assert f"cannot be completed before tick {ticks}" in refused.outcome["explanation"]
