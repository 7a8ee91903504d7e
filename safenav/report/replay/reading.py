"""Conversion of a trace to a ``Replay``.

``safenav.audit`` reads the lines; here they are arranged tick by tick. Only the requirements of a
picture are checked (the checker decides whether the run was right): places on the map, robots and
obstacles that the header names, one move for each robot and tick. The ticks of a run in time are
the instants at which something happened. A trace that was cut off is shown up to its last complete
tick."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from msgspec.structs import replace

from safenav.begun import Begun
from safenav.errors import Diagnostic, InputError
from safenav.outcome import Verdict
from safenav.report.replay.obstacle_history import ObstacleHistory
from safenav.report.replay.robot_paths import ContradictionError, RobotPaths
from safenav.report.replay.timeline import (
    Changes,
    Event,
    ObstacleStatus,
    Replay,
    RobotBelief,
    RobotProgress,
    Slack,
    StackRow,
    StoryKind,
)
from safenav.runtime.energy.charges import TracedCharges
from safenav.scenario.objective import Ltl, Objective, TargetObjective
from safenav.trace import records
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.reading import read_trace
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import ActResult, DeadlineVerdict, MoveEnd
from safenav.trace.wording import Wording, objective_of
from safenav.world.map import Region, RegionMap

STORY = frozenset(StoryKind)


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


class ReplayBuilder:
    """A replay in the making: ``tell`` passes it the lines of a trace in their order."""

    def __init__(self, trace: Trace) -> None:
        header = self.header = trace.header.scenario
        try:
            self.map = RegionMap.from_grid(header.map.grid, header.map.names, header.map.areas)
        except ValueError as error:
            raise ContradictionError(f"the map cannot be used: {error}") from error
        robots = header.robots
        self.paths = RobotPaths(self.map, robots, live=trace.header.clock is not None)
        self.obstacles = ObstacleHistory(trace.obstacles.values(), self.paths)
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
        self.plans: list[tuple[int, Mapping[str, tuple[Region, ...]]]] = []
        self.deadlines: list[Slack] = []
        self.violation: records.Violation | None = None
        self.ending: records.End | None = None
        if header.begun is not None:
            self.obstacles.begin(header.begun)
            self._begin(header.begun)

    def _begin(self, begun: Begun) -> None:
        """Take over the rounds of the run that this one continues."""
        for name, done in begun.robots.items():
            told = self._objective(name)
            if not (isinstance(told, TargetObjective) and told.settles):
                self.progress[name].append((-1, RobotProgress(done.rounds)))

    @property
    def wording(self) -> Wording:
        actions = {name: found.actions for name, found in self.obstacles.hidden.items()}
        skills = {name: robot.capabilities for name, robot in self.header.robots.items()}
        return Wording(
            self.map.word, self.map.place, team=len(skills), actions=actions, skills=skills
        )

    def tell(self, line: records.Record) -> None:
        """Add the next line. Raises ContradictionError if it does not fit those before."""
        line = self.paths.timed(line)
        self.charges.take(line)
        self._charges(line.tick, line.t or 0.0)
        self.obstacles.take(line)
        match line:
            case records.Move():
                self.paths.move(line)
            case records.Push():
                return self._push(line)
            case records.Pop():
                return self._pop(line)
            case records.Goal():
                return self._goal(line)
            case records.Depart():
                self.paths.step(line)
            case records.Arrive():
                self.paths.step(line)
                if line.result is not MoveEnd.ARRIVED:
                    self._event(line, StoryKind.FAILURE)
            case records.ActionEnd() if line.reason or ActResult.FAILED in line.results.values():
                self._event(line, StoryKind.FAILURE)
            case records.Late():
                self._event(line, StoryKind.FAILURE)
            case records.Violation():
                self.violation = line
            case records.Backtrack() if self.violation is not None:
                self._reword(self.wording.backing_up(self.violation, line))
            case records.Request():
                self._requested(line)
            case records.Met():
                self._event(line, StoryKind.RESOLVED)
            case records.Told():
                self._told(line.tick, line.robot, line.objective)
            case records.Belief():
                self._believe(line)
            case records.Synthesis() if line.verdict is Verdict.REALIZABLE and line.tick:
                self._told(line.tick, line.robot, line.objective)
            case records.NewObjective() if line.at_once:
                self._given(line.tick, line.robot, objective_of(line.objective))
            case records.Plan():
                ways = {n: tuple(region for region, _ in way) for n, way in line.robots.items()}
                self.plans.append((line.tick, ways))
            case records.Deadline():
                self._deadline(line)
            case records.PlanEnd():
                self.plans.append((line.tick, {}))
            case records.End():
                self.ending = line
        if isinstance(line, records.Waiting) and line.until is not None:
            self._event(line, StoryKind.PAUSED)
        elif line.type in STORY:
            self._event(line, StoryKind(line.type))

    def _charges(self, tick: int, time: float) -> None:
        """Note the charges that have changed; live, those of this time."""
        for name, told in self.percent.items():
            capacity = self.charges.batteries[name].capacity
            level = round(100 * self.charges.at(name, time) / capacity)
            if not told or told[-1][1] != level:
                told.append((tick, level))

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
        self.paths.known(line.robot)
        self.paths.known(line.of)
        regions = frozenset(self.paths.on_map(region) for region in line.regions)
        told = self.beliefs.setdefault((line.robot, line.of), [])
        told.append((line.tick, RobotBelief(line.seen, regions)))

    def _goal(self, line: records.Goal) -> None:
        self.paths.known(line.robot)
        told = self.progress[line.robot]
        before = told[-1][1] if told else RobotProgress()
        objective = self._objective(line.robot)
        settles = isinstance(objective, TargetObjective) and objective.settles
        last = objective.targets[-1] if isinstance(objective, TargetObjective) else frozenset()
        holding = settles and line.region in last
        rounds = 0 if settles else line.round  # ticks on the spot are not rounds to show
        told.append((line.tick, RobotProgress(rounds, self.paths.on_map(line.region))))
        if not settles or before.reached != line.region:  # continued holding is not an event
            self._event(line, StoryKind.GOAL)
            if holding:
                self._reword(self.wording.holding(line))
            else:
                again = line.round == before.rounds  # said with the target that ended it
                shown = replace(line, round=0) if again else line
                formulas = isinstance(objective, Ltl)
                self._reword(self.wording.goal(shown, formulas=formulas))

    def _deadline(self, line: records.Deadline) -> None:
        """A promise begins with its ``set``, a round as long before it is due as it may take."""
        promises = self.header.promises
        within = {} if promises is None else promises.within
        of = self.wording.obstacle(line.of)
        begun = (one.begin for one in reversed(self.deadlines) if one.of == of)
        if line.verdict is DeadlineVerdict.SET:
            begin = line.tick
        elif line.of in self.paths.tracks:
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
        self.paths.known(name)
        objective = objective_of(told)
        if objective != self._objective(name):
            self._given(tick, name, objective)

    def _given(self, tick: int, name: str, objective: Objective | None) -> None:
        self.paths.known(name)
        self.objectives[name].append((tick, objective))
        self.progress[name].append((tick, RobotProgress()))

    def _event(self, line: records.Record, kind: StoryKind) -> None:
        """A line of the story, where it happens: where it says, else at its obstacle."""
        robot: str | None = getattr(line, "robot", None) or getattr(line, "requester", None)
        late = isinstance(line, records.Late)
        obstacle: str | None = None if late else getattr(line, "obstacle", None)
        known = self.obstacles.hidden.get(obstacle or "")
        region = None if known is None else known.region
        match line:
            case records.Violation():
                region = self.paths.on_map(line.proposed)
            case records.Met() | records.Resolved() | records.Arrive():
                region = self.paths.on_map(line.at)
            case records.Goal():
                region = self.paths.on_map(line.region)
        if robot is not None:
            self.paths.known(robot)
        text = self.wording.sentence(line)
        self.events.append(Event(line.tick, kind, text, robot, region, obstacle))

    def replay(self, version: str) -> Replay:
        paths, last, obstacles = self.paths, self.paths.last, self.obstacles
        ended = self.ending is not None and self.ending.tick == last + 1
        if within := ended and paths.times is None:  # the run ended within that tick
            paths.stand()
            last += 1
        return Replay(
            name=self.header.name,
            map=self.map,
            robots=paths.up_to(last),
            hidden=tuple(obstacles.hidden.values()),
            last=last,
            statuses={
                n: Changes.of(ObstacleStatus.HIDDEN, c) for n, c in obstacles.statuses.items()
            },
            objectives={n: Changes.of(c[0][1], c) for n, c in self.objectives.items()},
            progress={n: Changes.of(RobotProgress(), c) for n, c in self.progress.items()},
            stack=Changes.of((), self.stack),
            events=tuple(replace(e, tick=min(e.tick, last)) for e in self.events),
            ending=self.ending,
            version=version,
            within=within,
            times=None if paths.times is None else tuple(paths.times),
            plans=Changes.of({}, self.plans),
            beliefs={pair: Changes.of(None, told) for pair, told in self.beliefs.items()},
            deadlines=tuple(self.deadlines),
            loads={name: Changes.of((), told) for name, told in obstacles.loads.items()},
            met={name: Changes.of(0, told) for name, told in obstacles.met.items()},
            chargers=tuple(self.paths.on_map(one) for one in self.header.chargers or ()),
            charges={name: Changes.of(100, told) for name, told in self.percent.items()},
        )
