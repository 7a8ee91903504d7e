"""Checkpoints: the frozen state of a run in its trace, from which ``resume`` continues it.

A checkpoint describes the run before a pass. Its data is read strictly: no part of it is executed,
and each number is checked against the scenario. Strategies are synthesized again where the robots
are; commands under way in a live run have ended where they began.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from enum import Enum
from types import UnionType
from typing import TYPE_CHECKING, Any, NamedTuple, Union, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Struct, ValidationError, defstruct, field
from msgspec.structs import asdict, replace

from safenav.errors import UsageError
from safenav.runtime.control.roles import Role
from safenav.runtime.run.deadlines import LedgerKept
from safenav.runtime.worlds.truth import Truth
from safenav.scenario.dump import dump
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.objective import Ltl, Objective, TargetObjective, to_data
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Limits
from safenav.scenario.yaml.findings import ReadableFolder
from safenav.team.apply import initial
from safenav.team.state import Is, Plan, RobotNow, State
from safenav.team.team import Team, assigned, introduced, team_of
from safenav.trace import records
from safenav.trace.fields import objective_of
from safenav.trace.setting import scenario_header

if TYPE_CHECKING:
    from safenav.trace.reading import Trace

ENDED = ("completed", "unrealizable", "late")
FEWEST, SHARE, LINE = 50, 2, 150
"""A checkpoint follows after that many lines at least, when they take ``SHARE`` times the space of
the last one, with ``LINE`` bytes for each."""


def _in_data(hint: Any) -> Any:
    """A type in the data of a checkpoint, which holds objectives as a scenario does."""
    if hint in (Objective, TargetObjective, Ltl):
        return dict[str, Any]
    origin, inner = get_origin(hint), tuple(map(_in_data, get_args(hint)))
    if origin in (Union, UnionType):
        return Union[inner]  # noqa: UP007 - of a tuple
    return hint if origin is None else origin[inner]


def _kept(kind: type[Struct], **others: Any) -> Any:
    """A struct as checkpoints hold it; ``others``: the types of some fields."""
    hints = get_type_hints(kind) | others
    fields = [(name, _in_data(hints[name])) for name in kind.__struct_fields__]
    return defstruct(kind.__name__, fields, frozen=True, forbid_unknown_fields=True)


_RobotKept: Any = _kept(RobotNow)
_StateKept = _kept(State, robots=tuple[_RobotKept, ...])


def _data(value: Any) -> Any:
    """A value of a state as the data of a checkpoint."""
    match value:
        case TargetObjective() | Ltl():
            return to_data(value)
        case Struct():
            return {name: _data(getattr(value, name)) for name in value.__struct_fields__}
        case tuple() | list():
            return [*map(_data, value)]
        case frozenset():
            return sorted(map(_data, value))
        case dict():
            return {key: _data(each) for key, each in value.items()}
        case Enum():
            return value.value
    return value


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
    scenario does not list, each with the robot whose battery it is; ``due``: the ticks in which
    steps under way end (lockstep). ``scenario``: its canonical form, in the first checkpoint."""

    state: Any
    own: tuple[dict[str, Any], ...]
    within: tuple[int | None, ...]
    helps: tuple[int | None, ...]
    memory: Memory
    introduced: tuple[tuple[Obstacle, int | None], ...] = ()
    due: dict[str, int] = field(default_factory=dict)
    truth: Truth | None = None
    scenario: dict[str, Any] | None = None


class Moment(NamedTuple):
    """A run before a pass, as it is."""

    team: Team
    state: State
    roles: tuple[Role, ...]
    memory: Memory
    due: dict[str, int]
    truth: Truth | None

    def kept(self) -> Kept:
        """The moment in the form of a checkpoint."""
        members, listed = self.team.members, len(self.team.scenario.obstacles)
        return Kept(
            _data(self.state),
            tuple(to_data(member.robot.objective) for member in members),
            tuple(member.robot.within for member in members),
            tuple(role.helps for role in self.roles) or (None,) * len(members),
            self.memory,
            tuple((each.source, each.battery_of) for each in self.team.obstacles[listed:]),
            self.due,
            self.truth,
        )


class Resumption(Struct, frozen=True):
    """A run to continue: its team and state, the roles and the lines before it."""

    team: Team
    state: State
    roles: tuple[Role, ...]
    kept: Kept
    lines: tuple[records.Record, ...]


def scenario_of(trace: Trace) -> Scenario:
    """Return the scenario of a run, which its first checkpoint holds. Raises UsageError if there is
    none, InputError if it cannot be used."""
    runs = (line.run for line in trace.records if isinstance(line, records.Checkpoint))
    found = next(filter(None, (run.get("scenario") for run in runs)), None)
    if found is None:
        raise UsageError(f"{trace.source}: {_NONE}")
    # Like an uploaded scenario, it may name no file.
    return load_scenario_text(json.dumps(found), trace.source, reach=ReadableFolder(None))


_NONE = "it has no checkpoint to continue from; a run with --trace writes them"


def resumption(trace: Trace, scenario: Scenario) -> Resumption:
    """Return the run of a trace at its last checkpoint. ``scenario``: its scenario, perhaps with
    other limits. Raises UsageError if the run has ended, has no checkpoint, or does not fit the
    scenario."""
    if trace.outcome is not None and trace.outcome.outcome.value in ENDED:
        raise UsageError(f"nothing to resume: the run ended ({trace.outcome.outcome.value})")
    found = [line for line in trace.records if isinstance(line, records.Checkpoint)]
    if not found:
        raise UsageError(f"{trace.source}: {_NONE}")
    limits = _compare(trace, scenario)
    try:
        kept = msgspec.convert(found[-1].run, Kept)
        team, state = _restored(team_of(scenario), kept)
    except (ValidationError, UsageError) as error:
        raise UsageError(f"{trace.source}: its last checkpoint cannot be used: {error}") from error
    roles = tuple(
        Role(robot.objective, helps) for robot, helps in zip(state.robots, kept.helps, strict=True)
    )
    header = replace(trace.header, scenario=replace(trace.header.scenario, limits=limits))
    lines = (header, *trace.records)[: found[-1].lines]
    return Resumption(team, state, roles, kept, lines)


def _compare(trace: Trace, scenario: Scenario) -> Limits:
    """Compare a scenario with the header of its trace; return its limits."""
    header = trace.header.scenario
    here = scenario_header(scenario, None, live=trace.header.clock is not None)
    pairs = {
        "map": (header.map, here.map),
        "robots": (header.robots, here.robots),
        "obstacles": (
            [replace(each, traversable=None) for each in header.obstacles],
            [replace(each, traversable=None) for each in here.obstacles],
        ),
        "until": (header.until, here.until),
    }
    other = [name for name, (there, own) in pairs.items() if there != own]
    if other:
        raise UsageError(
            f"the scenario is not that of {trace.source}: it differs in {' and '.join(other)}"
        )
    return here.limits


def _restored(team: Team, kept: Kept) -> tuple[Team, State]:
    """The team and the state of a checkpoint, checked."""
    state, count = msgspec.convert(kept.state, _StateKept), len(team.members)
    for what in (state.robots, kept.own, kept.within, kept.helps):
        _require(len(what) == count, "it has other robots than the scenario")
    for source, battery_of in kept.introduced:
        known = battery_of is None or _is_in(battery_of, team.members)
        _require(known, "a robot is unknown")
        _require(team.world.is_free(source.region), f"{source.name} is in no free region")
        _require(source.name not in team.numbers, f"{source.name} is listed twice")
        team = introduced(team, source, battery_of)
    for i, objective in enumerate(map(_objective, kept.own)):
        if objective != team.members[i].robot.objective:
            _require_free(team, objective)
            team = assigned(team, i, objective, kept.within[i])
    found = State(**{**asdict(state), "robots": tuple(map(_robot, state.robots))})
    _check_state(team, found)
    memory = kept.memory
    numbers = [*kept.helps, *(k for k, _, _ in memory.stack), *memory.aside]
    numbers += [k for k, _ in memory.helpers]
    _require(all(k is None or _is_in(k, team.obstacles) for k in numbers), "an obstacle is unknown")
    asked = [who for _, who, _ in memory.stack if who is not None]
    _require(all(_is_in(who, team.members) for who in asked), "a robot is unknown")
    return team, found


def _objective(data: dict[str, Any]) -> Objective:
    found = objective_of(data)
    _require(found is not None, "an objective is unknown")
    assert found is not None
    return found


def _robot(kept: Any) -> RobotNow:
    """A robot of a checkpoint."""
    found = asdict(kept) | {"objective": _objective(kept.objective)}
    if kept.base is not None:
        objective, *rest = kept.base
        found["base"] = _objective(objective), *rest
    return RobotNow(**found)


def _require_free(team: Team, objective: Objective) -> None:
    regions = (region for target in objective.targets for region in target)
    _require(all(map(team.world.is_free, regions)), "a target is in no free region")


def _check_state(team: Team, state: State) -> None:
    """Raise UsageError if a number of the state names nothing."""
    robots, obstacles = state.robots, state.obstacles
    _require(len(obstacles) == len(team.obstacles), "it has other obstacles than the scenario")
    for i, robot in enumerate(robots):
        member, name = team.members[i], team.members[i].name
        free = member.graph.outside(())
        poses = [robot.pose, *([] if robot.to is None else [robot.to])]
        _require(all(p >= 0 and free >> p & 1 for p in poses), f"{name} is in no free region")
        steps = robot.to is None or robot.to in member.graph.steps(robot.pose)
        _require(steps, f"{name} is on no possible step")
        targets = len(member.targets)
        for count, most in ((robot.own, targets), (robot.task, len(robot.objective.targets))):
            fits = 0 <= count.memory < max(1, 1 << most) and count.met >= 0
            _require(fits, f"{name} has an unknown progress")
            in_turn = robot.objective.in_turn if most != targets else member.pursuit.in_turn
            _require(not in_turn or count.memory < most, f"{name} has an unknown next target")
        _require(robot.acting is None or _is_in(robot.acting, robots), "a robot is unknown")
        _require(all(0 <= r < team.size for r in robot.failed), "a region is unknown")
        for objective in (robot.objective, *([] if robot.base is None else robot.base[:1])):
            _require_free(team, objective)
        _check_own(team, i, robot)
    for i, member in enumerate(team.members):
        here = {robots[i].pose % team.size, robots[i].next % team.size}
        for j in member.rivals:
            there = {robots[j].pose % team.size, robots[j].next % team.size}
            _require(not here & there, f"{member.name} is where {team.members[j].name} is")
    for k, each in enumerate(obstacles):
        needs, name = team.obstacles[k].needs, team.obstacles[k].name
        over = each.state is Is.OVER or (each.state is Is.SEALED and not each.given_up)
        _require(0 <= each.stage.need < len(needs) + over, f"{name} has an unknown need")
        who = {*each.stage.done, *(each.stage.group or ()), *(i for i, _ in each.asked)}
        _require(all(_is_in(i, robots) for i in who), "a robot is unknown")
        _require(all(0 <= r < team.size for _, r in each.asked), "a region is unknown")
    numbers = [*state.requests, *state.over, *(k for _, k in state.attempts)]
    _require(all(_is_in(k, obstacles) for k in numbers), "an obstacle is unknown")
    _require(all(_is_in(i, robots) for i, _ in state.attempts), "a robot is unknown")
    open_ = {k for k, each in enumerate(obstacles) if each.state is Is.OPEN}
    _require({*state.requests} == open_ and len(state.requests) == len(open_), "a request is lost")
    _require(state.time >= 0, "its time is negative")
    if state.plan is not None:
        _check_plan(team, state, state.plan)


def _check_own(team: Team, i: int, robot: RobotNow) -> None:
    """Check what only some robots have: formulas, beliefs, inputs, batteries."""
    member, inputs = team.members[i], {each.name for each in team.scenario.inputs}
    names = {name for name, _ in initial(team).robots[i].values} | inputs
    for objective in (robot.objective, member.robot.objective):
        names |= {*objective.memory} if isinstance(objective, Ltl) else set()
    values = [*robot.values, *([] if robot.came is None else robot.came[1])]
    values += [] if robot.base is None else robot.base[3]
    _require({name for name, _ in values} <= names, f"{member.name} remembers something unknown")
    _require(robot.mode is None or robot.mode in inputs, "an input is unknown")
    for j, known in robot.known:
        cells = known if isinstance(known, frozenset) else {known}
        there = all(0 <= cell < team.size for cell in cells)
        _require(_is_in(j, team.members) and there, f"{member.name} tracks something unknown")
    battery = member.robot.model.battery
    most = 0 if battery is None else battery.capacity
    _require(0 <= robot.charge <= most, f"{member.name} has an impossible charge")


def _check_plan(team: Team, state: State, plan: Plan) -> None:
    _require(len(plan.ways) == len(state.robots), "its plan is for other robots")
    _require(all(_is_in(k, state.obstacles) for k in plan.foreseen), "an obstacle is unknown")
    for i, way in enumerate(plan.ways):
        robot, graph = state.robots[i], team.members[i].graph
        _require(not way or _is_in(robot.at, way), "a place in its plan is unknown")
        free = graph.outside(())
        for before, after in zip(way, (*way[1:], None), strict=False):
            pose = before.pose
            _require(pose >= 0 and bool(free >> pose & 1), "its plan leads to no free region")
            if after is not None and after.pose != pose:
                _require(after.pose in graph.steps(pose), "its plan has an impossible step")
            for j, place in before.after:
                known = _is_in(j, plan.ways) and _is_in(place, plan.ways[j])
                _require(known, "its plan waits for nothing")
            _require(
                all(_is_in(k, state.obstacles) for k, _ in before.needs)
                and all(_is_in(k, state.obstacles) for k in before.over),
                "an obstacle is unknown",
            )


def _is_in(number: int, listed: Any) -> bool:
    return 0 <= number < len(listed)


def _require(holds: object, why: str) -> None:
    if not holds:
        raise UsageError(why)


class Checkpoints:
    """The checkpoints of a run, of which it ``emits`` the lines: at most a share of the trace."""

    def __init__(self, emit: Callable[[records.Record], None]) -> None:
        self._emit = emit
        self.lines = self._last = self._size = 0
        self._moment: Moment | None = None
        self._at = 0

    def take(self, moment: Moment) -> None:
        """Remember the run before a pass; record it if a checkpoint is due."""
        self._moment, self._at = moment, self.lines
        lines = self.lines - self._last
        if lines >= FEWEST and lines * LINE >= SHARE * self._size:
            self.write()

    def write(self) -> None:
        """Record the run as it was before the present pass."""
        if self._moment is not None and self._at > self._last:
            run = msgspec.to_builtins(self._moment.kept())
            self._size = len(msgspec.json.encode(run))
            if not self._last:
                run["scenario"] = dump(self._moment.team.scenario)
            tick, self._last = self._moment.memory.tick, self._at
            self._emit(records.Checkpoint(tick, self._at, run))
