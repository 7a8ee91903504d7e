"""Conversion of a trace to a ``Replay``.

``safenav.audit`` reads the lines; here they are arranged tick by tick. Only the requirements of a
picture are checked (the checker decides whether the run was right): places on the map, robots and
obstacles that the header names, one move for each robot and tick. The ticks of a run in time are
the instants at which something happened. A trace that was cut off is shown up to its last complete
tick."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.outcome import Verdict
from safenav.report.replay.timeline import (
    Changes,
    Event,
    Hidden,
    LongStep,
    ObstacleStatus,
    Replay,
    RobotBelief,
    RobotProgress,
    RobotTrack,
    Slack,
    StackRow,
    StoryKind,
)
from safenav.runtime.energy.charges import TracedCharges
from safenav.scenario.objective import Ltl, Objective, TargetObjective
from safenav.trace import records, setting
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.reading import read_trace
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import OPERATOR_ACTION, ActResult, DeadlineVerdict, MoveEnd
from safenav.trace.wording import Wording, objective_of
from safenav.world.map import HEADINGS, Region, RegionMap

SAME = 1e-3
"""Seconds within which two instants are the same."""

STORY = frozenset(StoryKind)


class ContradictionError(Exception):
    """A line that does not fit the header or the lines before it."""


def read_replay(path: Path) -> Replay:
    """Return the run of a trace file.

    Raises InputError, with file and line, for a file that is not a trace."""
    return replay_of(read_trace(path))


def replay_of(trace: Trace) -> Replay:
    """Return the run of a trace. Raises InputError where it contradicts itself."""
    line = trace.header.line
    try:
        telling = ReplayBuilder(trace)
        for record in trace.records:
            line = record.line
            telling.tell(record)
    except ContradictionError as error:
        raise InputError([Diagnostic(trace.source, line, 1, str(error))]) from error
    return telling.replay(trace.header.safenav)


ObstacleLine = (
    records.Violation
    | records.Request
    | records.Resolved
    | records.Reopened
    | records.KnownObstacle
    | records.ObstacleChange
)


class ReplayBuilder:
    """A replay in the making: ``tell`` passes it the lines of a trace in their order."""

    def __init__(self, trace: Trace) -> None:
        header = self.header = trace.header.scenario
        try:
            self.map = RegionMap.from_grid(header.map.grid, header.map.names, header.map.areas)
        except ValueError as error:
            raise ContradictionError(f"the map cannot be used: {error}") from error
        robots = header.robots
        self.tracks = {name: self._track(name, robot) for name, robot in robots.items()}
        self.hidden = {name: self._hidden(found) for name, found in trace.obstacles.items()}
        self.regions = {name: list(track.regions) for name, track in self.tracks.items()}
        self.headings = {name: list(track.headings) for name, track in self.tracks.items()}
        self.statuses: dict[str, list[tuple[int, ObstacleStatus]]] = {n: [] for n in self.hidden}
        self.objectives = {n: [(-1, objective_of(r.objective))] for n, r in robots.items()}
        self.progress: dict[str, list[tuple[int, RobotProgress]]] = {name: [] for name in robots}
        self.charges = TracedCharges(trace.header)
        self.percent: dict[str, list[tuple[int, int]]] = {name: [] for name in self.charges.charge}
        """The level of each robot with a battery, as [from tick, level]."""
        self._charges(0, 0.0)
        self.frames: list[StackRow] = []
        self.stack: list[tuple[int, tuple[StackRow, ...]]] = []
        self.events: list[Event] = []
        self.beliefs: dict[tuple[str, str], list[tuple[int, RobotBelief | None]]] = {}
        self.bound: dict[str, list[Region | None]] = {}
        self.times = None if trace.header.clock is None else [0.0]
        """Seconds of each instant of a live run; None for a run in lockstep, which has ticks."""
        self.steps: dict[str, list[LongStep]] = {name: [] for name in robots}
        """Steps of a live run."""
        self.plans: list[tuple[int, Mapping[str, tuple[Region, ...]]]] = []
        self.deadlines: list[Slack] = []
        self.loads: dict[str, list[tuple[int, tuple[str, ...]]]] = {}
        self.met: dict[str, list[tuple[int, int]]] = {}
        """How many needs of an obstacle with several are met."""
        self._begin(header.begun)
        self.violation: records.Violation | None = None
        self.ending: records.End | None = None

    def _begin(self, begun: setting.BegunHeader | None) -> None:
        """Take over what the run continues."""
        if begun is None:
            return
        for name in begun.closed:
            if name in self.statuses:
                self.statuses[name].append((-1, ObstacleStatus.BLOCKED))
                self.met[name] = [(-1, len(self.hidden[name].actions))]
        for name, groups in begun.met.items():
            self.met[name] = [(-1, len(groups))]
            if name in self.hidden and self.hidden[name].carried[len(groups) - 1]:
                self.loads[name] = [(-1, groups[-1])]
        for name, done in begun.robots.items():
            told = objective_of(self.header.robots[name].objective)
            settles = isinstance(told, TargetObjective) and told.settles
            if not settles:
                self.progress[name].append((-1, RobotProgress(done.rounds)))

    def _track(self, name: str, robot: setting.RobotHeader) -> RobotTrack:
        heading = HEADINGS[robot.heading] if robot.heading is not None else None
        can = tuple(sorted(robot.capabilities))
        if robot.vision is not None and robot.vision < 1:
            raise ContradictionError(f"{name} does not even see the next region")
        place = ((self._on_map(robot.start),), (heading,))
        return RobotTrack(name, robot.model, robot.layer, can, *place, robot.vision)

    def _hidden(self, obstacle: setting.ObstacleHeader) -> Hidden:
        return Hidden(
            obstacle.name,
            obstacle.type,
            self._on_map(obstacle.region),
            tuple(need.action for need in obstacle.all_needs),
            tuple(map(self._on_map, obstacle.resolution_regions)),
            tuple(robot for robot in self.header.robots if robot in obstacle.blocks),
            obstacle.from_ or 0,
            tuple(need.same is True for need in obstacle.all_needs[1:]),
        )

    @property
    def wording(self) -> Wording:
        actions = {name: found.actions for name, found in self.hidden.items()}
        skills = {name: robot.capabilities for name, robot in self.header.robots.items()}
        return Wording(
            self.map.word, self.map.place, team=len(skills), actions=actions, skills=skills
        )

    def tell(self, line: records.Record) -> None:
        """Add the next line. Raises ContradictionError if it does not fit those before."""
        if self.times is not None:
            line = self._timed(line, self.times)
        self.charges.take(line)
        self._charges(line.tick, line.t or 0.0)
        match line:
            case records.Move():
                self._move(line)
            case records.Push():
                return self._push(line)
            case records.Pop():
                return self._pop(line)
            case records.Goal():
                return self._goal(line)
            case records.Depart() | records.Arrive():
                self._step(line)
            case records.ActionEnd() if line.reason or ActResult.FAILED in line.results.values():
                self._event(line, StoryKind.FAILURE)
            case records.Late():
                self._event(line, StoryKind.FAILURE)
            case records.Reopened():
                self._status(line, ObstacleStatus.FOUND)
            case records.Discovered():
                found = self._hidden(line.obstacle)
                if OPERATOR_ACTION in found.actions:  # it stands for a failure: it was not there
                    self.hidden[found.name] = replace(found, since=line.tick)
                self.hidden.setdefault(found.name, found)
                self.statuses.setdefault(found.name, [])
            case records.Violation():
                self.violation = line
                self._status(line, ObstacleStatus.FOUND)
            case records.Backtrack() if self.violation is not None:
                self._reword(self.wording.backing_up(self.violation, line))
            case records.Request():
                self._requested(line)
                known_as = self.statuses.get(line.obstacle, ())
                if line.helper is not None:
                    self._status(line, ObstacleStatus.REQUESTED)
                elif not known_as or known_as[-1][1] is ObstacleStatus.HIDDEN:
                    self._status(line, ObstacleStatus.FOUND)  # an order that has to wait
            case records.Met():
                self._carried(line)
                self._met(line, line.need + 1)
                self._event(line, StoryKind.RESOLVED)
            case records.Resolved():
                self._put_down(line)
                known = self.hidden.get(line.obstacle)
                self._met(line, 0 if known is None else len(known.actions))
                untraversable = line.traversable is False
                status = ObstacleStatus.BLOCKED if untraversable else ObstacleStatus.RESOLVED
                self._status(line, status)
            case records.KnownObstacle():
                self._status(line, ObstacleStatus.BLOCKED)
            case records.Told():
                self._told(line.tick, line.robot, line.objective)
            case records.Belief():
                self._believe(line)
            case records.Synthesis() if line.verdict is Verdict.REALIZABLE and line.tick:
                self._told(line.tick, line.robot, line.objective)
            case records.Appeared():
                self._appear(line)
            case records.Gone():
                self._put_down(line)
                self._status(line, ObstacleStatus.RESOLVED)
            case records.NewObjective() if line.at_once:
                self._known(line.robot)
                told = objective_of(line.objective)
                self.objectives[line.robot].append((line.tick, told))
                self.progress[line.robot].append((line.tick, RobotProgress()))
            case records.Plan():
                ways = {n: tuple(region for region, _ in way) for n, way in line.robots.items()}
                self.plans.append((line.tick, ways))
            case records.Deadline():
                self._deadline(line)
            case records.PlanEnd():
                self.plans.append((line.tick, {}))
            case records.End():
                self.ending = line
        if line.type in STORY:
            self._event(line, StoryKind(line.type))

    def _timed(self, line: records.Record, times: list[float]) -> records.Record:
        """Return the line with the number of its instant; until then all is as it was."""
        if line.t is not None and line.t > times[-1] + SAME:
            times.append(line.t)
            for name in self.tracks:
                self.regions[name].append(self.regions[name][-1])
                self.headings[name].append(self.headings[name][-1])
                steps = self.steps[name]
                if steps and steps[-1].last == len(times) - 2:
                    steps[-1] = replace(steps[-1], last=len(times) - 1)
        return replace(line, tick=len(times) - 1)

    def _charges(self, tick: int, time: float) -> None:
        """Note the charges that have changed; live, those of this time."""
        for name, told in self.percent.items():
            capacity = self.charges.batteries[name].capacity
            level = round(100 * self.charges.at(name, time) / capacity)
            if not told or told[-1][1] != level:
                told.append((tick, level))

    def _step(self, line: records.Depart | records.Arrive) -> None:
        self._known(line.robot)
        if self.times is None:
            raise ContradictionError("a run without a clock has no steps in seconds")
        now, steps = self.times[-1], self.steps[line.robot]
        if isinstance(line, records.Depart):
            end = now + (line.seconds or 0.0)
            steps.append(LongStep(line.tick, line.tick, self._on_map(line.to), now, end))
            return
        if not steps or steps[-1].last < line.tick:
            raise ContradictionError(f"{line.robot} arrives, and is not under way")
        steps[-1] = replace(steps[-1], last=line.tick - 1, end=now)
        if steps[-1].last < steps[-1].first:
            del steps[-1]
        self.regions[line.robot][-1] = self._on_map(line.at)
        self.headings[line.robot][-1] = None if line.heading is None else HEADINGS[line.heading]
        if line.result is not MoveEnd.ARRIVED:
            self._event(line, StoryKind.FAILURE)

    def _move(self, line: records.Move) -> None:
        self._known(line.robot)
        regions, headings = self.regions[line.robot], self.headings[line.robot]
        if line.tick != len(regions):
            expected = f"the next move of {line.robot} is that of tick {len(regions)}"
            raise ContradictionError(f"{expected}, not of tick {line.tick}")
        regions.append(self._on_map(line.to))
        headings.append(HEADINGS[line.heading] if line.heading is not None else None)
        toward = None if line.toward is None else self._on_map(line.toward)
        self.bound.setdefault(line.robot, [None]).append(toward)

    def _push(self, line: records.Push) -> None:
        # The new entry of a replaced helper is pushed at the depth of the one before.
        del self.frames[max(0, line.depth - 1) :]
        helpers = line.helpers or ((line.helper,) if line.helper else ())
        self.frames.append(StackRow(line.obstacle, line.requester, helpers))
        self._objectives(line)
        self._event(line, StoryKind.PUSH)
        parts = dict.fromkeys(n for n in (line.requester, *helpers) if n is not None)
        self._reword(self.wording.sentence(line) + self.wording.objectives(line, parts))

    def _requested(self, line: records.Request) -> None:
        """Other robots may help with an entry of the stack: another need is next, say."""
        helpers = line.helpers or ((line.helper,) if line.helper else ())
        frames = [
            replace(row, helpers=helpers) if row.obstacle == line.obstacle else row
            for row in self.frames
        ]
        if frames != self.frames:
            self.frames = frames
            self.stack.append((line.tick, tuple(frames)))

    def _pop(self, line: records.Pop) -> None:
        own = [n for n, row in enumerate(self.frames) if row.obstacle == line.obstacle]
        mine = [n for n in own if self.frames[n].requester == line.requester] or own
        if mine:  # wherever it is in the stack
            del self.frames[mine[-1]]
        del self.frames[max(0, line.depth) :]
        self._objectives(line)
        self._event(line, StoryKind.POP)

    def _reword(self, text: str) -> None:
        """Reword the last event with knowledge that only the lines before it have."""
        self.events[-1] = replace(self.events[-1], text=text)

    def _believe(self, line: records.Belief) -> None:
        self._known(line.robot)
        self._known(line.of)
        regions = frozenset(self._on_map(region) for region in line.regions)
        told = self.beliefs.setdefault((line.robot, line.of), [])
        told.append((line.tick, RobotBelief(line.seen, regions)))

    def _goal(self, line: records.Goal) -> None:
        self._known(line.robot)
        told = self.progress[line.robot]
        before = told[-1][1] if told else RobotProgress()
        objective = self._objective(line.robot)
        settles = isinstance(objective, TargetObjective) and objective.settles
        last = objective.targets[-1] if isinstance(objective, TargetObjective) else frozenset()
        holding = settles and line.region in last
        rounds = 0 if settles else line.round  # ticks on the spot are not rounds to show
        told.append((line.tick, RobotProgress(rounds, self._on_map(line.region))))
        if not settles or before.reached != line.region:  # continued holding is not an event
            self._event(line, StoryKind.GOAL)
            if holding:
                self._reword(self.wording.holding(line))
            else:
                again = line.round == before.rounds  # said with the target that ended it
                shown = replace(line, round=0) if again else line
                formulas = isinstance(objective, Ltl)
                self._reword(self.wording.goal(shown, formulas=formulas))

    def _carried(self, line: records.Met) -> None:
        known = self.hidden.get(line.obstacle)
        if known is not None and line.need < len(known.carried) and known.carried[line.need]:
            robots = line.robots or (line.robot,)
            self.loads.setdefault(line.obstacle, []).append((line.tick, robots))
        else:
            self._put_down(line)

    def _met(self, line: ObstacleLine | records.Met, needs: int) -> None:
        told = self.met.setdefault(line.obstacle, [])
        if not told or told[-1][1] != needs:
            told.append((line.tick, needs))

    def _put_down(self, line: records.Met | records.Resolved | records.Gone) -> None:
        told = self.loads.get(line.obstacle, [])
        if told and told[-1][1]:
            told.append((line.tick, ()))

    def _appear(self, line: records.Appeared) -> None:
        self._status(line, ObstacleStatus.HIDDEN)
        if line.obstacle in self.met:  # it is back
            self._met(line, 0)
        known = self.hidden[line.obstacle]
        if known.since > 0 and len(self.statuses[line.obstacle]) == 1:
            self.hidden[line.obstacle] = replace(known, since=line.tick)

    def _stand(self, last: int) -> bool:
        """Let robots that took no turn in the tick after ``last`` stand where they were, if the run
        ended within that tick; return whether it did."""
        if self.ending is None or self.ending.tick != last + 1:
            return False
        for name, regions in self.regions.items():
            if len(regions) == last + 1:
                regions.append(regions[-1])
                self.headings[name].append(self.headings[name][-1])
                bound = self.bound.setdefault(name, [None] * (last + 1))
                bound.append(bound[-1])
        return True

    def long_steps(self, robot: str, last: int) -> tuple[LongStep, ...]:
        """Return the steps of a robot that took longer than a tick, up to the tick ``last``."""
        if self.times is not None:
            return tuple(self.steps[robot])
        return _long_steps(self.bound.get(robot, [])[: last + 1])

    def _deadline(self, line: records.Deadline) -> None:
        """A promise begins with its ``set``, a round as long before it is due as it may take."""
        promises = self.header.promises
        within = {} if promises is None else promises.within
        of = self.wording.obstacle(line.of)
        begun = (one.begin for one in reversed(self.deadlines) if one.of == of)
        if line.verdict is DeadlineVerdict.SET:
            begin = line.tick
        elif line.of in self.tracks:
            begin = max(0, line.due - within.get(line.of, line.due))
        else:
            begin = next(begun, 0)
        self.deadlines.append(Slack(line.tick, of, begin, line.due, line.verdict.value))

    def _objective(self, name: str) -> Objective | None:
        return self.objectives[name][-1][1]

    def _objectives(self, line: records.Push | records.Pop) -> None:
        self.stack.append((line.tick, tuple(self.frames)))
        for name, told in line.objectives.items():
            self._told(line.tick, name, told)

    def _told(self, tick: int, name: str, told: TracedObjective) -> None:
        self._known(name)
        objective = objective_of(told)
        if objective != self._objective(name):
            self.objectives[name].append((tick, objective))
            self.progress[name].append((tick, RobotProgress()))

    def _status(self, line: ObstacleLine, status: ObstacleStatus) -> None:
        if line.obstacle not in self.hidden:
            raise ContradictionError(f"the header has no obstacle {line.obstacle}")
        self.statuses[line.obstacle].append((line.tick, status))

    def _known(self, robot: str) -> None:
        if robot not in self.tracks:
            raise ContradictionError(f"the header has no robot {robot}")

    def _on_map(self, region: Region) -> Region:
        if not 0 <= region < self.map.size:
            raise ContradictionError(
                f"{region} is not a region of the map (0 to {self.map.size - 1})"
            )
        return region

    def _event(self, line: records.Record, kind: StoryKind) -> None:
        """A line of the story, where it happens: where it says, else at its obstacle."""
        robot: str | None = getattr(line, "robot", None) or getattr(line, "requester", None)
        late = isinstance(line, records.Late)
        obstacle: str | None = None if late else getattr(line, "obstacle", None)
        known = self.hidden.get(obstacle or "")
        region = None if known is None else known.region
        match line:
            case records.Violation():
                region = self._on_map(line.proposed)
            case records.Met() | records.Resolved() | records.Arrive():
                region = self._on_map(line.at)
            case records.Goal():
                region = self._on_map(line.region)
        if robot is not None:
            self._known(robot)
        text = self.wording.sentence(line)
        self.events.append(Event(line.tick, kind, text, robot, region, obstacle))

    def replay(self, version: str) -> Replay:
        last = min((len(regions) for regions in self.regions.values()), default=1) - 1
        within = self.times is None and self._stand(last)
        last += within
        tracks = tuple(
            replace(
                track,
                regions=tuple(self.regions[name][: last + 1]),
                headings=tuple(self.headings[name][: last + 1]),
                steps=self.long_steps(name, last),
            )
            for name, track in self.tracks.items()
        )
        return Replay(
            name=self.header.name,
            map=self.map,
            robots=tracks,
            hidden=tuple(self.hidden.values()),
            last=last,
            statuses={n: Changes.of(ObstacleStatus.HIDDEN, c) for n, c in self.statuses.items()},
            objectives={n: Changes.of(c[0][1], c) for n, c in self.objectives.items()},
            progress={n: Changes.of(RobotProgress(), c) for n, c in self.progress.items()},
            stack=Changes.of((), self.stack),
            events=tuple(replace(e, tick=min(e.tick, last)) for e in self.events),
            ending=self.ending,
            version=version,
            within=within,
            times=None if self.times is None else tuple(self.times),
            plans=Changes.of({}, self.plans),
            beliefs={pair: Changes.of(None, told) for pair, told in self.beliefs.items()},
            deadlines=tuple(self.deadlines),
            loads={name: Changes.of((), told) for name, told in self.loads.items()},
            met={name: Changes.of(0, told) for name, told in self.met.items()},
            chargers=tuple(self._on_map(one) for one in self.header.chargers or ()),
            charges={name: Changes.of(100, told) for name, told in self.percent.items()},
        )


def _long_steps(bound: Sequence[Region | None]) -> tuple[LongStep, ...]:
    """Return the runs of ticks in which a robot is in transit to the same region."""
    steps: list[LongStep] = []
    for tick, toward in enumerate(bound):
        if toward is None:
            continue
        before = steps[-1] if steps else None
        if before is not None and before.last == tick - 1 and before.toward == toward:
            steps[-1] = replace(before, last=tick, end=tick + 1)
        else:
            steps.append(LongStep(tick, tick, toward, tick - 1, tick + 1))
    return tuple(steps)
