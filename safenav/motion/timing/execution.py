"""Movers that carry out steps and actions at given times, and the lines of their motion; the
actions of a run by its trace, in lockstep or live.

A robot that has more time than its step takes glides or drives more slowly; a walker stands first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from math import inf

from msgspec import Struct
from msgspec.structs import asdict, replace

from safenav.motion.file import (
    Action,
    Curve,
    Flight,
    Line,
    Measured,
    MotionOutcome,
    Moving,
    Release,
    Reserve,
    Segment,
)
from safenav.motion.mover import Crossing, Mover
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.setting import NeedHeader, RobotHeader
from safenav.trace.vocabulary import MoveEnd


class TimedAction(Struct, frozen=True):
    """An act of robots on an obstacle in ``region``, recorded by the ``index``-th record of the
    trace; of a live run, part of ``command``. ``takes``: they carry it from then on."""

    index: int
    command: int
    obstacle: str
    region: int
    action: str
    robots: tuple[str, ...]
    takes: bool


def actions_of(trace: Trace) -> tuple[list[TimedAction], set[tuple[str, int]]]:
    """Return the actions in the order of the trace, and the steps that stop short of such an
    obstacle in the region that they enter: robot, and the command or, in lockstep, the first
    tick."""
    found: list[TimedAction] = []
    short: set[tuple[str, int]] = set()
    obstacles, lockstep = trace.obstacles, trace.header.clock is None
    at = {name: robot.start for name, robot in trace.header.scenario.robots.items()}
    begun: dict[str, int] = {}
    steps: dict[str, int] = {}
    acts: dict[int, records.Act] = {}
    ended: dict[tuple[str, int], int] = {}
    last: set[str] = set()
    for index, record in enumerate(trace.records):
        match record:
            case records.Move(toward=None):
                step = begun.pop(record.robot, record.tick)
                if record.to != record.from_:
                    at[record.robot], steps[record.robot] = record.to, step
            case records.Move():
                begun.setdefault(record.robot, record.tick)
            case records.Arrive(result=MoveEnd.ARRIVED):
                at[record.robot], steps[record.robot] = record.at, record.command
            case records.Act():
                acts[record.command] = record
            case records.ActionEnd():
                for name in acts[record.command].robots:
                    ended[name, record.tick] = record.command
            case records.Met() | records.Resolved():
                obstacle = obstacles[record.obstacle]
                needs = obstacle.needs
                number = record.need if isinstance(record, records.Met) else len(needs) - 1
                resolved = isinstance(record, records.Resolved) and obstacle.name in last
                last.discard(obstacle.name)
                if isinstance(record, records.Met) and number == len(needs) - 1:
                    last.add(obstacle.name)
                command = ended.get((record.robot, record.tick), 0 if lockstep else None)
                if resolved or command is None:
                    continue
                takes = number + 1 < len(needs) and bool(needs[number + 1].same)
                team = team_of(trace, record, needs[number], at)
                what = (obstacle.name, obstacle.region, needs[number].action)
                found.append(TimedAction(index, command, *what, team, takes))
                inside = (n for n in team if at[n] == obstacle.region and n not in begun)
                short |= {(name, steps[name]) for name in inside if name in steps}
            case _:
                pass
    return found, short


def by_command(actions: list[TimedAction]) -> Mapping[int, list[TimedAction]]:
    """The actions of each command, those that take a load last."""
    found: dict[int, list[TimedAction]] = {}
    for action in sorted(actions, key=lambda action: (action.takes, action.obstacle)):
        found.setdefault(action.command, []).append(action)
    return found


def team_of(
    trace: Trace, record: records.Met | records.Resolved, need: NeedHeader, at: Mapping[str, int]
) -> tuple[str, ...]:
    """The robots that fulfil a need: the recorded robot, and the others that are able to, even
    without a request. ``at``: where each robot is."""
    robots = trace.header.scenario.robots
    alone = isinstance(record, records.Met) and not need.together
    others = (n for n in record.robots or () if at[n] in need.regions and not alone)
    able = (n for n in others if need.action in robots[n].capabilities)
    return tuple(dict.fromkeys((record.robot, *able)))


def in_conflict(robots: Mapping[str, RobotHeader], one: str, other: str) -> bool:
    """Whether two robots must never share a region."""
    mine, theirs = robots[one], robots[other]
    if one == other or mine.conflicts is None or theirs.conflicts is None:
        return one != other and mine.layer == theirs.layer
    return other in mine.conflicts or one in theirs.conflicts


STANDING = 1.0
"""Motion length in seconds for runs without moves."""
SLACK = 1e-6
"""Seconds that are rounding."""


class MotionExecution:
    """The movers of a run, and the ``lines`` of their motion."""

    def __init__(self, movers: Mapping[str, Mover]) -> None:
        self.movers = movers
        self.lines: list[Line] = []
        self._due: set[str] = set()
        """Robots that have acted in their own region, and must resume from there."""

    def step(
        self, robot: str, step: Crossing, begin: float, end: float | None = None
    ) -> tuple[float, float]:
        """Carry out a step from ``begin`` to ``end`` (None: as soon as the robot can). Return its
        start and its earliest end, in seconds."""
        mover = self.movers[robot]
        self._rest(mover, step.tick, begin)
        if end is not None and end > _step_end(mover, step)[0] + SLACK:
            self.lines += mover.halt(step.tick)
            natural, walks = _step_end(mover, step)
            if walks and end > natural + SLACK:
                self.lines += mover.rest(step.tick, mover.time + end - natural)
        begun = mover.time
        moved = mover.move(step)
        natural = mover.time
        if end is not None and end > natural + SLACK:
            factor = (end - begun) / (natural - begun)
            moved = [_slower(piece, begun, factor) for piece in moved]
            mover.time = end
        self.lines += moved
        return max(begin, begun), natural

    def act(
        self,
        robots: Iterable[str],
        actions: Sequence[TimedAction],
        tick: int,
        begin: float,
        end: float | None = None,
    ) -> tuple[tuple[float, str], float]:
        """Carry out actions one after the other from ``begin`` to ``end`` (None: as soon as the
        robots can). Return when the last robot is at rest, that robot, and the end of all, in
        seconds."""
        team = {name: self.movers[name] for name in robots}
        for mover in team.values():
            near = bool(actions) and actions[0].region == mover.region
            self._rest(mover, tick, begin, stays=near and begin < mover.time + SLACK)
            self.lines += mover.halt(tick)
        ready = max((mover.time, name) for name, mover in team.items())
        lasting = max(mover.values.get("action_seconds", 2.0) for mover in team.values())
        pause = 0.0
        if end is not None:
            ahead = {name: copy(mover) for name, mover in team.items()}
            _, natural = _done(ahead, actions, tick, lasting, 0.0, end)
            if actions and natural > end:
                lasting = max(0.0, lasting - (natural - end) / len(actions))
            pause = max(0.0, end - natural)
        lines, over = _done(team, actions, tick, lasting, pause, inf if end is None else end)
        self.lines += lines
        for name, mover in team.items():
            if any(name in act.robots and act.region == mover.region for act in actions):
                self._due.add(name)
            if end is not None:
                self.lines += mover.wait(tick, end)
        return ready, over

    def finish(self, over: float = 0.0) -> tuple[tuple[Line, ...], MotionOutcome]:
        """Let all robots come to rest, and rest until all of them do, at least until ``over``."""
        tick = max((getattr(line, "tick", 0) for line in self.lines), default=0)
        for mover in self.movers.values():
            self._rest(mover, tick, 0.0)
            self.lines += mover.halt(tick)
        until = max([over, *(mover.time for mover in self.movers.values())]) or STANDING
        for mover in self.movers.values():
            self.lines += mover.wait(tick, until)
        return tuple(sorted(self.lines, key=when)), MotionOutcome(until)

    def _rest(self, mover: Mover, tick: int, until: float, *, stays: bool = False) -> None:
        """Rest until then: in the centre of the region, unless the robot ``stays`` where it has
        acted."""
        if mover.robot in self._due and not stays:
            self._due.discard(mover.robot)
            self.lines += mover.resume(tick)
        if until > mover.time + SLACK:
            self.lines += mover.halt(tick)
            self.lines += mover.wait(tick, until)


def when(line: Line) -> tuple[float, int]:
    """Order by time; at the same time ends come before beginnings."""
    if isinstance(line, Release):
        return line.t, 0
    if isinstance(line, Measured):
        return line.rows[0].t, 2
    time = line.t0 if hasattr(line, "t0") else line.t
    return time, 1 if isinstance(line, Reserve) else 2


def _done(
    team: Mapping[str, Mover],
    actions: Sequence[TimedAction],
    tick: int,
    lasting: float,
    pause: float,
    end: float,
) -> tuple[list[Line], float]:
    """Return the lines of robots that carry out actions one after the other, the first after a
    ``pause``, each for ``lasting`` seconds, the last until ``end`` but for rounding; and when all
    are done."""
    lines: list[Line] = []
    over = max((mover.time for mover in team.values()), default=0.0)
    for number, act in enumerate(actions):
        group = [mover for name, mover in team.items() if name in act.robots]
        for mover in group:
            if number and actions[number - 1].region == mover.region != act.region:
                lines += mover.resume(tick)
            lines += mover.face(tick, act.region)
        start = max([over, *(mover.time for mover in group)]) + (0.0 if number else pause)
        over = start + lasting
        if abs(over - end) < SLACK:
            over = end
        for mover in group:
            lines += mover.wait(tick, over)
            times = (min(start, over), over)
            what = (act.action, act.obstacle, act.region)
            lines.append(Action(mover.robot, tick, *what, *times))
    return lines, over


def _step_end(mover: Mover, step: Crossing) -> tuple[float, bool]:
    """Return the end of a step that would begin now, and whether it includes walking."""
    ahead = copy(mover)
    moved = ahead.move(step)
    return ahead.time, any(isinstance(piece, Segment) for piece in moved)


def _slower(piece: Moving, begin: float, factor: float) -> Moving:
    """Return the same path, slower by a factor from ``begin`` on."""
    assert isinstance(piece, Flight), "a walker rests first"
    t0, t1 = (begin + (t - begin) * factor for t in (piece.t0, piece.t1))
    parts = tuple(_stretched(part, factor) for part in piece.parts)
    return replace(piece, parts=parts, t0=t0, t1=t1)


def _stretched(part: Curve, factor: float) -> Curve:
    found = {
        name: tuple(c / factor**power for power, c in enumerate(value))
        for name, value in asdict(part).items()
        if isinstance(value, tuple)
    }
    return replace(part, seconds=part.seconds * factor, **found)
