"""Suspects on shared floors: a joint plan around all of them, in time whatever of them is there."""

from collections.abc import Iterator
from itertools import combinations
from random import Random

import pytest

from runtime.deadlines.every_behaviour import every_behaviour
from runtime.deadlines.instances import FUZZ
from runtime.deadlines.test_choice import SUSPECT
from runtime.played import Run, play
from safenav.runtime.deadlines.bound import BoundMoment, BoundObstacle, BoundRobot
from safenav.runtime.resolution.problem import OpenNeed, OpenObstacle
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, region_mask

HALL = (
    SUSPECT.replace("layer: air", "layer: ground")
    .replace("blocks: [ground]", "blocks: [walker]")
    .replace("obstacles: [{type: gate, region: [1, 7]}]", "obstacles: [GATE]")
    .replace("resolve_within: 12", "resolve_within: LIMIT")
)
CAREFUL = "whichever suspects exist"


@pytest.mark.parametrize("gate", ["", "{type: gate, region: [1, 7]}"], ids=["absent", "there"])
@pytest.mark.parametrize(("limit", "careful"), [(16, True), (13, True), (12, False)])
def test_a_joint_plan_leads_around_suspects_if_that_is_in_time(
    gate: str, limit: int, careful: bool
) -> None:
    played = play(HALL.replace("GATE", gate).replace("LIMIT", str(limit)))
    first = played.all("plan")[0]
    assert (CAREFUL in first["reason"]) == careful
    if careful:
        assert played.one("resolved", obstacle="parcel@42")["tick"] == 14
    assert played.outcome["late"] == (["parcel@42"] if gate and not careful else [])


@pytest.mark.parametrize("seed", range(FUZZ // 10 or 3))
def test_a_careful_plan_is_in_time_whatever_is_there(seed: int) -> None:
    """One run for each set of suspects; the oracle knows every behaviour with all of them there."""
    floor = Floor(Random(f"suspects {seed}"))
    for limit in (floor.truth - 1, floor.truth + 2):
        ends = {careful_end(play(floor.text(limit, there))) for there in floor.subsets()}
        assert all(end is None or floor.truth <= end <= limit + 1 for end in ends)


def careful_end(played: Run) -> int | None:
    """The tick in which a careful plan of the first tick serves the parcel; None if none does, or
    a suspect was encountered before it began."""
    plans = [line for line in played.all("plan") if CAREFUL in line["reason"]]
    if not plans or plans[0]["tick"] > 1 or played.all("violation", tick=1):
        return None
    parcel = [line for line in played.all("resolved") if line["obstacle"].startswith("parcel")]
    return int(parcel[0]["tick"])


class Floor:
    """A small floor with two robots, suspects that stop one of them, and a parcel for that one;
    ``truth``: the earliest tick of its resolution if all suspects are there, and known."""

    def __init__(self, random: Random) -> None:
        self.truth = 0
        while self.truth < 3:
            rows, cols = random.choice(((3, 5), (4, 5), (3, 6)))
            self.grid = ["#" * cols, *(self._row(random, cols) for _ in range(rows)), "#" * cols]
            world = RegionMap.from_grid(self.grid)
            free = sorted(world.free)
            if len(free) < 8:
                continue
            self.a, self.p, self.parcel, *self.suspects = random.sample(free, random.choice((4, 5)))
            truth = self._truth(world)
            self.truth = 0 if truth is None else truth

    def _row(self, random: Random, cols: int) -> str:
        inside = "".join("#" if random.random() < 0.2 else "." for _ in range(cols - 2))
        return f"#{inside}#"

    def _truth(self, world: RegionMap) -> int | None:
        graph = PoseGraph(world, Mobility.FREE)
        robots = [(self.a, "fetch"), (self.p, "push")]
        walkers = tuple(BoundRobot(graph, at, 0, 1, frozenset({skill})) for at, skill in robots)
        needs = [("fetch", self.parcel, frozenset[int]())]
        needs += [("push", at, frozenset({0})) for at in self.suspects]
        opens = tuple(
            BoundObstacle(OpenObstacle("", at, (stops,), (OpenNeed(action, 1, region_mask([at])),)))
            for action, at, stops in needs
        )
        foes = (frozenset({1}), frozenset({0}))
        found = every_behaviour(BoundMoment(walkers, opens, 1), foes=foes)
        assert found is not None
        return None if found.turns[0] is None else found.turns[0] // 2

    def subsets(self) -> Iterator[tuple[int, ...]]:
        for size in range(len(self.suspects) + 1):
            yield from combinations(self.suspects, size)

    def text(self, limit: int, there: tuple[int, ...]) -> str:
        grid = "".join(f'    - "{row}"\n' for row in self.grid)
        head, _ = HALL.split("robots:\n  a:")
        catalogue = head[head.index("catalogue:") :]
        gates = ", ".join(f"{{type: gate, region: {at}}}" for at in there)
        suspects = ", ".join(f"{{type: gate, region: {at}}}" for at in self.suspects)
        return (
            f"safenav: 1\nmap:\n  grid:\n{grid}{catalogue}robots:\n"
            f"  a: {{model: walker, start: {self.a}, objective: {{hold: {self.a}}}}}\n"
            f"  p: {{model: pusher, start: {self.p}, objective: {{hold: {self.p}}}}}\n"
            f"obstacles: [{gates}]\nsuspects: [{suspects}]\n"
            f"orders: [{{at: 1, type: parcel, region: {self.parcel}, resolve_within: {limit}}}]\n"
            "until: {rounds: 1}\nlimits: {ticks: 60}\n"
        )


ALONE = """
map: {{grid: {grid}}}
catalogue:
  robots: {{walker: {{mobility: {mobility}, layer: ground, capabilities: [fetch]}}}}
  obstacles:
    parcel: {{action: fetch, blocks: []}}
    debris: {{action: clear, resolve_at: neighbours}}
robots:
  a: {{model: walker, start: {start}, heading: south, objective: {{visit: [{start}]}}}}
obstacles: {there}
suspects: [{{type: debris, region: {suspect}}}]
orders: [{{at: 1, type: parcel, region: {parcel}, resolve_within: {limit}}}]
until: {{rounds: 1}}
"""
RING = ["#######", "#.....#", "#.###.#", "#.....#", "#######"]
BENT = ["########", "#......#", "#..#...#", "#..##..#", "##.....#", "########"]


@pytest.mark.parametrize("stands", [False, True], ids=["absent", "there"])
@pytest.mark.parametrize(
    ("grid", "mobility", "start", "suspect", "parcel", "limit"),
    [
        (RING, "free", 8, 10, 26, 5),  # both ways take six steps
        (BENT, "heading", 36, 18, 17, 4),  # it may arrive facing west, or as soon facing north
    ],
    ids=["two ways", "two headings"],
)
def test_of_two_fastest_ways_a_robot_takes_that_without_suspects(
    grid: list[str], mobility: str, start: int, suspect: int, parcel: int, limit: int, stands: bool
) -> None:
    there = f"[{{type: debris, region: {suspect}}}]" if stands else "[]"
    text = ALONE.format(
        grid=grid,
        mobility=mobility,
        start=start,
        suspect=suspect,
        parcel=parcel,
        limit=limit,
        there=there,
    )
    played = play(text)
    assert played.outcome["late"] == []
    resolved = played.one("resolved")["tick"]
    assert resolved == limit + 1
    assert suspect not in played.path("a")[:resolved]
    assert played.all("acts")[0]["around"] == {"a": [suspect]}
