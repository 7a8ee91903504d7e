"""The ``robots:`` of a scenario, and whether each can reach its targets."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from itertools import combinations

from msgspec.structs import replace

from safenav.scenario import language
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import (
    Ltl,
    Objective,
    TargetObjective,
    kinds_that,
    one_of,
    ruled,
    staying,
)
from safenav.scenario.reachability import Reachability
from safenav.scenario.reading.catalogue import model_named, vision_of
from safenav.scenario.reading.objective import resolve_objective, stated, within_of
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Scalar, clipped
from safenav.world.map import HEADINGS, Heading, RegionMap
from safenav.world.moves import Mobility, Pose

Standing = tuple[Robot, Node | None, Node | None]
"""A robot that holds its start region, and the nodes of its start and ``tracks``."""


def resolve_robots(
    team: Mapping[Scalar, language.RobotKeys], reading: Reading, others: Collection[Robot] = ()
) -> tuple[Robot, ...]:
    """Return the readable robots; errors in the others are reported. ``others``: robots that the
    scenario already has."""
    standing: list[Standing] = [(robot, None, None) for robot in others]
    robots = [_robot(key.text, item, standing, reading) for key, item in team.items()]
    _check_starts(standing, reading)
    _check_timing(standing, reading)
    return tuple(robot for robot in robots if robot is not None)


def _robot(
    name: str, item: language.RobotKeys, standing: list[Standing], reading: Reading
) -> Robot | None:
    before = len(reading)
    model = model_named(item.model, item.named("model"), reading)
    if item.vision is not None:
        model = model and replace(model, vision=vision_of(item.vision))
    heading, start = _heading(item, model, reading), reading.region(item.start)
    for key, words in (("avoids", item.avoids), ("tracks", item.tracks)):
        _check_others(words or (), item.named(key), name, reading)
    avoids = None if item.avoids is None else frozenset(word.text for word in item.avoids)
    tracks = frozenset(word.text for word in item.tracks)
    if start is not None and model is not None:
        at = staying(frozenset({start}))
        there = Robot(name, model, Pose(start), at, avoids, tracks)
        standing.append((there, item.at("start"), item.at("tracks")))
    mobility = model.mobility if model else None
    objective = resolve_objective(item.objective, mobility, reading)
    waiting = _while_waiting(item, objective, mobility, reading)
    within = within_of(item.objective, objective, reading)
    if model is None or start is None or objective is None:
        return None
    if mobility is Mobility.HEADING and heading is None:
        return None
    pose = Pose(start, heading if mobility is Mobility.HEADING else None)
    robot = Robot(name, model, pose, objective, avoids, tracks, waiting, within)
    robot = replace(robot, when=_when(item, robot, reading))
    _check_reachable(robot, objective, item.at("objective"), reading)
    if waiting is not None:
        misses_targets(robot, waiting, item.at("while_waiting"), reading)
    return None if item.flawed or len(reading) > before else robot


def _while_waiting(
    item: language.RobotKeys, own: Objective | None, mobility: Mobility | None, reading: Reading
) -> TargetObjective | None:
    """Return the objective while it waits for help. With ``ltl`` there is none: the robot stays,
    which keeps its safety formulas."""
    if item.while_waiting is None:
        return None
    found = resolve_objective(item.while_waiting, mobility, reading)
    if isinstance(found, Ltl) or isinstance(own, Ltl):
        hint = f"use {one_of(kinds_that())} for both, or leave out 'while_waiting'"
        node = item.at("while_waiting")
        reading.add(node, f"{item.named('while_waiting')} cannot be used with 'ltl'", hint)
        return None
    return found and own and ruled(found, own)


def _when(
    item: language.RobotKeys, robot: Robot, reading: Reading
) -> tuple[tuple[str, Objective], ...]:
    """Return its objectives while inputs are on, in the order of the file."""
    what, found = item.named("when"), []
    for key, value in (item.when or {}).items():
        if key.text not in reading.inputs:
            declare = "declare it in 'inputs'"
            reading.unknown(key, f"{what}: no input is named", key.text, reading.inputs, declare)
        objective = resolve_objective(value, robot.model.mobility, reading)
        if isinstance(objective, Ltl) or isinstance(robot.objective, Ltl):
            hint = "name the input in its formulas instead"
            reading.add(key, f"{what}: not with formulas", hint)
        elif objective is not None:
            _check_reachable(robot, objective, value.node, reading)
            found.append((key.text, objective))
    return tuple(found)


def _heading(
    item: language.RobotKeys, model: RobotModel | None, reading: Reading
) -> Heading | None:
    """Return the heading; report it if heading mobility lacks it."""
    missing = item.at("heading") is None
    if missing and model is not None and model.mobility is Mobility.HEADING:
        found = f"robot {item.of.removeprefix('of ')}: the key 'heading' is missing"
        hint = f"a {model.name} starts with a heading: {', '.join(HEADINGS)}"
        reading.add(item.node, found, hint)
    return HEADINGS[item.heading] if item.heading else None


def _check_others(words: Collection[Scalar], what: str, name: str, reading: Reading) -> None:
    """Report names in a list that are not those of other robots."""
    for word in words:
        if word.text == name:
            reading.add(word, f"{what}: a robot cannot list itself")
        elif word.text not in reading.named:
            found = f"{what}: no robot is named"
            reading.unknown(word, found, word.text, {*reading.named} - {name})


def _check_starts(standing: Collection[Standing], reading: Reading) -> None:
    """Report robots in conflict that start in the same region."""
    there: dict[int, list[Standing]] = {}
    for each in standing:
        there.setdefault(each[0].start.region, []).append(each)
    for crowd in there.values():
        reported = set()
        for (first, *_), (second, node, _) in combinations(crowd, 2):
            if second.name not in reported and first.conflicts(second):
                reported.add(second.name)
                region = second.start.region
                found = f"'start' of {second.name}: {first.name} also starts in region {region}"
                reading.add(node, found, _why_apart(first, second))


def _check_timing(standing: Collection[Standing], reading: Reading) -> None:
    """Report beliefs where steps take several ticks: the assumptions about the other robots would
    be false."""
    for robot, _, node in standing:
        slow = [
            other.name
            for other, *_ in standing
            if robot.tracks and (other is robot or other.name in robot.tracks)
            if other.model.timing > 1
        ]
        if slow:
            what = f"'tracks' of {clipped(robot.name)}: beliefs require one-tick steps"
            found = f"{what}; those of {clipped(slow[0])} take longer"
            reading.add(node, found, "leave out 'tracks', or the 'timing' of the model")


def _why_apart(one: Robot, other: Robot) -> str:
    for robot, rest in ((one, other), (other, one)):
        if robot.avoids is not None and rest.name in robot.avoids:
            return f"{clipped(robot.name)} avoids {clipped(rest.name)}"
    return f"robots of one layer ({clipped(one.model.layer)}) cannot share a region"


def _check_reachable(
    robot: Robot, objective: Objective, node: Node | None, reading: Reading
) -> None:
    world = reading.world
    if not objective.targets or world is None or not reading.reachable:
        return
    if robot.start.region in objective.avoid:
        start = world.label(robot.start.region)
        found = f"'avoid' of {robot.name}: it starts in {start}, which it must avoid"
        place = node.get("avoid") if isinstance(node, document.Mapping) else node
        reading.add(place, found, "let it start elsewhere")
    reach = Reachability(robot.model.mobility, robot.start, world, objective.avoid)
    meets = reach.follows if objective.settles else reach.recurs
    if not misses_targets(robot, objective, node, reading) and not meets(objective.targets):
        what = "its targets in this order" if objective.settles else "all targets infinitely often"
        hint = "with heading mobility it cannot turn at its target"
        reading.add(node, f"objective of {robot.name}: it cannot visit {what}", hint)


def misses_targets(robot: Robot, objective: Objective, node: Node | None, reading: Reading) -> bool:
    """Return whether a robot cannot reach some target of an objective from its start; report those
    targets."""
    world, before = reading.world, len(reading)
    if world is None or not reading.reachable:
        return False
    start, targets = world.label(robot.start.region), objective.targets
    reach = Reachability(robot.model.mobility, robot.start, world, objective.avoid)
    places = stated(node)[1] or (node,) * len(targets)  # none if the kind is misspelt
    for target, place in zip(targets, places, strict=True):
        if not reach.reaches(target):
            regions = clipped(world.labels(target), 80)
            found = f"objective of {robot.name}: {regions} cannot be reached from {start}"
            reading.add(place, found, _why(robot, target, world))
    return len(reading) > before


def _why(robot: Robot, target: frozenset[int], world: RegionMap) -> str:
    if Reachability(robot.model.mobility, robot.start, world).reaches(target):
        return "regions that it avoids are between them"
    if robot.model.mobility is Mobility.HEADING:
        on_foot = Reachability(Mobility.FREE, Pose(robot.start.region), world)
        if on_foot.reaches(target):
            return "with heading mobility it cannot turn around on the spot: check the heading"
    return "walls are between them"
