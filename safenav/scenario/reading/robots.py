"""The ``robots:`` of a scenario, and whether each can do what its objective asks."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from itertools import combinations

from msgspec.structs import replace

from safenav.formula.syntax import RESERVED_WORDS
from safenav.scenario.model import Catalogue, Robot, RobotModel, Tracking, conflict
from safenav.scenario.objective import (
    EXAMPLE,
    KINDS,
    STAYING,
    Ltl,
    Objective,
    avoided,
    kinds_that,
    one_of,
    ruled,
    staying,
    targets_of,
)
from safenav.scenario.reachability import Reachability
from safenav.scenario.reading.catalogue import VISION, read_vision
from safenav.scenario.reading.naming import IDENTIFIER
from safenav.scenario.reading.objective import (
    OWN_VARIABLES,
    TIMED,
    VARIABLE,
    ObjectiveKeys,
    ObjectiveReader,
    stated,
)
from safenav.scenario.reading.regions import REGION, RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import TEXT, WORDS, Key, Shape, Table, choice, form, named
from safenav.world.map import Heading, RegionMap
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
_HEADINGS = {heading.label: heading for heading in Heading}


class RobotKeys(Table):
    definition = "robot"
    made = Robot
    model = Key(TEXT, "A robot model of the catalogue.", required="for example 'model: digit'")
    start = Key(
        REGION, "Where it starts.", required="a region, for example 'start: 47' or 'start: [3, 8]'"
    )
    heading = Key(
        Shape({"enum": tuple(_HEADINGS)}, read.text),
        "Which way it faces, if its mobility is heading.",
    )
    objective = Key(form(ObjectiveKeys), required=f"its task, for example 'objective: {EXAMPLE}'")
    while_waiting = Key(
        form(ObjectiveKeys), "While it waits for help; not 'ltl'. Default: it stays."
    )
    vision = Key(VISION)
    avoids = Key(WORDS, "Robots to keep apart from. Default: those of its layer.")
    tracks = Key(WORDS, "Robots that its specification also models.")
    tracking = Key(choice(Tracking), "How its specification models others.")
    when = Key(form(named(ObjectiveKeys)), "Objectives while inputs are on; the first counts.")


ROBOTS = form({**named(RobotKeys, VARIABLE), "minProperties": 1})


def read_robots(
    node: Node | None,
    regions: RegionReader,
    catalogue: Catalogue,
    findings: Findings,
    reachable: bool = True,
    inputs: Collection[str] = (),
    others: Collection[Robot] = (),
) -> tuple[Robot, ...]:
    """The robots that could be read; what is wrong with the others is reported, and with
    ``reachable`` also that one cannot get to its targets. ``others``: robots that the scenario has
    already."""
    team = read.mapping(node, "robots", findings)
    if team is None:
        return ()
    if not team.entries:
        findings.add(team, "there are no robots", "a scenario has at least one")
    names = frozenset(key.text for key, _ in team.entries) | {robot.name for robot in others}
    for key, _ in team.entries:
        if any(robot.name == key.text for robot in others):
            found = f"the team has a robot {clipped(key.text)} already"
            findings.add(key, found, "name it otherwise")
    objectives = ObjectiveReader(regions, names, findings, inputs)
    reader = _RobotReader(regions, catalogue, objectives, names, findings, reachable)
    reader.inputs = inputs
    reader.beside(others)
    robots = [reader.read(key, item) for key, item in team.entries]
    reader.check_starts()
    reader.check_timing()
    return tuple(robot for robot in robots if robot is not None)


class _RobotReader:
    def __init__(
        self,
        regions: RegionReader,
        catalogue: Catalogue,
        objectives: ObjectiveReader,
        names: Collection[str],
        findings: Findings,
        reachable: bool,
    ) -> None:
        self.inputs: Collection[str] = ()
        self._reachable = reachable
        self._regions = regions
        self._catalogue = catalogue
        self._objectives = objectives
        self._names = names
        self._findings = findings
        self._standing: list[tuple[Robot, Node | None]] = []
        self._tracking: dict[str, Node | None] = {}

    def read(self, key: Scalar, node: Node) -> Robot | None:
        before = len(self._findings)
        name = clipped(key.text)
        self._check_name(key)
        item = RobotKeys.read(node, f"robot {name}", self._findings, f"of {name}", INSIDE_OBJECTIVE)
        if item is None:
            return None
        model = self._seeing(self._model(item, name), item.vision, name)
        heading = self._heading(item, name, model)
        start = self._regions.region(item.start, f"'start' of {name}")
        self._check_others(item.where(RobotKeys.avoids), "avoids", key.text)
        self._check_others(item.where(RobotKeys.tracks), "tracks", key.text)
        avoids, tracks, tracking = item.avoids, item.tracks or frozenset(), item.tracking
        if start is not None and model is not None:
            # Whatever its objective is, it stands there.
            target = staying(frozenset({start}))
            there = Robot(
                key.text, model, Pose(start), target, avoids, tracks, tracking or Tracking.NEARBY
            )
            self._standing.append((there, item.start))
            self._tracking[key.text] = item.where(RobotKeys.tracking)
        mobility = model.mobility if model else None
        objective = self._objectives.read(item.objective, name, mobility)
        waiting = self._while_waiting(item.while_waiting, objective, name, mobility)
        within = self._objectives.within(item.objective, name, objective)
        if model is None or start is None or objective is None:
            return None
        if mobility is Mobility.HEADING and heading is None:
            return None
        pose = Pose(start, heading if mobility is Mobility.HEADING else None)
        tracking = tracking or Tracking.NEARBY
        robot = Robot(key.text, model, pose, objective, avoids, tracks, tracking, waiting, within)
        robot = replace(robot, when=self._when(item.when, robot))
        if self._reachable and self._regions.world is not None:
            _check_reachable(robot, item.objective, self._regions.world, self._findings)
        return robot if len(self._findings) == before else None

    def _while_waiting(
        self, node: Node | None, own: Objective | None, name: str, mobility: Mobility | None
    ) -> Objective | None:
        """The objective while it waits for help. Formulas keep their safety lines then, so that a
        robot with formulas stays."""
        if node is None:
            return None
        found = self._objectives.read(node, name, mobility)
        if isinstance(found, Ltl) or isinstance(own, Ltl):
            hint = f"use {one_of(kinds_that())} for both, or leave out 'while_waiting'"
            self._findings.add(node, f"'while_waiting' of {name} cannot be used with 'ltl'", hint)
            return None
        return found and own and ruled(found, own)

    def _when(self, node: Node | None, robot: Robot) -> tuple[tuple[str, Objective], ...]:
        """Its objectives while inputs are on, in their order."""
        what, found = f"'when' of {robot.name}", []
        item = read.mapping(node, what, self._findings)
        for key, value in item.entries if item else ():
            name = clipped(key.text)
            if key.text not in self.inputs:
                hint = suggestion(key.text, self.inputs) or "declare it in 'inputs'"
                self._findings.add(key, f"{what}: no input is named '{name}'", hint)
            told = f"{robot.name} when {name}"
            objective = self._objectives.read(value, told, robot.model.mobility)
            if isinstance(objective, Ltl) or isinstance(robot.objective, Ltl):
                hint = "name the input in its formulas instead"
                self._findings.add(key, f"{what}: not with formulas", hint)
            elif objective is not None:
                if self._reachable and self._regions.world is not None:
                    changed = replace(robot, objective=objective)
                    _check_reachable(changed, value, self._regions.world, self._findings)
                found.append((key.text, objective))
        return tuple(found)

    def _check_name(self, key: Scalar) -> None:
        shown = clipped(key.text)
        if not IDENTIFIER.fullmatch(key.text):
            hint = "use letters, digits and '_', beginning with a letter"
            self._findings.add(key, f"'{shown}' cannot name a robot", hint)
        elif key.text in RESERVED_WORDS | OWN_VARIABLES:
            hint = "use another name: robots become variables of specifications"
            self._findings.add(key, f"'{shown}' is reserved and cannot name a robot", hint)

    def _model(self, item: RobotKeys, name: str) -> RobotModel | None:
        word = item.model
        if word is None:
            return None
        model = self._catalogue.robots.get(word)
        if model is None and not self._catalogue.may_hold(word):
            hint = suggestion(word, self._catalogue.robots)
            found = f"'model' of {name}: unknown robot model '{clipped(word)}'"
            self._findings.add(item.where(RobotKeys.model), found, hint)
        return model

    def _heading(self, item: RobotKeys, name: str, model: RobotModel | None) -> Heading | None:
        """The heading; one that the mobility does not need is checked and ignored."""
        node = item.where(RobotKeys.heading)
        if node is None:
            if model is not None and model.mobility is Mobility.HEADING:
                found = f"robot {name}: the key 'heading' is missing"
                hint = f"a {model.name} starts with a heading: {', '.join(_HEADINGS)}"
                self._findings.add(item.node, found, hint)
            return None
        word = item.heading
        if word is not None and word not in _HEADINGS:
            found = f"'heading' of {name}: unknown heading '{clipped(word)}'"
            self._findings.add(node, found, suggestion(word, _HEADINGS))
        return _HEADINGS.get(word) if word is not None else None

    def _seeing(self, model: RobotModel | None, node: Node | None, name: str) -> RobotModel | None:
        """The model with the robot's own vision, if it has one."""
        if node is None:
            return model
        vision = read_vision(node, f"'vision' of {name}", self._findings)
        return model and replace(model, vision=vision)

    def _check_others(self, node: Node | None, word: str, name: str) -> None:
        """Report names in a list that name no other robot."""
        what = f"'{word}' of {clipped(name)}"
        for item in node.items if isinstance(node, Sequence) else ():
            other = item.value if isinstance(item, Scalar) else None
            if not isinstance(other, str) or not other.strip():
                continue  # told below
            if other == name:
                self._findings.add(item, f"{what}: a robot cannot list itself")
            elif other not in self._names:
                found = f"{what}: no robot is named '{clipped(other)}'"
                hint = suggestion(other, frozenset(self._names) - {name})
                self._findings.add(item, found, hint)

    def beside(self, others: Iterable[Robot]) -> None:
        """Take note of robots that have been read before."""
        self._standing += [(robot, None) for robot in others]

    def check_starts(self) -> None:
        """Report robots that must never share a region and start in one."""
        there: dict[int, list[tuple[Robot, Node | None]]] = {}
        for robot, node in self._standing:
            there.setdefault(robot.start.region, []).append((robot, node))
        for crowd in there.values():
            told = set()
            for (first, _), (second, node) in combinations(crowd, 2):
                if second.name not in told and conflict(first, second):
                    told.add(second.name)
                    region = second.start.region
                    found = f"'start' of {second.name}: {first.name} also starts in region {region}"
                    self._findings.add(node, found, _why_apart(first, second))

    def check_timing(self) -> None:
        """Report robots that keep track of others step by step where steps take several ticks:
        what their specification assumes of the others would not be true."""
        team = [robot for robot, _ in self._standing]
        for robot in team:
            if robot.tracking is Tracking.NEARBY:
                continue
            seen = [
                other
                for other in team
                if other is robot or other.name in robot.tracks or conflict(robot, other)
            ]
            slow = [other.name for other in seen if other.model.timing.most > 1]
            if slow:
                found = (
                    f"'tracking' of {clipped(robot.name)}: {robot.tracking.value} requires "
                    f"one-tick steps; those of {clipped(slow[0])} take longer"
                )
                hint = "'tracking: nearby' is right for any timing"
                self._findings.add(self._tracking[robot.name], found, hint)


def _why_apart(one: Robot, other: Robot) -> str:
    for robot, rest in ((one, other), (other, one)):
        if robot.avoids is not None and rest.name in robot.avoids:
            return f"{clipped(robot.name)} avoids {clipped(rest.name)}"
    return f"robots of one layer ({clipped(one.model.layer)}) cannot share a region"


def _check_reachable(robot: Robot, node: Node | None, world: RegionMap, findings: Findings) -> None:
    targets = targets_of(robot.objective)
    if not targets:
        return
    avoid = avoided(robot.objective)
    reach = Reachability(robot.model.mobility, robot.start, world, avoid)
    places = stated(node)[1]
    start = world.label(robot.start.region)
    if robot.start.region in avoid:
        found = f"'avoid' of {robot.name}: it starts in {start}, which it must avoid"
        place = node.get("avoid") if isinstance(node, Mapping) else node
        findings.add(place, found, "let it start elsewhere")
    missed = False
    for target, place in zip(targets, places, strict=True):
        if reach.reaches(target):
            continue
        missed = True
        regions = " or ".join(world.label(region) for region in sorted(target))
        found = f"objective of {robot.name}: {clipped(regions, 80)} cannot be reached from {start}"
        findings.add(place, found, _why(robot, target, world))
    settles = not isinstance(robot.objective, Ltl) and robot.objective.settles
    if not missed and settles and not reach.follows(targets):
        found = f"objective of {robot.name}: it cannot get from target to target in this order"
        findings.add(node, found, "with heading mobility it cannot turn at its target")
    elif not missed and not settles and not reach.recurs(targets):
        found = f"objective of {robot.name}: it cannot visit all targets infinitely often"
        hint = "with heading mobility it cannot turn at its target"
        findings.add(node, found, hint)


def _why(robot: Robot, target: frozenset[int], world: RegionMap) -> str:
    if Reachability(robot.model.mobility, robot.start, world).reaches(target):
        return "what it avoids is between them"
    if robot.model.mobility is Mobility.HEADING:
        on_foot = Reachability(Mobility.FREE, Pose(robot.start.region), world)
        if on_foot.reaches(target):
            return "with heading mobility it cannot turn round on the spot: check the heading"
    return "walls are between them"
