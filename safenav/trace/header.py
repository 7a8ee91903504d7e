"""Conversion of a scenario to the header of a trace."""

from __future__ import annotations

from collections.abc import Mapping

import safenav
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.motion import resolved
from safenav.spec.other_robots.belief import MOST_CELLS
from safenav.trace import setting
from safenav.trace.reading import Trace
from safenav.trace.records import VERSION, Header
from safenav.world.map import RegionMap
from safenav.world.partition import rooms


def scenario_header(
    scenario: Scenario, truths: Mapping[str, bool | None] | None, *, live: bool = False
) -> setting.ScenarioHeader:
    """Return the scenario as recorded in a trace, fully resolved.

    ``truths`` maps an obstacle's name to the value of ``traversable`` drawn from this run's seed;
    None stands for a world that is not simulated, whose truths are unknown beforehand.
    """
    return setting.ScenarioHeader(
        name=scenario.name,
        map=_map(scenario.map),
        robots={robot.name: _robot(robot, scenario) for robot in scenario.robots},
        world="external" if truths is None else "simulated",
        obstacles=tuple(
            obstacle_header(o, scenario, None if truths is None else truths[o.name])
            for o in scenario.obstacles
        ),
        until=setting.UntilHeader(scenario.until.rounds),
        limits=scenario.limits,
        seed=scenario.seed,
        coordination=scenario.coordination.value,
        partition=_partition(scenario),
        changes=_changes(scenario),
        requirements=scenario.requirements or None,
        never_together=scenario.never_together or None,
        promises=None if live else _promises(scenario),
        chargers=tuple(sorted(scenario.chargers)) or None,
        inputs=scenario.inputs or None,
        flat=None if scenario.flat is None else scenario.flat.name,
    )


def unstarted(scenario: Scenario) -> Trace:
    """Return the trace of a run of the scenario that has not begun."""
    header = Header(0, VERSION, safenav.__version__, scenario_header(scenario, None))
    return Trace(scenario.name, header, (), cut_off=False, ignored=0)


def _promises(scenario: Scenario) -> setting.PromisesHeader | None:
    if not scenario.deadlines:
        return None
    within = {robot.name: robot.within for robot in scenario.robots if robot.within is not None}
    return setting.PromisesHeader(within, scenario.until.by, scenario.late.value)


def obstacle_header(
    obstacle: Obstacle, scenario: Scenario, truth: bool | None = None
) -> setting.ObstacleHeader:
    """Return an obstacle as recorded in a trace; ``truth``: what resolving it will reveal."""
    return setting.ObstacleHeader(
        type=obstacle.type.name,
        name=obstacle.name,
        region=obstacle.region,
        action=obstacle.type.action,
        resolution_regions=obstacle.resolution_regions(scenario.map),
        blocks=frozenset(robot.name for robot in scenario.robots if obstacle.blocks(robot)),
        traversable=truth,
        needs=_needs(obstacle, scenario.map) if obstacle.type.listed else None,
        from_=obstacle.appears,
        until=obstacle.goes,
        ordered=obstacle.ordered or None,
        resolve_within=scenario.limit_of(obstacle),
    )


def _needs(obstacle: Obstacle, world: RegionMap) -> tuple[setting.NeedHeader, ...]:
    return tuple(
        setting.NeedHeader(
            need.action,
            obstacle.resolution_regions(world, number),
            need.robots,
            need.together,
            need.same or None,
        )
        for number, need in enumerate(obstacle.needs)
    )


def _map(world: RegionMap) -> setting.MapHeader:
    """Return the map, with metres only if they are known."""
    frame = world.frame
    return setting.MapHeader(
        world.rows,
        world.cols,
        tuple(world.grid_rows()),
        resolution=None if frame is None else frame.resolution,
        origin=None if frame is None else (*frame.origin, frame.yaw),
        names=dict(world.names) or None,
        areas={name: tuple(sorted(area)) for name, area in world.areas.items()} or None,
    )


def _robot(robot: Robot, scenario: Scenario) -> setting.RobotHeader:
    model = robot.model
    return setting.RobotHeader(
        model=model.name,
        mobility=model.mobility.value,
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
        when=tuple(setting.WhenHeader(n, o) for n, o in robot.when) or None,
    )


def _changes(scenario: Scenario) -> tuple[setting.ChangeHeader, ...] | None:
    found = tuple(
        setting.ChangeHeader(
            change.at,
            change.robot,
            change.objective,
            change.active,
            change.within,
        )
        for change in scenario.changes
    )
    return found or None


def _partition(scenario: Scenario) -> tuple[tuple[int, ...], ...] | None:
    if not any(robot.tracks for robot in scenario.robots):
        return None
    world = scenario.map
    cells = scenario.partition or rooms(world).coarsened(MOST_CELLS, world).cells
    return tuple(tuple(sorted(cell)) for cell in cells)
