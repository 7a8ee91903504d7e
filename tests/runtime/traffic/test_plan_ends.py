"""Where a joint plan ends: in a live run often with the mission, in lockstep with its first leg."""

import pytest

from runtime.played import completed

SWAP = """
name: swap
map: {{grid: ["#########", "#..###..#", "#.......#", "#..###..#", "#########"]}}
catalogue:
  robots:
    cart: {{mobility: {mobility}, layer: ground, capabilities: [], timing: 1{battery}}}
robots:
  a: {{model: cart, start: [2, 1]{heading}, objective: {first}}}
  b: {{model: cart, start: [2, 7]{heading}, objective: {{visit: [[2, 1], [2, 7]]}}}}
{more}
clock: {clock}
"""
VISIT = "{visit: [[2, 7], [2, 1]]}"
"""Both robots pass the corridor four times, each time in opposite directions."""


@pytest.mark.parametrize(
    ("clock", "change", "one"),
    [
        ("live", {}, True),
        ("live", {"mobility": "heading", "heading": ", heading: east"}, True),
        ("lockstep", {}, False),
        (
            "live",
            {
                "battery": ", battery: {capacity: 200, charge: 9}",
                "more": "chargers: [[1, 1], [1, 7]]",
            },
            False,
        ),
        ("live", {"first": "{ltl: {liveness: [region = 25, region = 19]}}"}, False),
    ],
    ids=["free", "headings", "lockstep", "battery", "formula"],
)
def test_a_plan_leads_through_the_mission(clock: str, change: dict[str, str], one: bool) -> None:
    plain = {"mobility": "free", "battery": "", "heading": "", "first": VISIT, "more": ""}
    run = completed(SWAP.format(clock=clock, **plain | change))
    assert (len(run.all("plan")) == 1) is one
    ends = [line["type"] for line in run.records][-2:]
    assert not one or ends == ["plan_end", "outcome"]  # no strategies for a mission that is over
