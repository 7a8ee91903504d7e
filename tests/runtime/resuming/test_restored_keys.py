"""What the header of a trace says of a scenario suffices to resume its run, or the key is named."""

from pathlib import Path

import pytest
from safenav.runtime.analysis.resuming import resumed

from once import SCENARIOS
from runtime.facts import CASES, read_case
from safenav.errors import UsageError
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.header import unstarted

KEPT = (
    *("name", "until", "limits", "seed", "coordination", "partition", "changes", "requirements"),
    *("failures", "never_together", "late", "chargers", "flat", "inputs"),
)
"""Fields of a scenario, besides the map, robots and obstacles, that a run depends on."""
NAMED = {"deadlines", "chargers", "inputs", "partition", "batteries", "'when'"}
ALL_KEYS = """
safenav: 1
name: everything
map:
  grid: ["#######", "#.....#", "#.....#", "#######"]
  names: {dock: [1, 5]}
  resolution: 0.5
  origin: [1, 2]
areas: {west: [[1, 1], [2, 1]]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [lift, drop], size: 0.4, timing: 2}
  obstacles:
    crate: {needs: [{action: lift}, {action: drop, at: [dock]}], blocks: [cart]}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[1, 3], dock], avoid: [[2, 5]]}}
  b: {model: cart, start: [2, 1], objective: {once: [[2, 3]]}, avoids: [a], tracks: [a],
      while_waiting: {hold: [2, 2]}}
obstacles: [{type: crate, region: [1, 2], from: 3, until: 30}]
never_together: [{robots: [a, b], in: [dock]}]
changes: [{at: 4, robot: a, service: out}, {at: 6, robot: b, objective: {hold: [2, 2]}}]
requirements: [{near: "always(distance(a, b) >= 0.1)"}]
limits: {ticks: 77, synthesis_seconds: 5, synthesis_memory: 300}
seed: 7
until: {rounds: 4}
"""


def _again(scenario: Scenario) -> Scenario | None:
    """The scenario by its header alone; None if that is refused, with the names of keys."""
    try:
        return resumed(unstarted(scenario))
    except UsageError as error:
        words = str(error).removeprefix("the trace does not fully describe ").partition(":")[0]
        assert {*words.replace(" and ", ", ").split(", ")} <= NAMED, error
        return None


def _same(scenario: Scenario) -> None:
    found = _again(scenario)
    if found is None:
        return
    before, after = (unstarted(each).header.scenario for each in (scenario, found))
    for key in ("map", "robots", "obstacles"):
        assert getattr(after, key) == getattr(before, key), key
    for key in KEPT:
        assert getattr(found, key) == getattr(scenario, key), key


FILES = [*SCENARIOS.glob("*.yaml"), *CASES.rglob("*.yaml")]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_header_describes_its_scenario_or_resuming_is_refused(file: Path) -> None:
    text = file.read_text() if file.parent == SCENARIOS else read_case(file)[0]
    text = text if "safenav: 1" in text.splitlines() else f"safenav: 1\n{text}"
    _same(load_scenario_text(text, str(file)))


def test_every_key_that_a_header_holds_is_restored() -> None:
    scenario = load_scenario_text(ALL_KEYS, "everything.yaml")
    assert _again(scenario) is not None
    _same(scenario)
