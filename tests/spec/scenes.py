"""Random scenes in which a robot keeps track of another, and what it can know of it."""

from collections.abc import Collection
from dataclasses import dataclass

from hypothesis import assume
from hypothesis import strategies as st

from safenav.judge.bundle.strategies import sees
from safenav.judge.world import World
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Visit
from safenav.spec import belief
from safenav.spec.belief import Knowledge
from safenav.spec.task import Known, Observed, Task
from safenav.world.map import Partition, Region, RegionMap
from safenav.world.poses import Mobility, Pose


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
            live=draw(st.booleans()),
        ),
    )


class Oracle:
    """A robot's possible knowledge of another one, which moves one step between two looks, or in a
    live run any number. It reads the map's text, and its line of sight is the judge's."""

    def __init__(self, scene: Scene) -> None:
        self.rows = scene.world.grid_rows()
        self.cols = len(self.rows[0])
        self.grid = World(len(self.rows), self.cols, scene.world.walls)
        self.task = scene.task
        self.cells = belief.watch_for(scene.task, scene.world).partition.cells

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
