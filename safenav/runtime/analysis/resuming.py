"""The rest of a run that was interrupted or killed, as a scenario, from what its trace says.

Robots begin where the trace leaves them (one that was under way: where it set out), with the
target whose turn it was. Obstacles that were resolved or disappeared are left out, as are the
met needs of others; robots out of service stay so. The team encounters again what it had met, and
what turned out untraversable still is. Needs that the same robots were to meet start over: the
rest does not know who those were. The memory of formulas also starts over. A robot begins with the
charge that it has; one whose battery is empty asks for help again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import ceil, floor
from typing import Any

from msgspec import Struct, field
from msgspec.structs import asdict, replace

from safenav.errors import UsageError
from safenav.outcome import Outcome
from safenav.runtime.energy.charges import TracedCharges
from safenav.runtime.passes import SLOWEST
from safenav.scenario import settings
from safenav.scenario.model import (
    Need,
    Obstacle,
    ObstacleType,
    Robot,
    RobotModel,
    Scenario,
    Timing,
    Tracking,
    name_parts,
)
from safenav.scenario.motion import MotionModel
from safenav.scenario.objective import Ltl, targets_of, with_targets
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.joining import joined
from safenav.trace import records, setting, vocabulary
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import ChangeCause, Reason
from safenav.trace.wording import objective_of
from safenav.trace.words import listed
from safenav.world.frame import Frame
from safenav.world.map import HEADINGS, RegionMap
from safenav.world.moves import Mobility, Pose

UNREAD = ("promises", "suspects", "chargers", "inputs", "partition")
"""Parts of a header from which no scenario is made: the scenario's file is needed."""
ENDED = ("completed", "unrealizable")


class _State(Struct):
    """The end of a trace. ``turns``: the next target of each robot; ``chosen``: the inputs that a
    user has set."""

    poses: dict[str, Pose]
    own: dict[str, TracedObjective]
    objectives: dict[str, TracedObjective]
    turns: dict[str, int] = field(default_factory=dict)
    rounds: dict[str, int] = field(default_factory=dict)
    out: set[str] = field(default_factory=set)
    gone: set[str] = field(default_factory=set)
    appeared: set[str] = field(default_factory=set)
    truths: dict[str, bool | None] = field(default_factory=dict)
    met: dict[str, int] = field(default_factory=dict)
    chosen: dict[str, bool] = field(default_factory=dict)
    time: float = 0.0

    def take(self, record: records.Record) -> None:
        """Follow a line."""
        self.time = record.t if record.t is not None else record.tick
        match record:
            case records.Move() if record.toward is None:
                self.poses[record.robot] = _pose(record.to, record.heading)
            case records.Arrive():
                self.poses[record.robot] = _pose(record.at, record.heading)
            case records.Operator() if record.robot is not None and record.region is not None:
                self.poses[record.robot] = _pose(record.region, record.heading)
            case records.Push() | records.Pop():
                self.objectives |= record.objectives
            case records.Told():
                self.objectives[record.robot] = record.objective
            case records.Synthesis() if record.reason is Reason.CHARGE:
                self.objectives[record.robot] = record.objective  # a stop is not its own
            case records.NewObjective():
                if record.at_once:
                    self.objectives[record.robot] = record.objective
                if record.cause is ChangeCause.INPUT:  # until it changes again
                    self.rounds[record.robot] = 0
                    return
                self.own[record.robot] = record.objective
                self.turns[record.robot] = self.rounds[record.robot] = 0
            case records.Goal() if self.objectives[record.robot] == self.own[record.robot]:
                self.turns[record.robot] = record.goal + 1
                self.rounds[record.robot] = record.round
            case records.Inputs():
                self.chosen = {name: record.values[name] for name in record.user or ()}
            case records.Resolved():
                if record.traversable is not False:
                    self.gone.add(record.obstacle)
                self.rounds.clear()
            case records.Truth():
                self.truths[record.obstacle] = record.traversable
            case records.Gone():
                self.gone.add(record.obstacle)
            case records.Appeared():
                self.gone.discard(record.obstacle)
                self.appeared.add(record.obstacle)
                self.met.pop(record.obstacle, None)
            case records.Met():
                self.met[record.obstacle] = record.need + 1
            case records.Service() if record.cause is not ChangeCause.BATTERY:
                (self.out.discard if record.active else self.out.add)(record.robot)
            case _:
                pass


def resumed(trace: Trace, scenario: Scenario | None = None) -> Scenario:
    """Return the scenario of the rest of a run. ``scenario``: what it was made of, for what its
    header does not hold. Raises UsageError if nothing is left, or that is needed."""
    outcome = next((r for r in trace.records if isinstance(r, records.End)), None)
    if outcome is not None and outcome.outcome.value in ENDED:
        raise UsageError(f"nothing to resume: the run ended ({outcome.outcome.value})")
    header = trace.header.scenario
    clock = settings.Clock.LOCKSTEP if trace.header.clock is None else settings.Clock.LIVE
    base = (
        replace(scenario, clock=clock, seed=header.seed) if scenario else _scenario(header, clock)
    )
    robots = header.robots
    if {robot.name for robot in base.robots} != {*robots}:
        raise UsageError("the scenario is another one: it has other robots than the trace")
    state = _State(
        {name: _pose(robot.start, robot.heading) for name, robot in robots.items()},
        {name: robot.objective for name, robot in robots.items()},
        {name: robot.objective for name, robot in robots.items()},
    )
    charges = TracedCharges(trace.header)
    for record in trace.records:
        state.take(record)
        charges.take(record)
    return replace(
        base,
        robots=tuple(_robot(robot, state, charges) for robot in base.robots),
        obstacles=tuple(_obstacles(base.obstacles, trace, state, {*charges.flat})),
        until=_until(
            base.until, state, ended_late=outcome is not None and outcome.outcome is Outcome.LATE
        ),
        changes=tuple(_changes(base, state)),
        inputs=tuple(_input(each, state, clock, base.limits) for each in base.inputs),
    )


def _until(until: settings.Until, state: _State, *, ended_late: bool) -> settings.Until:
    """The rounds that are left, and the deadline in ticks of the rest. One that has passed is due
    at its beginning, so that the rest is also late; a run that it has ended continues without."""
    robots = state.poses
    done = min(map(state.rounds.get, robots, [0] * len(robots)))
    by = None if until.by is None or ended_late else max(0, floor(until.by - state.time))
    return settings.Until(max(1, until.rounds - done), by, begun=True)


def _robot(robot: Robot, state: _State, charges: TracedCharges) -> Robot:
    told = objective_of(state.own[robot.name])
    objective = robot.objective if told is None or isinstance(told, Ltl) else told
    if not isinstance(objective, Ltl) and objective.in_turn:
        targets = targets_of(objective)
        turn = state.turns.get(robot.name, 0)
        if objective.settles:
            objective = with_targets(objective, targets[min(turn, len(targets) - 1) :])
        else:
            turn %= len(targets)
            objective = with_targets(objective, (*targets[turn:], *targets[:turn]))
    model, charge = robot.model, charges.now(robot.name)
    if model.battery is not None and charge is not None:
        model = replace(model, battery=replace(model.battery, start=charge))
    return replace(robot, model=model, start=state.poses[robot.name], objective=objective)


def _obstacles(
    listed: Iterable[Obstacle], trace: Trace, state: _State, flat: set[str]
) -> Iterable[Obstacle]:
    found = {r.obstacle.name for r in trace.records if isinstance(r, records.Discovered)}
    known = {o.name for o in listed}
    later = [_made_obstacle(trace.obstacles[name]) for name in sorted(found - known)]
    truths = {(o.name, o.from_): o.traversable for o in trace.header.scenario.obstacles}
    for obstacle in (*listed, *later):
        to_come = obstacle.appears is not None and (
            obstacle.appears > state.time or obstacle.name not in state.appeared
        )
        if (obstacle.name in state.gone and not to_come) or obstacle.name in flat:
            continue
        if obstacle.goes is not None and obstacle.goes <= state.time:
            continue
        truth = truths.get((obstacle.name, obstacle.appears), obstacle.traversable)
        met = 0 if to_come else state.met.get(obstacle.name, 0)
        yield replace(
            obstacle,
            type=_left(obstacle.type, met),
            traversable=truth if to_come else state.truths.get(obstacle.name, truth),
            # an order needs a tick at which it comes
            appears=_later(obstacle.appears, state) if to_come or obstacle.ordered else None,
            goes=_later(obstacle.goes, state),
        )


def _left(kind: ObstacleType, met: int) -> ObstacleType:
    """A type without the needs that were met."""
    while 0 < met < len(kind.needs) and kind.needs[met].same:
        met -= 1
    return replace(kind, listed=kind.needs[met:]) if 0 < met < len(kind.needs) else kind


def _later(time: int | None, state: _State) -> int | None:
    """A tick of the run in those of the rest."""
    return None if time is None else max(1, round(time - state.time))


def _input(
    each: settings.Input, state: _State, clock: settings.Clock, limits: settings.Limits
) -> settings.Input:
    """An input in the time of the rest, which begins at tick 1, or live at 0. One that a user has
    set stays so until the end."""
    begin, time = 0 if clock is settings.Clock.LIVE else 1, state.time
    if each.name in state.chosen:
        last = limits.ticks if clock is settings.Clock.LOCKSTEP else limits.seconds
        end = ceil(limits.ticks * SLOWEST if last is None else last)
        set_on = ((begin, end),) if state.chosen[each.name] else ()
        return replace(each, spans=set_on, probability=0.0)
    spans = ((max(begin, floor(first - time)), floor(last - time)) for first, last in each.spans)
    return replace(each, spans=tuple(span for span in spans if span[1] >= begin))


def _changes(base: Scenario, state: _State) -> Iterable[settings.RobotChange]:
    for name in sorted(state.out):
        yield settings.RobotChange(1, name, active=False)
    for change in base.changes:
        if change.at > state.time:
            yield replace(change, at=_later(change.at, state) or 1)


def _scenario(header: setting.ScenarioHeader, clock: settings.Clock) -> Scenario:
    """The scenario of a header."""
    missing = [key for key in UNREAD if getattr(header, key)]
    robots = header.robots.values()
    missing += ["batteries"] if any(robot.battery for robot in robots) else []
    missing += ["'when'"] if any(robot.when for robot in robots) else []
    if missing:
        said = f"the trace does not fully describe {listed(missing)}"
        raise UsageError(f"{said}: also name the scenario (safenav resume TRACE SCENARIO)")
    world = RegionMap.from_grid(header.map.grid, header.map.names, header.map.areas)
    if header.map.resolution is not None:
        x, y, yaw = header.map.origin or (0.0, 0.0, 0.0)
        world = replace(world, frame=Frame(header.map.resolution, (x, y), yaw))
    limits = {k: v for k, v in asdict(header.limits).items() if v is not None}
    return Scenario(
        header.name,
        world,
        tuple(_made(name, robot) for name, robot in header.robots.items()),
        tuple(_made_obstacle(o) for o in header.obstacles),
        settings.Until(header.until.rounds or 1),
        settings.Limits(**limits),
        header.seed,
        settings.Coordination(header.coordination),
        catalogue=built_in(),
        clock=clock,
        order=settings.RequestOrder(header.order),
        never_together=tuple(
            settings.Exclusion(frozenset(e.robots), frozenset(e.regions))
            for e in header.never_together or ()
        ),
    )


def _made(name: str, robot: setting.RobotHeader) -> Robot:
    model = RobotModel(
        robot.model,
        Mobility(robot.mobility),
        robot.layer,
        robot.capabilities,
        robot.vision,
        timing=Timing() if robot.timing is None else Timing(robot.timing.least, robot.timing.most),
        carries=1 if robot.carries is None else robot.carries,
    )
    if robot.motion is not None:
        model = replace(model, motion=_motion(robot.motion))
    objective = objective_of(robot.objective)
    if objective is None:
        raise UsageError(f"the objective of {name} is of a kind that this version does not know")
    waiting = None if robot.while_waiting is None else objective_of(robot.while_waiting)
    return Robot(
        name,
        model,
        _pose(robot.start, robot.heading),
        objective,
        robot.conflicts,
        frozenset(robot.tracks or ()),
        Tracking(robot.tracking or "nearby"),
        waiting,
    )


def _motion(told: Mapping[str, Any]) -> MotionModel:
    """Return a robot's motion model with all parameters."""
    values: dict[str, Any] = {
        name: tuple(map(tuple, value)) if isinstance(value, list | tuple) else value
        for name, value in told.items()
        if name != "kind"
    }
    return MotionModel(str(told["kind"]), tuple(values.items()))


def _made_obstacle(told: setting.ObstacleHeader) -> Obstacle:
    needs = tuple(
        Need(n.action, n.robots, frozenset(n.regions), n.together, bool(n.same))
        for n in told.all_needs
    )
    kind = ObstacleType(
        told.type,
        told.action,
        frozenset(told.resolution_regions),
        told.blocks,
        told.traversable is not None,
        needs if told.needs else (),
    )
    times = told.from_, told.until, told.resolve_within
    swept = None if told.sweeps is None else frozenset(told.sweeps)
    _, _, number = name_parts(told.name)
    return Obstacle(
        kind, told.region, told.traversable, *times, bool(told.ordered), number, sweeps=swept
    )


def _pose(region: int, heading: vocabulary.Heading | None) -> Pose:
    return Pose(region, None if heading is None else HEADINGS[str(heading)])


def rest_with(told: Sequence[records.Record], scenario: Scenario, robot: str) -> Scenario:
    """The rest of a run with a robot that joins the team. ``told``: the records of the run so far;
    ``robot``: an item of ``robots`` in a scenario. Raises UsageError."""
    header = next(record for record in told if isinstance(record, records.Header))
    trace = Trace("<run>", header, tuple(told), cut_off=False, ignored=0)
    return joined(resumed(trace, scenario), robot)


def joins_words(rest: Scenario) -> str:
    """The reason for which a run ends where a robot joins it. ``rest``: the scenario with it."""
    return f"{rest.robots[-1].name} joins the team, and another run continues from here"
