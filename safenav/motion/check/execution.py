"""The rules of an execution: where real robots were measured, against the trace and their plans.

A plan may break none of its rules while the robot does something else, so these have names of their
own. What lies between two measurements is taken as a straight line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np
from msgspec import Struct

from safenav.motion.check.bodies import STEP, places, radius
from safenav.motion.check.finding import NEAR, Finding, Report
from safenav.motion.check.paths import Array
from safenav.motion.check.room import Grid, Holding, outside
from safenav.motion.file.records import Action, GoalLine, Measured, Motion, Moving, Reset
from safenav.trace.records import Arrive, Depart
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import MoveEnd

SETPOINTS, GOALS = "setpoints", "goals"
"""How a robot is driven: by a reference that it tracks, or by goals to which it finds its way."""
TOUCH = 0.01
"""Metres by which odometry may have a body over a border."""
WINDOW, DRIFT = 5.0, 0.25
"""Seconds in which the fastest message dates the robot's clock, and the most by which that may
change."""
JUMP = 0.05
"""Metres between where a plan continues after it was given up, and where the robot was then."""


class MeasuredWay(Struct, frozen=True):
    """The measurements of a robot: when heard (n), its own stamps (n), x and y (n, 2)."""

    times: Array
    stamps: Array
    centres: Array

    def at(self, times: Array) -> Array:
        columns = [np.interp(times, self.times, self.centres[:, axis]) for axis in (0, 1)]
        return np.stack(columns, axis=1)


class TrackingError(Struct, frozen=True):
    """How well a robot did what it was sent: measurements, and the most metres off its reference or
    at the end of a goal."""

    robot: str
    driven: str
    measurements: int
    off: float

    def __str__(self) -> str:
        where = "off its plan" if self.driven == SETPOINTS else "from its goals"
        return f"{self.robot}: {self.measurements} measurements, at most {self.off:.3f} m {where}"


def driven_robots(motion: Motion) -> dict[str, Mapping[str, object]]:
    """The robots that were really driven; none in a motion that is only computed."""
    return {name: own for name, own in motion.header.robots.items() if "driven" in own}


def check_execution(
    motion: Motion,
    trace: Trace,
    pieces: Mapping[str, Sequence[Moving]],
    held: Sequence[Holding],
    conflicts: Mapping[str, frozenset[str]],
    report: Report,
) -> None:
    """Every rule, for every robot that was driven."""
    grid = Grid(motion.header.rows, motion.header.cols, motion.header.side)
    ways: dict[str, MeasuredWay] = {}
    acting = [line for line in motion.lines if isinstance(line, Action)]
    swept = {name: told.sweeps or () for name, told in trace.obstacles.items()}
    for name, limits in driven_robots(motion).items():
        way = _way(motion, name, report)
        if way is None:
            continue
        ways[name] = way
        _rate(name, way, _number(limits, "gap"), motion.outcome.makespan, report)
        _clock(name, way, report)
        own = [h for h in held if h.robot == name]
        # Who acts on an obstacle reaches into its region, which blocks all others, and into those
        # that its resolution sweeps, which are reserved meanwhile.
        for one in acting:
            if one.robot == name:
                room = {one.region, *swept.get(one.obstacle, ())}
                own += [Holding(name, region, one.t0, one.t1) for region in room]
        found = outside(way.times, way.centres, radius(limits), own, grid, TOUCH)
        if found is not None:
            t, x, y, into, region = found
            what = f"measured at ({x:.3f}, {y:.3f}) m, {into:.3f} m into region {region}, "
            what += "which it does not have"
            if any(a.robot == name and a.t0 <= t <= a.t1 for a in acting):
                what += " (it acts: 'sweeps' of an obstacle's type reserves what that takes)"
            report(Finding(t, name, "measured room", what))
        if limits["driven"] == SETPOINTS:
            _tracking(motion, name, way, pieces.get(name, []), report)
        else:
            _arrivals(motion, trace, name, way, _number(limits, "tolerance"), report)
    _distances(motion, ways, conflicts, report)


def trackings(motion: Motion, trace: Trace) -> list[TrackingError]:
    """How well each driven robot did what it was sent, outside of its actions."""
    found: list[TrackingError] = []
    unheard: list[Finding] = []
    for name, limits in driven_robots(motion).items():
        way = _way(motion, name, unheard.append)
        if way is None:
            continue
        if limits["driven"] == SETPOINTS:
            own = [line for line in motion.lines if isinstance(line, Moving) and line.robot == name]
            errors = _errors(motion, name, way, own)
            off = float(errors.max(initial=0.0))
        else:
            offs = [off for _, _, off in _arrived(motion, trace, name, way) if off is not None]
            off = max(offs, default=0.0)
        found.append(TrackingError(name, str(limits["driven"]), len(way.times), off))
    return found


def _number(limits: Mapping[str, object], key: str) -> float:
    value = limits.get(key)
    return float(value) if isinstance(value, int | float) else 0.0


def _way(motion: Motion, name: str, report: Report) -> MeasuredWay | None:
    rows = [
        row
        for line in motion.lines
        if isinstance(line, Measured) and line.robot == name
        for row in line.rows
    ]
    if not rows:
        report(Finding(0.0, name, "measured rate", "no measurement is recorded"))
        return None
    table = np.array([(row.t, row.stamp, row.x, row.y) for row in rows])
    for column, what in ((0, "was heard"), (1, "is stamped")):
        back = np.diff(table[:, column])
        if len(back) and back.min() < 0:
            at = int(back.argmin())
            found = f"a measurement {what} {-back[at]:.3f} s before the one that precedes it"
            report(Finding(float(table[at, 0]), name, "measured clock", found))
            if column == 0:
                return None
    return MeasuredWay(table[:, 0], table[:, 1], table[:, 2:])


def _rate(name: str, way: MeasuredWay, gap: float, makespan: float, report: Report) -> None:
    """No measurement is missing for longer than ``gap`` seconds."""
    times = np.concatenate([[0.0], way.times, [makespan]])
    silent = np.diff(times)
    worst = int(silent.argmax())
    if silent[worst] > gap:
        what = f"no measurement for {silent[worst]:.3f} s, more than {gap:g} s"
        report(Finding(float(times[worst]), name, "measured rate", what))


def _clock(name: str, way: MeasuredWay, report: Report) -> None:
    """The robot's clock is as fast as that of the run: the fastest messages stay as late."""
    late = way.times - way.stamps
    windows = (way.times // WINDOW).astype(int)
    found = [(float(late[windows == w].min()), w * WINDOW) for w in np.unique(windows)]
    (least, _), (most, _) = min(found), max(found)
    if most - least > DRIFT:
        at = next(t for offset, t in found if abs(offset - found[0][0]) > DRIFT / 2)
        what = f"its clock drifts by {most - least:.3f} s against that of the run"
        report(Finding(at, name, "measured clock", what))


def _errors(motion: Motion, name: str, way: MeasuredWay, pieces: Sequence[Moving]) -> Array:
    """Metres off the reference at each measurement; 0 while the robot acts: it has none then."""
    planned = places(pieces, motion.header.robots[name], way.times)
    off: Array = np.hypot(*(way.centres - planned).T)
    for line in motion.lines:
        if isinstance(line, Action) and line.robot == name:
            off[(way.times >= line.t0) & (way.times <= line.t1)] = 0.0
    return off


def _tracking(
    motion: Motion,
    name: str,
    way: MeasuredWay,
    pieces: Sequence[Moving],
    report: Report,
) -> None:
    """A robot is where its plan has it, up to the tolerance that the header states."""
    if not pieces:
        return  # the rule of continuity tells it
    tolerance = _number(motion.header.robots[name], "tolerance")
    off = _errors(motion, name, way, pieces)
    beyond = np.flatnonzero(off > tolerance)
    if len(beyond):
        worst = float(off.max())
        what = f"{off[beyond[0]]:.3f} m off its plan, at most {worst:.3f} m; {tolerance:g} m are"
        report(Finding(float(way.times[beyond[0]]), name, "tracking", f"{what} tolerated"))
    for reset in motion.lines:
        if isinstance(reset, Reset) and reset.robot == name:
            was = way.at(np.array([reset.t]))[0]
            jump = float(np.hypot(was[0] - reset.x, was[1] - reset.y))
            if jump > JUMP:
                what = f"its plan continues {jump:.3f} m from where it was measured"
                report(Finding(reset.t, name, "tracking", what))


def _arrivals(
    motion: Motion,
    trace: Trace,
    name: str,
    way: MeasuredWay,
    tolerance: float,
    report: Report,
) -> None:
    """A robot that arrives is where its last goal was, and was sent there by this step."""
    for end, region, off in _arrived(motion, trace, name, way):
        if off is None:
            what = f"arrives in region {region}, to which no goal was sent"
            report(Finding(end, name, "arrival", what))
        elif off > tolerance:
            what = f"arrives {off:.3f} m from its goal; {tolerance:g} m are tolerated"
            report(Finding(end, name, "arrival", what))


def _arrived(
    motion: Motion, trace: Trace, name: str, way: MeasuredWay
) -> Iterator[tuple[float, int, float | None]]:
    """The arrivals of a robot: when, where, and metres from its goal; None: no goal was sent."""
    goals = [line for line in motion.lines if isinstance(line, GoalLine) and line.robot == name]
    departs: dict[int, Depart] = {}
    for record in trace.records:
        if isinstance(record, Depart) and record.robot == name:
            departs[record.command] = record
        if not isinstance(record, Arrive) or record.robot != name:
            continue
        if record.result is not MoveEnd.ARRIVED:
            continue
        end, depart = record.t or 0.0, departs[record.command]
        sent = [goal for goal in goals if goal.t0 < end - NEAR and goal.to == depart.to]
        if not sent or sent[-1].t1 < (depart.t or 0.0):
            yield end, depart.to, None
            continue
        was = way.at(np.array([end]))[0]
        yield end, depart.to, float(np.hypot(was[0] - sent[-1].x, was[1] - sent[-1].y))


def _distances(
    motion: Motion,
    ways: Mapping[str, MeasuredWay],
    conflicts: Mapping[str, frozenset[str]],
    report: Report,
) -> None:
    """Measured bodies of robots in conflict never touch."""
    times: Array = np.arange(0.0, motion.outcome.makespan, STEP)
    if not len(times):
        return
    for one, other in combinations(ways, 2):
        if other not in conflicts[one] and one not in conflicts[other]:
            continue
        apart = np.hypot(*(ways[one].at(times) - ways[other].at(times)).T)
        least = radius(motion.header.robots[one]) + radius(motion.header.robots[other])
        nearest = int(apart.argmin())
        if apart[nearest] < least - TOUCH:
            what = f"measured {apart[nearest]:.3f} m from {one}, and must be at least {least:.3f} m"
            report(Finding(float(times[nearest]), other, "measured distance", what))
