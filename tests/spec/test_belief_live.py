"""Others that move at any speed between two looks (live runs), against a flood of the map.

The oracle is this file's own: it reads the map's text, and its line of sight is the judge's.
"""

from collections.abc import Collection

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from safenav.formula.evaluator import Predicate, predicate
from safenav.formula.parser import parse
from safenav.judge.bundle.tasks import sees
from safenav.judge.world import World
from safenav.runtime.control.observing import after_look
from safenav.spec.other_robots import belief
from safenav.spec.other_robots.knowledge import Knowledge, watch
from safenav.spec.specification import Section
from safenav.world.map import RegionMap
from safenav.world.partition import Partition
from spec.scenes import Scene, scenes
from support.examples import campaign

Known = int | frozenset[int]


@st.composite
def live_scenes(draw: st.DrawFn) -> Scene:
    scene = draw(scenes())
    assume(len(scene.world.free) <= 16)
    task = replace(scene.task, live=True)
    return Scene(scene.world, task)


class Oracle:
    """A robot's possible knowledge of another one after any number of steps between readings."""

    def __init__(self, world: RegionMap, scene: Scene) -> None:
        self.rows = world.grid_rows()
        self.cols = len(self.rows[0])
        self.grid = World(self.rows, self.cols)
        task = scene.task
        self.radius, self.closed = task.robot.model.vision, task.closed
        self.cells = belief.watch_for(task, world).partition.cells

    def beside(self, region: int) -> list[int]:
        row, col = divmod(region, self.cols)
        near = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
        inside = [(r, c) for r, c in near if 0 <= r < len(self.rows) and 0 <= c < self.cols]
        return [r * self.cols + c for r, c in inside if self.rows[r][c] == "."]

    def flood(self, regions: Collection[int]) -> set[int]:
        found, fresh = set(regions), list(regions)
        while fresh:
            beyond = set(self.beside(fresh.pop())) - found
            found |= beyond
            fresh += beyond
        return found

    def next(self, own: int, known: Known) -> set[Known]:
        now = [known] if isinstance(known, int) else [r for k in known for r in self.cells[k]]
        reach = self.flood(now)
        seen = {r for r in reach if sees(self.grid, own, r, self.radius, self.closed)}
        cells = frozenset(k for k, cell in enumerate(self.cells) if cell & (reach - seen))
        return {*seen, *([cells] if cells else [])}


def env_trans(scene: Scene) -> list[Predicate]:
    found = belief.assumptions(scene.task, scene.world)
    return [predicate(parse(c.formula)) for c in found if c.section is Section.ENV_TRANS]


@campaign(25)
@given(live_scenes())
def test_the_assumptions_allow_exactly_the_possible_observations_at_any_speed(
    scene: Scene,
) -> None:
    """All that can be known, everywhere where the robot can get to; all inputs are tried."""
    world, task, oracle = scene.world, scene.task, Oracle(scene.world, scene)
    (model,) = belief.models(task, world)
    number = {model.number(known): known for known in model.owns}
    steps, values = env_trans(scene), range(world.size + len(model.beliefs))
    blocked = {known.region for known in task.blocked}
    start: tuple[int, Known] = (task.pose.region, task.observed[0].region)
    found, fresh = {start}, [start]
    while fresh:
        own, known = fresh.pop()
        state = {"region": own, "at_other": model.number(known)}
        allowed = {
            value
            for value in values
            if all(f(state, {"region": own, "at_other": value}) for f in steps)
        }
        expected = oracle.next(own, known)
        assert {number.get(value) for value in allowed} == expected
        floor = [own, *(r for r in oracle.beside(own) if r not in blocked)]
        new = {(after, known) for after in floor for known in expected} - found
        found |= new
        fresh += new


@campaign(60)
@given(live_scenes(), st.data())
def test_the_other_robot_is_in_its_believed_region_after_any_number_of_steps(
    scene: Scene, data: st.DataObject
) -> None:
    world, task, oracle = scene.world, scene.task, Oracle(scene.world, scene)
    watch, steps = belief.watch_for(task, world), env_trans(scene)
    own, other = task.pose.region, task.observed[0].region
    blocked = {known.region for known in task.blocked}
    knowledge: Knowledge = other

    def state() -> dict[str, int]:
        return {"region": own, **belief.observe(task, world, {"other": knowledge})}

    for _ in range(8):
        for _ in range(data.draw(st.integers(0, 6))):
            other = data.draw(st.sampled_from([other, *oracle.beside(other)]))
        before = state()
        knowledge = after_look(watch, own, other, knowledge)
        assert other in watch.possible(knowledge)
        assert all(formula(before, state()) for formula in steps)
        own = data.draw(st.sampled_from([own, *sorted({*oracle.beside(own)} - blocked)]))


@pytest.mark.parametrize(("live", "cells"), [(False, {1}), (True, {1, 2})])
def test_one_that_has_stepped_out_of_sight_may_be_far_in_a_live_run(
    live: bool, cells: set[int]
) -> None:
    world = RegionMap.from_grid(["...."])
    partition = Partition.of([[0, 1], [2], [3]])
    assert watch(world, partition, 1.0, frozenset(), live).update(0, 1).belief == cells
