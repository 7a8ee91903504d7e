"""Conversion of a trace to a ``Replay``.

``safenav.trace`` reads the lines; this module arranges them by tick. It checks only the
requirements of a picture (the judge checks the run itself): regions on the map, robots and
obstacles that the header names, one move for each robot and tick. The ticks of a live run are the
instants of its events. A trace that was cut off is shown up to its last complete tick."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.outcome import Verdict
from safenav.report.replay.changes import Changes
from safenav.report.replay.charges import TracedCharges
from safenav.report.replay.obstacle_history import ObstacleHistory
from safenav.report.replay.robot_paths import ContradictionError, RobotPaths
from safenav.report.replay.timeline import (
    Event,
    Replay,
    RobotBelief,
    RobotProgress,
    Slack,
    StackRow,
    StoryKind,
)
from safenav.scenario.objective import Ltl, Objective, TargetObjective
from safenav.scenario.settings import Clock, Exclusion
from safenav.trace import records, setting
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.reading import Trace, read_trace
from safenav.trace.told_objective import objective_of
from safenav.trace.vocabulary import ActResult, DeadlineVerdict, MoveEnd
from safenav.trace.wording import Wording
from safenav.world.map import RegionMap

STORY = frozenset(StoryKind) - {StoryKind.DEADLINE}


def read_replay(path: Path) -> Replay:
    """Return the run of a trace file.

    Raises InputError, with file and line, for a file that is not a trace."""
    return replay_of(read_trace(path))


def replay_of(trace: Trace) -> Replay:
    """Return the run of a trace. Raises InputError if it contradicts itself."""
    line = trace.header.line
    try:
        builder = ReplayBuilder(trace)
        for record in trace.records:
            line = record.line
            builder.add(record)
    except ContradictionError as error:
        raise InputError([Diagnostic(trace.source, line, 1, str(error))]) from error
    replay = builder.replay
    # Events of an incomplete last tick belong to the last complete one.
    replay.events = [replace(e, tick=min(e.tick, replay.last)) for e in replay.events]
    return replay


class ReplayBuilder:
    """Builder of a replay: ``tell`` takes the lines of a trace in order."""

    def __init__(self, trace: Trace) -> None:
        header = self.header = trace.header.scenario
        self._live = trace.header.clock == Clock.LIVE
        try:
            world = RegionMap.from_grid(header.map.grid, header.map.names, header.map.areas)
        except ValueError as error:
            raise ContradictionError(f"the map cannot be used: {error}") from error
        robots = header.robots
        self.paths = RobotPaths(world, robots, live=trace.header.clock is not None)
        self.obstacles = ObstacleHistory(header.obstacles, trace.obstacles.values(), self.paths)
        self.charges = TracedCharges(trace.header)
        self.replay = Replay(
            name=header.name,
            map=world,
            robots=tuple(self.paths.tracks.values()),
            hidden=self.obstacles.hidden,
            statuses=self.obstacles.statuses,
            loads=self.obstacles.loads,
            met=self.obstacles.met,
            objectives={n: Changes.of(objective_of(r.objective)) for n, r in robots.items()},
            progress={name: Changes.of(RobotProgress()) for name in robots},
            version=trace.header.safenav,
            times=self.paths.times,
            charges={name: Changes.of(self._percent(name, 0.0)) for name in self.charges.charge},
            chargers=tuple(self.paths.on_map(one) for one in header.chargers or ()),
            exclusions=tuple(map(self._exclusion, header.never_together or ())),
        )
        self.violation: records.Violation | None = None

    def _exclusion(self, each: setting.ExclusionHeader) -> Exclusion:
        return Exclusion(frozenset(each.robots), frozenset(map(self.paths.on_map, each.regions)))

    @property
    def wording(self) -> Wording:
        actions = {name: found.actions for name, found in self.obstacles.hidden.items()}
        skills = {name: robot.capabilities for name, robot in self.header.robots.items()}
        world, team = self.replay.map, len(skills)
        return Wording(
            world.word, world.place, team=team, actions=actions, skills=skills, live=self._live
        )

    def add(self, line: records.Record) -> None:
        """Add the next line. Raises ContradictionError if it does not fit those before."""
        line = self.paths.timed(line)
        self.charges.take(line)
        for name, charge in self.replay.charges.items():
            charge.put(line.tick, self._percent(name, line.t or 0.0))
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
            case records.Act() if not line.obstacles:
                return None  # on an obstacle unknown to the team
            case records.Violation():
                self.violation = line
            case records.Backtrack() if self.violation is not None:
                self._reword(self.wording.backing_up(self.violation, line))
            case records.Request():
                self._requested(line)
            case records.Met():
                self._event(line, StoryKind.RESOLVED)
            case records.Told():
                self._set_objective(line.tick, line.robot, line.objective)
            case records.Belief():
                self._believe(line)
            case records.Synthesis() if line.verdict is Verdict.REALIZABLE and line.tick:
                self._set_objective(line.tick, line.robot, line.objective)
            case records.NewObjective() if line.at_once:
                self._given(line.tick, line.robot, objective_of(line.objective))
            case records.Plan():
                paths = {n: tuple(region for region, _ in path) for n, path in line.robots.items()}
                self.replay.plans.append((line.tick, paths))
            case records.Deadline():
                self._deadline(line)
            case records.PlanEnd():
                self.replay.plans.append((line.tick, {}))
            case records.End():
                self.replay.ending = line
                self.replay.within = self.paths.end(line.tick)
        if isinstance(line, records.Waiting) and line.until is not None:
            self._event(line, StoryKind.PAUSED)
        elif line.type in STORY:
            self._event(line, StoryKind(line.type))

    def _percent(self, name: str, time: float) -> int:
        """Return the charge of a robot in percent; live: at ``time`` in seconds."""
        return round(100 * self.charges.at(name, time) / self.charges.batteries[name].capacity)

    def _push(self, line: records.Push) -> None:
        # With another helper, the entry is pushed again at the same depth.
        helpers = line.helpers or ((line.helper,) if line.helper else ())
        below = self.replay.stack.now[: max(0, line.depth - 1)]
        self._stacked(line, (*below, StackRow(line.obstacle, line.requester, helpers)))
        self._event(line, StoryKind.PUSH)
        parts = dict.fromkeys(n for n in (line.requester, *helpers) if n is not None)
        self._reword(self.wording.sentence(line) + self.wording.objectives(line, parts))

    def _requested(self, line: records.Request) -> None:
        """Update the helpers of a stack entry: they change with its next need, for example."""
        helpers = line.helpers or ((line.helper,) if line.helper else ())
        frames = (
            replace(row, helpers=helpers) if row.obstacle == line.obstacle else row
            for row in self.replay.stack.now
        )
        self.replay.stack.put(line.tick, tuple(frames))

    def _pop(self, line: records.Pop) -> None:
        frames = [*self.replay.stack.now]
        own = [n for n, row in enumerate(frames) if row.obstacle == line.obstacle]
        mine = [n for n in own if frames[n].requester == line.requester] or own
        if mine:  # at any position of the stack
            del frames[mine[-1]]
        self._stacked(line, tuple(frames[: max(0, line.depth)]))
        self._event(line, StoryKind.POP)

    def _stacked(self, line: records.Push | records.Pop, frames: tuple[StackRow, ...]) -> None:
        self.replay.stack.append((line.tick, frames))
        for name, objective in line.objectives.items():
            self._set_objective(line.tick, name, objective)

    def _reword(self, text: str) -> None:
        """Reword the last event with knowledge from earlier lines."""
        self.replay.events[-1] = replace(self.replay.events[-1], text=text)

    def _believe(self, line: records.Belief) -> None:
        self.paths.known(line.robot)
        self.paths.known(line.of)
        regions = frozenset(self.paths.on_map(region) for region in line.regions)
        beliefs = self.replay.beliefs.setdefault((line.robot, line.of), Changes.of(None))
        beliefs.append((line.tick, RobotBelief(line.seen, regions)))

    def _goal(self, line: records.Goal) -> None:
        self.paths.known(line.robot)
        progress = self.replay.progress[line.robot]
        before = progress.now
        objective = self._objective(line.robot)
        settles = isinstance(objective, TargetObjective) and objective.settles
        last = objective.targets[-1] if isinstance(objective, TargetObjective) else frozenset()
        holding = settles and line.region in last
        rounds = 0 if settles else line.round  # a round per held tick is not shown
        progress.append((line.tick, RobotProgress(rounds, self.paths.on_map(line.region))))
        if not settles or before.reached != line.region:  # continued holding is not an event
            self._event(line, StoryKind.GOAL)
            if holding:
                self._reword(self.wording.holding(line))
            else:
                again = line.round == before.rounds  # reported with its last target
                shown = replace(line, round=0) if again else line
                formulas = isinstance(objective, Ltl)
                self._reword(self.wording.goal(shown, formulas=formulas))

    def _deadline(self, line: records.Deadline) -> None:
        """Add a deadline. Its bar begins when it is set; that of a round begins ``within`` ticks
        before it is due."""
        promises = self.header.promises
        within = {} if promises is None else promises.within
        of = self.wording.obstacle(line.of)
        begun = (one.begin for one in reversed(self.replay.deadlines) if one.of == of)
        if line.verdict is DeadlineVerdict.SET:
            begin = line.tick
        elif line.of in self.paths.tracks:
            begin = max(0, line.due - within.get(line.of, line.due))
        else:
            begin = next(begun, 0)
        verdict = (line.verdict.value, line.due - line.tick)
        self.replay.deadlines.append(Slack(line.tick, of, begin, line.due, *verdict))
        if line.verdict in (DeadlineVerdict.LATE, DeadlineVerdict.LOST):
            self._event(line, StoryKind.DEADLINE)

    def _objective(self, name: str) -> Objective | None:
        return self.replay.objectives[name].now

    def _set_objective(self, tick: int, name: str, traced: TracedObjective) -> None:
        self.paths.known(name)
        objective = objective_of(traced)
        if objective != self._objective(name):
            self._given(tick, name, objective)

    def _given(self, tick: int, name: str, objective: Objective | None) -> None:
        self.paths.known(name)
        self.replay.objectives[name].append((tick, objective))
        self.replay.progress[name].append((tick, RobotProgress()))

    def _event(self, line: records.Record, kind: StoryKind) -> None:
        """Add an event, at the region that its line names, else at that of its obstacle."""
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
        self.replay.events.append(Event(line.tick, kind, text, robot, region, obstacle))
