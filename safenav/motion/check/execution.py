"""The rules of an execution: measured positions of real robots against the trace and their plans. A
robot may deviate from a plan that breaks no rule, so these rules have names of their own. Motion
between two measurements is taken as a straight line.
"""

from collections.abc import Iterator
from itertools import pairwise
from math import inf

import numpy as np
from msgspec import Struct

from safenav.motion.check.examination import (
    MEASURED_TOUCH,
    Disc,
    Examination,
    Holding,
    check_distances,
    outside,
)
from safenav.motion.check.walk import NEAR, Array
from safenav.motion.file import GoalLine, Measured, Reset
from safenav.trace.file import Trace
from safenav.trace.records import Act, Operator
from safenav.trace.vocabulary import ActResult, MoveEnd
from safenav.trace.words import counted

SETPOINTS, GOALS = "setpoints", "goals"
"""The ways of driving a robot: by a reference that it tracks, or by goals to which it navigates
itself."""
WINDOW, DRIFT = 5.0, 0.25
"""The interval in which the fastest message dates the robot's clock, and the maximum change of that
date, in seconds."""
JUMP = 0.05
"""Maximum distance, in metres, between the start of a plan after a reset and the robot's position
then."""


HELD = 0.1
"""Seconds within which a robot beyond its tolerance is held."""


class MeasuredPath(Struct, frozen=True):
    """The measurements of a robot: times of reception (n), its own stamps (n), x and y (n, 2)."""

    times: Array
    stamps: Array
    centres: Array

    def at(self, times: Array) -> Array:
        columns = [np.interp(times, self.times, self.centres[:, axis]) for axis in (0, 1)]
        return np.stack(columns, axis=1)


class TrackingError(Struct, frozen=True):
    """Tracking error of a robot: number of measurements, largest distance in metres from its
    reference or from a goal at its end, and how often it was held for exceeding its tolerance."""

    robot: str
    driven: str
    measurements: int
    off: float
    held: int = 0

    def __str__(self) -> str:
        where = "off its plan" if self.driven == SETPOINTS else "from its goals"
        where += f"; held {counted(self.held, 'time')}" if self.held else ""
        return f"{self.robot}: {self.measurements} measurements, at most {self.off:.3f} m {where}"


def check_execution(case: Examination) -> list[TrackingError]:
    """Check every rule for every robot that was driven; return their tracking errors, outside of
    actions."""
    paths, found = dict(_paths(case)), []
    for name, path in paths.items():
        _rate(case, name, path)
        _clock(case, name, path)
        own: list[Holding] = []
        # A robot that acts on an obstacle reaches into its region: no other robot may enter it.
        acts = _acts(case.trace, name)
        acting = [(one, t0, t1) for act, t0, t1 in acts for one in act.obstacles]
        acting += [(a.obstacle, a.t0, a.t1) for a in case.actions if a.robot == name]
        for obstacle, t0, t1 in acting:
            if obstacle in case.obstacles:
                own.append(Holding(name, case.obstacles[obstacle].region, t0, t1))
        own += [held for held in case.held if held.robot == name]
        body = Disc("measured body", case.radius(name), path.times, path.centres)
        if (reach := outside(case, body, own, MEASURED_TOUCH)) is not None:
            case.wrong(reach[0], name, "measured room", reach[1])
        driven = str(case.driven[name]["driven"])
        follows = driven == SETPOINTS
        off = _tracking(case, name, path) if follows else _arrivals(case, name, path)
        held = len(_holds(case, name)) if follows else 0
        found.append(TrackingError(name, driven, len(path.times), off, held))
    check_distances(case, {name: path.at for name, path in paths.items()}, measured=True)
    return found


def _acts(trace: Trace, name: str) -> Iterator[tuple[Act, float, float]]:
    """Yield the actions in which a robot takes part, successful or not, each with start and end."""
    for act, end in trace.acts:
        if name in act.robots:
            yield act, act.t or 0.0, inf if end is None else end.t or 0.0


def _paths(case: Examination) -> Iterator[tuple[str, MeasuredPath]]:
    """Yield the robots that were measured, with their measurements."""
    for name in case.driven:
        if (path := _path(case, name)) is not None:
            yield name, path


def _path(case: Examination, name: str) -> MeasuredPath | None:
    rows = [row for line in case.motion.of(Measured, name) for row in line.rows]
    if not rows:
        if case.makespan > case.numbers[name]["gap"]:
            case.wrong(0.0, name, "measured rate", "no measurement is recorded")
        return None
    table = np.array([(row.t, row.stamp, row.x, row.y) for row in rows])
    for column, what in ((0, "was heard"), (1, "is stamped")):
        back = np.diff(table[:, column])
        if len(back) and back.min() < 0:
            at = int(back.argmin())
            found = f"a measurement {what} {-back[at]:.3f} s before the one that precedes it"
            case.wrong(float(table[at, 0]), name, "measured clock", found)
            if column == 0:
                return None
    return MeasuredPath(table[:, 0], table[:, 1], table[:, 2:])


def _rate(case: Examination, name: str, path: MeasuredPath) -> None:
    """Check that no gap between measurements is longer than the ``gap`` seconds of the header."""
    gap = case.numbers[name]["gap"]
    times = np.concatenate([[0.0], path.times, [case.makespan]])
    silent = np.diff(times)
    worst = int(silent.argmax())
    if silent[worst] > gap:
        what = f"no measurement for {silent[worst]:.3f} s, more than {gap:g} s"
        case.wrong(float(times[worst]), name, "measured rate", what)


def _clock(case: Examination, name: str, path: MeasuredPath) -> None:
    """Check that the robot's clock runs at the rate of the run's: the least delay of messages is
    constant."""
    late = path.times - path.stamps
    windows = (path.times // WINDOW).astype(int)
    found = [(float(late[windows == w].min()), w * WINDOW) for w in np.unique(windows).tolist()]
    (least, _), (most, _) = min(found), max(found)
    if most - least > DRIFT:
        at = next(t for offset, t in found if abs(offset - found[0][0]) > DRIFT / 2)
        what = f"its clock drifts by {most - least:.3f} s against that of the run"
        case.wrong(at, name, "measured clock", what)


def _errors(case: Examination, name: str, path: MeasuredPath) -> Array:
    """Return the metres off the reference at each measurement; 0 while the robot acts, when it has
    none, and in a run that took no time, which has no plan. The lines of the motion cover only
    actions that have fulfilled a need."""
    if not case.pieces[name]:
        return np.zeros(len(path.times))
    off: Array = np.hypot(*(path.centres - case.places(name, path.times)).T)
    spans = [(line.t0, line.t1) for line in case.actions if line.robot == name]
    for _, begin, end in _acts(case.trace, name):
        if not any(begin < t1 and t0 < end for t0, t1 in spans):
            spans.append((begin, end))
    for t0, t1 in spans:
        off[(path.times >= t0) & (path.times <= t1)] = 0.0
    return off


def _holds(case: Examination, name: str) -> list[Reset]:
    """Return the resets after which a robot's plan continues; the plan of a fallen robot ends."""
    last = max((piece.t1 for piece in case.pieces[name]), default=0.0)
    return [reset for reset in case.motion.of(Reset, name) if reset.t < last - NEAR]


def _failures(trace: Trace, name: str) -> Iterator[tuple[float, float]]:
    """Yield the intervals in which, by the trace, a robot may have been held. Each begins with a
    command that failed, took more than one attempt or preceded an operator's intervention, and
    ends with the next command."""
    commands = [(0.0, False)]
    for depart, arrive in trace.steps:
        if depart.robot == name:
            failed = arrive is None or arrive.result is not MoveEnd.ARRIVED or bool(arrive.reason)
            commands.append((depart.t or 0.0, failed))
    for act, end in trace.acts:
        if name in act.robots:
            failed = end is None or ActResult.FAILED in end.results.values() or bool(end.reason)
            commands.append((act.t or 0.0, failed))
    helped = [r.t or 0.0 for r in trace.records if isinstance(r, Operator) and r.robot == name]
    for (begin, failed), (until, _) in pairwise([*sorted(commands), (inf, False)]):
        if failed or any(begin <= t < until for t in helped):
            yield begin, until


def _tracking(case: Examination, name: str, path: MeasuredPath) -> float:
    """Check that a robot is where its plan has it, within the tolerance in the header, or is held
    as soon as it is not. Its plan then continues from its position, and the trace records a failure
    or another attempt. Return the largest distance from the plan."""
    tolerance = case.numbers[name].get("tolerance", 0.0)
    off = _errors(case, name, path)
    held = np.zeros(len(path.times), dtype=bool)
    failures = [*_failures(case.trace, name)]
    for reset in _holds(case, name):
        if not any(begin - HELD <= reset.t <= end + HELD for begin, end in failures):
            what = f"held ({reset.reason}), but the trace reports no failure then"
            case.wrong(reset.t, name, "tracking", what)
        held |= (path.times >= reset.t - HELD) & (path.times <= reset.t + NEAR)
    beyond = np.flatnonzero((off > tolerance) & ~held)
    if len(beyond):
        what = f"{off[beyond[0]]:.3f} m off its plan, at most {off.max():.3f} m; {tolerance:g} m "
        case.wrong(float(path.times[beyond[0]]), name, "tracking", f"{what}are tolerated")
    for reset in case.motion.of(Reset, name):
        was = path.at(np.array([reset.t]))[0]
        jump = float(np.hypot(was[0] - reset.x, was[1] - reset.y))
        if jump > JUMP:
            what = f"its plan continues {jump:.3f} m from where it was measured"
            case.wrong(reset.t, name, "tracking", what)
    return float(off.max(initial=0.0))


def _arrivals(case: Examination, name: str, path: MeasuredPath) -> float:
    """Check that a robot that arrives is at its last goal, to which this step has sent it. Return
    the largest distance from a goal."""
    goals, tolerance = case.motion.of(GoalLine, name), case.numbers[name].get("tolerance", 0.0)
    most = 0.0
    for depart, arrive in case.trace.steps:
        if arrive is None or arrive.robot != name or arrive.result is not MoveEnd.ARRIVED:
            continue
        end = arrive.t or 0.0
        sent = [goal for goal in goals if goal.t0 < end - NEAR and goal.to == depart.to]
        if not sent or sent[-1].t1 < (depart.t or 0.0):
            what = f"arrives in region {depart.to}, to which no goal was sent"
            case.wrong(end, name, "arrival", what)
            continue
        was = path.at(np.array([end]))[0]
        off = float(np.hypot(was[0] - sent[-1].x, was[1] - sent[-1].y))
        most = max(most, off)
        if off > tolerance:
            what = f"arrives {off:.3f} m from its goal; {tolerance:g} m are tolerated"
            case.wrong(end, name, "arrival", what)
    return most
