"""The reader that builds a run from a trace, the only reader of trace lines for people.

The judge checks the run itself. This reader checks only what pictures require: regions on the map,
robots and obstacles that the header names, one move for each robot and tick. A cut-off trace is
shown up to its last complete tick."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.run import values
from safenav.run.run import Run
from safenav.run.tracks import SAME, ContradictionError, RobotTrack, tracks_of
from safenav.run.wording import Wording
from safenav.scenario.model import OPERATOR_ACTION, Obstacle
from safenav.scenario.objective import Ltl, Objective
from safenav.trace import records
from safenav.trace.file import Trace, read_trace
from safenav.trace.vocabulary import ActResult, DeadlineVerdict, MoveEnd
from safenav.world.map import Region, RegionMap

_KINDS = {
    **{str(kind): kind for kind in values.StoryKind if kind not in ("deadline", "note")},
    **dict.fromkeys(("order", "resumed"), values.StoryKind.NOTE),
    "duty": values.StoryKind.OBJECTIVE,
    "part": values.StoryKind.RESOLVED,
    "late": values.StoryKind.FAILURE,
}
"""The kind of the event of a line."""
_STATUSES = {
    "violation": values.ObstacleStatus.FOUND,
    "reopened": values.ObstacleStatus.FOUND,
    "blocked": values.ObstacleStatus.BLOCKED,
    "resolved": values.ObstacleStatus.RESOLVED,
    "appeared": values.ObstacleStatus.HIDDEN,
    "gone": values.ObstacleStatus.ABSENT,
}
"""The status of the obstacle of a line."""


Line = records.Record
"""A line of a trace, for listeners that only pass it on."""
Beginning = records.Header
Place = Callable[[RegionMap, Region], str]
"""A function that returns the words for an event's region."""


def read_run(path: str | Path) -> Run:
    """Return the run of a trace file.

    Raises InputError, with file and line, for a file that is not a trace."""
    return run_of(read_trace(path))


def run_of(trace: Trace) -> Run:
    """Return the run of a trace. Raises InputError if it contradicts itself."""
    line = trace.header.line
    try:
        reader = RunReader(trace.header)
        for record in trace.records:
            line = record.line
            reader.append(record)
        _refuse_gaps(reader.run)
    except ContradictionError as error:
        raise InputError([Diagnostic(trace.source, line, 1, str(error))]) from error
    run, last = reader.run, reader.run.last
    # An incomplete last tick: its events move to the previous tick, its moves are omitted.
    run.events = [replace(e, tick=min(e.tick, last)) for e in run.events]
    for track in run.robots:
        del track.regions[last + 1 :], track.headings[last + 1 :]
    return run


def _refuse_gaps(run: Run) -> None:
    """Raise ContradictionError if the moves of a robot are missing."""
    longest = max((len(track.regions) for track in run.robots), default=0)
    for track in run.robots:
        if len(track.regions) < longest - 1:
            raise ContradictionError(f"{track.name} has no move in tick {len(track.regions)}")


class RunReader:
    """Reader of a run. ``append`` takes the lines of its trace in order and updates ``run`` after
    each."""

    def __init__(self, header: records.Header, place: Place = RegionMap.place) -> None:
        scenario = self._scenario = header.scenario
        seconds = [0.0] if header.live else None
        tracks = self._tracks = tracks_of(scenario)
        skills = {robot.name: robot.capabilities for robot in scenario.robots}
        self._wording = Wording(scenario.map, place, skills, live=header.live)
        self._acts: dict[int, int] = {}
        self._violation: records.Violation | None = None
        self._modes: set[str] = set()
        """Robots with the objective of an input, whose rounds do not count."""
        self.run = Run(
            name=scenario.name,
            map=scenario.map,
            robots=tuple(tracks.values()),
            version=header.safenav,
            seconds=seconds,
            inputs={each.name: False for each in scenario.inputs},
            chargers=tuple(sorted(scenario.chargers)),
            exclusions=scenario.never_together,
            interrupts=None if scenario.flat is None else scenario.flat.name,
        )
        # Several obstacles can appear in a region one after the other, in any order.
        for each in sorted(scenario.obstacles, key=lambda each: each.appears is not None):
            if each.name not in self.run.hidden:
                self._add(each)

    def _add(self, each: Obstacle) -> None:
        actions = [need.action for need in each.needs]
        self._wording.actions[each.name] = actions
        absent = each.appears or OPERATOR_ACTION in actions
        first = values.ObstacleStatus.ABSENT if absent else values.ObstacleStatus.HIDDEN
        self.run.hidden[each.name] = values.Hidden(
            each.name,
            each.type.name,
            self._on_map(each.region),
            tuple(actions),
            values.Changes.of(first),
            tuple(need.same for need in each.needs[1:]),
            each.ordered,
        )

    @staticmethod
    def beginning(line: records.Record) -> records.Header | None:
        """Return the line if it is the header of a new run, else None."""
        return line if isinstance(line, records.Header) else None

    def append(self, line: records.Record) -> None:
        """Add the next line. Raises ContradictionError if it contradicts earlier lines."""
        if self.run.seconds is not None:
            line = replace(line, tick=self._instant(line.t))
        now = self.run.time(line.tick)
        kind = _KINDS.get(line.type)
        if (obstacle := getattr(line, "obstacle", None)) and line.type in _STATUSES:
            self._status(line.tick, obstacle, _STATUSES[line.type])
        match line:
            case records.Move():
                self._move(line)
            case records.Depart() | records.Arrive() if self.run.seconds is None:
                raise ContradictionError("a run without a clock has no steps in seconds")
            case records.Depart():
                to, seconds = self._on_map(line.to), line.seconds or 0.0
                self._robot(line.robot).depart(line.tick, to, now, seconds)
            case records.Arrive():
                at = self._on_map(line.at)
                self._robot(line.robot).arrive(line.tick, at, line.heading, now)
                if line.result is not MoveEnd.ARRIVED:
                    kind = values.StoryKind.FAILURE
                elif line.reason:
                    kind = values.StoryKind.NOTE
            case records.Violation():
                self._violation = line
            case records.Backtrack() if self._violation is not None:
                told, instead = self.run.events[-1], self._wording.instead(self._violation, line)
                self.run.events[-1] = replace(told, text=f"{told.text}; {instead}")
            case records.Act():
                self._acts[line.command] = line.tick
                kind = kind if line.obstacles else None  # none on an obstacle unknown to the team
            case records.ActionEnd():  # the results can name undiscovered obstacles
                begun = self._acts.pop(line.command, line.tick)
                for name in line.results:
                    self._seen(begun, self.run.hidden.get(name))
                if line.reason or ActResult.FAILED in line.results.values():
                    kind = values.StoryKind.FAILURE
            case records.Push() | records.Pop():
                self._stacked(line)
            case records.Duty():
                for name, objective in line.objectives.items():
                    self._given(line.tick, name, objective)
            case records.NewObjective(at_once=True):
                self._given(line.tick, line.robot, line.objective)
            case records.Belief():
                self._believe(line)
            case records.Service():
                self._robot(line.robot).out.put(line.tick, not line.active)
            case records.Charge():
                self._robot(line.robot).charge.append((line.tick, line.percent))
            case records.Inputs():
                self._switched(line)
            case records.Deadline():
                lost = line.verdict in (DeadlineVerdict.LATE, DeadlineVerdict.LOST)
                kind = values.StoryKind.DEADLINE if lost else values.StoryKind.NOTE
            case records.Waiting(until=float()):
                kind = values.StoryKind.PAUSED
            case records.Operator(robot=str() as robot, region=int() as region):
                self._robot(robot).put(self._on_map(region), line.heading)
            case records.End():
                self._end(line)
            case _:
                self._obstacle(line)
        match line:
            case records.Goal():
                self._goal(line)
            case records.Synthesis():
                self._event(line, values.StoryKind.SYNTHESIS, synthesis=line)
            case _ if kind is not None:
                self._event(line, kind)

    def _robot(self, name: str) -> RobotTrack:
        if name not in self._tracks:
            raise ContradictionError(f"the header has no robot {name}")
        return self._tracks[name]

    def _on_map(self, region: Region) -> Region:
        size = self.run.map.size
        if not 0 <= region < size:
            raise ContradictionError(f"{region} is not a region of the map (0 to {size - 1})")
        return region

    def _instant(self, time: float | None) -> int:
        """Return the index of an instant of a live run. At a new instant all robots keep their last
        poses until later lines move them."""
        seconds = self.run.seconds
        assert seconds is not None
        if time is not None and time > seconds[-1] + SAME:
            seconds.append(time)
            for track in self.run.robots:
                track.stand()
        return len(seconds) - 1

    def _move(self, line: records.Move) -> None:
        """Read a robot's turn in lockstep. Each robot has one such line in each tick."""
        track, to = self._robot(line.robot), self._on_map(line.to)
        due = len(track.regions)
        if line.tick != due:
            expected = f"the next move of {line.robot} is that of tick {due}"
            raise ContradictionError(f"{expected}, not of tick {line.tick}")
        track.move(to, line.heading, None if line.toward is None else self._on_map(line.toward))

    def _end(self, line: records.End) -> None:
        """Read the end of a run. Robots without a turn in its tick stay or remain in transit."""
        run, tick = self.run, line.tick
        run.ending = line
        for track in run.robots:
            if len(track.regions) == tick:
                track.stand()
                if (step := track.transit(tick)) is not None:
                    track.steps[-1] = replace(step, end=tick + 1)

    def _obstacle(self, line: records.Record) -> None:
        """Read a line about an obstacle."""
        run = self.run
        match line:
            case records.Discovered():
                name = line.obstacle.name
                if name not in run.hidden:
                    self._add(line.obstacle)
                if OPERATOR_ACTION in run.hidden[name].actions:  # the obstacle represents a failure
                    self._status(line.tick, name, values.ObstacleStatus.HIDDEN)
            case records.Request():
                helpers = line.helpers
                if helpers:
                    self._status(line.tick, line.obstacle, values.ObstacleStatus.REQUESTED)
                else:  # the request may be an order
                    self._seen(line.tick, self._known(line.obstacle))
                # The helpers of a request may change, for example with the next need.
                rows = run.stack.now
                mine = (
                    replace(row, helpers=helpers) if row.obstacle == line.obstacle else row
                    for row in rows
                )
                run.stack.put(line.tick, tuple(mine))
            case records.Part():
                hidden, who = self._known(line.obstacle), line.robots or (line.robot,)
                self._seen(line.tick, hidden)
                carry = tuple(name for name in hidden.loads.now if name not in who)
                takes = line.need < len(hidden.carried) and hidden.carried[line.need]
                hidden.loads.put(line.tick, (*carry, *who) if takes else carry)
                hidden.met.put(line.tick, line.need + (not line.missing))
            case records.Resolved():
                hidden = self._known(line.obstacle)
                hidden.met.put(line.tick, len(hidden.actions))
                hidden.loads.put(line.tick, ())
                if run.restarts_rounds(line.obstacle):  # rounds count from the last resolution
                    self._restart(line.tick, run.robots)
            case records.Appeared():  # it may have disappeared before
                self._known(line.obstacle).met.put(line.tick, 0)
            case records.Gone():
                self._known(line.obstacle).loads.put(line.tick, ())

    def _known(self, obstacle: str) -> values.Hidden:
        if obstacle not in self.run.hidden:
            raise ContradictionError(f"the header has no obstacle {obstacle}")
        return self.run.hidden[obstacle]

    def _status(self, tick: int, obstacle: str, status: values.ObstacleStatus) -> None:
        self._known(obstacle).status.append((tick, status))

    def _seen(self, tick: int, hidden: values.Hidden | None) -> None:
        """Mark an obstacle on which a robot acts as found, even if no robot has requested it."""
        if hidden is not None and hidden.status.now is values.ObstacleStatus.HIDDEN:
            hidden.status.append((tick, values.ObstacleStatus.FOUND))

    def _restart(self, tick: int, robots: Iterable[RobotTrack]) -> None:
        for track in robots:
            track.progress.put(tick, replace(track.progress.now, rounds=0))

    def _event(
        self, line: records.Record, kind: values.StoryKind, text: str = "", **more: Any
    ) -> None:
        """Add an event at its line's region or, if there is none, at its obstacle's region."""
        robot: str | None = getattr(line, "robot", None) or getattr(line, "requester", None)
        late = isinstance(line, records.Late)
        obstacle: str | None = None if late else getattr(line, "obstacle", None)
        known = self.run.hidden.get(obstacle or "")
        region = None if known is None else known.region
        match line:
            case records.Violation():
                region = self._on_map(line.proposed)
            case records.Part() | records.Resolved() | records.Arrive():
                region = self._on_map(line.at)
            case records.Goal():
                region = self._on_map(line.region)
        if robot is not None:
            self._robot(robot)
        text = text or self._wording.sentence(line)
        self.run.events.append(values.Event(line.tick, kind, text, robot, region, obstacle, **more))

    def _stacked(self, line: records.Push | records.Pop) -> None:
        run, rows, helpers = self.run, [*self.run.stack.now], line.helpers
        if isinstance(line, records.Push):
            # An entry with another helper is pushed again at the same depth.
            rows[max(0, line.depth - 1) :] = [
                values.StackRow(line.obstacle, line.requester, helpers)
            ]
        else:
            own = [n for n, row in enumerate(rows) if row.obstacle == line.obstacle]
            ended = [n for n in own if rows[n].requester == line.requester] or own
            if ended:  # at any position of the stack
                del rows[ended[-1]]
            del rows[max(0, line.depth) :]
        run.stack.append((line.tick, tuple(rows)))

    def _believe(self, line: records.Belief) -> None:
        regions = frozenset(map(self._on_map, line.regions))
        held, of = self._robot(line.robot).beliefs, self._robot(line.of).name
        beliefs = held.setdefault(of, values.Changes.of(None))
        beliefs.append((line.tick, values.RobotBelief(line.seen, regions)))

    def _goal(self, line: records.Goal) -> None:
        track = self._robot(line.robot)
        (last, before), objective = track.progress[-1], track.objectives.now
        settles = objective is not None and objective.settles
        rounds = 0 if settles else line.round  # the rounds of held ticks are not shown
        reached = values.RobotProgress(rounds, self._on_map(line.region))
        track.progress.append((line.tick, reached))
        stays = settles or (before.rounds and line.tick <= last + 1)
        if stays and before.reached == line.region:  # no event for each tick
            return
        new = 0 if line.round == before.rounds else line.round  # report a completed round once
        shown, does = replace(line, round=0 if line.robot in self._modes else new), "reaches"
        if objective and settles and line.region in objective.targets[-1]:
            shown, does = replace(line, round=0), "holds"
        elif isinstance(objective, Ltl):  # the step that leaves a region may meet the goal
            does = f"meets goal {line.goal + 1} of its formulas at"
        self._event(line, values.StoryKind.GOAL, self._wording.goal(shown, does), round=new)

    def _switched(self, line: records.Inputs) -> None:
        """Restart the rounds when an input changes a robot's objective."""
        self.run.inputs |= line.values
        of = ((robot.name, name) for robot in self._scenario.robots for name, _ in robot.when)
        modes = {robot for robot, name in of if line.values.get(name)}
        self._restart(line.tick, map(self._robot, modes ^ self._modes))
        self._modes = modes

    def _given(self, tick: int, name: str, objective: Objective) -> None:
        track = self._robot(name)
        track.objectives.append((tick, objective))
        track.progress.append((tick, values.RobotProgress()))
