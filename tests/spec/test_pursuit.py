"""The automaton of an objective and its formulas say the same, step by step, and the steps of a
robot are those of its map; strategies of visits keep their order, and those that avoid others never
share a region with them."""

import json
from collections.abc import Iterable
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import networkx
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from oracle.text import Truth, truth
from safenav import (
    Heading,
    Pose,
    Region,
    RegionMap,
    Robot,
    Specification,
    Synthesizer,
    Task,
    Verdict,
    compile_task,
    first_failure,
    load_scenario_text,
)
from support.examples import campaign

REGIONS = range(9)
OPEN = ["...", "...", "..."]


def anyof(*regions: Region) -> dict[str, list[Region]]:
    return {"any": [*regions]}


OBJECTIVES: list[dict[str, Any]] = [
    {"patrol": [0, 8]},
    {"patrol": [anyof(0, 1), anyof(7, 8)]},
    {"patrol": [0, 4, 8]},
    {"patrol": [anyof(0, 1), 3, anyof(7, 8), 5]},
    {"visit": [4]},
    {"visit": [0, 8, 4]},
    {"visit": [anyof(0, 3), anyof(3, 6)]},
    {"cover": [0, 4, 8]},
    {"hold": 4},
    {"hold": anyof(4, 5)},
    {"once": [0, 8, 4]},
    {"once": [anyof(0, 3), anyof(4, 5)]},
    {"once": [anyof(4, 5)]},
]


def rover(grid: Iterable[str], objective: object, pose: Pose) -> Robot:
    """A robot with this objective, as a scenario has it."""
    robot = {"model": "rover", "start": pose.region, "objective": objective}
    if pose.heading is not None:
        robot["heading"] = pose.heading.label
    model = {"mobility": "free" if pose.heading is None else "heading", "layer": "ground"}
    data = {"safenav": 1, "map": {"grid": [*grid]}, "robots": {"a": robot}}
    text = json.dumps(data | {"catalogue": {"robots": {"rover": model}}})
    return load_scenario_text(text).robots[0]


def task_of(robot: Robot, index: int = 0, **rest: Any) -> Task:
    """Its task where it starts; ``index``: its next target."""
    task = Task(robot, robot.start, robot.objective, **rest)
    return replace(task, memory=replace(task.memory, index=index))


def rules(specification: Specification, section: str, item: str = "") -> list[Truth]:
    """The formulas of a section; ``item``: only those of this origin."""
    return [
        truth(each.formula)
        for each in specification.constraints
        if each.section == section and item in ("", each.origin.item)
    ]


def values(memory: int, region: int) -> dict[str, int]:
    return {"region": region, "scout": memory, "goal": memory, "assigned": 9}


@pytest.mark.parametrize("objective", OBJECTIVES, ids=str)
def test_steps_are_allowed_and_counted_as_the_formulas_require(objective: dict[str, Any]) -> None:
    # A visit has a memory where goals are assigned at runtime; see below.
    robot = rover(OPEN, objective, Pose(3))
    spec = compile_task(task_of(robot, assignable=True), RegionMap.from_grid(OPEN))
    steps, goals = (
        rules(spec, section, "robots.a.objective") for section in ("SYS_TRANS", "SYS_LIVENESS")
    )
    own, counted = robot.objective, 0
    memories = range(len(own.targets)) if own.in_turn else (0,)
    for memory, region, then, after in product(memories, REGIONS, memories, REGIONS):
        before, now = values(memory, region), values(then, after)
        if own.strict and own.begin(region, memory) != memory:
            continue  # a state that the formulas never let it be in
        kept = all(rule(before, now) for rule in steps)
        turned = own.turned(memory, region) if own.in_turn else memory
        assert kept == (then == turned and not own.forbidden(memory, region, after))
        if kept:
            met = tuple(i for i, goal in enumerate(goals) if goal(before, now))
            counts = own.met(then, after)
            if own.in_turn and own.settles:  # the last one alone is a goal forever
                counts = (0,) if len(own.targets) - 1 in counts else ()
            assert met == counts
            counted += 1
    assert counted > 20


@pytest.mark.parametrize("objective", OBJECTIVES[:7], ids=str)
def test_an_objective_starts_as_the_formulas_require(objective: dict[str, Any]) -> None:
    for region in REGIONS:
        robot = rover(OPEN, objective, Pose(region))
        for memory in range(len(robot.objective.targets)):
            task = task_of(robot, memory, assignable=True)
            spec = compile_task(task, RegionMap.from_grid(OPEN))
            start = values(robot.objective.begin(region, memory), region)
            for rule in rules(spec, "SYS_INIT", "robots.a.objective"):
                assert rule(start, {})


def graph(grid: list[str], turns: bool) -> networkx.DiGraph:
    """The steps on a map: to free neighbours, never backwards with a heading, or none at all."""
    found = networkx.DiGraph()
    cols, facings = len(grid[0]), [*Heading] if turns else [None]
    free = [region for region, sign in enumerate("".join(grid)) if sign == "."]
    for region, facing in product(free, facings):
        found.add_edge(Pose(region, facing), Pose(region, facing))
        row, col = divmod(region, cols)
        for side, (down, right) in zip(Heading, ((-1, 0), (0, 1), (1, 0), (0, -1)), strict=True):
            beside = (row + down) * cols + col + right
            inside = 0 <= row + down < len(grid) and 0 <= col + right < cols
            if inside and beside in free and not (turns and side == (facing or 0) ^ 2):
                found.add_edge(Pose(region, facing), Pose(beside, side if turns else None))
    return found


@pytest.mark.parametrize("seed", range(12))
def test_a_strategy_takes_the_targets_of_a_visit_in_their_order(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its specification has no memory of the next target, from which it begins all the same."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path))
    random, grid = Random(seed), ["....", ".##.", "...."]
    world = RegionMap.from_grid(grid)
    heading = random.choice((None, Heading(random.randrange(4))))
    pose = Pose(random.choice(world.free), heading)
    places, size = random.sample(world.free, 8), random.randint(1, 2)
    targets = [places[2 * k : 2 * k + size] for k in range(random.randint(2, 4))]
    robot = rover(grid, {"visit": [anyof(*target) for target in targets]}, pose)
    index = random.randrange(len(targets))
    spec = compile_task(task_of(robot, index), world)
    assert {variable.name for variable in spec.variables} <= {"region", "heading"}
    strategy = Synthesizer(verifier=first_failure).synthesize(spec).strategy
    assert strategy is not None
    steps = graph(grid, turns=heading is not None)
    node, here, turn = strategy.initial()[0], pose, index
    for _ in range(3 * len(targets)):
        turn = (turn + (here.region in targets[turn])) % len(targets)
        ways = networkx.single_source_shortest_path_length(steps, here)
        shortest = min(length for at, length in ways.items() if at.region in targets[turn])
        for _ in range(shortest or 1):  # the shortest way to the next target, or a stay at it
            (node,) = strategy.transitions[node]
            now = strategy.values(node)
            here = Pose(now["region"], None if heading is None else Heading(now["heading"]))
            if here.region in targets[turn]:
                break
        assert here.region in targets[turn]


@pytest.mark.parametrize("names", [("b",), ("b", "c")], ids=len)
def test_a_robot_never_enters_an_occupied_region_and_meets_its_targets(
    names: tuple[str, ...],
) -> None:
    grid = [".....", ".###.", "....."]
    world = RegionMap.from_grid(grid)
    task = task_of(rover(grid, {"visit": [0, 14]}, Pose(0)), avoids=names)
    result = Synthesizer(verifier=first_failure).synthesize(compile_task(task, world))
    assert result.verdict is Verdict.REALIZABLE and result.verified
    strategy, draw = result.strategy, Random(7)
    assert strategy is not None
    node, others, visited = strategy.initial()[0], dict.fromkeys(names, 10), set[int]()
    for _ in range(400):
        here = strategy.values(node)["region"]
        for name, place in others.items():
            choices = [place, *(r for r in world.neighbours(place) if r != here)]
            others[name] = draw.choice(choices)
        taken = {*others.values()}
        sides = {f"busy_{side.label}": int(world.step(here, side) in taken) for side in Heading}
        node = strategy.successors_for(node, sides)[0]
        there = strategy.values(node)["region"]
        assert there == here or there not in taken
        visited.add(there)
    assert {0, 14} <= visited


@campaign(30)
@given(st.data())
def test_a_specification_allows_exactly_the_steps_of_the_map(data: st.DataObject) -> None:
    """No step leads into a forbidden pose; the robot may stay."""
    rows, cols = data.draw(st.sampled_from([(1, 5), (2, 3), (3, 3), (3, 2), (4, 1)]))
    line = st.lists(st.sampled_from("...#"), min_size=cols, max_size=cols).map("".join)
    grid = data.draw(st.lists(line, min_size=rows, max_size=rows))
    steps = graph(grid, turns=data.draw(st.booleans()))
    assume(steps)
    poses = [*steps]
    here = data.draw(st.sampled_from(poses))
    lost = data.draw(st.frozensets(st.sampled_from(poses), max_size=2))
    robot = rover(grid, {"visit": [here.region]}, here)
    spec = compile_task(task_of(robot, forbidden=lost), RegionMap.from_grid(grid))
    allowed = rules(spec, "SYS_TRANS")
    facings = {pose.heading for pose in poses}
    every = [Pose(region, facing) for region in range(rows * cols) for facing in facings]
    for a, b in product(poses, every):
        before, after = ({"region": p.region, "heading": p.heading or 0} for p in (a, b))
        expected = steps.has_edge(a, b) and b not in lost
        assert all(rule(before, after) for rule in allowed) == expected, (a, b)
