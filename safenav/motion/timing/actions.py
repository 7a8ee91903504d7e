"""The actions of a run by its trace, in lockstep or live: robots and obstacle of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.setting import NeedHeader
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
                needs = obstacle.all_needs
                number = record.need if isinstance(record, records.Met) else len(needs) - 1
                resolved = isinstance(record, records.Resolved) and obstacle.name in last
                last.discard(obstacle.name)
                if isinstance(record, records.Met) and number == len(needs) - 1:
                    last.add(obstacle.name)
                command = ended.get((record.robot, record.tick), 0 if lockstep else None)
                if resolved or command is None:
                    continue
                takes = number + 1 < len(needs) and bool(needs[number + 1].same)
                team = tuple(_team(trace, record, needs[number], at))
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


def _team(
    trace: Trace, record: records.Met | records.Resolved, need: NeedHeader, at: Mapping[str, int]
) -> Iterator[str]:
    """The robots that fulfil a need: the recorded robot, and the others that are able to, even
    without a request. ``at``: where each robot is."""
    yield record.robot
    robots = trace.header.scenario.robots
    alone = isinstance(record, records.Met) and not need.together
    for name in () if alone else record.robots or ():
        able = at[name] in need.regions and need.action in robots[name].capabilities
        if able and name != record.robot:
            yield name
