"""Live: skipping turns that would have no effect changes nothing."""

from collections.abc import Callable
from unittest.mock import patch

import pytest
from safenav.runtime.turns.idling import Idling
from safenav.runtime.turns.turn import Turns

from live.missions import crowd
from runtime.played import Run
from safenav.runtime.run.mission import Mission
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.scenario.reading.loader import load_scenario_text

WAYS = """\
safenav: 1
map: {grid: ["#########", "#.......#", "###.#####", "#.......#", "#########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[3, 7], [1, 1]]}}
  b: {model: cart, start: [3, 7], objective: {visit: [[1, 1], [3, 7]]}}
  c: {model: cart, start: [1, 7], objective: {hold: [1, 7]}}
until: {rounds: 1}
"""


def run(text: str) -> tuple[list[str], int]:
    """The lines of a live run with delays, and how many turns were carried out."""
    scenario, heard, turns = load_scenario_text(text), Run(), 0
    world = LiveSimulation(scenario, speeds={}, delayed=0.3, seed=1)
    step = Turns.step

    def counted(self: Turns, robot: object) -> object:
        nonlocal turns
        turns += 1
        return step(self, robot)  # type: ignore[arg-type]

    with patch.object(Turns, "step", counted):
        Mission(scenario, world=world, listeners=[heard]).run()
    for record in heard.records:
        for passing in ("seconds", "cached", "synthesis_seconds"):
            record.pop(passing, None)
    return heard.lines, turns


def always(_: Idling, __: object, turn: Callable[[], object]) -> None:
    turn()


@pytest.mark.parametrize("text", [WAYS, str(crowd(3, 4)), str(crowd(5, 5))])
def test_skipping_idle_turns_changes_no_line(text: str) -> None:
    lines, turns = run(text)
    with patch.object(Idling, "unless_idle", always):
        all_lines, all_turns = run(text)
    assert lines == all_lines
    assert turns < all_turns
