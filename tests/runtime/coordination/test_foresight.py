"""Warnings of ``safenav check`` about runs that cannot be completed, compared with the runs."""

import pytest

from runtime.played import loaded, play
from safenav.report.terminal.worst_cases import worst_lines
from safenav.runtime.coordination.foresight import foreseen, unserved
from safenav.runtime.deadlines.worst import worst_cases
from safenav.world.moves import Pose

FLOOR = """
map:
  grid: ["#########", "#.......#", "###.#####", "#.......#", "#########"]
catalogue:
  robots: {{carrier: {{mobility: free, layer: ground, capabilities: [lift]}}}}
  obstacles:
    crate: {{needs: [{{action: lift, robots: {robots}, at: neighbours, together: true}}]}}
robots:
  ann: {{model: carrier, start: {ann}, objective: {{visit: [{visits}]}}}}
  ben: {{model: carrier, start: [3, 7], objective: {{hold: [3, 7]}}}}
obstacles: [{{type: crate, region: [2, 3]}}]
until: {{rounds: 1}}
{more}
"""
PLAIN = {"robots": 2, "ann": "[3, 1]", "visits": "[1, 1], [3, 1]", "more": ""}
NEEDED = "an operator will be needed, unless the run is completed before"
MET = "changes: [{at: 3, robot: ann, objective: {visit: [[3, 2], [3, 1]]}}]"


@pytest.mark.parametrize(
    ("changes", "said", "ends"),
    [
        ({}, "ann and ben reach only 30 for it, where there is no room", "operator_needed"),
        ({"ann": "[1, 1]"}, "", "completed"),
        ({"robots": 1}, "", "completed"),
        ({"robots": 3}, "ann cannot meet its objective infinitely often", "operator_needed"),
        ({"robots": 3, "visits": "[3, 1], [3, 2], [1, 1]", "more": MET}, "", "completed"),
    ],
    ids=["no room", "from both sides", "alone", "too few", "another objective"],
)
def test_check_says_what_a_run_needs(changes: dict[str, object], said: str, ends: str) -> None:
    text = FLOOR.format(**PLAIN | changes)
    found = foreseen(loaded(text))
    assert bool(said) == bool(found) and all(said in "; ".join(found) for _ in found)
    assert all(NEEDED in each for each in found[:1])
    assert unserved(loaded(text)) == ({"crate@21"} if "no room" in said else frozenset())
    assert play(text).outcome["outcome"] == ends


def test_check_promises_nothing_of_what_is_never_resolved() -> None:
    scenario = loaded(FLOOR.format(**PLAIN))
    poses = {"ann": [Pose(30, None)], "ben": [Pose(34, None)]}
    bounds, known = (worst_cases(scenario, poses, each) for each in ((), unserved(scenario)))
    assert "at best" in "".join(worst_lines(bounds, str))
    assert "crate@21: never resolved" in "".join(worst_lines(known, str))
