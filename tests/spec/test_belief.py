"""Beliefs contain the true position, and the specification says exactly how they develop.

Judged in random scenes in which a robot keeps track of another, by what it can know of it. Among
the tests the campaigns are short; `make fuzz` tries thousands.
"""

from collections.abc import Collection
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from once import SCENARIOS
from safenav import (
    Pose,
    Region,
    RegionMap,
    Robot,
    Synthesizer,
    Task,
    UsageError,
    Verdict,
    compile_task,
    first_failure,
    load_scenario,
)
from safenav.formula.parser import parse
from safenav.formula.syntax import Predicate, predicate
from safenav.judge.bundle.strategies import sees
from safenav.judge.world import World
from safenav.scenario.model import RobotModel
from safenav.scenario.objective import Visit
from safenav.spec import belief
from safenav.spec.belief import Knowledge, watch
from safenav.spec.specification import Section
from safenav.spec.task import Known, Observed
from safenav.world.map import Cells, in_order
from safenav.world.poses import Mobility, bits
from support.examples import campaign


@st.composite
def partitions(draw: st.DrawFn, world: RegionMap) -> Cells:
    """Any partition whatever; cells need not be connected."""
    labels = draw(st.lists(st.integers(0, 3), min_size=len(world.free), max_size=len(world.free)))
    cells: dict[int, list[Region]] = {}
    for region, label in zip(world.free, labels, strict=True):
        cells.setdefault(label, []).append(region)
    return in_order(cells.values())


@st.composite
def tracks(draw: st.DrawFn) -> tuple[Task, RegionMap]:
    """A robot with the task of keeping track of another, and its map."""
    rows, cols = draw(st.integers(1, 5)), draw(st.integers(1, 6))
    line = st.lists(st.sampled_from("...#"), min_size=cols, max_size=cols).map("".join)
    world = RegionMap.from_grid(draw(st.lists(line, min_size=rows, max_size=rows)))
    assume(len(world.free) >= 2)
    free = st.sampled_from(world.free)
    own, other = draw(free), draw(free)
    target = st.frozensets(free, min_size=1, max_size=3)
    radius = draw(st.sampled_from([1.0, 1.5, 2.0, 3.0, None]))
    model = RobotModel("rover", Mobility.FREE, "ground", frozenset(), radius)
    objective = Visit((draw(target), draw(target)))
    blocked = draw(st.frozensets(free, max_size=2)) - {own}
    task = Task(
        Robot("rover", model, Pose(own), objective),
        Pose(own),
        objective,
        blocked=tuple(Known(region, "map", "closed") for region in sorted(blocked)),
        observed=(Observed("other", other),),
        partition=draw(st.none() | partitions(world)),
        closed=draw(st.frozensets(free, max_size=2)),
        live=draw(st.booleans()),
    )
    return task, world


class Oracle:
    """A robot's possible knowledge of another one, which moves one step between two looks, or in a
    live run any number. It reads the map's text, and its line of sight is the judge's."""

    def __init__(self, task: Task, world: RegionMap) -> None:
        self.rows = world.grid_rows()
        self.cols = len(self.rows[0])
        self.grid = World(len(self.rows), self.cols, world.walls)
        self.task = task
        self.cells = belief.watch_for(task, world).cells

    def beside(self, region: int) -> list[int]:
        row, col = divmod(region, self.cols)
        near = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
        inside = [(r, c) for r, c in near if 0 <= r < len(self.rows) and 0 <= c < self.cols]
        return [r * self.cols + c for r, c in inside if self.rows[r][c] == "."]

    def steps(self, own: int) -> list[int]:
        """The regions of the robot after its next move."""
        blocked = {known.region for known in self.task.blocked}
        return [own, *(region for region in self.beside(own) if region not in blocked)]

    def reach(self, regions: Collection[int]) -> set[int]:
        found, fresh = set(regions), list(regions)
        while fresh:
            beyond = {near for region in fresh for near in self.beside(region)} - found
            found |= beyond
            fresh = list(beyond) if self.task.live else []
        return found

    def sees(self, own: int, other: int) -> bool:
        return sees(self.grid, own, other, self.task.robot.model.vision, self.task.closed)

    def next(self, own: int, known: Knowledge) -> set[Knowledge]:
        now = [known] if isinstance(known, int) else [r for k in known for r in self.cells[k]]
        reach = self.reach(now)
        seen = {region for region in reach if self.sees(own, region)}
        cells = frozenset(k for k, cell in enumerate(self.cells) if cell & (reach - seen))
        return {*seen, *([cells] if cells else [])}


def formulas(task: Task, world: RegionMap, section: Section) -> list[Predicate]:
    found = belief.assumptions(task, world)
    return [predicate(parse(c.formula)) for c in found if c.section is section]


@campaign(40)
@given(tracks())
def test_the_assumptions_allow_exactly_the_possible_observations(
    scene: tuple[Task, RegionMap],
) -> None:
    """All that can be known, everywhere where the robot can get to; all inputs are tried."""
    (task, world), oracle = scene, Oracle(*scene)
    assume(len(world.free) <= 16)
    (model,) = belief.models(task, world)
    number = {model.number(known): known for known in model.owns}
    steps = formulas(task, world, Section.ENV_TRANS)
    start: tuple[int, Knowledge] = (task.pose.region, task.observed[0].region)
    found, fresh = {start}, [start]
    while fresh:
        own, known = fresh.pop()
        state = {"region": own, "at_other": model.number(known)}
        allowed = {
            number.get(value)
            for value in range(world.size + len(model.beliefs))
            if all(f(state, {"region": own, "at_other": value}) for f in steps)
        }
        expected = oracle.next(own, known)
        assert allowed == expected
        new = {(after, known) for after in oracle.steps(own) for known in expected} - found
        found |= new
        fresh += new
    assert {(own, known) for known, owns in model.owns.items() for own in bits(owns)} == found


@campaign(60)
@given(tracks(), st.data())
def test_the_other_robot_is_always_in_its_believed_region(
    scene: tuple[Task, RegionMap], data: st.DataObject
) -> None:
    """Its observations satisfy the assumptions, also those of a specification that begins while it
    is out of sight."""
    (task, world), oracle = scene, Oracle(*scene)
    watch, own, other = belief.watch_for(task, world), task.pose.region, task.observed[0].region
    knowledge: Knowledge = other
    for turn in range(8):
        if turn in (0, 4):
            cells = knowledge if isinstance(knowledge, frozenset) else None
            task = replace(task, pose=Pose(own), observed=(Observed("other", other, cells),))
            begins, steps = (
                formulas(task, world, section) for section in (Section.ENV_INIT, Section.ENV_TRANS)
            )
            state = {"region": own, **belief.observe(task, world, {"other": knowledge})}
            assert all(formula(state, None) for formula in begins)
        for _ in range(data.draw(st.integers(0, 6 if task.live else 1))):
            other = data.draw(st.sampled_from(oracle.beside(other) or [other]))
        knowledge = watch.look(own, other, knowledge)
        assert other in watch.possible(knowledge)
        assert (knowledge == other) == oracle.sees(own, other)
        after = data.draw(st.sampled_from(oracle.steps(own)))
        following = {"region": after, **belief.observe(task, world, {"other": knowledge})}
        assert all(formula(state, following) for formula in steps)
        own, state = after, following


def test_after_a_jump_out_of_sight_a_robot_may_be_in_any_cell() -> None:
    world = RegionMap.from_grid(["......"])
    here = watch(world, in_order([[0, 1, 2], [3, 4, 5]]), 2.0)
    assert here.look(1, 5, 1) == {0, 1}
    assert here.look(1, 3, 1) == 3


def test_too_many_beliefs_are_refused_with_a_hint(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = load_scenario(SCENARIOS / "case_study_3.yaml")
    digit = scenario.robot("digit")
    seeing = replace(digit, model=replace(digit.model, vision=2.5))
    task = Task(seeing, digit.start, digit.objective, observed=(Observed("quad", 49),))
    most = len(belief.models(task, scenario.map)[0].beliefs)
    for limit in (most, most - 1):
        belief._model.cache_clear()
        monkeypatch.setattr(belief, "MOST_BELIEFS", limit)
        if limit == most:
            compile_task(task, scenario.map)
            continue
        with pytest.raises(
            UsageError, match=rf"digit: more than {limit} beliefs .* 3 cells.* larger tiles"
        ):
            compile_task(task, scenario.map)


def test_a_robot_that_sees_everything_has_no_beliefs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A map of 64 regions: no value of the input is beyond them."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path))
    world = RegionMap.from_grid(["........"] * 8)
    model = RobotModel("rover", Mobility.FREE, "ground", frozenset())
    visit = Visit((frozenset({0}), frozenset({1})))
    rover = Robot("rover", model, Pose(0), visit)
    task = Task(rover, Pose(0), visit, observed=(Observed("other", 3),))
    spec = compile_task(task, world)
    assert [variable.bounds for variable in spec.variables if variable.name == "at_other"] == [
        (0, 63)
    ]
    result = Synthesizer(verifier=first_failure).synthesize(spec)
    assert (result.verdict, result.verified) == (Verdict.REALIZABLE, True)
