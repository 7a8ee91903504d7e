"""The state of the run at a trace line, replayed from the lines before it alone.

Rules examine a situation before a line takes effect, and again when a turn is over. After a broken
rule the situation follows the trace, so that one fault is not reported forever."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from typing import TypeVar

from safenav.audit.grid import Grid
from safenav.audit.passes import LIVE
from safenav.audit.progress import Progress
from safenav.trace.objective import Objective
from safenav.trace.records import (
    Act,
    Acted,
    Appeared,
    Arrive,
    Assumption,
    Backtrack,
    Belief,
    Blocked,
    Depart,
    Discovered,
    Goal,
    Gone,
    Hold,
    Inputs,
    Move,
    NewObjective,
    Operator,
    Ordered,
    Outcome,
    Pop,
    Push,
    Record,
    Reopened,
    Request,
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
    ActResult,
    BlockReason,
    ChangeCause,
    Ending,
    Form,
    Heading,
    HoldReason,
    MoveEnd,
    OperatorDeed,
    Region,
)

L = TypeVar("L", bound=Record)

RESYNTHESIS = "resynthesis"
WITHOUT_EFFECT = (ActResult.FAILED, ActResult.NOTHING)


_CHANGES = (Violation, Resolved, Gone, Appeared, Blocked, Reopened, Service, NewObjective)
"""Records after which an obstacle that was set aside may be served again."""


class Status(Enum):
    """Status of an obstacle."""

    ABSENT = auto()
    """It has not appeared yet, or has disappeared."""
    UNRESOLVED = auto()
    RESOLVED = auto()
    UNTRAVERSABLE = auto()
    """Resolved, and found to be a permanent obstacle."""
    GIVEN_UP = auto()
    """No robot can resolve it: the robots that it blocks plan around it."""


@dataclass(frozen=True)
class StackEntry:
    """An entry of the objective stack: helpers, requester and obstacle; ``before``: the objectives
    that it stores, those before the push."""

    obstacle: str | None
    requester: str | None
    helpers: tuple[str, ...]
    line: int
    before: Mapping[str, Objective] = field(default_factory=dict)


@dataclass
class Turn:
    """One robot's turn, or (robot None) what happens before the first.

    ``origin``, ``on_the_way`` (from an earlier turn) and ``progress`` are the robot's when the turn
    began, ``objectives`` those of the whole team. ``final``: only the outcome comes after it.
    ``torn``: the run ended from outside, or the trace breaks off, so that lines may be missing
    here. ``failed``: live, a step has ended here otherwise than it should."""

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
    failed: bool = False
    advanced: set[str] = field(default_factory=set)
    """Obstacles of which a need was met in this turn, as far as that follows from the moves."""
    met: dict[tuple[str, int], frozenset[str]] = field(default_factory=dict)
    """The needs of obstacles that were met in this turn, with the robots that met them; for the
    last need of each, the robots that could have met it."""

    def all(self, kind: type[L]) -> list[L]:
        return [record for record in self.records if isinstance(record, kind)]

    def first(self, kind: type[L]) -> L | None:
        return next((record for record in self.records if isinstance(record, kind)), None)


def helpers_of(record: Request | Push | Pop) -> tuple[str, ...]:
    """Return all helpers that a line names."""
    return record.helpers or (() if record.helper is None else (record.helper,))


class Situation:
    """The team, the obstacles and the stack, as of some line."""

    def __init__(self, trace: Trace) -> None:
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
        self.ahead = dict.fromkeys(robots, 0)
        """Number of targets that each robot has met of an objective that ends, whatever it did
        meanwhile."""
        self.toward: dict[str, Region | None] = dict.fromkeys(robots)
        self.signals: dict[str, Signal] = {}
        """Each robot's last command inputs, where robots are driven by command inputs."""
        self.beliefs: dict[tuple[str, str], Belief] = {}
        self.stack: list[StackEntry] = []
        self.requests: dict[str, dict[str, Region]] = {}
        """The open requests, the oldest first: obstacle -> requesters, each with the region where
        it waits."""
        self.given_up: dict[str, dict[str, Region]] = {}
        """The requests for obstacles that are given up."""
        self.permanent: set[str] = set()
        """The obstacles of which an operator says that they stay."""
        self.aside: set[str] = set()
        """The obstacles that no joint state serves until something changes."""
        self.helping: dict[str, frozenset[str]] = {}
        """The helpers of each obstacle that were named last."""
        self.listed = {
            name: [o for o in self.header.obstacles if o.name == name] or [obstacle]
            for name, obstacle in self.obstacles.items()
        }
        """All obstacles of one name: an obstacle may reappear."""
        self.status = {
            name: Status.ABSENT if all(o.from_ for o in listed) else Status.UNRESOLVED
            for name, listed in self.listed.items()
        }
        self.stage = dict.fromkeys(self.obstacles, 0)
        self.done: dict[str, set[str]] = {name: set() for name in self.obstacles}
        self.group: dict[str, frozenset[str]] = {}
        """The robots that met the last need of each obstacle."""
        self.introduced = {obstacle.name for obstacle in self.header.obstacles}
        """Obstacles that the scenario lists, or that a line has described."""
        self.discovered: set[str] = set()
        self.out: set[str] = set()
        self.orders: set[str] = set()
        """Obstacles that were ordered, so that no robot has made the request."""
        self.inputs = {each.name: False for each in self.header.inputs or ()}
        self.base = dict(self.objectives)
        """The objectives of the header, which robots have while no input gives them another."""
        self._kept: dict[str, int] = {}
        """The robots that are out of service."""
        self.form: dict[tuple[str, Objective], Form | None] = {}
        self.live = trace.header.clock == LIVE
        self.under_way: dict[str, Depart] = {}
        """Live: the step of each robot that has not ended."""
        self.acting: dict[str, Act] = {}
        """Live: the action of each robot that has not ended."""
        self.awaiting: set[str] = set()
        """Live: the robots that wait for a strategy."""
        self.ended: dict[str, Arrive] = {}
        """Live: the end of each robot's step that its next move shows."""
        self.outcome: Outcome | None = None
        self.turn = Turn(0, None, self.header_line, dict(self.objectives))

    def has_heading(self, robot: str) -> bool:
        return self.header.robots[robot].mobility == "heading"

    def taken_by(self, robot: str) -> set[Region]:
        """Return the regions that a robot occupies: two while it is in transit."""
        toward = self.toward[robot]
        return {self.region[robot]} if toward is None else {self.region[robot], toward}

    def zones(self, one: str, other: str) -> list[frozenset[Region]]:
        """Return the sets of regions in which two robots are never together."""
        return [
            frozenset(zone.regions)
            for zone in self.header.never_together or ()
            if {one, other} <= {*zone.robots}
        ]

    def conflict(self, one: str, other: str) -> bool:
        """Return whether two robots must never share a region."""
        robots = self.header.robots
        listed = robots[one].conflicts
        if listed is None:
            return robots[one].layer == robots[other].layer
        return other in listed

    def capable(self, obstacle: str) -> set[str]:
        """Return the robots that have the action which the obstacle needs next, and what the same
        robots must do after it: only those of the need before it where it takes the same."""
        robots, needs = self.header.robots, self.obstacles[obstacle].all_needs
        stage = min(self.stage[obstacle], len(needs) - 1)
        actions = self.obstacles[obstacle].actions(stage)
        able = {name for name, robot in robots.items() if actions <= robot.capabilities}
        return able & self.group[obstacle] if needs[stage].same else able

    def alternates(self, robot: str) -> bool:
        """Return whether the robot was synthesized for its objective as plain alternation."""
        return self.form.get((robot, self.objectives[robot])) is Form.ALTERNATION

    def need(self, obstacle: str) -> NeedHeader:
        """Return the obstacle's next need, or its last one if all are met."""
        needs = self.obstacles[obstacle].all_needs
        return needs[min(self.stage[obstacle], len(needs) - 1)]

    def too_few(self, obstacle: str) -> list[bool]:
        """Return for each unmet need whether fewer robots have its action, and what the same robots
        must do after it, than it takes."""
        about, robots = self.obstacles[obstacle], self.header.robots.values()
        left = range(self.stage[obstacle], len(about.all_needs))
        return [
            sum(about.actions(k) <= robot.capabilities for robot in robots)
            < about.all_needs[k].robots
            for k in left
        ]

    def stopped_by(self, obstacle: str) -> set[str]:
        """Return the robots that the obstacle physically stops."""
        return set(self.obstacles[obstacle].blocks & self.header.robots.keys())

    def blocked_by(self, obstacle: str) -> set[str]:
        """Return the robots that must not enter the obstacle's region now: those that it stops,
        except one that resolves it by entering, as long as it may yet be resolved."""
        stopped = self.stopped_by(obstacle)
        if self.status[obstacle] is not Status.UNRESOLVED:
            return stopped
        return {name for name in stopped if not self._resolves_by_entering(obstacle, name)}

    def _resolves_by_entering(self, obstacle: str, robot: str) -> bool:
        """Return whether one need is left, which the robot alone meets in the obstacle's own
        region."""
        left = self.obstacles[obstacle].all_needs[self.stage[obstacle] :]
        return (
            len(left) == 1
            and left[0].robots == 1
            and not left[0].same
            and self.obstacles[obstacle].region in left[0].regions
            and left[0].action in self.header.robots[robot].capabilities
        )

    def is_cut_short(self) -> bool:
        """Return whether the run ended within this turn, so that the rest of it never happened."""
        if not self.turn.final:
            return False
        endings = (Ending.COMPLETED, Ending.TICK_LIMIT)
        return self.outcome is None or self.outcome.outcome not in endings

    def is_requested(self, obstacle: str) -> bool:
        """Return whether a request for the obstacle is on the stack and not yet fulfilled."""
        return any(entry.obstacle == obstacle for entry in self.stack)

    def entry_of(self, record: Pop) -> StackEntry | None:
        """Return the entry that a pop drops: that of its request, wherever it is in the stack."""
        why = (record.obstacle, record.requester, helpers_of(record))
        entries = reversed(self.stack)
        return next((e for e in entries if (e.obstacle, e.requester, e.helpers) == why), None)

    def _drop(self, record: Pop) -> None:
        """Remove an entry from the stack, even if it is not exactly the one that the line names."""
        found = [e for e in self.stack if e.obstacle == record.obstacle] or self.stack
        dropped = self.entry_of(record) or (found[-1] if found else None)
        if dropped is not None:
            self.stack.remove(dropped)

    def obstacles_at(self, region: Region) -> list[ObstacleHeader]:
        return [o for o in self.obstacles.values() if o.region == region]

    def show(self, region: Region) -> str:
        return self.grid.show(region)

    def starts_turn(self, record: Record) -> bool:
        """Return whether a new turn begins with this line: its violation, or else its move (or, in
        a trace that is wrong, a backtrack from nothing)."""
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
        if isinstance(record, _CHANGES):
            self.aside.clear()
        match record:
            case Hold():
                waits = record.why is HoldReason.SYNTHESIS
                (self.awaiting.add if waits else self.awaiting.discard)(record.robot)
            case Depart():
                self.awaiting.discard(record.robot)
                self.under_way[record.robot] = record
            case Arrive():
                self.under_way.pop(record.robot, None)
                self.ended[record.robot] = record
            case Act():
                self.acting[record.robot] = record
            case Acted():
                self.acting.pop(record.robot, None)
                self._perform(record.robot, record.results)
            case Reopened():
                self.status[record.obstacle] = Status.UNRESOLVED
                self.requests[record.obstacle] = self.given_up.pop(record.obstacle, {})
            case Operator() if (
                record.deed is OperatorDeed.PERMANENT and record.obstacle is not None
            ):
                self.permanent.add(record.obstacle)
            case Operator() if record.region is not None and record.robot is not None:
                self.region[record.robot] = record.region
                self.heading[record.robot] = record.heading
                self.toward[record.robot] = None
            case Move():
                self.region[record.robot] = record.to
                self.heading[record.robot] = record.heading
                self.toward[record.robot] = record.toward
                if record.signal is not None:
                    self.signals[record.robot] = record.signal
                self._wait_here(record.robot)
                ended = self.ended.pop(record.robot, None)
                self.turn.failed = ended is not None and ended.result is not MoveEnd.ARRIVED
                if not self.live:
                    self._perform(record.robot, {})
            case Belief():
                self.beliefs[record.robot, record.of] = record
            case Violation():
                self.discovered.add(record.obstacle)
                requesters = self.requests.setdefault(record.obstacle, {})
                requesters.pop(record.robot, None)
                requesters[record.robot] = self.region[record.robot]
                closed = self.status[record.obstacle] in (Status.RESOLVED, Status.ABSENT)
                if self.external and closed:  # a door has fallen shut again
                    self.status[record.obstacle] = Status.UNRESOLVED
                    self.stage[record.obstacle] = 0
                    self.done[record.obstacle].clear()
            case Discovered():
                self.introduced.add(record.obstacle.name)
            case Resolved():
                self.stage[record.obstacle] = len(self.obstacles[record.obstacle].all_needs)
                self.requests.pop(record.obstacle, None)
                gone = record.traversable is not False
                self.status[record.obstacle] = Status.RESOLVED if gone else Status.UNTRAVERSABLE
                for progress in self.progress.values():
                    progress.recount()
            case Appeared():
                self.requests.pop(record.obstacle, None)
                self.status[record.obstacle] = Status.UNRESOLVED
                self.stage[record.obstacle] = 0
                self.done[record.obstacle].clear()
                self.discovered.discard(record.obstacle)
                self.orders.discard(record.obstacle)
            case Ordered():
                self.requests[record.obstacle] = {}
                self.discovered.add(record.obstacle)
                self.orders.add(record.obstacle)
            case Truth():
                changed = replace(self.obstacles[record.obstacle], traversable=record.traversable)
                self.obstacles[record.obstacle] = changed
            case NewObjective():
                robots = dict(self.header.robots)
                robots[record.robot] = replace(robots[record.robot], objective=record.objective)
                self.header = replace(self.header, robots=robots)
                self._count_ahead(record)
                if record.at_once:
                    self.objectives[record.robot] = record.objective
                    self.progress[record.robot].reset(record.objective, record.line)
            case Inputs():
                self.inputs = dict(record.values)
            case Service():
                if record.cause is ChangeCause.BATTERY and not record.active:
                    self._asks_for(record.robot)
                (self.out.discard if record.active else self.out.add)(record.robot)
            case Gone():
                self.requests.pop(record.obstacle, None)
                self.status[record.obstacle] = Status.ABSENT
                self.discovered.discard(record.obstacle)
            case Blocked():
                self.given_up[record.obstacle] = self.requests.pop(record.obstacle, {})
                untraversable = record.reason is BlockReason.UNTRAVERSABLE
                self.status[record.obstacle] = (
                    Status.UNTRAVERSABLE if untraversable else Status.GIVEN_UP
                )
            case Request():
                if record.aside:
                    self.aside.add(record.obstacle)
                self.helping[record.obstacle] = frozenset(helpers_of(record))
            case Push():
                helpers = helpers_of(record)
                self.stack.append(
                    StackEntry(
                        record.obstacle,
                        record.requester,
                        helpers,
                        record.line,
                        dict(self.objectives),
                    )
                )
                self._put_in_force(record.objectives, record.line)
            case Pop():
                self._drop(record)
                self._put_in_force(record.objectives, record.line)
            case Told():
                self._put_in_force({record.robot: record.objective}, record.line)
            case Synthesis():
                self.form[record.robot, record.objective] = record.form
                always_own = record.places is not None  # a strategy of assignable goals
                if record.node is not None and not always_own:  # it was installed
                    self._put_in_force({record.robot: record.objective}, record.line)
                if record.tick > 0:
                    robot = record.robot
                    self.progress[robot].reset(self.objectives[robot], record.line)
            case Assumption():
                self.progress[record.robot].reset(self.objectives[record.robot], record.line)
            case Goal():
                own = self.objectives[record.robot] == self.header.robots[record.robot].objective
                if own and record.goal == self.ahead[record.robot]:
                    self.ahead[record.robot] += 1
                met = self.progress[record.robot]
                if met.reset_line < self.turn.line:
                    met.meet(record)
                else:  # counted by the objective before the reset, or by that after it
                    met.last_round = record.round
            case _:
                pass

    def finish_turn(self, last: bool) -> None:
        """Note of the turn that is over whether it was the last of the trace."""
        self.turn.final = last
        from_outside = (Ending.INTERRUPTED, Ending.ERROR)
        self.turn.torn = last and (self.outcome is None or self.outcome.outcome in from_outside)

    def due(self, robot: str) -> Objective:
        """Return the objective that the inputs give to a robot now."""
        listed = self.header.robots[robot].when or ()
        return next((w.objective for w in listed if self.inputs.get(w.input)), self.base[robot])

    def _count_ahead(self, record: NewObjective) -> None:
        """Count the targets met of an objective that ends: one resumed after an input continues."""
        robot, before = record.robot, self.ahead[record.robot]
        self.ahead[robot] = 0
        if record.cause is ChangeCause.INPUT and record.objective == self.base[robot]:
            self.ahead[robot] = self._kept.pop(robot, 0)
        elif record.cause is ChangeCause.INPUT:
            self._kept.setdefault(robot, before)

    def standing(self, obstacle: str) -> set[str]:
        """Return the robots that have the action that the obstacle needs next and stand where it is
        performed."""
        regions = self.need(obstacle).regions
        able = self.capable(obstacle) - self.under_way.keys()
        return {robot for robot in able if self.region[robot] in regions}

    def _asks_for(self, robot: str) -> None:
        """Note that a robot whose charge is used up asks for the obstacle that appeared there."""
        for flat in self.turn.all(Appeared)[-1:]:
            self.discovered.add(flat.obstacle)
            self.requests[flat.obstacle] = {robot: self.region[robot]}

    def _wait_here(self, robot: str) -> None:
        """Note that a robot that encounters an obstacle waits where it has backed up to."""
        violation = self.turn.first(Violation)
        if violation is not None and robot in self.requests.get(violation.obstacle, ()):
            toward = self.toward[robot]
            here = self.region[robot] if toward is None else toward
            self.requests[violation.obstacle][robot] = here

    def _perform(self, robot: str, results: Mapping[str, ActResult]) -> None:
        """Note what the robot does where it stands: its part in the needs that are next, unless its
        result was none. A need that is met gives way to the next."""
        for name, obstacle in self.obstacles.items():
            if results.get(name) in WITHOUT_EFFECT:
                continue
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
            if len(group) < need.robots or last:
                return
            self.group[name] = frozenset(group)
            self.stage[name] += 1
            self.done[name].clear()
            self.turn.advanced.add(name)

    def _put_in_force(self, objectives: Mapping[str, Objective], line: int) -> None:
        for robot, objective in objectives.items():
            if self.objectives[robot] != objective:
                self.objectives[robot] = objective
                self.progress[robot].reset(objective, line)
