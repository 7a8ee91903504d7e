"""The canonical form of a scenario: the data of a scenario file that needs no other file.

Regions are numbers, the map is drawn, and the catalogue holds every model and type. Reading the
data again gives the same scenario; a trace holds it, so that ``safenav resume`` needs no file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from msgspec.structs import asdict

from safenav.scenario.language import UNLIMITED, VERSION
from safenav.scenario.model import (
    Need,
    Obstacle,
    ObstacleType,
    ResolveAt,
    Robot,
    RobotModel,
    Scenario,
)
from safenav.scenario.objective import Ltl, Objective, to_data
from safenav.scenario.settings import Expect, Input, RobotChange
from safenav.world.map import Region, RegionMap

Data = dict[str, Any]


def dump(scenario: Scenario) -> Data:
    """Return a scenario as plain data (of JSON or YAML); its source is not part of it."""
    flat, used = scenario.flat, [each.type for each in scenario.obstacles]
    models = {each.model.name: each.model for each in scenario.robots}
    models |= scenario.catalogue.robots
    types = {kind.name: kind for kind in (*used, *([flat] if flat else []))}
    types |= scenario.catalogue.obstacles
    return {
        "safenav": VERSION,
        "name": scenario.name,
        "map": _map(scenario.map),
        **_given(areas={n: _cells(area, scenario.map) for n, area in scenario.map.areas.items()}),
        "catalogue": {
            "robots": {name: _model(model) for name, model in models.items()},
            "obstacles": {name: _type(kind) for name, kind in types.items()},
        },
        "robots": {each.name: _robot(each, models) for each in scenario.robots},
        **_given(
            inputs={each.name: _input(each) for each in scenario.inputs},
            obstacles=[_obstacle(each) for each in scenario.obstacles if not each.ordered],
            orders=[_order(each) for each in scenario.obstacles if each.ordered],
            changes=[_change(each) for each in scenario.changes],
            never_together=[
                {"robots": sorted(each.robots), "in": sorted(each.regions)}
                for each in scenario.never_together
            ],
            chargers=sorted(scenario.chargers),
            flat=flat.name if flat else None,
            resolve_within=scenario.resolve_within,
            partition={"tiles": scenario.tiles} if scenario.tiles else None,
            requirements=[
                text if name == text else {name: text}
                for name, text in scenario.requirements.items()
            ],
            expect=_expect(scenario.expect),
        ),
        "until": _given(**asdict(scenario.until)),
        "limits": _given(**asdict(scenario.limits)),
        "clock": scenario.clock.value,
        "late": scenario.late.value,
        "seed": scenario.seed,
        "coordination": scenario.coordination.value,
    }


def _given(**values: Any) -> Data:
    """Return the values that are not missing; a field's underscore is not part of its key."""
    given = {key: value for key, value in values.items() if value is not None}
    return {key.rstrip("_"): value for key, value in given.items() if value not in ([], {})}


def _cells(regions: Iterable[Region], world: RegionMap) -> list[tuple[int, int]]:
    return [world.position(region) for region in sorted(regions)]


def _map(world: RegionMap) -> Data:
    frame = world.frame
    return {
        "grid": world.grid_rows(),
        **_given(
            names=dict(world.names),
            resolution=frame and list(frame.resolution),
            origin=frame and [*frame.origin, frame.yaw],
        ),
    }


def _model(model: RobotModel) -> Data:
    return _given(
        mobility=model.mobility.value,
        layer=model.layer,
        capabilities=sorted(model.capabilities),
        vision=_vision(model),
        size=model.size,
        speed=model.speed,
        timing=model.timing,
        motion=model.motion,
        battery=model.battery and asdict(model.battery),
    )


def _vision(model: RobotModel) -> float | str:
    return UNLIMITED if model.vision is None else model.vision


def _type(kind: ObstacleType) -> Data:
    where: Data = {"needs": [_need(need) for need in kind.listed]}
    if not kind.listed:
        where = {"action": kind.action, **_given(resolve_at=_place(kind.resolve_at))}
    blocks = {} if kind.blocks is None else {"blocks": sorted(kind.blocks)}
    rest = _given(resolve_within=kind.resolve_within)
    return {**where, **blocks, **({"has_truth": True} if kind.has_truth else {}), **rest}


def _need(need: Need) -> Data:
    return asdict(need) | {"at": _place(need.at)}


def _place(at: ResolveAt | frozenset[Region]) -> str | list[Region]:
    return at.value if isinstance(at, ResolveAt) else sorted(at)


def _objective(objective: Objective, within: int | None = None) -> Data:
    data = to_data(objective)
    if isinstance(objective, Ltl):
        formulas: Any = data["ltl"]
        return {"ltl": {key: value for key, value in formulas.items() if key != "inputs"}}
    targets: list[Any] = [
        min(target) if len(target) == 1 else {"any": sorted(target)} for target in objective.targets
    ]
    data[objective.kind] = targets[0] if objective.one else targets
    return data | _given(within=within)


def _robot(robot: Robot, models: Mapping[str, RobotModel]) -> Data:
    own, usual = robot.model, models[robot.model.name]
    waiting = robot.while_waiting
    return {
        "model": own.name,
        "start": robot.start.region,
        "objective": _objective(robot.objective, robot.within),
        **({} if robot.avoids is None else {"avoids": sorted(robot.avoids)}),
        **_given(
            heading=robot.start.facing,
            vision=None if own.vision == usual.vision else _vision(own),
            tracks=sorted(robot.tracks),
            while_waiting=waiting and _objective(waiting),
            when={name: _objective(objective) for name, objective in robot.when},
        ),
    }


def _input(each: Input) -> Data:
    again = {(): None, (False,): "off", (True,): "on"}.get(each.again, "both")
    return _given(at=[f"{first}-{last}" for first, last in each.spans], always_eventually=again)


def _obstacle(each: Obstacle) -> Data:
    return _given(
        type=each.type.name,
        region=each.region,
        traversable=each.traversable,
        from_=each.appears,
        until=each.goes,
        resolve_within=each.resolve_within,
    )


def _order(each: Obstacle) -> Data:
    within = _given(resolve_within=each.resolve_within)
    return {"at": each.appears, "type": each.type.name, "region": each.region, **within}


def _change(each: RobotChange) -> Data:
    service = None if each.active is None else ("out", "back")[each.active]
    objective = each.objective and _objective(each.objective, each.within)
    return {"at": each.at, "robot": each.robot, **_given(objective=objective, service=service)}


def _expect(expect: Expect) -> Data:
    found: Data = asdict(expect) | {"outcome": expect.outcome and expect.outcome.value}
    sets = {k: sorted(v) if isinstance(v, frozenset) else v for k, v in found.items()}
    return {key: value for key, value in sets.items() if value is not None}
