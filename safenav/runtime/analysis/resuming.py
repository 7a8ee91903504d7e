"""The rest of an interrupted or killed run as a scenario, derived from its trace.

Robots begin in their last poses (in transit: the departure pose), with their progress
(``trace_end``). Obstacles that were resolved or disappeared are left out, as are fulfilled needs of
others; robots out of service stay so. Requests stay open, and untraversable regions stay closed.
Robots carry the loads that they had taken. Formulas keep a memory that fits the steps so far
(``memories``). A robot begins with its last charge; one with an empty battery requests help again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from math import ceil, floor

from msgspec import convert
from msgspec.structs import asdict, replace

from safenav.errors import UsageError
from safenav.runtime.analysis.trace_end import TraceEnd, ended_late
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
    Tracking,
    name_parts,
)
from safenav.scenario.objective import Ltl
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.joining import joined
from safenav.trace import records, setting
from safenav.trace.reading import Trace
from safenav.trace.told_objective import objective_in_trace, objective_of
from safenav.trace.words import listed
from safenav.world.map import Frame, RegionMap
from safenav.world.moves import Mobility, Pose

UNREAD = {"promises": "deadlines"} | {key: key for key in ("chargers", "inputs", "partition")}
"""Parts of a header that do not suffice to rebuild a scenario, with their names: the scenario's
file is needed."""
ENDED = ("completed", "unrealizable")


def resumed(trace: Trace, scenario: Scenario | None = None) -> Scenario:
    """Return the scenario of the rest of a run. ``scenario``: its scenario, for data that the
    header lacks. Raises UsageError if the run has ended, or if that scenario is missing."""
    outcome = trace.outcome
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
    if scenario is not None and header.begun is not None:
        base = _since_then(base, header)
    state, charges = TraceEnd.of(trace), TracedCharges(trace.header)
    for record in trace.records:
        charges.take(record)
    by = base.until.by
    if by is not None:  # a missed one is due at the beginning, so that the rest is also late
        by = None if ended_late(trace) else max(0, floor(by - state.begins))
    timed = base.deadlines and clock is settings.Clock.LOCKSTEP
    listed = _listed(base.obstacles, trace)
    obstacles = [*_obstacles(listed, trace, state, {*charges.flat})]
    left = {obstacle.name for obstacle in obstacles}
    there = {obstacle.name for obstacle in obstacles if obstacle.appears is None}
    open_ = left.union(charges.flat)
    begun = state.begun(trace, timed=timed)
    met = _met(listed, state)
    team = tuple(_robot(robot, state, charges) for robot in base.robots)
    anew = {robot.name for robot in team if _has_other_formulas(robot, state)}
    inputs = tuple(_input(each, state, clock, base.limits) for each in base.inputs)
    first = 0 if clock is settings.Clock.LIVE else 1
    on = {each.name for each in inputs if any(a <= first <= b for a, b in each.spans)}
    away = {r.name for r in team if r.name in state.away and on & {one for one, _ in r.when}}
    return replace(
        base,
        robots=team,
        obstacles=tuple(obstacles),
        until=replace(base.until, by=by),
        changes=tuple(_changes(base, state)),
        inputs=inputs,
        begun=replace(
            begun,
            robots={
                name: replace(done, uncounted=done.uncounted and name not in away)
                for name, done in begun.robots.items()
                if name not in anew
            },
            due={name: ticks for name, ticks in begun.due.items() if name in open_},
            late=tuple(name for name in begun.late if name in open_),
            closed=tuple(name for name in begun.closed if name in left),
            met={name: groups for name, groups in met.items() if name in left},
            asked={name: waits for name, waits in begun.asked.items() if name in there},
            stays=tuple(name for name in begun.stays if name in there),
        ),
    )


def _since_then(base: Scenario, header: setting.ScenarioHeader) -> Scenario:
    """Return a scenario with the changes, inputs and obstacles that remained when the run with this
    header continued it."""
    return replace(
        base,
        obstacles=tuple(map(_made_obstacle, header.obstacles)),
        until=replace(base.until, by=None if header.promises is None else header.promises.by),
        changes=_made_changes(header),
        inputs=convert(header.inputs or (), tuple[settings.Input, ...], from_attributes=True),
    )


def _robot(robot: Robot, state: TraceEnd, charges: TracedCharges) -> Robot:
    own = state.own[robot.name]
    last = objective_of(own.objective)
    objective = robot.objective if last is None or isinstance(last, Ltl) else last
    within = own.within if own.objective != objective_in_trace(robot.objective) else robot.within
    model, charge = robot.model, charges.now(robot.name)
    if model.battery is not None and charge is not None:
        model = replace(model, battery=replace(model.battery, start=charge))
    start = state.poses[robot.name]
    return replace(robot, model=model, start=start, objective=objective, within=within)


def _has_other_formulas(robot: Robot, state: TraceEnd) -> bool:
    """Whether the scenario gives a robot other formulas than its run; they begin again then."""
    formulas = isinstance(robot.objective, Ltl)
    return formulas and objective_in_trace(robot.objective) != state.own[robot.name].objective


def _listed(obstacles: Collection[Obstacle], trace: Trace) -> tuple[Obstacle, ...]:
    """The obstacles of a run: those of its scenario, and those that were discovered."""
    found = {r.obstacle.name for r in trace.records if isinstance(r, records.Discovered)}
    later = sorted(found - {obstacle.name for obstacle in obstacles})
    return (*obstacles, *(_made_obstacle(trace.obstacles[name]) for name in later))


def _obstacles(
    listed: Iterable[Obstacle], trace: Trace, state: TraceEnd, flat: set[str]
) -> Iterable[Obstacle]:
    truths = {(o.name, o.from_): o.traversable for o in trace.header.scenario.obstacles}
    known = state.obstacles
    there = known.appeared | known.closed | known.stays | known.asked.keys()
    if trace.header.scenario.world == "external":  # such a world does not report all that appears
        there |= known.gone
    for obstacle in listed:
        to_come = obstacle.appears is not None and (
            obstacle.appears > state.time or obstacle.name not in there
        )
        if (obstacle.name in known.gone and not to_come) or obstacle.name in flat:
            continue
        if obstacle.goes is not None and obstacle.goes <= state.time:
            continue
        drawn = truths.get((obstacle.name, obstacle.appears))
        truth = obstacle.traversable if drawn is None else drawn  # unknown in external worlds
        met = 0 if to_come else len(known.met.get(obstacle.name, ()))
        if met == len(obstacle.needs) and truth is None:
            continue  # the trace lacks the line of its resolution
        # an order needs a tick at which it appears
        appears = _later(obstacle.appears, state) if to_come or obstacle.ordered else None
        if to_come and appears is not None and state.had and state.begins < state.time:
            appears = max(2, appears)  # a robot was in its region when this tick began
        yield replace(
            obstacle,
            type=_left(obstacle.type, met),
            traversable=truth if to_come else known.truths.get(obstacle.name, truth),
            appears=appears,
            goes=_later(obstacle.goes, state),
        )


def _left(kind: ObstacleType, met: int) -> ObstacleType:
    """Return a type without its fulfilled needs, except those whose robots must also fulfil the
    next."""
    first = _first_left(kind.needs, met)
    return replace(kind, listed=kind.needs[first:]) if 0 < first < len(kind.needs) else kind


def _first_left(needs: Sequence[Need], met: int) -> int:
    while 0 < met < len(needs) and needs[met].same:
        met -= 1
    return met


def _met(listed: Iterable[Obstacle], state: TraceEnd) -> dict[str, tuple[tuple[str, ...], ...]]:
    """The robots that fulfilled earlier needs of obstacles whose next need the same robots must
    fulfil."""
    found = {}
    for obstacle in listed:
        groups = state.obstacles.met.get(obstacle.name, [])
        first = _first_left(obstacle.needs, len(groups))
        if first < len(groups) < len(obstacle.needs):
            found[obstacle.name] = tuple(groups[first:])
    return found


def _later(time: int | None, state: TraceEnd) -> int | None:
    """Return a tick of the run in ticks of the rest."""
    return None if time is None else max(1, round(time - state.begins))


def _input(
    each: settings.Input, state: TraceEnd, clock: settings.Clock, limits: settings.Limits
) -> settings.Input:
    """Return an input in the time of the rest, which begins at tick 1 (live: at 0). One set by a
    user stays so until the end."""
    begin, time = 0 if clock is settings.Clock.LIVE else 1, state.begins
    if each.name in state.chosen:
        last = limits.ticks if clock is settings.Clock.LOCKSTEP else limits.seconds
        end = ceil(limits.ticks * SLOWEST if last is None else last)
        set_on = ((begin, end),) if state.chosen[each.name] else ()
        return replace(each, spans=set_on)
    spans = ((max(begin, floor(first - time)), floor(last - time)) for first, last in each.spans)
    return replace(each, spans=tuple(span for span in spans if span[1] >= begin))


def _changes(base: Scenario, state: TraceEnd) -> Iterable[settings.RobotChange]:
    for name in sorted(state.out):
        yield settings.RobotChange(0 if state.live else 1, name, active=False)
    for change in base.changes:
        if change.at > state.time:
            yield replace(change, at=_later(change.at, state) or 1)


def _scenario(header: setting.ScenarioHeader, clock: settings.Clock) -> Scenario:
    """The scenario of a header."""
    missing = [UNREAD[key] for key in UNREAD if getattr(header, key)]
    robots = header.robots.values()
    missing += ["batteries"] if any(robot.battery for robot in robots) else []
    missing += ["'when'"] if any(robot.when for robot in robots) else []
    if missing:
        words = f"the trace does not fully describe {listed(missing)}"
        raise UsageError(f"{words}: also name the scenario (safenav resume TRACE SCENARIO)")
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
        requirements=header.requirements or {},
        catalogue=built_in(),
        clock=clock,
        changes=_made_changes(header),
        never_together=convert(
            header.never_together or (), tuple[settings.Exclusion, ...], from_attributes=True
        ),
    )


def _made_changes(header: setting.ScenarioHeader) -> tuple[settings.RobotChange, ...]:
    return tuple(
        settings.RobotChange(
            change.at,
            change.robot,
            None if change.objective is None else objective_of(change.objective),
            change.active,
            change.within,
        )
        for change in header.changes or ()
    )


def _made(name: str, robot: setting.RobotHeader) -> Robot:
    model = RobotModel(
        robot.model,
        Mobility(robot.mobility),
        robot.layer,
        robot.capabilities,
        robot.vision,
        timing=robot.timing or 1,
    )
    if robot.motion is not None:
        size, speed = (_number(robot.motion.get(key)) for key in ("size", "speed"))
        model = replace(model, motion=str(robot.motion["kind"]), size=size, speed=speed)
    objective = objective_of(robot.objective)
    if objective is None:
        raise UsageError(f"the objective of {name} is of a kind that this version does not know")
    waiting = None if robot.while_waiting is None else objective_of(robot.while_waiting)
    return Robot(
        name,
        model,
        Pose.of(robot.start, robot.heading),
        objective,
        robot.conflicts,
        frozenset(robot.tracks or ()),
        Tracking(robot.tracking or "nearby"),
        waiting,
    )


def _made_obstacle(header: setting.ObstacleHeader) -> Obstacle:
    needs = tuple(
        Need(n.action, n.robots, frozenset(n.regions), n.together, bool(n.same))
        for n in header.all_needs
    )
    kind = ObstacleType(
        header.type,
        header.action,
        frozenset(header.resolution_regions),
        header.blocks,
        header.traversable is not None,
        needs if header.needs else (),
    )
    times = header.from_, header.until, header.resolve_within
    _, _, number = name_parts(header.name)
    return Obstacle(kind, header.region, header.traversable, *times, bool(header.ordered), number)


def rest_with(lines: Sequence[records.Record], scenario: Scenario, robot: str) -> Scenario:
    """Return the rest of a run with a robot that joins the team. ``lines``: the records of the run
    so far; ``robot``: an item of ``robots`` in a scenario, as YAML. Raises UsageError."""
    header = next(record for record in lines if isinstance(record, records.Header))
    trace = Trace("<run>", header, tuple(lines), cut_off=False, ignored=0)
    return joined(resumed(trace, scenario), robot)


def joins_words(rest: Scenario) -> str:
    """Return the reason why a run ends when a robot joins it. ``rest``: the scenario with that
    robot."""
    return f"{rest.robots[-1].name} joins the team, and another run continues from here"


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None
