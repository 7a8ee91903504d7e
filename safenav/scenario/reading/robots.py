"""The ``robots:`` of a scenario, and whether each can reach its targets."""

from __future__ import annotations

from collections.abc import Collection
from itertools import combinations

from msgspec.structs import replace

from safenav.formula.syntax import RESERVED_WORDS
from safenav.scenario.model import Robot, RobotModel, Tracking
from safenav.scenario.objective import (
    EXAMPLE,
    KINDS,
    STAYING,
    Ltl,
    Objective,
    TargetObjective,
    kinds_that,
    one_of,
    ruled,
    staying,
)
from safenav.scenario.reachability import Reachability
from safenav.scenario.reading.catalogue import MODEL, VISION
from safenav.scenario.reading.objective import (
    NAME_OF_ROBOT,
    OWN_VARIABLES,
    TIMED,
    ObjectiveKeys,
    read_objective,
    read_within,
    stated,
)
from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.fields import IDENTIFIER, well_named
from safenav.scenario.yaml.shapes import WORDS, Key, Table, choice, form, named, word
from safenav.world.map import HEADINGS, Heading, RegionMap
from safenav.world.moves import Mobility, Pose

_EXAMPLES = {key: kind.example() for key, kind in KINDS.items()}
INSIDE_OBJECTIVE = {
    key: f"it belongs in the objective, for example 'objective: {{{example}}}'"
    for key, example in {
        "avoid": f"{_EXAMPLES[TIMED[0]]}, avoid: [5]",
        "always": f"{STAYING.example()}, always: region != 5",
        "within": f"{_EXAMPLES[TIMED[0]]}, within: 20",
        **_EXAMPLES,
        "ltl": "ltl: {liveness: [region = 3]}",
    }.items()
}


class RobotKeys(Table):
    definition = "robot"
    made = Robot
    model = Key(MODEL, "A robot model of the catalogue.", required="for example 'model: digit'")
    start = Key(
        REGION, "Where it starts.", required="a region, for example 'start: 47' or 'start: [3, 8]'"
    )
    heading = Key(word(HEADINGS), "Its initial heading, if its mobility is heading.")
    objective = Key(form(ObjectiveKeys), required=f"its task, for example 'objective: {EXAMPLE}'")
    while_waiting = Key(
        form(ObjectiveKeys), "While it waits for help; not 'ltl'. Default: it stays."
    )
    vision = Key(VISION)
    avoids = Key(WORDS, "Robots whose regions it must not enter. Default: those of its layer.")
    tracks = Key(WORDS, "Robots that its specification also models.")
    tracking = Key(choice(Tracking), "How its specification models other robots.")
    when = Key(form(named(ObjectiveKeys)), "Objectives while inputs are on; the first counts.")


ROBOTS = form({**named(RobotKeys, NAME_OF_ROBOT), "minProperties": 1})


Standing = tuple[Robot, Node | None, Node | None]
"""A robot that holds its start region, and the nodes of its start and tracking."""


def read_robots(
    node: Node | None, reading: Reading, others: Collection[Robot] = ()
) -> tuple[Robot, ...]:
    """Return the readable robots; errors in the others are reported. ``others``: robots that the
    scenario already has."""
    team = read.mapping(node, "robots", reading)
    if team is None:
        return ()
    if not team.entries:
        reading.add(team, "there are no robots", "a scenario has at least one")
    known = [robot.name for robot in others]
    reading.named = (*(key.text for key, _ in team.entries), *known)
    for key, _ in team.entries:
        if key.text in known:
            found = f"the team has a robot {clipped(key.text)} already"
            reading.add(key, found, "choose another name")
    standing: list[Standing] = [(robot, None, None) for robot in others]
    robots = [_robot(key, item, standing, reading) for key, item in team.entries]
    _check_starts(standing, reading)
    _check_timing(standing, reading)
    return tuple(robot for robot in robots if robot is not None)


def _robot(key: Scalar, node: Node, standing: list[Standing], reading: Reading) -> Robot | None:
    before = len(reading)
    name = clipped(key.text)
    reserved = key.text in RESERVED_WORDS | OWN_VARIABLES
    if well_named(key, "a robot", reading, IDENTIFIER) and reserved:
        hint = "use another name: robots become variables of specifications"
        reading.add(key, f"'{name}' is reserved and cannot name a robot", hint)
    item = RobotKeys.read(node, f"robot {name}", reading, f"of {name}", INSIDE_OBJECTIVE)
    if item is None:
        return None
    model = item.model
    if item.where(RobotKeys.vision) is not None:
        vision = item.vision
        model = model and replace(model, vision=vision)
    heading, start = _heading(item, name, model), item.start
    for other in (RobotKeys.avoids, RobotKeys.tracks):
        _check_others(item.where(other), f"'{other.name}' of {name}", key.text, reading)
    own = item.given(RobotKeys.avoids, RobotKeys.tracks, RobotKeys.tracking)
    if start is not None and model is not None:
        there = Robot(key.text, model, Pose(start), staying(frozenset({start})), **own)
        at = item.where(RobotKeys.start), item.where(RobotKeys.tracking)
        standing.append((there, *at))
    mobility = model.mobility if model else None
    objective = read_objective(item.objective, name, mobility, reading)
    waiting = _while_waiting(item.while_waiting, objective, name, mobility, reading)
    within = read_within(item.objective, name, objective, reading)
    if model is None or start is None or objective is None:
        return None
    if mobility is Mobility.HEADING and heading is None:
        return None
    pose = Pose(start, heading if mobility is Mobility.HEADING else None)
    robot = Robot(key.text, model, pose, objective, while_waiting=waiting, within=within, **own)
    robot = replace(robot, when=_when(item.when, robot, reading))
    _check_reachable(robot, item.objective, reading)
    if waiting is not None:
        misses_targets(replace(robot, objective=waiting), item.while_waiting, reading)
    return robot if len(reading) == before else None


def _while_waiting(
    node: Node | None, own: Objective | None, name: str, mobility: Mobility | None, reading: Reading
) -> TargetObjective | None:
    """Return the objective while it waits for help. With ``ltl`` there is none: the robot stays,
    which keeps its safety formulas."""
    if node is None:
        return None
    found = read_objective(node, name, mobility, reading)
    if isinstance(found, Ltl) or isinstance(own, Ltl):
        hint = f"use {one_of(kinds_that())} for both, or leave out 'while_waiting'"
        reading.add(node, f"'while_waiting' of {name} cannot be used with 'ltl'", hint)
        return None
    return found and own and ruled(found, own)


def _when(node: Node | None, robot: Robot, reading: Reading) -> tuple[tuple[str, Objective], ...]:
    """Return its objectives while inputs are on, in the order of the file."""
    what, found = f"'when' of {robot.name}", []
    item = read.mapping(node, what, reading, example=f"{{alarm: {EXAMPLE}}}")
    for key, value in item.entries if item else ():
        if key.text not in reading.inputs:
            declare = "declare it in 'inputs'"
            reading.unknown(key, f"{what}: no input is named", key.text, reading.inputs, declare)
        reported = f"{robot.name} when {clipped(key.text)}"
        objective = read_objective(value, reported, robot.model.mobility, reading)
        if isinstance(objective, Ltl) or isinstance(robot.objective, Ltl):
            hint = "name the input in its formulas instead"
            reading.add(key, f"{what}: not with formulas", hint)
        elif objective is not None:
            _check_reachable(replace(robot, objective=objective), value, reading)
            found.append((key.text, objective))
    return tuple(found)


def _heading(item: RobotKeys, name: str, model: RobotModel | None) -> Heading | None:
    """Return the heading; report it if heading mobility lacks it."""
    missing = item.where(RobotKeys.heading) is None
    if missing and model is not None and model.mobility is Mobility.HEADING:
        found = f"robot {name}: the key 'heading' is missing"
        hint = f"a {model.name} starts with a heading: {', '.join(HEADINGS)}"
        item.findings.add(item.node, found, hint)
    return item.heading


def _check_others(node: Node | None, what: str, name: str, reading: Reading) -> None:
    """Report names in a list that are not those of other robots."""
    for item in node.items if isinstance(node, Sequence) else ():
        other = item.value if isinstance(item, Scalar) else None
        if not isinstance(other, str) or not other.strip():
            continue  # reported when the list is read
        if other == name:
            reading.add(item, f"{what}: a robot cannot list itself")
        elif other not in reading.named:
            found = f"{what}: no robot is named"
            reading.unknown(item, found, other, {*reading.named} - {name})


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
    """Report robots with ``exact`` or ``belief`` tracking where steps take several ticks: the
    assumptions of their specification about the other robots would be false."""
    for robot, _, node in standing:
        if robot.tracking is Tracking.NEARBY:
            continue
        slow = [
            other.name
            for other, *_ in standing
            if other is robot or other.name in robot.tracks or robot.conflicts(other)
            if other.model.timing > 1
        ]
        if slow:
            what = f"'tracking' of {clipped(robot.name)}: {robot.tracking.value}"
            found = f"{what} requires one-tick steps; those of {clipped(slow[0])} take longer"
            reading.add(node, found, "'tracking: nearby' works with any timing")


def _why_apart(one: Robot, other: Robot) -> str:
    for robot, rest in ((one, other), (other, one)):
        if robot.avoids is not None and rest.name in robot.avoids:
            return f"{clipped(robot.name)} avoids {clipped(rest.name)}"
    return f"robots of one layer ({clipped(one.model.layer)}) cannot share a region"


def _check_reachable(robot: Robot, node: Node | None, reading: Reading) -> None:
    objective, world = robot.objective, reading.world
    if not objective.targets or world is None or not reading.reachable:
        return
    if robot.start.region in objective.avoid:
        start = world.label(robot.start.region)
        found = f"'avoid' of {robot.name}: it starts in {start}, which it must avoid"
        place = node.get("avoid") if isinstance(node, Mapping) else node
        reading.add(place, found, "let it start elsewhere")
    reach = Reachability(robot.model.mobility, robot.start, world, objective.avoid)
    meets = reach.follows if objective.settles else reach.recurs
    if not misses_targets(robot, node, reading) and not meets(objective.targets):
        what = "its targets in this order" if objective.settles else "all targets infinitely often"
        hint = "with heading mobility it cannot turn at its target"
        reading.add(node, f"objective of {robot.name}: it cannot visit {what}", hint)


def misses_targets(robot: Robot, node: Node | None, reading: Reading) -> bool:
    """Return whether a robot cannot reach some target of its objective from its start; report those
    targets."""
    world, before = reading.world, len(reading)
    if world is None or not reading.reachable:
        return False
    avoid, start = robot.objective.avoid, world.label(robot.start.region)
    reach = Reachability(robot.model.mobility, robot.start, world, avoid)
    targets = robot.objective.targets
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
