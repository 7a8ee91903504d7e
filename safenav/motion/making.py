"""Computation of the motion of all robots from a trace."""

from __future__ import annotations

from collections.abc import Mapping

import safenav
from safenav.errors import Diagnostic, InputError, SafenavError, UsageError
from safenav.motion.file import Flight, Line, Motion, MotionHeader
from safenav.motion.flyer import flown
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Glider, Mover, Start, flown_through
from safenav.motion.schedule import scheduled, when
from safenav.motion.timing import dated, ordered, paces_of
from safenav.motion.walker import WalkerMover, fault_of
from safenav.pace.robot import SIDE as SIDE
from safenav.scenario.model import Scenario
from safenav.scenario.motion import KINDS
from safenav.trace.reading import Trace, unstarted
from safenav.trace.setting import RobotHeader


def motion_of(trace: Trace, side: float | None = None, *, track: bool = False) -> Motion:
    """Return the motion of a run. ``side``: side of a region in metres, in place of the trace's;
    ``track``: also simulate how flyers track their references. Raises UsageError or
    InputError if a robot cannot move so, or if the trace breaks a rule.
    """
    floor = floor_of(trace, side)
    movers = movers_of(trace, floor)
    robots = {name: described(trace, name, movers[name]) for name in movers}
    header = header_of(trace, floor, robots)
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
    return Motion(header, lines, outcome)


def header_of(
    trace: Trace, floor: MetricFloor, robots: Mapping[str, Mapping[str, object]]
) -> MotionHeader:
    """Return the header of a motion of a run. ``robots``: how each moves."""
    return MotionHeader(
        trace=trace.digest,
        safenav=safenav.__version__,
        side=floor.side,
        rows=floor.rows,
        cols=floor.cols,
        origin=trace.header.scenario.map.origin or (0.0, 0.0, 0.0),
        robots=robots,
    )


def refuse_broken(trace: Trace, error: Exception | None = None) -> None:
    """Raise UsageError if the trace itself breaks a rule: motion is made of valid runs only."""
    from safenav.checked_trace import check_trace  # imported here: it is slow

    try:
        found = check_trace(trace).findings
    except Exception:  # then the first error is more helpful
        return
    if found:
        hint = f"all broken rules: safenav check --json {trace.source}"
        raise UsageError(f"{trace.source} breaks a rule: {found[0]}\n    {hint}") from error


def check_movable(scenario: Scenario) -> None:
    """Raise UsageError or InputError if a robot cannot move so on the floor of a scenario."""
    trace = unstarted(scenario)
    movers_of(trace, floor_of(trace))


def _flown(name: str, moved: Glider, lines: tuple[Line, ...], track: bool) -> tuple[Line, ...]:
    """Return the lines with the flights of a flyer through the centres of regions, and if wanted
    with its simulated flight."""
    flights = [line for line in lines if isinstance(line, Flight) and line.robot == name]
    size, tilt, floor = moved.values["size"], moved.values["tilt"], moved.floor
    smooth = dict(zip(map(id, flights), flown_through(flights, floor, size), strict=True))
    found = [smooth.get(id(line), line) for line in lines]
    if flights and track:
        found.append(flown(list(smooth.values()), floor, size, tilt))
    return tuple(sorted(found, key=when))


def floor_of(trace: Trace, side: float | None = None) -> MetricFloor:
    """The floor of a trace in metres. Raises InputError if its regions are not square."""
    header, world = trace.header, trace.header.scenario.map
    if side is None:
        east, north = world.resolution or (SIDE, SIDE)
        if abs(east - north) > 1e-9 * max(east, north):
            found = f"regions of {east:g} x {north:g} m: motion needs square regions"
            hint = "set their size: --side 2.7"
            raise InputError([Diagnostic(trace.source, header.line, 1, found, hint)])
        side = east
    if not 0 < side < 1e6:
        found = f"regions of {side:g} m: their side must be more than 0"
        raise InputError([Diagnostic(trace.source, header.line, 1, found)])
    return MetricFloor(world.rows, world.cols, side)


def movers_of(trace: Trace, floor: MetricFloor) -> dict[str, Mover]:
    """A mover for each robot, where it starts. Raises InputError for a start off the map."""
    movers = {}
    for name, robot in trace.header.scenario.robots.items():
        if not 0 <= robot.start < floor.rows * floor.cols:
            found = f"{name} starts in region {robot.start}, which is not on the map"
            raise InputError([Diagnostic(trace.source, trace.header.line, 1, found)])
        movers[name] = mover(name, floor, robot.start, robot.heading, _motion(name, robot))
    return movers


def mover(
    robot: str, floor: MetricFloor, region: int, heading: str | None, motion: Mapping[str, object]
) -> Mover:
    """The mover of a robot by its ``motion`` in a trace (kind and parameters), at rest in a region.

    Raises UsageError for an unknown kind, an impossible parameter, or a floor on which the robot
    cannot move so.
    """
    kind = str(motion.get("kind"))
    if kind not in KINDS:
        known = ", ".join(sorted(KINDS))
        raise UsageError(f"{robot}: unknown kind of motion '{kind[:40]}'\n    known: {known}")
    values: dict[str, float] = {}
    for name, parameter in KINDS[kind].items():
        value = motion.get(name, parameter.default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise UsageError(f"{robot}: '{name}' of its motion is not a number")
        if not parameter.least <= value <= parameter.most:
            limits = f"from {parameter.least:g} to {parameter.most:g}"
            raise UsageError(f"{robot}: '{name}' of its motion is {value:g}, not {limits}")
        values[name] = float(value)
    start = Start(robot, floor, region, heading, values)
    if kind == "walker":
        walker = WalkerMover(start)
        if (fault := fault_of(walker.gait)) is not None:
            raise UsageError(
                f"{robot}: a walker {values['height']:g} m high at {values['speed']:g} m/s cannot "
                f"turn on regions of {floor.side:g} m: {fault}\n"
                "    change 'speed' or 'height' of its model"
            )
        return walker
    return Glider(start, kind)


def _motion(name: str, robot: RobotHeader) -> Mapping[str, object]:
    if robot.motion is None:
        raise UsageError(
            f"{name}: the model '{robot.model}' has no motion in metres\n"
            "    add 'motion: rover' or 'speed: 0.5' to it in the scenario, and run it again"
        )
    return robot.motion


def described(trace: Trace, name: str, moved: Mover) -> Mapping[str, object]:
    """Describe a robot's motion for the header."""
    robot = trace.header.scenario.robots[name]
    return {**_motion(name, robot), "layer": robot.layer, **moved.limits()}
