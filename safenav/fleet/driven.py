"""The motion file of a drive: the commands sent as its plan, the measurements as its execution.

Only names and frames are added afterwards: times count from the start of the run, positions from
the corner of the map. A piece of a command that did not bring its robot into the next region
belongs to the departure region, as in the trace.
"""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from typing import TypeVar

from msgspec.structs import replace

from safenav.fleet.file import Station
from safenav.fleet.following import Follower
from safenav.fleet.transport import Located, Places, SentGoal
from safenav.fleet.world import FleetWorld
from safenav.motion import file
from safenav.motion.check.verdict import GAPS
from safenav.motion.making import (
    action_lines,
    end_of,
    floor_of,
    header_of,
    movers_of,
    reservations,
    time_of,
    when,
)
from safenav.motion.mover import Mover
from safenav.motion.timing import actions_of, by_command
from safenav.trace import records
from safenav.trace.file import Trace

ROWS = 200
"""Maximum number of measurements in one line of the file."""
DIGITS = 5
"""Decimals of measured metres, seconds and radians."""
ROUNDING = 1e-6
"""Tolerance in seconds between a time of the trace and the world's clock."""
P = TypeVar("P", bound=file.Piece)
Step = tuple[records.Depart, records.Arrive | None]


def driven_motion(
    trace: Trace, world: FleetWorld, stations: Mapping[str, Station], began: float
) -> file.Motion:
    """Return the motion of a completed drive. ``began``: start of the run on the clock of the
    world, which has a recording.

    Raises UsageError or InputError if a robot's model has no motion in metres.
    """
    goals = world.goals
    places, followers, recording = goals.places, goals.followers, goals.recording
    assert recording is not None
    begun = goals.begun + began
    floor = floor_of(trace)
    movers = movers_of(trace, floor)
    actions = by_command(actions_of(trace)[0])
    lines = [*reservations(trace)]
    for act, acted in trace.acts:
        if acted is not None:
            deeds, times = actions.get(act.command, ()), (time_of(act), time_of(acted))
            lines += action_lines(deeds, act.robots, acted.tick, *times)
    over, steps = end_of(trace), trace.steps
    for name, body in movers.items():
        turns = _Turns(name, steps)
        if name in followers:
            lines += turns.in_steps(_plan(followers[name], body, begun, over))
            for reset in followers[name].resets:
                if 0 <= (t := reset.t - begun) <= over + ROUNDING:
                    lines.append(replace(reset, t=t))
        else:
            mine = (sent for sent in recording.goals if sent.robot == name)
            lines += turns.in_steps([_goal(sent, places, body, begun, over) for sent in mine])
        lines += _measured(name, recording.places.get(name, []), places, begun, over)
    driven = {name: _driven(stations[name], floor.side) for name in movers}
    found = tuple(sorted(lines, key=when))
    return file.Motion(header_of(trace, floor, driven), found, file.MotionOutcome(over))


def _driven(station: Station, side: float) -> dict[str, object]:
    kind = "goals" if station.follow is None else "setpoints"
    return {"driven": kind, "tolerance": station.off(side), "gap": GAPS[kind]}


class _Turns:
    """The steps of one robot. A command belongs to the first step that had not ended when it was
    sent."""

    def __init__(self, name: str, steps: Iterable[Step]) -> None:
        mine = [step for step in steps if step[0].robot == name]
        self._steps = sorted(mine, key=lambda step: step[0].command)
        self._ends = [arrive.t or 0.0 for _, arrive in self._steps if arrive is not None]

    def tick(self, t: float) -> int:
        """Return the tick of the robot's step at time ``t``, or else of its next one."""
        number = min(self._step(t), len(self._steps) - 1)
        return self._steps[number][0].tick if number >= 0 else 0

    def _step(self, t: float) -> int:
        return bisect_right(self._ends, t + ROUNDING)

    def in_steps(self, pieces: Iterable[P]) -> list[P]:
        """Return pieces with their ticks. In each step the last piece that crosses a border becomes
        the step, if the robot arrives beyond it in the trace."""
        found = [replace(piece, tick=self.tick(piece.t0)) for piece in pieces]
        steps: dict[int, list[int]] = {}
        for index, piece in enumerate(found):
            steps.setdefault(self._step(piece.t0), []).append(index)
        for number, indices in steps.items():
            if number >= len(self._steps):
                continue
            depart, arrive = self._steps[number]
            crossing = [i for i in indices if found[i].origin != found[i].to]
            stays = arrive is not None and arrive.at == depart.from_
            last = None if stays or not crossing else crossing[-1]
            for index in indices:
                at = depart.from_ if last is None or index < last else depart.to
                ends = (depart.from_, depart.to) if index == last else (at, at)
                found[index] = replace(found[index], origin=ends[0], to=ends[1])
        return found


def _plan(follower: Follower, body: Mover, begun: float, over: float) -> list[file.Moving]:
    """Return all references sent to a follower in the run, with rest before and after them."""
    follower.end_plan(begun + over)
    sent = [replace(p, t0=p.t0 - begun, t1=p.t1 - begun) for p in follower.plan]
    first = sent[0].t0 if sent else over
    return [*(body.rest(0, first) if first > 0 else ()), *sent]


def _goal(sent: SentGoal, places: Places, body: Mover, begun: float, over: float) -> file.GoalLine:
    goal = sent.goal
    x, y = places.frame.on_map(goal.x, goal.y)
    yaw = None if goal.yaw is None else goal.yaw - places.frame.yaw
    to = places.region(goal.x, goal.y)
    assert to is not None
    origin, body.region = body.region, to
    ends = (sent.begun - begun, over if sent.ended is None else min(over, sent.ended - begun))
    return file.GoalLine(sent.robot, 0, "goal", origin, to, *ends, x, y, yaw, sent.end)


def _measured(
    name: str, heard: Iterable[tuple[float, Located]], places: Places, begun: float, over: float
) -> Iterator[file.Measured]:
    rows = []
    for t, at in heard:
        if 0 <= t - begun <= over + ROUNDING:
            numbers = (*places.frame.on_map(at.x, at.y), at.yaw - places.frame.yaw)
            x, y, yaw = (round(number, DIGITS) for number in numbers)
            rows.append(
                file.Measurement(round(t - begun, DIGITS), round(at.stamp, DIGITS), x, y, yaw)
            )
    for begin in range(0, len(rows), ROWS):
        yield file.Measured(name, tuple(rows[begin : begin + ROWS]))
