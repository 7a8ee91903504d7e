"""Random scenes in which a robot keeps track of another, and random walks of both."""

from dataclasses import dataclass

from hypothesis import assume
from hypothesis import strategies as st

from safenav.runtime.control.observing import after_look
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Visit
from safenav.spec.other_robots import belief
from safenav.spec.other_robots.knowledge import Knowledge
from safenav.spec.task import Known, Observed, Task
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.partition import Partition


@st.composite
def maps(draw: st.DrawFn) -> RegionMap:
    rows, cols = draw(st.integers(1, 5)), draw(st.integers(1, 6))
    line = st.lists(st.sampled_from("...#"), min_size=cols, max_size=cols).map("".join)
    world = RegionMap.from_grid(draw(st.lists(line, min_size=rows, max_size=rows)))
    assume(len(world.free) >= 2)
    return world


@st.composite
def partitions(draw: st.DrawFn, world: RegionMap) -> Partition:
    """Any partition whatever; cells need not be connected."""
    labels = draw(st.lists(st.integers(0, 3), min_size=len(world.free), max_size=len(world.free)))
    cells: dict[int, list[Region]] = {}
    for region, label in zip(world.free, labels, strict=True):
        cells.setdefault(label, []).append(region)
    return Partition.of(cells.values())


@dataclass(frozen=True)
class Scene:
    """A map, and a robot on it with the task of keeping track of another."""

    world: RegionMap
    task: Task


@st.composite
def scenes(draw: st.DrawFn) -> Scene:
    world = draw(maps())
    free = st.sampled_from(world.free)
    own, other = draw(free), draw(free)
    target = st.frozensets(free, min_size=1, max_size=3)
    radius = draw(st.sampled_from([1.0, 1.5, 2.0, 3.0, None]))
    model = RobotModel("rover", Mobility.FREE, "ground", frozenset(), radius)
    objective = Visit((draw(target), draw(target)))
    blocked = draw(st.frozensets(free, max_size=2)) - {own}
    return Scene(
        world,
        Task(
            Robot("rover", model, Pose(own), objective),
            Pose(own),
            objective,
            blocked=tuple(Known(region, "map", "closed") for region in sorted(blocked)),
            observed=(Observed("other", other),),
            partition=draw(st.none() | partitions(world)),
            closed=draw(st.frozensets(free, max_size=2)),
        ),
    )


@dataclass(frozen=True)
class Look:
    """One turn: the other has come to ``other``, the robot looks from ``before``, knows
    ``knowledge``, and steps to ``after``."""

    before: Region
    other: Region
    knowledge: Knowledge
    after: Region


def walk(scene: Scene, data: st.DataObject, steps: int) -> list[Look]:
    """Both robots at random."""
    world, task = scene.world, scene.task
    (observed,) = task.observed
    blocked = {known.region for known in task.blocked}
    watch = belief.watch_for(task, world)
    own, other, knowledge = task.pose.region, observed.region, belief.known_of(observed)
    looks = []
    for _ in range(steps):
        other = data.draw(st.sampled_from([other, *world.neighbours(other)]))
        knowledge = after_look(watch, own, other, knowledge)
        steps_ = [own, *(r for r in world.neighbours(own) if r not in blocked)]
        after = data.draw(st.sampled_from(steps_))
        looks.append(Look(own, other, knowledge, after))
        own = after
    return looks
