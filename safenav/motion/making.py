"""Computation of all robots' motion from a trace, with each step and action at its time in a run
with a clock.

A robot rests before a step that has time to spare; a step with too little time is refused.
"""

from collections.abc import Iterator, Mapping
from copy import copy

import safenav
from safenav.errors import Diagnostic, InputError, SafenavError, UsageError
from safenav.motion import file
from safenav.motion.flyer import flown
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Glider, Mover, flown_through
from safenav.motion.timing import actions_of, by_command, dated, ordered, paces_of
from safenav.motion.walker import WalkerMover, fault_of
from safenav.pace.robot import ACTION, BOUNDS, Figures
from safenav.pace.robot import SIDE as SIDE
from safenav.trace import records
from safenav.trace.file import Trace
from safenav.trace.vocabulary import MoveEnd


def motion_of(trace: Trace, side: float | None = None, *, track: bool = False) -> file.Motion:
    """Return the motion of a run. ``side``: side of a region in metres, instead of the trace's;
    ``track``: also simulate how flyers track their references. Raises UsageError or InputError if a
    robot has no motion on the floor or the trace breaks a rule."""
    floor = floor_of(trace, side)
    movers = movers_of(trace, floor)
    header = _header(trace, floor)
    try:
        timed = ordered(trace, dated(trace, paces_of(trace, header)))
        lines, outcome = scheduled(timed, floor, movers)
    except SafenavError:
        raise
    except Exception as error:
        refuse_broken(trace, error)
        raise
    for name, moved in movers.items():
        if isinstance(moved, Glider) and moved.kind == "flyer":
            lines = _flown(name, moved, lines, track)
    return file.Motion(header, lines, outcome)


def _header(trace: Trace, floor: MetricFloor) -> file.MotionHeader:
    return file.MotionHeader(
        trace=trace.digest,
        safenav=safenav.__version__,
        side=floor.side,
        rows=floor.rows,
        cols=floor.cols,
        origin=trace.header.scenario.map.placement,
        robots={name: file.described(robot) for name, robot in trace.robots.items()},
    )


def refuse_broken(trace: Trace, error: Exception | None = None) -> None:
    """Raise UsageError if the trace itself breaks a rule, since only valid runs have a motion."""
    from safenav.run.checked import check_trace  # imported here, since the judge is slow to load

    if found := check_trace(trace).findings:
        hint = f"all broken rules: safenav check --json {trace.source}"
        raise UsageError(f"{trace.source} breaks a rule: {found[0]}\n    {hint}") from error


def _flown(
    name: str, moved: Glider, lines: tuple[file.Line, ...], track: bool
) -> tuple[file.Line, ...]:
    """Return the lines with a flyer's flights made smooth: it does not stop in the centres of
    regions. ``track``: also add its simulated flight."""
    flights = [line for line in lines if isinstance(line, file.Flight) and line.robot == name]
    size, tilt, floor = moved.values["size"], moved.values["tilt"], moved.floor
    smooth = dict(zip(map(id, flights), flown_through(flights, floor, size), strict=True))
    found = [smooth.get(id(line), line) for line in lines]
    if flights and track:
        found.append(flown(list(smooth.values()), floor, size, tilt))
    return tuple(sorted(found, key=when))


def floor_of(trace: Trace, side: float | None = None) -> MetricFloor:
    """Return the floor of a trace in metres. ``side``: the side of its regions (None: the map's or,
    if it has none, ``SIDE``)."""
    world = trace.header.scenario.map
    if side is None:
        side = SIDE if world.frame is None else world.frame.resolution
    return MetricFloor(world.rows, world.cols, side)


def movers_of(trace: Trace, floor: MetricFloor) -> dict[str, Mover]:
    """Return a mover for each robot, at rest where the robot starts."""
    movers = {}
    for name, robot in trace.robots.items():
        if (figures := robot.model.figures) is None:
            raise UsageError(
                f"{name}: the model '{robot.model.name}' has no motion in metres\n"
                "    add 'motion: rover' or 'speed: 0.5' to it in the scenario, and run it again"
            )
        movers[name] = mover(name, floor, *robot.start.place, figures)
    return movers


def mover(
    robot: str, floor: MetricFloor, region: int, heading: str | None, figures: Figures
) -> Mover:
    """Return the mover of a robot, at rest in a region.

    Raises UsageError for an impossible parameter or a floor on which the robot cannot move.
    """
    kind, values = figures.kind, figures.values
    for name, (least, most) in BOUNDS[kind].items():
        if not least <= values[name] <= most:
            limits = f"from {least:g} to {most:g}"
            raise UsageError(f"{robot}: '{name}' of its motion is {values[name]:g}, not {limits}")
    if kind == "walker":
        walker = WalkerMover(robot, floor, region, heading, figures)
        if (fault := fault_of(walker.gait)) is not None:
            raise UsageError(
                f"{robot}: a walker {values['height']:g} m high at {values['speed']:g} m/s cannot "
                f"turn on regions of {floor.side:g} m: {fault}\n"
                "    give its model a 'speed' of 0.4 to 0.46, or another 'motion'"
            )
        return walker
    return Glider(robot, floor, region, heading, figures)


STANDING = 1.0
"""Duration of the motion of a run without moves, in seconds."""
SLACK = 1e-6
"""Tolerance for rounding, in seconds."""


def scheduled(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[file.Line, ...], file.MotionOutcome]:
    """Return the lines of the motion by which these movers carry out a trace from time 0. Raises
    InputError if they cannot: a step leaves too little time, or a robot changes its region without
    a step."""
    run = _Schedule(trace, floor, movers)
    for record in trace.records:
        run.take(record)
    return run.end()


def reservations(trace: Trace) -> Iterator[file.Line]:
    """Yield the reservations of a run with a clock."""
    for name, robot in trace.robots.items():
        yield file.Reserve(name, robot.start.region, 0.0)
    for depart, arrive in trace.steps:
        yield file.Reserve(depart.robot, depart.to, time_of(depart))
        if arrive is not None and arrive.result is not MoveEnd.LOST:
            left = depart.to if arrive.at == depart.from_ else depart.from_
            yield file.Release(arrive.robot, left, time_of(arrive))


class _Schedule:
    def __init__(self, trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]) -> None:
        self._trace, self._floor, self._movers = trace, floor, movers
        self._lines = [*reservations(trace)]
        actions, self._short = actions_of(trace)
        self._actions = by_command(actions)
        self._departs: dict[str, records.Depart] = {}
        """The steps in progress."""
        self._acts = {act.command: act for act, _ in trace.acts}

    def take(self, record: records.Record) -> None:
        match record:
            case records.Depart():
                self._departs[record.robot] = record
            case records.Arrive():
                self._arrive(self._departs.pop(record.robot), record)
            case records.ActionEnd() if record.command in self._acts:
                self._act(self._acts[record.command], record)

    def _arrive(self, depart: records.Depart, arrive: records.Arrive) -> None:
        name, region = depart.robot, self._movers[depart.robot].region
        if arrive.at == depart.from_ == region:
            return  # the robot stays at rest
        if depart.from_ != region:
            found = f"{name} departs from region {depart.from_}, but was in region {region}"
            raise self._refused(depart, f"{found}: no motion shows how the robot got there")
        if arrive.at != depart.to:
            found = f"{name} was sent to region {depart.to}, but arrives in region {arrive.at}"
            raise self._refused(arrive, f"{found}: no motion shows how the robot got there")
        begin, end = time_of(depart), time_of(arrive)
        natural = self._step(depart, end)
        if natural > end + SLACK:
            raise self._refused(
                depart,
                f"{name} takes {end - begin:.2f} s from region {depart.from_} to "
                f"{depart.to}; its motion takes {natural - begin:.2f} s",
                "change 'motion' or 'speed' of its model, or the side of regions: --side",
            )

    def _step(self, depart: records.Depart, end: float | None) -> float:
        """Carry out a step until ``end``, or at the robot's own pace if the trace records no end. A
        robot with time to spare rests first. Return the time of the end."""
        tick, to, mover = depart.tick, depart.to, self._movers[depart.robot]
        short = depart.command in self._short

        def end_from_now() -> float:
            ahead = copy(mover)
            ahead.move(tick, to, short=short)
            return ahead.time

        self._lines += self._rest(mover, tick, time_of(depart))
        if end is not None and end - end_from_now() > SLACK:
            self._lines += mover.halt(tick)
            self._lines += mover.wait(tick, mover.time + end - end_from_now())
        self._lines += mover.move(tick, to, short=short)
        return mover.time

    def _act(self, act: records.Act, acted: records.ActionEnd) -> None:
        """Carry out the actions of a command one after another. Each begins as soon as its robots
        are at rest and face the obstacle; the last one lasts until the end of the command."""
        actions = self._actions.get(acted.command, [])
        idle = self._movers.keys() - self._departs.keys()
        unasked = sorted(idle & {name for one in actions for name in one.robots} - {*act.robots})
        team = {name: self._movers[name] for name in (*act.robots, *unasked)}
        tick, begin, end = acted.tick, time_of(act), time_of(acted)
        for left, one in zip(range(len(actions), 0, -1), actions, strict=True):
            group = [mover for name, mover in team.items() if name in one.robots]
            for mover in group:
                self._lines += self._faced(mover, tick, one.region, begin, end)
            ready = max(mover.time for mover in group)
            until = end
            if left > 1:
                until = ready + min(ACTION, (end - ready) / left)
            for mover in group:
                about = mover.robot, tick, one.action, one.obstacle, one.region
                self._lines.append(file.Action(*about, ready, until))
                self._lines += mover.wait(tick, until)
                mover.due = mover.due or one.region == mover.region
            begin = until
        for name, mover in team.items():
            if not any(name in one.robots for one in actions):
                self._lines += [*self._rest(mover, tick, begin), *mover.halt(tick)]
            if mover.time > end + SLACK:
                late = f"{name} acts until {end:.2f} s, but comes to rest only at "
                raise self._refused(acted, f"{late}{mover.time:.2f} s")

    def _faced(
        self, mover: Mover, tick: int, region: int, begin: float, end: float
    ) -> list[file.Moving]:
        """Return the motion by which a robot halts and faces a region, until ``end``. If the time
        is too short, it does not turn; without time, it stays where it has acted."""
        near = region == mover.region and begin < mover.time + SLACK
        for stays, towards in ((near, region), (near, mover.region), (True, mover.region)):
            ready = copy(mover)
            lines = self._rest(ready, tick, begin, stays=stays)
            lines += [*ready.halt(tick), *ready.face(tick, towards)]
            if ready.time <= end:
                break
        vars(mover).update(vars(ready))
        return lines

    def _rest(
        self, mover: Mover, tick: int, until: float, *, stays: bool = False
    ) -> list[file.Moving]:
        """Return the motion of a robot that rests until a time: in the centre of its region or, if
        it ``stays``, where it has acted."""
        lines: list[file.Moving] = []
        if mover.due and not stays:
            mover.due = False
            lines += mover.resume(tick)
        if until > mover.time + SLACK:
            lines += [*mover.halt(tick), *mover.wait(tick, until)]
        return lines

    def _refused(self, record: records.Record, found: str, hint: str = "") -> InputError:
        return InputError([Diagnostic(self._trace.source, record.line, 1, found, hint)])

    def end(self) -> tuple[tuple[file.Line, ...], file.MotionOutcome]:
        """Let the robots end their steps and rest until the end of the run. Return all lines in
        order, and the outcome."""
        for depart in self._departs.values():  # steps under way when the run ends
            if depart.from_ == self._movers[depart.robot].region:
                self._step(depart, None)
        tick = max((getattr(line, "tick", 0) for line in self._lines), default=0)
        movers = self._movers.values()
        for mover in movers:
            self._lines += [*self._rest(mover, tick, 0.0), *mover.halt(tick)]
        until = max([end_of(self._trace), *(mover.time for mover in movers)]) or STANDING
        for mover in movers:
            self._lines += mover.wait(tick, until)
        return tuple(sorted(self._lines, key=when)), file.MotionOutcome(until)


def when(line: file.Line) -> tuple[float, int]:
    """Return the sort key of a line: by time, then releases, reservations, other lines."""
    if isinstance(line, file.Release):
        return line.t, 0
    time = line.t0 if hasattr(line, "t0") else line.t
    return time, 1 if isinstance(line, file.Reserve) else 2


def time_of(record: records.Record) -> float:
    """Return the time of a line, in seconds."""
    return record.t or 0.0


def end_of(trace: Trace) -> float:
    """Return the time of the last line of a trace, in seconds."""
    return max(map(time_of, trace.records), default=0.0)
