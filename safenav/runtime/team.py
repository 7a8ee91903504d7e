"""The state of a running mission: one ``RobotState`` for each robot, and their shared state.

The mission owns it; the parts of the runtime hold a reference and change it by the methods below,
or field by field where the docstring of the field's owner allows it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from enum import Enum

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.beliefs import Beliefs
from safenav.runtime.duties.reasons import Shortfall
from safenav.runtime.duties.requests import OpenRequest, Requests
from safenav.runtime.duties.settlement import Settled
from safenav.runtime.failures import FailureCounts, stands_for
from safenav.runtime.formulas import graph_of
from safenav.runtime.knowledge import Knowledge
from safenav.runtime.navigation import Planner
from safenav.runtime.progress import Progress
from safenav.runtime.stops import Stops
from safenav.runtime.termination import Conclusion
from safenav.runtime.worlds.protocol import Acted, Ended
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.objective import Objective
from safenav.spec.objective import Memory
from safenav.trace import records
from safenav.trace.header import obstacle_header
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.told_objective import objective_in_trace
from safenav.trace.vocabulary import HoldReason, MovedBy
from safenav.trace.writing import Listener
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.poses import Mask, PoseGraph


class Role(Enum):
    """Current role of a robot."""

    OWN = "its own objective"
    HELPS = "resolves an obstacle"
    WAITS = "waits"
    CHARGES = "goes to a charger, or charges"


class Assignment(Struct, frozen=True):
    """Current assignment of one robot. ``obstacle``: the one that it resolves, if it helps (or will
    once it has charged, or met a target of its own). ``goal``: the poses where it does so or waits
    to (a mask). ``safe_poses``: those that it may go to (a mask; None: all)."""

    role: Role
    objective: Objective
    obstacle: str | None = None
    goal: Mask = 0
    safe_poses: Mask | None = None


class DecidedStep(Struct, frozen=True):
    """A step to ``pose``, or a stay there. ``before``: the values of its specification's variables
    where the robot sets out; ``shown``: regions that its strategy observed as occupied although no
    robot is there; ``why``: the reason for a stay that ``by`` does not give."""

    pose: Pose
    by: MovedBy
    before: Mapping[str, int] = field(default_factory=dict)
    shown: frozenset[Region] = frozenset()
    why: HoldReason | None = None

    @property
    def planned(self) -> bool:
        """Whether it is a step of a joint plan."""
        return self.by is MovedBy.PLAN


class RobotState(Struct):
    """One robot in a run. ``pose``: where it stands, or, in transit, where it set out: until the
    step ends it occupies both regions. ``recalls``: its formula memory after that step. ``own``:
    its progress with its own objective; ``progress``: with its present one (the same object unless
    it has another duty). ``active``: it is in service; otherwise it stands still. ``arriving``:
    goals met by its last step of a joint plan are not counted yet. ``acting``: the robot whose
    action it takes part in, on ``acts_on`` (in lockstep: the known obstacles within its reach at
    its last action); ``asked``: it has been let act since it came here; ``acted``: the result, if
    it must stay for it; ``moved``: where it was moved instead. ``held``: the reason why it must
    stand still. ``stays_for``: the observation for which its strategy last had it stay, with the
    regions ``shown`` as occupied; ``stood``: the moments at which it has decided since it stands
    there. ``mode``: the input that set its present objective; ``base``: the objective before that,
    with its progress. ``came``: the pose from which it entered its region (None: it was put there).
    ``charge``: that of its battery; ``stop``: the pose to which its charge makes it go. ``claims``:
    further regions in which, by a report, it may be: before its turn those named by the end of its
    step, then those in which it is lost that are not closed yet, since others are there; each with
    the robots to which it is to be closed."""

    robot: Robot
    pose: Pose
    own: Progress
    assignment: Assignment
    progress: Progress
    transit: DecidedStep | None = None
    recalls: Mapping[str, int] = field(default_factory=dict)
    begun: bool = False
    active: bool = True
    arriving: bool = False
    acting: str | None = None
    acts_on: tuple[Obstacle, ...] = ()
    asked: bool = False
    acted: Acted | None = None
    moved: Ended | None = None
    stays_for: Hashable = None
    shown: frozenset[Region] = frozenset()
    stood: set[Hashable] = field(default_factory=set)
    held: HoldReason | None = None
    mode: str | None = None
    base: tuple[Objective, Progress, int | None] | None = None
    came: Pose | None = None
    charge: float | None = None
    stop: Pose | None = None
    claims: Mapping[Region, frozenset[str]] = field(default_factory=dict)
    _planner: Planner | None = None

    @property
    def planner(self) -> Planner:
        """Its strategy in execution; there is one from the first synthesis on."""
        assert self._planner is not None
        return self._planner

    @property
    def has_strategy(self) -> bool:
        return self._planner is not None

    def take_over(self, planner: Planner) -> None:
        """Put another strategy in force."""
        self._planner = planner
        self.stood.clear()

    @property
    def name(self) -> str:
        return self.robot.name

    @property
    def serves_later(self) -> bool:
        """Whether it serves an obstacle after a target of its own."""
        return self.assignment.role is Role.OWN and self.assignment.obstacle is not None

    @property
    def too_flat(self) -> bool:
        """Whether its charge does not suffice for a step."""
        battery = self.robot.model.battery
        return battery is not None and self.charge is not None and self.charge < battery.move

    @property
    def next_pose(self) -> Pose:
        """The pose of the robot's next decision: where it stands, or where it arrives."""
        return self.pose if self.transit is None else self.transit.pose

    @property
    def memory(self) -> Memory:
        """The memory of its own objective; for formulas, also while it has another duty."""
        return Memory(self.own.memory.index, self.progress.memory.values)

    @property
    def next_memory(self) -> Memory:
        """The memory in ``next_pose``."""
        return self.memory if self.transit is None else Memory(self.memory.index, self.recalls)

    @property
    def occupied(self) -> frozenset[Region]:
        """The regions that the robot occupies now: two while it is in transit."""
        return frozenset({self.pose.region, self.next_pose.region})

    def assign(self, assignment: Assignment) -> None:
        """Give the robot another assignment, or its own objective again."""
        before = self.progress
        if assignment.role is Role.OWN:
            self.progress = self.own
        elif assignment.objective != self.assignment.objective or self.progress is self.own:
            self.progress = Progress(assignment.objective)
        self.progress.keep_memory(before)
        self.begun = self.begun and assignment.objective == self.assignment.objective
        self.assignment = assignment


class TeamState(Struct):
    """The robots by name, their knowledge, and the trace listeners.

    ``requests``: the stack; ``settled``: the last settlement, None before the first; ``lacks``: the
    shortfalls of obstacles that could not be resolved at some time; ``recorded``: the objectives
    that the trace named last. Only ``safenav.runtime.algorithm.apply`` changes these. ``now``: the
    clock of a live run, None in lockstep; ``failures``: those of its robots; ``deferred``: the
    settlement of a decision that waits for strategies; ``waiting``: the conclusion of a run that
    waits instead of ending, for an operator or a change of the scenario at ``waits_until``
    (``changes_to_come``: whether it has any left), ``outdated`` if a robot has been put in or out
    of service or moved elsewhere since; ``changes``: number of changes on which
    decisions depend, ``moves``: of departures and arrivals; ``emitted``: of records. ``dues``: the
    tick in which a request is due; ``stops``: those of a robot with a battery; ``frees``: whether
    a joint plan may help a robot that has no strategy from its pose. ``inputs``: their values in
    this tick, and in the one before.
    """

    scenario: Scenario
    robots: dict[str, RobotState]
    knowledge: Knowledge
    listeners: tuple[Listener, ...] = ()
    requests: Requests = field(default_factory=Requests)
    lacks: Mapping[str, Shortfall] = field(default_factory=dict)
    settled: Settled | None = None
    recorded: Mapping[str, TracedObjective] = field(default_factory=dict)
    beliefs: Beliefs = field(default_factory=Beliefs)
    introduced: set[str] = field(default_factory=set)
    tick: int = 0
    now: Callable[[], float] | None = None
    failures: FailureCounts = field(default_factory=FailureCounts)
    deferred: Settled | None = None
    waiting: Conclusion | None = None
    waits_until: float | None = None
    outdated: bool = False
    changes: int = 0
    moves: int = 0
    emitted: int = 0
    dues: Callable[[OpenRequest], int | None] = lambda _: None
    stops: Callable[[RobotState], Stops | None] = lambda _: None
    changes_to_come: Callable[[], bool] = lambda: False
    frees: Callable[[str], bool] = lambda _: False
    _known_others: dict[str, tuple[list[RobotState], list[RobotState]]] = field(
        default_factory=dict
    )
    inputs: Mapping[str, bool] = field(default_factory=dict)
    inputs_before: Mapping[str, bool] = field(default_factory=dict)

    @classmethod
    def initial(cls, scenario: Scenario, listeners: Iterable[Listener] = ()) -> TeamState:
        """Every robot at its start with the scenario's objective, and its progress in a continued
        run."""
        robots = {}
        for robot in scenario.robots:
            done = None if scenario.begun is None else scenario.begun.robots.get(robot.name)
            own = Progress(robot.objective)
            if done is not None:
                own = Progress.continued(robot.objective, done)
            role = Assignment(Role.OWN, robot.objective)
            begun = done is not None and not done.uncounted
            robots[robot.name] = RobotState(robot, robot.start, own, role, own, begun=begun)
        team = cls(scenario, robots, Knowledge(scenario), tuple(listeners))
        team.knowledge.barred = team.failures.barred
        team.recorded = team.objectives()
        team.inputs = team.inputs_before = {each.name: False for each in scenario.inputs}
        return team

    def give(self, name: str, objective: Objective, within: int | None, own: Progress) -> None:
        """Give a robot another objective of its own; it pursues it unless it has another duty."""
        robot = self.robots[name]
        robot.robot = replace(robot.robot, objective=objective, within=within)
        self.scenario = replace(self.scenario, robots=tuple(r.robot for r in self.robots.values()))
        robot.own = own
        if robot.assignment.role is Role.OWN:
            robot.planner.node = None  # it needs a strategy for this objective
            safe = robot.assignment.safe_poses
            robot.assignment = Assignment(Role.OWN, objective, safe_poses=safe)
            robot.progress, robot.begun = own, False

    def has_had_turn(self, robot: RobotState) -> bool:
        """Whether a robot has had its turn of tick 1 before the run was continued: it stays until
        that tick ends, and its goals count then."""
        begun = self.scenario.begun
        return begun is not None and self.tick <= 1 and robot.name in begun.had

    @property
    def waits_for_operator(self) -> bool:
        return self.waiting is not None and self.waits_until is None

    @property
    def last_settled(self) -> Settled:
        """The last settlement: there is one from the start of the run on."""
        assert self.settled is not None
        return self.settled

    @property
    def out_of_service(self) -> list[str]:
        """The names of the robots that are out of service."""
        return [name for name, robot in self.robots.items() if not robot.active]

    def has_done_all(self, robot: RobotState) -> bool:
        """Whether a robot has completed its rounds and, if its objective ends, stands at its last
        target."""
        return robot.own.rounds >= self.scenario.until.rounds and self.stands(robot)

    def stands(self, robot: RobotState) -> bool:
        """Whether a robot is not in transit, and certainly where its own objective ends; True if
        that has no end."""
        if not robot.own.objective.settles:
            return True
        known = self.knowledge.obstacles.values()
        lost = (each.region for each in known if stands_for(each, robot.name))
        regions = {*robot.occupied, *robot.claims, *lost}
        return robot.transit is None and all(map(robot.own.stands, regions))

    def rounds_counted(self, robot: RobotState) -> int:
        """The completed rounds of a robot, at most as many as the mission requires."""
        return min(robot.own.rounds, self.scenario.until.rounds)

    @property
    def poses(self) -> dict[str, Pose]:
        """Pose of each robot; in transit, its departure pose."""
        return {name: robot.pose for name, robot in self.robots.items()}

    def objectives(self) -> dict[str, TracedObjective]:
        """The objectives in force, as in a trace."""
        robots = self.robots.items()
        return {name: objective_in_trace(robot.assignment.objective) for name, robot in robots}

    @property
    def live(self) -> bool:
        return self.now is not None

    def emit(self, record: records.Record) -> None:
        if self.now is not None:
            record = replace(record, t=round(self.now(), 9))
        self.emitted += 1
        for listener in self.listeners:
            listener(record)

    def moved(self) -> None:
        """Record that a robot has set out, or its step has ended."""
        self.moves, self.changes = self.moves + 1, self.changes + 1

    def tell_goals(self, robot: RobotState, met: Sequence[int]) -> None:
        """Record goals that a robot has met where it stands."""
        for goal, rounds in robot.progress.counted(met):
            here = robot.pose.region
            self.emit(records.Goal(self.tick, robot.name, goal, here, rounds))

    def restart_counts(self) -> None:
        """Restart all round counts, after a resolution."""
        for robot in self.robots.values():
            robot.own.restart_count()
            robot.progress.restart_count()

    @property
    def time(self) -> float:
        """The tick; in a live run the seconds. The times of obstacles and changes are in this
        unit."""
        return self.tick if self.now is None else self.now()

    @property
    def named(self) -> set[str]:
        """The names of the obstacles that the trace has introduced."""
        return self.introduced | {known.name for known in self.scenario.obstacles}

    def introduce(self, obstacle: Obstacle, truth: bool | None = None) -> None:
        """Record an obstacle that the scenario does not list, when it is encountered or, if the
        truth that resolving it will reveal is known (``truth``), when it appears."""
        if obstacle.name not in self.named:
            self.introduced.add(obstacle.name)
            header = obstacle_header(obstacle, self.scenario, truth)
            self.emit(records.Discovered(self.tick, header))

    def graph(self, robot: RobotState) -> PoseGraph:
        """The poses of a robot and the steps that its guarantees allow."""
        return graph_of(robot.robot, self.scenario.map)

    def rivals(self, robot: Robot) -> list[RobotState]:
        """Return the other robots for which a robot may have to wait."""
        return self._others(robot)[0]

    def in_conflict(self, robot: Robot) -> list[RobotState]:
        """Return the other robots that must never share a region with this one."""
        return self._others(robot)[1]

    def _others(self, robot: Robot) -> tuple[list[RobotState], list[RobotState]]:
        """The robots that one may have to wait for, and those of them in conflict with it."""
        found = self._known_others.get(robot.name)
        if found is None:
            others = [o for o in self.robots.values() if o.name != robot.name]
            rivals = [o for o in others if self.scenario.interfere(robot, o.robot)]
            found = rivals, [o for o in rivals if robot.conflicts(o.robot)]
            self._known_others[robot.name] = found
        return found

    def had_by_others(self, robot: Robot, among: Collection[Region] | None = None) -> set[Region]:
        """The regions that a robot must not enter because of where other robots are; ``among``:
        only these."""
        found = set[Region]()
        if self.scenario.never_together:
            at = {name: other.occupied for name, other in self.robots.items()}
            found |= self.scenario.held(robot.name, at)
        others = self.in_conflict(robot)
        found.update([other.pose.region for other in others])
        found.update([o.transit.pose.region for o in others if o.transit is not None])
        return found if among is None else found.intersection(among)

    def claimed_beside(self, robot: RobotState) -> bool:
        """Return whether, by a report that has no effect yet, another robot may be in an adjacent
        region that is still open to this one. Until then, this robot must not set out."""
        claiming = [o for o in self.robots.values() if o.claims and o is not robot]
        if not claiming:
            return False
        sides = self.scenario.map.neighbours(robot.pose.region)
        beside = {*sides} - self.had_by_others(robot.robot, sides)
        return any(
            region in beside and (not names or robot.name in names)
            for other in claiming
            for region, names in other.claims.items()
        )

    def standing(self) -> dict[str, Region]:
        """The region of each robot that can take part in an action; in a live run, not of those in
        transit."""
        robots = self.robots.items()
        return {n: state.pose.region for n, state in robots if not (self.live and state.transit)}

    def occupied(self) -> frozenset[Region]:
        """Return all occupied regions."""
        return frozenset().union(*(state.occupied for state in self.robots.values()))
