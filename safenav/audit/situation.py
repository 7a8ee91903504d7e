"""The state of the run at a trace line: replayed from the lines before it, and nothing else.

Rules look at a situation before a line takes effect, and again when a turn is over. After a
broken rule the situation follows the trace, so that one fault is not reported for ever.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import TypeVar

from safenav.audit.grid import Grid
from safenav.audit.progress import Progress
from safenav.trace.objective import Objective
from safenav.trace.records import (
    Appeared,
    Assumption,
    Backtrack,
    Belief,
    Blocked,
    Discovered,
    Goal,
    Gone,
    Met,
    Move,
    NewObjective,
    Outcome,
    Pop,
    Push,
    Record,
    Resolved,
    Service,
    Signal,
    Synthesis,
    Told,
    Truth,
    Violation,
)
from safenav.trace.setting import NeedHeader, ObstacleHeader
from safenav.trace.trace import Trace
from safenav.trace.vocabulary import (
    BlockReason,
    Ending,
    Form,
    Heading,
    Region,
)

L = TypeVar("L", bound=Record)

RESYNTHESIS = "resynthesis"


class Status(Enum):
    """What has become of an obstacle."""

    ABSENT = auto()
    """It has not appeared yet, or has gone by itself."""
    UNRESOLVED = auto()
    RESOLVED = auto()
    UNTRAVERSABLE = auto()
    """Resolved, and found to be an obstacle for good."""
    GIVEN_UP = auto()
    """Nobody can resolve it: those whom it blocks plan around it."""


@dataclass(frozen=True)
class StackEntry:
    """An entry of the objective stack: why it was pushed, and what was in force before."""

    obstacle: str | None
    requester: str | None
    helper: str | None
    before: Mapping[str, Objective]
    tick: int
    line: int


@dataclass
class Turn:
    """One robot's turn, or (robot None) what happens before the first.

    ``origin``, ``on_the_way`` (from an earlier turn) and ``progress`` are the robot's when the
    turn began, ``objectives`` those of
    the whole team. ``final``: nothing comes after it but the outcome. ``torn``: the run ended
    from outside, or the trace breaks off, so that lines may be missing here.
    """

    tick: int
    robot: str | None
    line: int
    objectives: Mapping[str, Objective]
    origin: Region | None = None
    on_the_way: bool = False
    progress: Progress | None = None
    records: list[Record] = field(default_factory=list)
    final: bool = False
    torn: bool = False
    advanced: set[str] = field(default_factory=set)
    """Obstacles of which a need was met in this turn, as far as that follows from the moves."""
    met: dict[tuple[str, int], frozenset[str]] = field(default_factory=dict)
    """The needs of obstacles that were met in this turn, and by whom; of the last need of each,
    who could have met it."""

    def all(self, kind: type[L]) -> list[L]:
        return [record for record in self.records if isinstance(record, kind)]

    def first(self, kind: type[L]) -> L | None:
        return next((record for record in self.records if isinstance(record, kind)), None)


class Situation:
    """The team, the obstacles and the stack, as of some line."""

    def __init__(self, trace: Trace) -> None:
        self.derived = trace.header.trace > 1
        """Whether duties are worked out afresh at every event (since version 2), so that a
        stack entry binds nobody for good."""
        self.header = trace.header.scenario
        self.header_line = trace.header.line
        self.grid = Grid(self.header.map)
        self.obstacles = trace.obstacles
        self.external = self.header.world == "external"
        robots = self.header.robots
        self.region: dict[str, Region] = {n: r.start for n, r in robots.items()}
        self.heading: dict[str, Heading | None] = {n: r.heading for n, r in robots.items()}
        self.objectives: dict[str, Objective] = {n: r.objective for n, r in robots.items()}
        self.progress = {n: Progress.at_start(r.objective, r.start) for n, r in robots.items()}
        self.toward: dict[str, Region | None] = dict.fromkeys(robots)
        self.signals: dict[str, Signal] = {}
        """What each robot was told last, where robots are told by signals."""
        self.beliefs: dict[tuple[str, str], Belief] = {}
        self.stack: list[StackEntry] = []
        self.listed = {
            name: [o for o in self.header.obstacles if o.name == name] or [obstacle]
            for name, obstacle in self.obstacles.items()
        }
        """All of one name: an obstacle may come back."""
        self.status = {
            name: Status.ABSENT if all(o.from_ for o in listed) else Status.UNRESOLVED
            for name, listed in self.listed.items()
        }
        self.stage = dict.fromkeys(self.obstacles, 0)
        self._tells_needs = any(
            isinstance(record, Resolved) and record.need is not None for record in trace.records
        )
        self.tells_met = any(isinstance(record, Met) for record in trace.records)
        """Whether the trace has lines of its own for needs that are met."""
        self.done: dict[str, set[str]] = {name: set() for name in self.obstacles}
        self.introduced = {obstacle.name for obstacle in self.header.obstacles}
        """Those that the scenario lists, or that a line has described."""
        self.discovered: set[str] = set()
        self.out: set[str] = set()
        """The robots that are out of service."""
        self.form: dict[tuple[str, Objective], Form | None] = {}
        self.outcome: Outcome | None = None
        self.turn = Turn(0, None, self.header_line, dict(self.objectives))

    def has_heading(self, robot: str) -> bool:
        return self.header.robots[robot].mobility == "heading"

    def taken_by(self, robot: str) -> set[Region]:
        """The regions that a robot takes up: two while it is on its way."""
        toward = self.toward[robot]
        return {self.region[robot]} if toward is None else {self.region[robot], toward}

    def conflict(self, one: str, other: str) -> bool:
        """Whether two robots must never share a region."""
        robots = self.header.robots
        listed = robots[one].conflicts
        if listed is None:
            return robots[one].layer == robots[other].layer
        return other in listed

    def capable(self, obstacle: str) -> set[str]:
        """The robots that have the action which the obstacle needs next."""
        action = self.need(obstacle).action
        return {n for n, r in self.header.robots.items() if action in r.capabilities}

    def alternates(self, robot: str) -> bool:
        """Whether the robot was synthesized for its objective as plain alternation."""
        return self.form.get((robot, self.objectives[robot])) is Form.ALTERNATION

    def need(self, obstacle: str) -> NeedHeader:
        """What the obstacle needs next, or needed last."""
        needs = self.obstacles[obstacle].all_needs
        return needs[min(self.stage[obstacle], len(needs) - 1)]

    def blocked_by(self, obstacle: str) -> set[str]:
        """The robots that must not enter the obstacle's region: those whom its type blocks,
        save those that resolve it by entering, unless it stays for good (DESIGN section 5, step
        2)."""
        listed = self.obstacles[obstacle].blocks & self.header.robots.keys()
        if self.status[obstacle] in (Status.UNTRAVERSABLE, Status.GIVEN_UP):
            return set(listed)
        robots, known = self.header.robots, self.obstacles[obstacle]
        stage = min(self.stage[obstacle], len(known.all_needs) - 1)
        return {name for name in listed if not known.resolved_by_entering(robots[name], stage)}

    def is_last_need(self, record: Resolved) -> bool:
        """Whether the line says that the whole obstacle is resolved, not only one of its needs."""
        count = len(self.obstacles[record.obstacle].all_needs)
        return record.need is None or record.need + 1 >= count

    def is_cut_short(self) -> bool:
        """Whether the run ended within this turn, so that the rest of it never happened."""
        if not self.turn.final:
            return False
        endings = (Ending.COMPLETED, Ending.TICK_LIMIT)
        return self.outcome is None or self.outcome.outcome not in endings

    def is_over(self, obstacle: str | None) -> bool:
        """Whether a request for this obstacle has been answered, one way or the other."""
        return obstacle is None or self.status[obstacle] is not Status.UNRESOLVED

    def is_requested(self, obstacle: str) -> bool:
        """Whether a request for the obstacle is on the stack and not yet answered."""
        return not self.is_over(obstacle) and any(f.obstacle == obstacle for f in self.stack)

    def entry_of(self, record: Pop) -> StackEntry | None:
        """The entry that a pop drops: that of its request, wherever it stands in the stack; if
        there is none, or in traces of version 1, the top one."""
        why = (record.obstacle, record.requester, record.helper)
        if self.derived:
            for entry in reversed(self.stack):
                if (entry.obstacle, entry.requester, entry.helper) == why:
                    return entry
        return self.stack[-1] if self.stack else None

    def obstacles_at(self, region: Region) -> list[ObstacleHeader]:
        return [o for o in self.obstacles.values() if o.region == region]

    def show(self, region: Region) -> str:
        return self.grid.show(region)

    def starts_turn(self, record: Record) -> bool:
        """Whether a new turn begins with this line: its violation, or else its move (or, in a
        trace that is wrong, a backtrack from nothing)."""
        turn = self.turn
        if isinstance(record, Violation):
            return True
        if not isinstance(record, Backtrack | Move):
            return False
        return turn.robot != record.robot or turn.first(Move) is not None

    def begin_turn(self, record: Violation | Backtrack | Move) -> None:
        robot = record.robot
        self.turn = Turn(
            record.tick,
            robot,
            record.line,
            dict(self.objectives),
            self.region[robot],
            self.toward[robot] is not None,
            self.progress[robot].copy(),
        )

    def apply(self, record: Record) -> None:
        """Let a line take effect."""
        if isinstance(record, Outcome):
            self.outcome = record
            return
        self.turn.records.append(record)
        match record:
            case Move():
                self.region[record.robot] = record.to
                self.heading[record.robot] = record.heading
                self.toward[record.robot] = record.toward
                if record.signal is not None:
                    self.signals[record.robot] = record.signal
                self._perform(record.robot)
            case Belief():
                self.beliefs[record.robot, record.of] = record
            case Violation():
                self.discovered.add(record.obstacle)
                if self.external and self.status[record.obstacle] is Status.RESOLVED:
                    # A door has fallen shut again.
                    self.status[record.obstacle] = Status.UNRESOLVED
            case Discovered():
                self.introduced.add(record.obstacle.name)
            case Resolved() if self.is_last_need(record):
                self.stage[record.obstacle] = len(self.obstacles[record.obstacle].all_needs)
                gone = record.traversable is not False
                self.status[record.obstacle] = Status.RESOLVED if gone else Status.UNTRAVERSABLE
                for progress in self.progress.values():
                    progress.recount()
            case Resolved():
                self.stage[record.obstacle] = (record.need or 0) + 1
                self.done[record.obstacle].clear()
            case Appeared():
                self.status[record.obstacle] = Status.UNRESOLVED
                self.stage[record.obstacle] = 0
                self.done[record.obstacle].clear()
                self.discovered.discard(record.obstacle)
            case Truth():
                changed = replace(self.obstacles[record.obstacle], traversable=record.traversable)
                self.obstacles[record.obstacle] = changed
            case NewObjective():
                robots = dict(self.header.robots)
                robots[record.robot] = replace(robots[record.robot], objective=record.objective)
                self.header = replace(self.header, robots=robots)
                if record.at_once:
                    self.objectives[record.robot] = record.objective
                    self.progress[record.robot].reset(record.objective, record.line)
            case Service():
                (self.out.discard if record.active else self.out.add)(record.robot)
            case Gone():
                self.status[record.obstacle] = Status.ABSENT
                self.discovered.discard(record.obstacle)
            case Blocked():
                untraversable = record.reason is BlockReason.UNTRAVERSABLE
                self.status[record.obstacle] = (
                    Status.UNTRAVERSABLE if untraversable else Status.GIVEN_UP
                )
            case Push():
                entry = StackEntry(
                    record.obstacle,
                    record.requester,
                    record.helper,
                    dict(self.objectives),
                    record.tick,
                    record.line,
                )
                self.stack.append(entry)
                self._put_in_force(record.objectives, record.line)
            case Pop():
                dropped = self.entry_of(record)
                if dropped is not None:
                    self.stack.remove(dropped)
                self._put_in_force(record.objectives, record.line)
            case Told():
                self._put_in_force({record.robot: record.objective}, record.line)
            case Synthesis():
                self.form[record.robot, record.objective] = record.form
                always_own = record.places is not None  # a strategy of assignable goals
                if self.derived and record.node is not None and not always_own:  # it was installed
                    self._put_in_force({record.robot: record.objective}, record.line)
                if record.tick > 0:
                    robot = record.robot
                    self.progress[robot].reset(self.objectives[robot], record.line)
            case Assumption():
                self.progress[record.robot].reset(self.objectives[record.robot], record.line)
            case Goal():
                met = self.progress[record.robot]
                if met.reset_line < self.turn.line:
                    met.meet(record)
                else:  # counted by the objective before the reset, or by that after it
                    met.last_round = record.round
            case _:
                pass

    def finish_turn(self, last: bool) -> None:
        """Say of the turn that is over whether it was the last of the trace."""
        self.turn.final = last
        from_outside = (Ending.INTERRUPTED, Ending.ERROR)
        self.turn.torn = last and (self.outcome is None or self.outcome.outcome in from_outside)

    def standing(self, obstacle: str) -> set[str]:
        """Who has the action that the obstacle needs next and stands where it is performed."""
        regions = self.need(obstacle).regions
        return {robot for robot in self.capable(obstacle) if self.region[robot] in regions}

    def _perform(self, robot: str) -> None:
        """Note what the robot does where it stands: its part in the needs that are next. Where
        the trace has no lines of single needs, one that is met makes way for the next."""
        for name, obstacle in self.obstacles.items():
            # Needs of an obstacle that no scenario lists count from its discovery on.
            counted = name in self.introduced or len(obstacle.all_needs) == 1
            if counted and self.status[name] in (Status.UNRESOLVED, Status.GIVEN_UP):
                self._perform_at(robot, name)

    def _perform_at(self, robot: str, name: str) -> None:
        while robot in self.standing(name):
            self.done[name].add(robot)
            need = self.need(name)
            group = self.standing(name) if need.together else self.done[name]
            last = self.stage[name] + 1 >= len(self.obstacles[name].all_needs)
            if len(group) >= need.robots:
                self.turn.met[name, self.stage[name]] = frozenset(group)
            if len(group) < need.robots or last or self._tells_needs:
                return
            self.stage[name] += 1
            self.done[name].clear()
            self.turn.advanced.add(name)

    def _put_in_force(self, objectives: Mapping[str, Objective], line: int) -> None:
        for robot, objective in objectives.items():
            if self.objectives[robot] != objective:
                self.objectives[robot] = objective
                self.progress[robot].reset(objective, line)
