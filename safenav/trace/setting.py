"""The scenario in the form of a trace header, fully resolved, and its conversion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta, Struct

from safenav.bounds import Count, Heading, Positive, Region
from safenav.scenario.model import Battery, Obstacle, Robot, Scenario
from safenav.scenario.motion import resolved
from safenav.scenario.objective import Objective
from safenav.scenario.settings import (
    Coordination,
    Exclusion,
    Input,
    LatePolicy,
    Limits,
    RobotChange,
)
from safenav.spec.belief import MOST_CELLS
from safenav.world.map import RegionMap
from safenav.world.partition import rooms
from safenav.world.poses import Mobility


def without_underscore(name: str) -> str:
    """Return the name of a field in JSON: the underscore distinguishes it from words of Python."""
    return name.rstrip("_")


class WhenHeader(Struct, frozen=True):
    """The ``objective`` of a robot while an input is on and none listed before it."""

    input: str
    objective: Objective


class RobotHeader(Struct, frozen=True):
    """A robot. ``conflicts``: those it must not share a region with (None: those of its layer).
    ``vision``: in regions; None: without limit. ``motion``: its kind and all parameters."""

    model: str
    mobility: Mobility
    layer: str
    capabilities: frozenset[str]
    start: Region
    heading: Heading | None
    objective: Objective
    conflicts: frozenset[str] | None = None
    vision: float | None = None
    tracks: tuple[str, ...] | None = None
    timing: Positive | None = None
    motion: Mapping[str, object] | None = None
    while_waiting: Objective | None = None
    battery: Battery | None = None
    when: tuple[WhenHeader, ...] | None = None


class NeedHeader(Struct, frozen=True):
    """An action that an obstacle needs: by ``robots`` distinct robots,
    ``together`` in one tick, from ``regions``; ``same``: by robots that met the need before it."""

    action: str
    regions: tuple[Region, ...]
    robots: Positive = 1
    together: bool = False
    same: bool | None = None


class ObstacleHeader(Struct, frozen=True, rename=without_underscore):
    """A hidden obstacle. ``blocks``: the robots that it physically stops, whatever they can do.
    ``traversable``: the truth of this run. ``needs``: in their order. ``from_`` and ``until``: when
    it appears and disappears. ``ordered``: the team is to resolve it as soon as it appears."""

    type: str
    name: str
    region: Region
    needs: Annotated[tuple[NeedHeader, ...], Meta(min_length=1)]
    blocks: frozenset[str]
    traversable: bool | None
    from_: Count | None = None
    until: Count | None = None
    resolve_within: Count | None = None
    ordered: bool | None = None

    def resolved_by_entering(self, robot: RobotHeader, stage: int) -> bool:
        """Whether a robot alone resolves it by entering its region once ``stage`` needs are met:
        only one is left, and the region is one of that need's."""
        last = self.needs[-1]
        only = stage == len(self.needs) - 1 and last.robots == 1 and not last.same
        return only and self.region in last.regions and last.action in robot.capabilities


class MapHeader(Struct, frozen=True):
    """The map. ``resolution``: metres of a region from west to east and from south to north.
    ``origin``: x, y (metres) and yaw (radians) of its south-western corner."""

    rows: Count
    cols: Count
    grid: tuple[str, ...]
    resolution: tuple[float, float] | None = None
    origin: tuple[float, float, float] | None = None
    names: Mapping[str, Count] | None = None
    """The regions to which the scenario gives names."""
    areas: Mapping[str, tuple[Region, ...]] | None = None
    """The sets of regions to which the scenario gives names."""


class UntilHeader(Struct, frozen=True):
    """The run is completed when every objective was met this many times after the last
    resolution."""

    rounds: Count | None = None


class PromisesHeader(Struct, frozen=True):
    """The deadlines: of a round in ticks, by robot; of the mission, a tick; whether the run ends
    with the first missed deadline (``stop``)."""

    within: Mapping[str, Count]
    by: Count | None = None
    late: LatePolicy = LatePolicy.GO_ON


class ScenarioHeader(Struct, frozen=True):
    """The scenario, fully resolved. ``robots`` are in the order of their turns. ``world``:
    ``simulated`` or ``external``. ``partition``: the cells of beliefs, None where no robot keeps
    any. ``requirements``: formulas over the motion of the run, by name. ``flat``: the type of
    obstacle that appears at a robot whose charge is used up."""

    name: str
    map: MapHeader
    robots: Mapping[str, RobotHeader]
    obstacles: tuple[ObstacleHeader, ...]
    until: UntilHeader
    limits: Limits
    seed: int
    coordination: Coordination
    world: Literal["simulated", "external"] = "simulated"
    partition: tuple[tuple[Region, ...], ...] | None = None
    changes: tuple[RobotChange, ...] | None = None
    requirements: Mapping[str, str] | None = None
    never_together: tuple[Exclusion, ...] | None = None
    promises: PromisesHeader | None = None
    chargers: tuple[Region, ...] | None = None
    inputs: tuple[Input, ...] | None = None
    flat: str | None = None


def scenario_header(
    scenario: Scenario, truths: Mapping[str, bool | None] | None, *, live: bool = False
) -> ScenarioHeader:
    """Return the scenario as recorded in a trace, fully resolved.

    ``truths`` maps an obstacle's name to the value of ``traversable`` drawn from this run's seed;
    None stands for a world that is not simulated, whose truths are unknown beforehand.
    """
    return ScenarioHeader(
        name=scenario.name,
        map=_map(scenario.map),
        robots={robot.name: _robot(robot, scenario) for robot in scenario.robots},
        world="external" if truths is None else "simulated",
        obstacles=tuple(
            obstacle_header(o, scenario, None if truths is None else truths[o.name])
            for o in scenario.obstacles
        ),
        until=UntilHeader(scenario.until.rounds),
        limits=scenario.limits,
        seed=scenario.seed,
        coordination=scenario.coordination,
        partition=_partition(scenario),
        changes=scenario.changes or None,
        requirements=scenario.requirements or None,
        never_together=scenario.never_together or None,
        promises=None if live else _promises(scenario),
        chargers=tuple(sorted(scenario.chargers)) or None,
        inputs=scenario.inputs or None,
        flat=None if scenario.flat is None else scenario.flat.name,
    )


def _promises(scenario: Scenario) -> PromisesHeader | None:
    if not scenario.deadlines:
        return None
    within = {robot.name: robot.within for robot in scenario.robots if robot.within is not None}
    return PromisesHeader(within, scenario.until.by, scenario.late)


def obstacle_header(
    obstacle: Obstacle, scenario: Scenario, truth: bool | None = None
) -> ObstacleHeader:
    """Return an obstacle as recorded in a trace; ``truth``: what resolving it will reveal."""
    return ObstacleHeader(
        type=obstacle.type.name,
        name=obstacle.name,
        region=obstacle.region,
        needs=_needs(obstacle, scenario.map),
        blocks=frozenset(robot.name for robot in scenario.robots if obstacle.blocks(robot)),
        traversable=truth,
        from_=obstacle.appears,
        until=obstacle.goes,
        ordered=obstacle.ordered or None,
        resolve_within=scenario.limit_of(obstacle),
    )


def _needs(obstacle: Obstacle, world: RegionMap) -> tuple[NeedHeader, ...]:
    return tuple(
        NeedHeader(
            need.action,
            obstacle.resolution_regions(world, number),
            need.robots,
            need.together,
            need.same or None,
        )
        for number, need in enumerate(obstacle.needs)
    )


def _map(world: RegionMap) -> MapHeader:
    """Return the map, with metres only if they are known."""
    frame = world.frame
    return MapHeader(
        world.rows,
        world.cols,
        tuple(world.grid_rows()),
        resolution=None if frame is None else frame.resolution,
        origin=None if frame is None else (*frame.origin, frame.yaw),
        names=dict(world.names) or None,
        areas={name: tuple(sorted(area)) for name, area in world.areas.items()} or None,
    )


def _robot(robot: Robot, scenario: Scenario) -> RobotHeader:
    model = robot.model
    return RobotHeader(
        model=model.name,
        mobility=model.mobility,
        layer=model.layer,
        capabilities=robot.capabilities,
        start=robot.start.region,
        heading=robot.start.facing,
        objective=robot.objective,
        conflicts=frozenset(other.name for other in scenario.in_conflict(robot)),
        vision=model.vision,
        tracks=tuple(sorted(robot.tracks)),
        timing=model.timing,
        motion=resolved(model.motion, model.size, model.speed, model.layer),
        while_waiting=robot.while_waiting,
        battery=model.battery,
        when=tuple(WhenHeader(n, o) for n, o in robot.when) or None,
    )


def _partition(scenario: Scenario) -> tuple[tuple[int, ...], ...] | None:
    if not any(robot.tracks for robot in scenario.robots):
        return None
    world = scenario.map
    cells = scenario.partition or rooms(world).coarsened(MOST_CELLS, world).cells
    return tuple(tuple(sorted(cell)) for cell in cells)
