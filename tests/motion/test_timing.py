"""Reservations: for any durations no robots meet, no region is entered early, and all moves end."""

import os
import random
from itertools import combinations

import pytest
from msgspec.structs import replace

from motion.runs import SHIPPED, motion, played, trace_of
from once import beside
from safenav.motion.check.verdict import check_motion
from safenav.motion.file import Action, Line, Moving, Release, Reserve
from safenav.motion.geometry import MetricFloor
from safenav.motion.making import motion_of
from safenav.motion.mover import Crossing, Glider, Mover
from safenav.motion.timing.execution import when
from safenav.motion.timing.in_time import in_time
from safenav.motion.timing.schedule import motion_at_earliest_times
from safenav.trace.reading import Trace, read_bytes
from safenav.trace.records import Met, Move, Resolved, Service

SLOWED = int(os.environ.get("SAFENAV_MOTION_SLOWED", "20"))


class Stroller(Glider):
    """Takes one to three seconds for a move, by chance, and sometimes one to halt."""

    chance: random.Random

    def move(self, crossing: Crossing) -> list[Moving]:
        self.region = crossing.to
        self.time += self.chance.uniform(1, 3)
        return []

    def halt(self, tick: int) -> list[Moving]:
        del tick
        self.time += self.chance.choice([0.0, 1.0])
        return []

    def rest(self, tick: int, until: float) -> list[Moving]:
        del tick
        self.time = until
        return []


def strolled(trace: Trace, seed: int) -> list[Line]:
    floor = MetricFloor(trace.header.scenario.map.rows, trace.header.scenario.map.cols, 2.7)
    movers: dict[str, Mover] = {}
    for name, robot in trace.header.scenario.robots.items():
        values = {"size": 0.5, "speed": 0.5, "action_seconds": 2.0}
        mover = Stroller(name, floor, robot.start, robot.heading, values, "disc")
        mover.chance = random.Random(f"{seed} {name}")
        movers[name] = mover
    lines, _ = motion_at_earliest_times(trace, floor, movers)
    return [*lines]


def overlaps(trace: Trace, plan: list[Line]) -> int:
    """Pairs of robots in conflict that have one region at once."""
    held: dict[tuple[str, int], float] = {}
    spans: dict[int, list[tuple[str, float, float]]] = {}
    for line in plan:
        if isinstance(line, Reserve):
            held[line.robot, line.region] = line.t
        elif isinstance(line, Release):
            begin = held.pop((line.robot, line.region))
            spans.setdefault(line.region, []).append((line.robot, begin, line.t))
    for (robot, region), begin in held.items():
        spans.setdefault(region, []).append((robot, begin, float("inf")))
    robots = trace.header.scenario.robots
    return sum(
        1
        for having in spans.values()
        for one, other in combinations(having, 2)
        if one[0] != other[0]
        and other[0] in (robots[one[0]].conflicts or ())
        and min(one[2], other[2]) > max(one[1], other[1]) + 1e-9
    )


def entered_early(trace: Trace, plan: list[Line]) -> int:
    """Reservations of a region whose obstacle blocks the robot and is not resolved yet, but by
    those that resolve it by entering."""
    done = {line.obstacle: line.t1 for line in plan if isinstance(line, Action)}
    obstacles = [*trace.obstacles.values()]
    blocked = [
        line
        for line in plan
        if isinstance(line, Reserve)
        for obstacle in obstacles
        if obstacle.region == line.region
        and line.robot in obstacle.blocks
        and not obstacle.resolved_by_entering(
            trace.header.scenario.robots[line.robot], len(obstacle.needs) - 1
        )
        and line.t < done.get(obstacle.name, float("inf")) - 1e-9
    ]
    return len(blocked)


@pytest.mark.parametrize("name", SHIPPED)
def test_slow_robots_never_overlap_never_enter_a_door_early_and_all_end(name: str) -> None:
    trace = trace_of(name)
    steps = sum(
        1 for r in trace.records if isinstance(r, Move) and r.to != r.from_ and r.toward is None
    )
    met = [r for r in trace.records if isinstance(r, Met)]
    once = {r.obstacle for r in met}  # the others have one need, told by their resolution
    resolved = [r for r in trace.records if isinstance(r, Resolved) and r.obstacle not in once]
    acting = [r.robots or (r.robot,) for r in (*met, *resolved)]
    for seed in range(SLOWED):
        plan = strolled(trace, seed)
        assert overlaps(trace, plan) == 0
        assert entered_early(trace, plan) == 0
        assert sum(1 for line in plan if isinstance(line, Release)) == steps
        assert sum(1 for line in plan if isinstance(line, Action)) == sum(map(len, acting))


def test_regions_are_reserved_in_the_first_tick_of_a_step_and_released_in_its_last() -> None:
    moves = [r for r in trace_of("team_of_six").records if isinstance(r, Move)]
    ends = [m for m in moves if m.toward is None and m.to != m.from_]
    begun: dict[str, int] = {}
    begins = []
    for move in moves:
        begun.setdefault(move.robot, move.tick)
        if move.toward is None:
            tick = begun.pop(move.robot)
            begins += [(move.robot, tick, move.to)] if move.to != move.from_ else []
    assert [b[1] for b in begins] != [m.tick for m in ends], "some steps take several ticks"
    lines = motion("team_of_six").lines
    entered = [(r.robot, r.tick, r.region) for r in lines if isinstance(r, Reserve) and r.tick > 0]
    left = [(r.robot, r.tick, r.region) for r in lines if isinstance(r, Release)]
    assert sorted(entered) == sorted(begins)
    assert sorted(left) == sorted((m.robot, m.tick, m.from_) for m in ends)


@pytest.mark.parametrize("name", SHIPPED)
def test_makespan_is_the_length_of_the_chain_that_is_named(name: str) -> None:
    outcome = motion(name).outcome
    assert outcome.chain[0].t0 == 0
    assert outcome.chain[-1].t1 == pytest.approx(outcome.makespan)
    for before, after in zip(outcome.chain, outcome.chain[1:], strict=False):
        assert after.t0 == pytest.approx(before.t1, abs=1e-9)
    length = sum(link.t1 - link.t0 for link in outcome.chain)
    assert length == pytest.approx(outcome.makespan, abs=1e-6)


def test_a_robot_without_charge_stands_until_its_battery_is_replaced() -> None:
    lines = motion("battery_delivery").lines
    replaced = max(line.t1 for line in lines if isinstance(line, Action))
    moved = [m for m in lines if isinstance(m, Moving) and m.robot == "digit" and m.origin != m.to]
    flat = max(move.t1 for move in moved if move.t0 < replaced)
    assert flat < replaced <= min(move.t0 for move in moved if move.t0 >= flat)
    told = in_time(trace_of("battery_delivery"), motion("battery_delivery")).records
    served = [(record.active, record.t) for record in told if isinstance(record, Service)]
    assert served == [(False, pytest.approx(flat)), (True, pytest.approx(replaced))]


APART = beside(__file__, "scenarios/apart.yaml")


def had(lines: list[Line], robot: str, regions: set[int]) -> list[tuple[float, float]]:
    """The spans in which a robot has one of these regions."""
    since: dict[int, float] = {}
    found = []
    for line in sorted(lines, key=when):
        if isinstance(line, Reserve) and line.robot == robot and line.region in regions:
            since[line.region] = line.t
        if isinstance(line, Release) and line.robot == robot and line.region in regions:
            found.append((since.pop(line.region), line.t))
    return [*found, *((t, float("inf")) for t in since.values())]


def together(one: list[tuple[float, float]], other: list[tuple[float, float]]) -> float:
    """The most seconds for which two spans are at the same time."""
    return max(min(e, f) - max(b, c) for b, e in one for c, f in other)


def test_robots_of_any_pace_are_never_together_where_the_scenario_forbids_it() -> None:
    trace = read_bytes(played(APART))
    runs = [[*motion_of(trace).lines], *(strolled(trace, seed) for seed in range(SLOWED))]
    for run in runs:
        assert together(had(run, "a", {10, 24}), had(run, "b", {10, 24})) < 1e-6


def test_a_motion_that_ignores_exclusions_is_refused() -> None:
    trace = read_bytes(played(APART))
    assert check_motion(motion_of(trace), trace) == []
    scenario = replace(trace.header.scenario, never_together=None)
    heedless = replace(trace, header=replace(trace.header, scenario=scenario))
    assert {found.rule for found in check_motion(motion_of(heedless), trace)} == {"never-together"}
