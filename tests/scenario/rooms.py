"""Two rooms with a doorway."""

from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text

ROOMS = """\
safenav: 1
map:
  grid: |
    #######
    #..#..#
    #.....#
    #..#..#
    #######
  names: {dock: [1, 2], gate: 17}
"""


def load(rest: str) -> Scenario:
    return load_scenario_text(ROOMS + rest, "rooms.yaml")
