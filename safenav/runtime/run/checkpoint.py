"""Checkpoints: the frozen state of a run in its trace, from which ``resume`` continues it.

A checkpoint describes the run before a pass. Its data is read strictly: no part of it is executed,
and its digest shows a change of it or of the header, unless the digest was updated as well.
Strategies are synthesized again where the robots are; commands under way in a live run have ended
where they began.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from hashlib import sha256
from itertools import pairwise

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.files import json_line
from safenav.formula.parser import Bounds, FormulaError, check, parse
from safenav.runtime.control.roles import Role
from safenav.runtime.run.deadlines import LedgerKept
from safenav.runtime.worlds.protocol import checked_obstacle
from safenav.runtime.worlds.simulation import Truth
from safenav.scenario.model import Clock, Obstacle, Robot, Scenario
from safenav.scenario.objective import Objective, formulas_in
from safenav.scenario.yaml.keys import entries
from safenav.strict_json import TYPE
from safenav.team.state import Is, Plan, RobotNow, State
from safenav.team.team import Member, Team, assigned, introduced, team_of
from safenav.trace import records
from safenav.trace.fields import WrongError, convert, plain
from safenav.trace.file import Trace, as_data
from safenav.world.poses import Mobility

FREE = ("name", "limits", "seed", "expect", "requirements", "catalogue", "clock", "failures")
"""Parts of a scenario that may be others when a run continues."""
ENDED = ("completed", "unrealizable", "late")
FEWEST, SHARE, LINE = 50, 2, 150
"""A checkpoint follows after that many lines at least, when they take ``SHARE`` times the space of
the last one, with ``LINE`` bytes for each."""
MOST = 10**7
"""No count of a run is as large."""


class Memory(Struct, frozen=True, forbid_unknown_fields=True):
    """The memory of the recorder: see there. ``ledger``: of deadlines, if there are any."""

    tick: int
    moved: int
    stack: tuple[tuple[int, int | None, tuple[str, ...]], ...] = ()
    helpers: tuple[tuple[int, tuple[str, ...]], ...] = ()
    aside: tuple[int, ...] = ()
    planned: bool = False
    ledger: LedgerKept | None = None


class Kept(Struct, frozen=True, forbid_unknown_fields=True):
    """A run before a pass. ``own``: the objective of each robot, with rounds of at most ``within``
    ticks; ``helps``: the obstacle that each robot serves; ``introduced``: the obstacles that the
    scenario does not list, each with the robot whose battery it is."""

    state: State
    own: tuple[Objective, ...]
    within: tuple[int | None, ...]
    helps: tuple[int | None, ...]
    memory: Memory
    introduced: tuple[tuple[Obstacle, int | None], ...] = ()
    truth: Truth | None = None
    sha256: str = ""

    def checkpoint(self, lines: int, first: bytes) -> records.Checkpoint:
        """The run after so many lines of its trace, the ``first`` of which is the header."""
        return sealed(records.Checkpoint(self.memory.tick, lines, plain(self)), first)


def sealed(line: records.Checkpoint, first: bytes) -> records.Checkpoint:
    """A checkpoint with the digest of its data and of the first line of its trace."""
    return replace(line, run={**line.run, "sha256": _digest(line.run, first)})


def _digest(run: Mapping[str, object], first: bytes) -> str:
    data = {key: value for key, value in run.items() if key != "sha256"}
    return sha256(first + json.dumps(data, sort_keys=True).encode()).hexdigest()


def text_of(header: records.Header) -> bytes:
    """The first line of a trace, as a writer writes it."""
    return json_line(as_data(header)).strip().encode()


class Resumption(Struct, frozen=True):
    """A run to continue: its team and state, the roles and the lines before it."""

    team: Team
    state: State
    roles: tuple[Role, ...]
    kept: Kept
    lines: tuple[records.Record, ...]

    def standing(self, scenario: Scenario) -> Scenario:
        """The scenario with each robot where its last step began."""
        rows = zip(scenario.robots, self.team.members, self.state.robots, strict=True)
        robots = [replace(robot, start=m.graph.pose(at.pose)) for robot, m, at in rows]
        return replace(scenario, robots=tuple(robots))


def _last_checkpoint(trace: Trace) -> tuple[int, Kept]:
    """The last checkpoint of a trace, and the number of lines before it."""
    found = [line for line in trace.records if isinstance(line, records.Checkpoint)]
    if not found:
        none = "it ends before its first checkpoint; run the scenario again, with --trace"
        raise UsageError(f"{trace.source}: {none}")
    for line in found:
        if line.run.get("sha256") != _digest(line.run, trace.first):
            what = "this checkpoint or the header was changed; resume needs them as written"
            raise UsageError(f"{trace.source}:{line.line}: {what}")
    try:
        return found[-1].lines, convert(Kept, found[-1].run)
    except WrongError as error:
        why = f"another version of safenav wrote its checkpoints ({error}): run the scenario again"
        raise UsageError(f"{trace.source}: {why}") from error


def resumption(trace: Trace, scenario: Scenario) -> Resumption:
    """Return the run of a trace at its last checkpoint. ``scenario``: its scenario, perhaps with
    other limits. Raises UsageError if the run has ended, has no checkpoint, or is not one of the
    scenario."""
    if trace.outcome is not None and trace.outcome.outcome.value in ENDED:
        raise UsageError(f"nothing to resume: the run ended ({trace.outcome.outcome.value})")
    count, kept = _last_checkpoint(trace)
    _compare(trace, scenario)
    if (wrong := next(_flaws(scenario), None)) is not None:
        raise UsageError(f"{trace.source}: the scenario in its header cannot be run: {wrong}")
    try:
        team = _restored(scenario, kept)
    except WrongError as error:
        raise UsageError(f"{trace.source}: a checkpoint does not fit its run: {error}") from error
    lines = trace.records[: max(0, count - 1)]
    told = {line.obstacle.name for line in lines if isinstance(line, records.Discovered)}
    if strange := {source.name for source, _ in kept.introduced} - told:
        raise UsageError(f"{trace.source}: no line before it introduces {min(strange)!a}")
    state = kept.state
    pairs = zip(state.robots, kept.helps, strict=True)
    roles = tuple(Role(robot.objective, helps) for robot, helps in pairs)
    recorded = replace(trace.header.scenario, limits=scenario.limits)
    header = replace(trace.header, scenario=recorded)
    first = text_of(header)  # it may have other limits
    begun = (
        sealed(each, first) if isinstance(each, records.Checkpoint) else each for each in lines
    )
    return Resumption(team, state, roles, kept, (header, *begun))


def _compare(trace: Trace, scenario: Scenario) -> None:
    """Compare a scenario with that of a trace. Raises UsageError if it is another one."""
    there, here = trace.header.scenario.recorded, scenario.recorded
    if there.clock is not scenario.clock:
        clock = "in seconds" if trace.header.live else "in ticks"
        raise UsageError(f"{trace.source} is the trace of a run {clock}, so it continues {clock}")
    parts = [name for name in Scenario.__struct_fields__ if name not in FREE]
    other = [name for name in parts if getattr(there, name) != getattr(here, name)]
    if other:
        raise UsageError(
            f"the scenario is not that of {trace.source}: it differs in {' and '.join(other)}"
        )


def _flaws(scenario: Scenario) -> Iterator[str]:
    """Yield what no scenario that was read from its file has: numbers beyond their limits, and
    objectives that its robots cannot have."""
    parts: dict[str, Struct] = {"until": scenario.until, "limits": scenario.limits}
    for name, part in {**parts, "failures": scenario.failures}.items():
        for word, key in entries(type(part)).items():
            value, least = getattr(part, key.field), key.least or 0
            number = isinstance(value, int | float)
            if number and (value < least or (key.above is not None and value <= key.above)):
                yield f"'{word}' of '{name}' is {value:g}"
    given = [(each.robot, each.objective) for each in scenario.changes]
    for robot in scenario.robots:
        inputs = (objective for _, objective in robot.when)
        given += [(robot.name, each) for each in (robot.objective, robot.while_waiting, *inputs)]
    for who, objective in given:
        if objective is not None:
            found = _wrong_objective(objective, scenario.robot(who), scenario)
            yield from (f"{who}: {each}" for each in found)


def _restored(scenario: Scenario, kept: Kept) -> Team:
    """The team of a checkpoint. The digest of one shows changes, not who has written it: raises
    WrongError if its state cannot be one of a run of the scenario."""
    team, count = team_of(scenario), len(scenario.robots)
    added = () if kept.truth is None else kept.truth.added
    for source in (*(source for source, _ in kept.introduced), *added):
        if found := _misplaced(source, scenario):
            raise WrongError(found)
    for source, battery_of in kept.introduced:
        team = introduced(team, source, battery_of)
    lengths = {len(each) for each in (kept.state.robots, kept.own, kept.within, kept.helps)}
    if lengths != {count} or len(kept.state.obstacles) != len(team.obstacles):
        raise WrongError("it has other numbers of robots or obstacles")
    for i, (own, robot) in enumerate(zip(kept.own, kept.state.robots, strict=True)):
        for each in (own, robot.objective, *([] if robot.base is None else robot.base[:1])):
            for found in _wrong_objective(each, scenario.robots[i], scenario):
                raise WrongError(f"{team.members[i].name}: {found}")
        if own != team.members[i].robot.objective:
            team = assigned(team, i, own, kept.within[i])
    if found := next(_wrong(team, kept), None):
        raise WrongError(found)
    return team


def _wrong_objective(objective: Objective, robot: Robot, scenario: Scenario) -> Iterator[str]:
    """Yield why a robot of a scenario cannot have an objective."""
    inputs = {each.name for each in scenario.inputs}
    yield from (f"there is no input '{name}'" for name in {*objective.inputs} - inputs)
    rules = formulas_in(objective)
    if not (objective.goals or (rules is not None and rules.safety)):
        yield "the objective is empty"
    for target in objective.targets:
        if not target or not all(map(scenario.map.is_free, target)):
            yield f"target {sorted(target)}: expected free regions of the map"
    if not all(0 <= region < scenario.map.size for region in objective.avoid):
        yield f"'avoid' {sorted(objective.avoid)}: expected regions of the map"
    if rules is None:
        return
    declared: dict[str, Bounds] = {"region": (0, scenario.map.size - 1), **rules.memory}
    declared |= {} if robot.model.mobility is Mobility.FREE else {"heading": (0, 3)}
    named = declared | dict.fromkeys(inputs)
    texts = [(text, declared, False) for text in rules.init]
    texts += [(text, named, True) for text in (*rules.safety, *rules.liveness)]
    for text, known, after in texts:
        try:
            for flaw in check(parse(text), known, next_allowed=after):
                yield f"the objective has a wrong formula: {flaw.found}"
        except FormulaError as error:
            yield f"the objective has a wrong formula: {error}"


def _misplaced(source: Obstacle, scenario: Scenario) -> str | None:
    """The reason why an obstacle cannot be on the map of a scenario."""
    try:
        checked_obstacle(source)
    except ValueError as error:
        return str(error)
    if not TYPE.fullmatch(source.type.name):
        return f"{source.type.name!a} cannot name an obstacle"
    places = frozenset[int]().union(*(need.places for need in source.needs))
    if scenario.map.is_free(source.region) and all(0 <= r < scenario.map.size for r in places):
        return None
    return f"the obstacle in region {source.region} is not on the map"


def _wrong(team: Team, kept: Kept) -> Iterator[str]:
    """Yield what no run of a team has: numbers and names of nothing, places off the map, steps that
    lead nowhere."""
    state, truth, ledger = kept.state, kept.truth, kept.memory.ledger
    most = {"robot": len(team.members), "obstacle": len(team.obstacles), "region": team.size}
    for what, number in _numbers(kept):
        if number is not None and not 0 <= number < most[what]:
            yield f"there is no {what} {number}"
    names = {member.name for member in team.members}
    helpers = [who for *_, who in kept.memory.stack] + [who for _, who in kept.memory.helpers]
    yield from (f"there is no robot {name}" for name in set[str]().union(*helpers) - names)
    for member, robot in zip(team.members, state.robots, strict=True):
        yield from _off_the_floor(member, robot)
    for listed in (state.obstacles, () if truth is None else truth.obstacles):
        for k, each in enumerate(listed):
            met = each.stage.need == len(team.obstacles[k].needs)
            left = each.given_up or each.state not in (Is.OVER, Is.SEALED)
            if not 0 <= each.stage.need <= len(team.obstacles[k].needs) or (met and left):
                yield f"{team.obstacles[k].name} has no need {each.stage.need}"
    if {*state.requests} != {k for k, each in enumerate(state.obstacles) if each.state is Is.OPEN}:
        yield "its requests are not its open obstacles"
    if truth is not None and len({len(truth.obstacles), len(truth.truths)}) > 1:
        yield "it has other obstacles than truths"
    if ledger is not None and len(ledger.clocks) != len(names):
        yield "it has other clocks than robots"
    lockstep, tick = team.scenario.clock is Clock.LOCKSTEP, kept.memory.tick
    if not (0 <= state.time < MOST and 0 <= tick < MOST) or (lockstep and state.time != tick):
        yield f"it is of the time {state.time} in tick {tick}"
    if state.plan is not None:
        yield from _unplanned(team, state, state.plan)


def _numbers(kept: Kept) -> Iterator[tuple[str, int | None]]:
    """The numbers of robots, obstacles and regions in a checkpoint."""
    state, memory, truth = kept.state, kept.memory, kept.truth
    for robot in state.robots:
        yield "robot", robot.acting
        for region in (*robot.failed, robot.behind):
            yield "region", region
        for j, known in robot.known:
            yield "robot", j
            yield from (("region", r) for r in ((known,) if isinstance(known, int) else known))
    for each in (*state.obstacles, *(() if truth is None else truth.obstacles)):
        yield from (("robot", i) for i in (*each.stage.done, *(each.stage.group or ())))
        yield from (pair for i, region in each.asked for pair in (("robot", i), ("region", region)))
    yield from (("robot", i) for _, i in kept.introduced)
    robots = [i for _, i, _ in memory.stack] + [i for i, _ in state.attempts]
    yield from (("robot", i) for i in robots)
    pairs = (*memory.helpers, *memory.stack, *(() if memory.ledger is None else memory.ledger.dues))
    named = [each[0] for each in pairs if isinstance(each[0], int)]
    brought = () if truth is None else truth.brought
    listed = (*state.requests, *state.over, *memory.aside, *kept.helps, *brought, *named)
    yield from (("obstacle", k) for k in (*listed, *(k for _, k in state.attempts)))


def _off_the_floor(member: Member, robot: RobotNow) -> Iterator[str]:
    """Yield why a robot cannot be where it is, or as far with its objectives."""
    name, graph = member.name, member.graph
    for pose in (robot.pose, robot.next, *(robot.came or ())[:1]):
        if pose < 0 or not graph.everywhere >> pose & 1:
            yield f"{name} cannot be in pose {pose}"
            return
    if robot.next not in (robot.pose, *graph.steps(robot.pose)):
        yield f"no step leads {name} from {robot.pose} to {robot.next}"
    if not 0 <= (robot.due or 0) < MOST:
        yield f"the step of {name} ends in tick {robot.due}"
    pursued = [(member.objective, robot.own), (robot.objective, robot.task)]
    pursued += [] if robot.kept is None else [(member.objective, robot.kept)]
    pursued += [] if robot.base is None else [(robot.base[0], robot.base[2])]
    for objective, count in pursued:
        pursuit = objective.pursuit
        most = pursuit.targets if pursuit.in_turn else 1 << pursuit.targets
        if not (0 <= count.memory < most and 0 <= count.met < MOST):
            yield f"{name} has no target {count.memory} or has met {count.met}"
    if not {name for name, _ in robot.values} >= graph.memory(robot.pose).keys():
        yield f"the formulas of {name} have no values"


def _unplanned(team: Team, state: State, plan: Plan) -> Iterator[str]:
    """Yield why robots cannot be where they are in a plan, or not continue by it."""
    if len(plan.ways) != len(team.members):
        yield "its plan has other robots"
        return
    gates = {*range(len(team.obstacles))}
    for member, robot, way in zip(team.members, state.robots, plan.ways, strict=True):
        if not (0 <= robot.at < len(way) or (not way and not robot.at)):
            yield f"{member.name} is at no place of its way"
            return
        left = way[robot.at :]
        poses = [robot.pose, *(place.pose for place in left)]
        if member.planned and not all(
            after in (before, *member.graph.steps(before)) for before, after in pairwise(poses)
        ):
            yield f"the plan has a step of {member.name} that is none"
        for place in left:
            others = (0 <= j < len(plan.ways) for j, _ in place.after)
            if not all(others) or not gates >= {k for k, _ in place.needs} | place.over:
                yield f"the plan of {member.name} waits for nothing that there is"
    if not gates >= plan.foreseen:
        yield "the plan foresees an obstacle that is none"


class Checkpoints:
    """The checkpoints of a run, of which it ``emits`` the lines: at most a share of the trace."""

    def __init__(self, emit: Callable[[records.Record], None]) -> None:
        self._emit = emit
        self.lines = self._last = self._size = self._at = 0
        self._first = b""
        self._kept: Kept | None = None

    def follow(self, line: records.Record) -> None:
        """Count a line of the trace."""
        self.lines += 1
        if isinstance(line, records.Header):
            self._first = text_of(line)

    def take(self, kept: Kept) -> None:
        """Remember the run before a pass; record it if a checkpoint is due."""
        self._kept, self._at = kept, self.lines
        lines = self.lines - self._last
        if lines >= FEWEST and lines * LINE >= SHARE * self._size:
            self.write()

    def write(self) -> None:
        """Record the run as it was before the present pass."""
        if self._kept is not None and self._at > self._last:
            line = self._kept.checkpoint(self._at, self._first)
            self._size = len(msgspec.json.encode(line))
            self._last = self._at
            self._emit(line)
