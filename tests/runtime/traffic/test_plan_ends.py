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
CHARGING = {"battery": ", battery: {capacity: 200, charge: 9}", "more": "chargers: [10, 16]"}


@pytest.mark.parametrize(
    ("clock", "change", "one"),
    [
        ("live", {}, True),
        ("live", {"mobility": "heading", "heading": ", heading: east"}, True),
        ("lockstep", {}, False),
        ("live", CHARGING, False),
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


EAST = ["#" * 22, "#..#..#..........#..##", "#..#..#.########.#..##"]
CROWDS = {
    "that has arrived before the others": (48, 3, 60, [76],
        ["#" * 13, *["#...#...#...#"] * 2, "#...........#", *["#...#...#...#"] * 2, "#" * 13],
        [(50, "patrol", 28, 24), (23, "visit", 14, 50), (72, "visit", 40, 61),
         (62, "visit", 14, 62), (70, "visit", 35, 45)]),
    "that charges on its way": (102, 2, 45, [128, 118, 93, 46, 51, 122],
        [*EAST, "#....................#", *EAST[::-1]],
        [(24, "visit", 117, 36), (122, "visit", 30, 23), (115, "visit", 60, 79),
         (93, "patrol", 81, 104), (124, "visit", 30, 40), (118, "patrol", 120, 111)]),
}  # fmt: skip


@pytest.mark.parametrize("robot", CROWDS)
def test_joint_plans_leave_no_robot_without_charge(robot: str) -> None:
    seed, rounds, capacity, chargers, grid, team = CROWDS[robot]
    battery = {"capacity": capacity, "charge": 2}
    model = {"mobility": "free", "layer": "ground", "battery": battery}
    robots = {
        f"r{k}": {"model": "cart", "start": start, "objective": {kind: targets}}
        for k, (start, kind, *targets) in enumerate(team)
    }
    mission = {"map": {"grid": grid}, "catalogue": {"robots": {"cart": model}}, "robots": robots}
    ends = {"until": {"rounds": rounds}, "seed": seed}
    completed(mission | ends | {"safenav": 1, "chargers": chargers})
