"""Robots that are never together in some regions: judged by a walk over the trace, and by the
campaigns' search over joint states."""

import json
import os
import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from campaigns.judge.joint import JointState, State
from campaigns.judge.mission import read_mission
from campaigns.judge.situation import Answer, at_start
from certify.making import certified
from runtime.played import loaded, play
from safenav.team.team import team_of

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
ROWS, COLS = 3, 4
BUNDLED = 7
CATALOGUE = {"robots": {"rover": {"mobility": "free", "layer": "ground"}}}


def drawn(seed: int) -> dict[str, Any]:
    """A connected map without obstacles."""
    rng, count = random.Random(f"together {seed}"), 2
    while True:
        walls = {r for r in range(ROWS * COLS) if rng.random() < 0.45}
        free = [r for r in range(ROWS * COLS) if r not in walls]
        if len(free) > count and len(reached(free[0], {*free})) == len(free):
            break
    zone = rng.sample(free, rng.randint(1, min(4, len(free) - count)))
    outside = [r for r in free if r not in zone]
    starts = rng.sample(outside, count)
    if rng.random() < 0.5:
        starts[0] = rng.choice(zone)
    robots: dict[str, Any] = {}
    for k, start in enumerate(starts):
        model = rng.choice(["rover", "quadcopter"])
        targets = rng.sample(free, rng.randint(1, 2))
        robots[f"r{k}"] = {"model": model, "start": start, "objective": {"visit": targets}}
    cells = ["#" if r in walls else "." for r in range(ROWS * COLS)]
    return {
        "safenav": 1,
        "map": {"grid": ["".join(cells[k : k + COLS]) for k in range(0, ROWS * COLS, COLS)]},
        "robots": robots,
        "never_together": [{"robots": [*robots], "in": [{"any": sorted(zone)}]}],
        "catalogue": CATALOGUE,
        "until": {"rounds": 1},
        "limits": {"ticks": 300},
    }


def beside(region: int) -> list[int]:
    row, col = divmod(region, COLS)
    ways = ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1))
    return [r * COLS + c for r, c in ways if 0 <= r < ROWS and 0 <= c < COLS]


def reached(start: int, free: set[int]) -> set[int]:
    found, queue = {start}, [start]
    while queue:
        for after in beside(queue.pop()):
            if after in free and after not in found:
                found.add(after)
                queue.append(after)
    return found


class Apart(JointState):
    """The states in which at most one robot is in the zone."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.zone = {*document["never_together"][0]["in"][0]["any"]}
        mission = read_mission({k: v for k, v in document.items() if k != "never_together"})
        super().__init__(mission, at_start(mission))

    def successors(self, state: State) -> Iterator[State]:
        for after in super().successors(state):
            if sum(region in self.zone for region, _ in after[0]) <= 1:
                yield after


def outcome(document: dict[str, Any]) -> str:
    """Run it; the team is never together in its zone at any line of the trace."""
    run = play(document)
    zone = {*document["never_together"][0]["in"][0]["any"]}
    inside = {name: {robot["start"]} for name, robot in document["robots"].items()}
    for line in run.records:
        if line["type"] in ("move", "depart", "arrive"):
            regions = {"move": ("to", "toward"), "depart": ("from", "to"), "arrive": ("at",)}
            inside[line["robot"]] = {line[k] for k in regions[line["type"]] if k in line}
            there = [name for name, regions in inside.items() if regions & zone]
            assert len(there) <= 1, (there, line)
    return str(run.outcome["outcome"])


@pytest.mark.parametrize("seed", range(WANTED))
def test_the_mission_completes_iff_some_order_of_moves_does(
    seed: int, clock: str, played: Callable[[], None]
) -> None:
    document = drawn(seed) | {"clock": clock}
    can = Apart(document).search(100_000) is Answer.YES
    wanted = "completed" if can else "operator_needed"
    assert outcome(document) == wanted, json.dumps(document)
    played()
    if seed % BUNDLED == 0 or (wanted == "operator_needed" and clock == "lockstep"):
        certified(json.dumps(document))


def test_robots_that_share_only_a_zone_may_wait_for_each_other() -> None:
    robot = "{model: quadcopter, start: %d, objective: {hold: %d}, avoids: []}"
    team = "\n".join(f"  {name}: {robot % (k, k)}" for k, name in enumerate("abc"))
    zone = "never_together: [{robots: [a, b], in: [3]}]"
    scenario = loaded(f'map: {{grid: ["...."]}}\nrobots:\n{team}\n{zone}\n')
    a, b, c = scenario.robots
    assert scenario.interfere(a, b) and not scenario.interfere(a, c)
    assert [member.planned for member in team_of(scenario).members] == [True, True, False]
