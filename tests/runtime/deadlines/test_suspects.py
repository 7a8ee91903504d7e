"""A joint plan around all suspects of a random floor is in time, whichever of them exist."""

from collections.abc import Iterator
from itertools import combinations
from random import Random

import pytest

from runtime.deadlines.every_behaviour import every_behaviour
from runtime.deadlines.instances import FUZZ
from runtime.facts import case
from runtime.played import Run, play
from safenav.runtime.deadlines.bound import BoundMoment, BoundObstacle, BoundRobot
from safenav.runtime.resolution.problem import OpenNeed, OpenObstacle
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility
from safenav.world.poses import PoseGraph, region_mask

CAREFUL = "whichever suspects exist"


@pytest.mark.parametrize("seed", range(FUZZ // 10 or 3))
def test_a_plan_around_all_suspects_is_in_time_whichever_exist(seed: int) -> None:
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
        text = case("deadlines/joint_plan_around_suspects")
        catalogue = text[text.index("catalogue:") : text.index("robots:\n  a:")]
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
