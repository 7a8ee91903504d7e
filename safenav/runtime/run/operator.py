"""Changes by an operator or the scenario's list, as events at the beginning of a tick.

The team has to encounter a closed region like any part of the scenario. It immediately knows new
objectives and orders, a robot's service, and the disappearance of a known obstacle. An impossible
change is refused at the call; one that becomes impossible later is dropped and recorded.

An operator's change is read from a line of words (of a terminal, file or program) or from data of a
page. A line begins with its kind: ``resolved door@47``, ``put_back digit 46 east``, ``give_up``;
see ``LINES``.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import yaml
from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.runtime.control.coordinate import Situation
from safenav.runtime.control.ends import GIVEN_UP, End, Stopped
from safenav.runtime.worlds.commands import Commands, Lockstep
from safenav.runtime.worlds.simulation import SimulatedWorld
from safenav.scenario.model import Coordination, Obstacle, ObstacleType, Scenario, name_parts
from safenav.scenario.objective import Objective
from safenav.scenario.reading.events import read_changes
from safenav.scenario.reading.loader import check_assignable
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import DocumentError, Node, read_document
from safenav.scenario.yaml.findings import parsed
from safenav.team import state as now
from safenav.team.acts import is_reserved, number, stands_for
from safenav.team.state import Is
from safenav.trace import records
from safenav.trace.vocabulary import OperatorIntervention
from safenav.trace.words import obstacle_words
from safenav.world.map import HEADINGS, Region
from safenav.world.poses import Mobility, Pose
from safenav.world.reachability import Reachability

USER, SCENARIO, INPUT = "user", "scenario", "input"


class Intervention(Struct, frozen=True):
    """A change by a user; its fields are the keys of its data. ``kind``: see ``LINES``; in a
    simulated world also ``close``: an obstacle of this ``type`` appears as soon as no robot is in
    its region, and ``open``: an ``obstacle`` disappears."""

    kind: str
    type: ObstacleType | None = None
    region: Region | None = None
    truth: bool = True
    heading: str | None = None
    obstacle: str = ""
    robot: str = ""
    objective: Objective | None = None
    active: bool = False
    input: str = ""
    on: bool = False


LINES = {
    "resolved": "resolved OBSTACLE",
    "permanent": "permanent OBSTACLE",
    "put_back": "put_back ROBOT REGION [HEADING]",
    "service": "service ROBOT out|back",
    "objective": "objective ROBOT {visit: [A, B]}",
    "order": "order TYPE REGION",
    "input": "input NAME on|off",
    "give_up": "give_up",
}
KEYS = {
    "close": "type region truth?",
    "open": "obstacle",
    "resolved": "obstacle",
    "permanent": "obstacle",
    "put_back": "robot region heading?",
    "service": "robot active",
    "objective": "robot objective",
    "order": "type region",
    "input": "input on",
    "give_up": "",
}
"""The keys of each kind's data, in the order of its line; keys with ``?`` are optional."""
SWITCHES = {"active": {"out": False, "back": True}, "on": {"on": True, "off": False}}
"""The words of a line that denote truth values."""


class Operator:
    """The operator of a run. ``asked``: changes that are not applied yet; ``inputs``: the inputs
    that the operator has set; ``truth``: the simulated world, if the world is simulated."""

    def __init__(
        self, scenario: Scenario, truth: SimulatedWorld | None, commands: Commands | Lockstep
    ) -> None:
        self.scenario, self.truth, self.commands = scenario, truth, commands
        self.asked: list[Intervention] = []
        self.inputs: dict[str, bool] = {}
        self._listed = [*scenario.changes]
        self._ordered: set[str] = set()

    def resume(self, time: float, lines: Iterable[records.Record]) -> None:
        """Continue after the changes until ``time``, with the inputs set by users until then."""
        self._listed = [change for change in self._listed if change.at > time]
        for line in lines:
            if isinstance(line, records.Inputs):
                self.inputs = {name: line.values[name] for name in line.user or ()}

    def ask(self, run: Situation, wanted: str | Mapping[str, Any]) -> None:
        """Request a change by an operator's line or its data. Raises UsageError, with the reason,
        if the change is impossible."""
        intervention = read_intervention(wanted, self.scenario)
        next(self._change(run, intervention))
        self.asked.append(intervention)

    def events(self, run: Situation, given_up: Callable[[], End]) -> Iterator[now.Event]:
        """Yield the changes of this moment. If the operator has given up and nothing else has
        changed, raises Stopped with the end ``given_up``."""
        while self._listed and self._listed[0].at <= run.state.time:
            change = self._listed.pop(0)
            i = self._robot(change.robot)
            if change.objective is not None:
                yield now.Assigned(i, change.objective, SCENARIO, change.within)
            if change.active and _is_lost(run, change.robot):
                reason = f"{change.robot} is lost: only an operator can bring it back"
                yield now.Late("service", reason, i)
            elif change.active is not None:
                yield from _serves(run, i, change.active, SCENARIO)
        if self.truth is None:
            for k, each in enumerate(run.team.obstacles):
                due = each.ordered and (each.source.appears or 0) <= run.state.time
                if due and run.state.obstacles[k].state is Is.AWAY:
                    yield now.Appeared(k)
        end, gives_up = given_up(), False
        while self.asked:
            wanted = self.asked.pop(0)
            brought = self._change(run, wanted)
            try:
                next(brought)
            except UsageError as error:  # the change has become impossible meanwhile
                yield now.Late("intervention", str(error))
                continue
            if wanted.kind == "give_up":
                gives_up = True
            else:
                end = GIVEN_UP
            yield from (event for event in brought if event is not None)
        if gives_up:
            raise Stopped(end)

    def selected(self, run: Situation) -> Iterator[now.Assigned]:
        """Yield the objectives that the inputs select and that differ from robots' present ones."""
        for i, (robot, member) in enumerate(zip(run.state.robots, run.team.members, strict=True)):
            given = dict(member.robot.when)
            mode = next((name for name in given if name in run.state.inputs), None)
            if mode == robot.mode:
                continue
            base = robot.base or (member.objective, member.robot.within, robot.own, robot.values)
            if mode is None:
                yield now.Assigned(i, base[0], INPUT, base[1], None, base)
            else:
                yield now.Assigned(i, given[mode], INPUT, None, mode, base)

    def _change(self, run: Situation, wanted: Intervention) -> Iterator[now.Event | None]:
        """Check a change; yield None, and then the events that it causes. Raises UsageError, with
        the reason, if it is impossible."""
        told, team, at = OperatorIntervention, run.team, int(run.state.time)
        match wanted:
            case Intervention("close", kind, region) if kind is not None and region is not None:
                if not (wanted.truth or kind.has_truth):
                    raise UsageError(f"'truth': {kind.name} has none")
                self._may_close(run, region)
                yield None
                truth = wanted.truth if kind.has_truth else None
                self._simulation().place(Obstacle(kind, region, truth, appears=at), Is.AWAY)
            case Intervention("order", kind, region) if kind is not None and region is not None:
                if kind.has_truth:
                    raise UsageError(f"{kind.name} has a truth: order a type without one")
                if kind.blocks != frozenset():
                    raise UsageError(f"{kind.name} stops robots: an order needs 'blocks: []'")
                yield None
                new = Obstacle(kind, region, appears=at, ordered=True)
                while new.name in team.numbers or new.name in self._ordered:
                    new = replace(new, number=new.number + 1)
                self._ordered.add(new.name)
                if self.truth is not None:
                    self.truth.place(new, Is.AWAY)
                else:
                    yield now.Introduced(new)
                    yield now.Appeared(run.team.numbers[new.name][-1], cause=USER)
            case Intervention("open"):
                name, there = wanted.obstacle, self._simulation().standing().values()
                source = next((each for each in there if each.name == name), None)
                if source is None:
                    raise UsageError(f"no unresolved obstacle {name}")
                yield None
                yield now.Intervened(told.RESOLVED, obstacle=team.numbers[name][-1])
                self._simulation().remove(name)
                yield now.Gone(number(team, run.state, source), USER)
            case Intervention("objective", objective=objective) if objective is not None:
                i = self._may_pursue(run, wanted.robot, objective)
                yield None
                yield now.Intervened(told.OBJECTIVE, i, objective=objective)
                yield now.Assigned(i, objective, USER)
            case Intervention("service"):
                i, name = self._robot(wanted.robot), wanted.robot
                back = any((each.kind, each.robot) == ("put_back", name) for each in self.asked)
                if wanted.active and _is_lost(run, name) and not back:
                    raise UsageError(f"{name} is lost: give its position (put_back {name} REGION)")
                yield None
                yield now.Intervened(told.ADDED if wanted.active else told.OUT_OF_SERVICE, i)
                yield from _serves(run, i, wanted.active, USER)
            case Intervention("input"):
                if wanted.input not in {each.name for each in self.scenario.inputs}:
                    raise UsageError(f"there is no input '{wanted.input}'")
                yield None
                self.inputs[wanted.input] = wanted.on
            case Intervention("resolved"):
                k = _met(run, wanted.obstacle)
                yield None
                yield now.Intervened(told.RESOLVED, obstacle=k)
                yield self._gone(k, team.obstacles[k].source)
            case Intervention("permanent"):
                self._live("an operator makes obstacles permanent")
                if not run.state.obstacles[k := _met(run, wanted.obstacle)].known:
                    raise UsageError(f"{wanted.obstacle} is already permanent")
                yield None
                yield now.Intervened(told.PERMANENT, obstacle=k)
                yield now.Declared(k)
            case Intervention("put_back", _, region) if region is not None:
                name, pose = wanted.robot, Pose.of(region, wanted.heading)
                i = self._may_stand(run, name, pose)
                yield None
                yield now.Intervened(told.PUT_BACK, i, pose=pose)
                member, was = team.members[i], run.state.robots[i].active
                if isinstance(self.commands, Commands):
                    self.commands.placed(member.robot, pose)
                yield now.Placed(i, member.graph.moved(run.state.robots[i].pose, pose))
                for k in _known(run):
                    if stands_for(team.obstacles[k].source, name):
                        yield now.Gone(k, "world")
                if not was:
                    yield now.Served(i, True, USER)
                for k in _known(run):
                    if team.obstacles[k].battery_of == i:  # the robot's empty battery
                        yield self._gone(k, team.obstacles[k].source)
            case Intervention("give_up"):
                yield None
                yield now.Intervened(told.GIVE_UP)

    def _gone(self, k: int, source: Obstacle) -> now.Gone:
        there = self.truth is not None and self.truth.remove(source.name)
        if not there and isinstance(self.commands, Commands):
            self.commands.cleared(source)
        return now.Gone(k, "world" if self.truth is None else USER)

    def _may_close(self, run: Situation, region: Region) -> None:
        standing = self._simulation().standing().get(region)
        if standing is not None:
            raise UsageError(f"{standing.name} already exists there: remove it first")
        for obstacle, each in zip(run.team.obstacles, run.state.obstacles, strict=True):
            untraversable = each.state is Is.SEALED and not each.given_up
            if obstacle.region == region and untraversable:
                raise UsageError(f"{obstacle.name} is permanent: no robot can pass")
        if any((each.kind, each.region) == ("close", region) for each in self.asked):
            raise UsageError(f"region {region} will be closed at the next tick")

    def _may_pursue(self, run: Situation, name: str, objective: Objective) -> int:
        """Return the index of a robot. Raises UsageError if it cannot pursue an objective."""
        member = run.team.members[i := self._robot(name)]
        pose, avoid = member.graph.pose(run.state.robots[i].next), objective.avoid
        if pose.region in avoid:
            raise UsageError(f"'avoid' of {name} includes its region {pose.region}")
        reach = Reachability(member.robot.model.mobility, pose, self.scenario.map, avoid)
        for target in objective.targets:
            if not reach.reaches(target):
                where = ", ".join(map(str, sorted(target)))
                raise UsageError(f"{name} cannot reach {where} from its region")
        return i

    def _may_stand(self, run: Situation, name: str, pose: Pose) -> int:
        """Return the index of a robot. Raises UsageError if it cannot be put into a pose."""
        self._live("robots are put back")
        member, region = run.team.members[i := self._robot(name)], pose.region
        if not run.state.robots[i].idle:
            raise UsageError(f"{name} executes a command: wait until it has ended")
        if (member.robot.model.mobility is Mobility.HEADING) is (pose.heading is None):
            reason = "needs a heading" if pose.heading is None else "has no heading"
            raise UsageError(f"{name} {reason}")
        if is_reserved(run.team, run.state, i, region):
            raise UsageError(
                f"another robot is in region {region}, or in a zone of 'never_together'"
            )
        away = {each.obstacle for each in self.asked if each.kind in ("resolved", "open")}
        for k in _known(run):
            obstacle, state = run.team.obstacles[k], run.state.obstacles[k]
            own = stands_for(obstacle.source, name)  # a placed robot is no longer lost
            if own or obstacle.region != region or obstacle.name in away:
                continue
            if obstacle.closes(i, state):
                raise UsageError(f"{obstacle.name} is in region {region}: resolve it first")
        there = None if self.truth is None else self.truth.standing().get(region)
        if there is not None and there.name not in away and there.blocks(member.robot):
            raise UsageError(f"{there.name} is in region {region}: resolve it first")
        return i

    def _live(self, what: str) -> None:
        if not self.commands.live:
            raise UsageError(f"{what} only in live runs: use 'clock: live'")

    def _robot(self, name: str) -> int:
        names = [robot.name for robot in self.scenario.robots]
        if name not in names:
            raise UsageError(f"no robot {name}")
        return names.index(name)

    def _simulation(self) -> SimulatedWorld:
        if self.truth is None:
            raise UsageError("only simulated worlds can be changed")
        return self.truth


def _serves(run: Situation, i: int, active: bool, cause: str) -> Iterator[now.Event]:
    if run.state.robots[i].active is not active:
        yield now.Served(i, active, cause)


def _known(run: Situation) -> list[int]:
    """Return the obstacles that the team knows."""
    return [k for k, each in enumerate(run.state.obstacles) if each.known or each.stands]


def _met(run: Situation, name: str) -> int:
    """Return the known obstacle with a name. Raises UsageError if there is none."""
    names = {run.team.obstacles[k].name: k for k in _known(run)}
    if name not in names:
        word = run.team.world.word
        listed = ", ".join(obstacle_words(each, word) for each in names) or "none"
        missing = obstacle_words(name, word)
        raise UsageError(f"the team knows no obstacle '{missing}'; known: {listed}")
    return names[name]


def _is_lost(run: Situation, name: str) -> bool:
    return any(stands_for(run.team.obstacles[k].source, name) for k in _known(run))


def read_intervention(wanted: str | Mapping[str, Any], scenario: Scenario) -> Intervention:
    """Return the intervention that a line of words, or the data of a page, describes; both are read
    like parts of a scenario. Raises UsageError, with the expected form, if it is impossible."""
    data = _data(wanted) if isinstance(wanted, str) else wanted
    kind = data.get("kind") if isinstance(data, Mapping) else None
    if not isinstance(kind, str) or kind not in KEYS:
        raise UsageError(f"unknown change; known: {', '.join(KEYS)}")
    keys = KEYS[kind].split()
    known = [key.rstrip("?") for key in keys]
    if unknown := [f"'{str(key)[:40]}'" for key in data if key not in ("kind", *known)]:
        raise UsageError(f"'{kind}' has no key {unknown[0]}; known: {', '.join(known) or 'none'}")
    if missing := [key for key in keys if key[-1] != "?" and data.get(key) is None]:
        raise UsageError(f"'{kind}' needs '{missing[0]}'; known: {', '.join(known)}")
    reading = Reading("the change", world=scenario.map, reachable=False)
    given = (key for key in known if data.get(key) is not None)
    values = {key: _read(key, data, scenario, reading) for key in given}
    reading.refuse_if_any()
    return Intervention(kind, **values)


def _data(line: str) -> dict[str, Any]:
    """Return the data that a line of words describes."""
    word, *rest = line.split(maxsplit=1) or [""]
    if word not in LINES:
        raise UsageError(f"unknown intervention '{word[:40]}'; known: {'; '.join(LINES.values())}")
    data: dict[str, Any] = {"kind": word}
    keys = [key for key in KEYS[word].split() if key[-1] != "?"]
    words = rest[0].split(maxsplit=len(keys) - 1) if rest else []
    if word == "put_back" and words:
        place, _, heading = words[-1].rpartition(" ")
        if heading in HEADINGS:
            words[-1], data["heading"] = place, heading
    expected = UsageError(f"expected: {LINES[word]}; found '{line.strip()[:60]}'")
    if len(words) != len(keys):
        raise expected
    for key, text in zip(keys, words, strict=True):
        if key in ("region", "objective"):
            data[key] = _value(text)
        elif key not in SWITCHES:
            data[key] = text.strip().strip("'\"")
        elif text in SWITCHES[key]:
            data[key] = SWITCHES[key][text]
        else:
            raise expected
    return data


def _value(text: str) -> object:
    try:
        read_document(text)  # checks the limits of depth and size
        return yaml.safe_load(text)
    except (DocumentError, yaml.YAMLError) as error:
        why = f": {error.found}" if isinstance(error, DocumentError) else ""
        raise UsageError(f"'{text[:60]}' is not valid YAML{why}") from error


def _read(key: str, data: Mapping[str, Any], scenario: Scenario, reading: Reading) -> Any:
    """Return the value of a key; None if there is an error in ``reading``. Raises UsageError."""
    value, types = data[key], scenario.catalogue.obstacles
    match key:
        case "type":
            if str(value) not in types:
                raise UsageError(f"the catalogue has no obstacle type '{str(value)[:40]}'")
            return types[str(value)]
        case "region":
            return reading.region(_node(value, reading), "'region'")
        case "heading" if value not in [*HEADINGS]:
            raise UsageError(f"unknown heading '{str(value)[:40]}'")
        case "truth" | "active" | "on":  # any text would count as true, even "out"
            if not isinstance(value, bool):
                raise UsageError(f"'{key}' must be true or false, not {value!r}")
            return value
        case "obstacle":
            return _obstacle(str(value), reading)
        case "objective":
            reading.team = scenario.robots
            reading.named = tuple(robot.name for robot in scenario.robots)
            listed = [{"at": 1, "robot": data["robot"], key: value}]
            changes = read_changes(_node(listed, reading), reading)
            if scenario.coordination is Coordination.ASSIGNABLE:
                check_assignable((), changes, None, reading)
            return next((each.objective for each in changes), None)
    return str(value)


def _obstacle(written: str, reading: Reading) -> str:
    """Return an obstacle's name with its region's index, since reports print ``door@gate``."""
    kind, where, number = name_parts(written)
    region = reading.written(where)
    return written if region is None else f"{kind}@{region}" + f"#{number}" * (number > 1)


def _node(data: object, reading: Reading) -> Node | None:
    return parsed(json.dumps(data), reading)
