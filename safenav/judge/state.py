"""The state of a run at a line. Only ``engine.after`` changes it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import takewhile
from typing import Any, NamedTuple

from safenav.judge.formulas import Pose
from safenav.judge.lines import Line, Objective
from safenav.judge.progress import Progress
from safenav.judge.world import World

EXTERNAL = (
    "Real robots, or a user's world, ran the mission. Their reports are trusted; unreported "
    "obstacles may be absent."
)
"""The reservation about a run whose world is not simulated."""
DECIMALS = 9
"""Decimals of a charge."""
MARGIN = 2e-6
"""The charge that a step may lack, since lines of live runs have rounded times."""
SLOWEST = 20
"""Seconds per tick of the limit if a simulated live run has no limit in seconds."""


@dataclass
class Robot:
    """A robot. ``holds``: the regions that it occupies or may occupy; ``bound``: the region to
    which it is in transit since tick ``began``; ``came``: the region from which it entered its
    present one; ``before``: its pose before its last move; ``given``: the objective that trace
    lines assigned last; ``begun``: the tick in which its round began; ``within``: the ticks that a
    round may take; ``away``, ``was_away``: whether it pursues something else in this round, or did
    in the previous one, so that there is no deadline; ``memories``: the possible memories of its
    formulas (None: not followed); ``recalled``: those before its last step; ``heard``: those with
    the inputs since that step began; ``stands``: the time since which it uses ``charge`` without a
    step (None: in a step); ``filled``: the tick in which its battery was replaced (0: it was not);
    ``kept``: its progress with the objective that it resumes after an input; ``first``: the target
    with which its strategy begins; ``told``: whether a user assigned its objective; ``since``: the
    tick of that assignment; ``acts``: the action in which it takes part; ``acted``: the last action
    that ended, with its end; ``knew``: the obstacles that the team knew when the action began, each
    with its stage; ``met``: the goals that its last step has met, each with its tick; ``turn``: the
    line of its last turn."""

    name: str
    data: Line
    pose: Pose
    holds: frozenset[int]
    own: Objective
    given: Objective
    progress: Progress
    within: int | None
    before: Pose
    begun: int = 0
    away: bool = False
    was_away: bool = False
    bound: int | None = None
    began: int = 0
    came: int | None = None
    moved: int = 0
    charge: float | None = None
    stands: float | None = 0.0
    filled: int = 0
    out: bool = False
    lost: bool = False
    memories: set[int] | None = None
    recalled: set[int] = field(default_factory=set)
    heard: set[int] = field(default_factory=set)
    kept: Progress | None = None
    first: int | None = None
    told: bool = False
    since: int = -1
    acts: Line | None = None
    acted: Line = field(default_factory=Line)
    knew: frozenset[tuple[str, int]] = frozenset()
    met: dict[int, int] = field(default_factory=dict)
    turn: int = 0
    ended: float = -1.0

    @property
    def faces(self) -> bool:
        """Whether the robot's pose includes a heading."""
        return bool(self.data.mobility == "heading")

    @property
    def stays(self) -> bool:
        """Whether the robot is in service and at its last target, where it may stay."""
        return self.settled and not self.out

    @property
    def settled(self) -> bool:
        """Whether the robot is at its last target, in service or not."""
        own, rests = self.own, self.bound is None and not self.lost
        ended = own.settles and (not own.ends or self.progress.ended(own))
        return ended and rests and self.pose[0] in own.last

    def again(self, e: Line, live: bool) -> bool:
        """Return whether an earlier line records the same goal (in turn: any goal) of the same
        step. In a live run only goals of formulas are compared."""
        if live:
            return self.own.kind == "ltl" and e.tick == self.met.get(e.goal)
        return bool(self.met) if self.own.in_turn else e.goal in self.met

    def finishes(self, e: Line, now: float) -> bool:
        """Return whether a goal line belongs to a step or action that the robot has just ended."""
        arrived = self.before != self.pose and e.goal not in self.met and self.ended == now
        return arrived or self.acted.tick == e.tick != self.met.get(e.goal)

    def hears(self, inputs: Mapping[str, bool]) -> set[int]:
        """Return the memories of the robot's formulas with these values of the inputs."""
        stated = {name: inputs.get(name, 0) for name in self.own.formulas.inputs}
        return {*self.own.formulas.remembering(stated)}

    def hear(self, inputs: Mapping[str, bool]) -> None:
        """Add the robot's possible memories with these values of the inputs."""
        if self.memories is not None:
            self.heard |= self.hears(inputs)
            self.memories = self.own.formulas.hearing(self.memories, self.heard)

    def follow(self, inputs: Mapping[str, bool]) -> None:
        """Begin to follow the memories of the robot's formulas, unless there are too many."""
        formulas, self.memories = self.own.formulas, None
        if self.own.kind == "ltl" and formulas.whole:
            self.heard = self.hears(inputs)
            self.memories = self.heard.intersection(formulas.begins(self.pose))


class Need(NamedTuple):
    """A need of an obstacle: ``robots`` of the ``able`` robots do ``action``. Able robots also have
    the actions of later needs for the same robots."""

    action: str
    regions: frozenset[int]
    robots: int
    together: bool
    same: bool
    able: frozenset[str]


class Rest(NamedTuple):
    """The open needs of an obstacle. ``left``: these needs, in order; ``done``: the robots that
    have done their part of the first; ``enters``: the robots that alone can fulfil the last need by
    entering; ``barred``: robots that never act on the obstacle; ``order``: its rank among loads."""

    name: str
    region: int
    blocks: frozenset[str]
    left: tuple[Need, ...]
    enters: frozenset[str]
    order: tuple[str, int, int]
    done: frozenset[str] = frozenset()
    barred: frozenset[str] = frozenset()

    def closes(self, robot: str) -> bool:
        """Return whether a robot must not enter the obstacle's region."""
        return robot in self.blocks and not (len(self.left) == 1 and robot in self.enters)

    def chain(self) -> tuple[Need, ...]:
        """Return the needs after the next one that its robots must also fulfil."""
        return tuple(takewhile(lambda need: need.same, self.left[1:]))

    def takes(self) -> bool:
        """Return whether the robots that fulfil the next need carry a load afterwards."""
        return bool(self.chain()) and not self.left[0].same

    def laden(self) -> frozenset[str]:
        """Return the robots that can take no other load, since they carry the obstacle or have
        taken their part of it."""
        if self.left and self.left[0].same:
            return self.left[0].able
        return self.done if self.takes() and not self.left[0].together else frozenset()

    def advanced(self, group: Iterable[str]) -> Rest:
        """Return the open needs after ``group`` and the robots in ``done`` fulfil the next one."""
        left, met = self.left[1:], self.done.union(group)
        if left and left[0].same:
            left = (left[0]._replace(able=left[0].able & met), *left[1:])
        return self._replace(left=left, done=frozenset())

    def acted(self, group: Iterable[str]) -> Rest:
        """Return the needs that remain open after ``group`` has done its part of the next one."""
        done = self.done.union(group)
        met = self.left[0].together or len(done) >= self.left[0].robots
        return self.advanced(group) if met else self._replace(done=done)


@dataclass
class Obstacle:
    """An obstacle. ``rest``: its open needs; ``group``: the robots that did the last part;
    ``asked``: the robots that have encountered it; ``there``: whether it is present; ``since``: the
    tick in which it last appeared, unless by the scenario; ``shut``: whether it is given up or
    permanent; ``known``: whether the team knows it; ``declared``: whether an operator declared it
    permanent; ``begun``: the line since which its next need has been next and no robot has returned
    to service."""

    name: str
    type: str
    region: int
    blocks: frozenset[str]
    needs: tuple[Need, ...]
    truth: bool | None
    within: int | None
    ordered: bool
    there: bool
    goes: int | None
    rest: Rest
    group: frozenset[str] = frozenset()
    asked: frozenset[str] = frozenset()
    resolved: bool = False
    shut: bool = False
    known: bool = False
    declared: bool = False
    since: int = -1
    begun: int = 0

    @property
    def open(self) -> bool:
        return self.there and not self.resolved

    @property
    def stage(self) -> int:
        """The number of needs that have been fulfilled."""
        return len(self.needs) - len(self.rest.left)

    @property
    def present(self) -> bool:
        return self.there and (self.shut or not self.resolved)

    @property
    def short(self) -> bool:
        """Whether an open need requires more robots with its actions than there are."""
        return any(len(need.able) < need.robots for need in self.needs[self.stage :])

    @property
    def permanent(self) -> bool:
        """Whether the obstacle was found untraversable or declared permanent, not only given up."""
        return self.there and self.shut and (self.resolved or self.declared)

    def begin(self) -> None:
        self.there, self.resolved, self.shut, self.known, self.declared = True, *[False] * 4
        self.rest = self.rest._replace(left=self.needs, done=frozenset())
        self.group = self.asked = frozenset()


class Step(NamedTuple):
    """A move, departure or arrival in one form. The robot was in ``start``. It is now ``at`` a
    region with a ``heading``, in transit to ``bound`` (None: not in transit), and ``holds``
    regions. ``to``: the end of the step; ``strays``: whether it failed or did not end as
    commanded."""

    start: int
    at: int
    heading: str | None
    bound: int | None
    holds: frozenset[int]
    strays: bool

    @property
    def to(self) -> int:
        return self.at if self.bound is None else self.bound


class State:
    """The state at a line of a trace. ``tick``, ``time`` (live: seconds); ``coming``: the
    scenario's obstacles that have not appeared yet; ``changes``: changes of robots that are not
    applied yet; ``dues``: the open deadlines of rounds, requests and the mission; ``missed``: those
    not met in time; ``kept``: for each robot and obstacle, the last deadline that was met;
    ``switched``: the tick in which each input changed last; ``limit``: ticks (live: seconds);
    ``rivals``: the robots in conflict with each robot; ``mates``: these, and those with which it
    shares a zone of ``never_together``; ``promised``: the tick in which the mission's deadline is
    kept; ``over``: the tick in which a lost deadline shows that the present turn has ended (None:
    none does); ``strays``: the number of steps that did not end as commanded; ``hands``: the number
    of changes by a user or the world."""

    def __init__(self, header: Line) -> None:
        self.scenario = h = header.scenario
        self.live, self.external = h.clock == "live", header.world == "external"
        self.world = World(h.map.rows, h.map.cols, h.map.walls)
        self.show = self.world.show
        self.cells: tuple[frozenset[int], ...] = header.cells or ()
        self.tick, self.time = 0, 0.0
        self.worked = 0.0  # live: the end of the last command
        self.limit = (h.limits.seconds or h.limits.ticks * SLOWEST) if self.live else h.limits.ticks
        self.promised: int | None = None
        self.over: int | None = None
        self.inputs = {each.name: False for each in h.inputs}
        self.robots = {data.name: self._robot(data) for data in h.robots}
        self.names = [*self.robots]
        self.obstacles: dict[str, Obstacle] = {}
        self.at: dict[int, list[Obstacle]] = {}  # by region
        self.kinds = {h.flat.name: h.flat} if h.flat else {}  # the first type of each name
        for data in sorted(h.obstacles, key=lambda one: one.appears or 0):
            self.add(data)
        listed = [one for one in h.obstacles if one.appears is not None]
        self.coming = sorted(listed, key=lambda one: one.appears)
        self.changes = sorted(h.changes, key=lambda one: one.at)
        self.by_user: set[str] = set()
        self.by = h.until.by
        self.dues = {} if self.by is None else {"mission": self.by}
        self.kept = dict(self.dues)
        self.excused: dict[str, int] = {}  # deadlines of obstacles that need not be resolved
        self.switched: dict[str, int] = {}
        self.missed: set[str] = set()
        self.orders: set[str] = set()
        self.flat_type = h.flat and h.flat.name
        self.flat: dict[str, str] = {}  # for each empty-battery obstacle, its robot
        self.drained: set[str] = set()  # these robots, until they leave service
        self.left: dict[int, float] = {}  # live: the last time a robot left a region
        self.moves = self.strays = self.hands = 0
        self.told: dict[tuple[str, bool], int] = {}  # the scenario's changes of service so far
        self.waits = False  # the team waits: robots keep their duties
        self.arrived = {*self.names}  # robots that may have met unrecorded goals
        self.restarted = -1  # the tick of the last resolution
        self.barred: set[tuple[str, str]] = set()  # robots with too many failures on an obstacle
        self.failed: dict[tuple[str, str], dict[str, int]] = {}  # memories of failed syntheses
        self.unrealizable: set[tuple[str, str]] = set()  # robots and their specifications
        self.ended: str | None = None
        self.zones = [(zone.robots, zone.regions) for zone in h.never_together]
        self.rivals, self.mates = dict[str, list[str]](), dict[str, list[str]]()
        for name in self.names:
            others = [one for one in self.names if one != name]
            self.rivals[name] = [one for one in others if self._conflict(name, one)]
            near = {*self.rivals[name]}.union(*(who for who, _ in self.zones if name in who))
            self.mates[name] = [one for one in others if one in near]
        self.kept_out = cache(self._kept_out)
        for robot in self.robots.values():
            robot.progress.stayed = int(robot.stays)
            self.restart(robot)

    def _robot(self, data: Line) -> Robot:
        (region, heading), own = data.start, data.objective
        pose = region, heading if data.mobility == "heading" else None
        held = frozenset([region])
        robot = Robot(data.name, data, pose, held, own, own, Progress(), data.within, pose)
        robot.charge = float(data.battery.start) if data.battery else None
        robot.follow(self.inputs)
        return robot

    def add(self, data: Line) -> None:
        """Add an obstacle. Entries with the same name describe one obstacle."""
        if data.name in self.obstacles:
            return
        kind, region, listed = data.type, data.region, list[Need]()
        self.kinds.setdefault(kind.name, kind)
        for k, need in enumerate(kind.needs):
            chain = [need, *takewhile(lambda other: other.same, kind.needs[k + 1 :])]
            actions = {each.action for each in chain}
            able = frozenset(n for n, r in self.robots.items() if actions <= r.data.capabilities)
            how = need.robots, need.together, need.same
            listed.append(Need(need.action, self._regions(need.at, region), *how, able))
        last, needs, blocks = listed[-1], tuple(listed), self._blocked(kind.blocks)
        alone = last.robots == 1 and not last.same and region in last.regions
        enters, order = last.able if alone else frozenset[str](), (kind.name, region, data.number)
        self.obstacles[data.name] = found = Obstacle(
            *(data.name, kind.name, region, blocks, needs),
            *(data.traversable, self.due_within(data)),
            *(data.ordered, data.appears is None, data.goes),
            Rest(data.name, region, blocks, needs, enters, order),
        )
        self.at.setdefault(found.region, []).append(found)

    def due_within(self, data: Line) -> int | None:
        """Return the number of ticks after its request by which an obstacle must be resolved; None
        if it has no deadline."""
        limits = data.resolve_within, data.type.resolve_within, self.scenario.resolve_within
        return next((each for each in limits if each is not None), None)

    def _regions(self, at: Any, region: int) -> frozenset[int]:
        """Return the free regions where robots fulfil a need of an obstacle in ``region``."""
        if at == "neighbours":
            return frozenset(to for to, _ in self.world.steps(False, (region, None)))
        return frozenset([region]) if at == "self" else at & self.world.free

    def _blocked(self, listed: frozenset[str] | None) -> frozenset[str]:
        """Return the robots that an obstacle blocks: those whose name, model or layer is ``listed``
        (None: all robots)."""
        every = ((n, {n, r.data.layer, r.data.model.name}) for n, r in self.robots.items())
        return frozenset(name for name, words in every if listed is None or words & listed)

    def _conflict(self, one: str, other: str) -> bool:
        """Return whether two robots must avoid each other. By default robots of one layer do."""
        a, b = self.robots[one].data, self.robots[other].data
        same = a.layer == b.layer
        avoids = (same if x.avoids is None else y.name in x.avoids for x, y in ((a, b), (b, a)))
        return any(avoids)

    def _kept_out(self, robot: str, other: str, holds: frozenset[int]) -> frozenset[int]:
        """Return the regions that ``robot`` must not enter while ``other`` occupies ``holds``."""
        shared = (zone for who, zone in self.zones if {robot, other} <= who and zone & holds)
        return (holds if other in self.rivals[robot] else frozenset()).union(*shared)

    def step(self, e: Line) -> Step | None:
        """Return the step or the placement that a line records; None if no robot moves."""
        robot, strays = self.robots.get(e.robot), e.result not in (None, "arrived")
        if robot is None:
            return None
        if e.kind == "operator" and e.region is not None:
            return Step(robot.pose[0], e.region, e.heading, None, frozenset([e.region]), False)
        if e.kind == "move":
            holds = frozenset([e.to] if e.toward is None else [e.to, e.toward])
            return Step(e.start, e.to, e.heading, e.toward, holds, strays)
        if e.kind == "depart":
            return Step(e.start, e.start, robot.pose[1], e.to, frozenset([e.start, e.to]), False)
        if e.kind == "arrive":
            holds = frozenset([e.at]) | (e.regions or frozenset())
            return Step(robot.pose[0], e.at, e.heading, None, holds, strays)
        return None

    def closing(self, robot: str, region: int) -> Iterator[Obstacle]:
        """Yield the obstacles that close their region to a robot."""
        for one in (x for x in self.at.get(region, ()) if x.there and robot in x.blocks):
            known = not self.external or one.known  # an unknown obstacle may be absent
            if one.shut or (one.open and known and one.rest.closes(robot)):
                yield one

    def charge(self, robot: Robot, now: float) -> float:
        """Return a robot's charge: live at second ``now``, in lockstep after its last turn."""
        battery, charge = robot.data.battery, robot.charge or 0.0
        rate = battery.charge if robot.pose[0] in self.scenario.chargers else -battery.stay
        if robot.stands is not None:
            charge += rate * max(0.0, (now if self.live else robot.moved) - robot.stands)
        return float(round(min(battery.capacity, max(0.0, charge)), DECIMALS))

    def is_empty(self, robot: Robot, now: float, margin: float = 0.0) -> bool:
        """Return whether a robot off the chargers lacks more than ``margin`` of a step's charge."""
        if robot.charge is None or robot.filled or robot.pose[0] in self.scenario.chargers:
            return False
        return bool(self.charge(robot, now) < robot.data.battery.move - margin)

    def rests(self, robot: Robot, now: float) -> bool:
        """Return whether a robot is out of service, or about to be: the obstacle that represents
        its empty battery has appeared."""
        return robot.out or (robot.name in self.flat.values() and self.is_empty(robot, now))

    def destination(self, name: str) -> Pose:
        """Return a robot's pose or, if it is in transit, the pose in which it will arrive."""
        robot = self.robots[name]
        if robot.bound is None:
            return robot.pose
        return robot.bound, self.world.side(robot.pose[0], robot.bound) if robot.faces else None

    def is_planned(self, robot: str) -> bool:
        """Return whether joint plans drive a robot: it has rivals, shares a zone, or has a battery,
        which strategies do not observe."""
        return bool(self.mates[robot] or self.robots[robot].data.battery)

    def keeps(self, robot: str) -> bool:
        """Return whether a robot meets own goals even while it pursues something else."""
        return self.is_planned(robot) or self.scenario.coordination == "assignable"

    def memories(self, robot: Robot) -> set[int]:
        """Return the memories that a robot's formulas may have now."""
        known, formulas = robot.memories or set(), robot.own.formulas
        return formulas.lasting(known, robot.pose, robot.heard) if self.live and known else known

    def arriving(self, robot: Robot, known: Iterable[int] | None = None) -> set[int]:
        """Return the memories that a robot's formulas may have at its destination, given the
        present memories."""
        known = self.memories(robot) if known is None else {*known}
        if robot.bound is None:
            return known
        after: set[int] = robot.own.formulas.after(known, robot.pose, self.destination(robot.name))
        return after & robot.heard

    def by_inputs(self, robot: Robot) -> Objective | None:
        """Return the objective that the inputs select for a robot instead of its own, or None."""
        return next((own for name, own in robot.data.when if self.inputs.get(name)), None)

    def disobeys(self, robot: Robot) -> bool:
        """Return whether a robot lacks the objective that the inputs select."""
        if robot.told or not robot.data.when:
            return False
        return bool(robot.own != (self.by_inputs(robot) or robot.data.objective))

    def now(self, e: Line) -> float:
        """Return the time of a line: its tick, or its second in a live run."""
        return float(e.tick if e.t is None or not self.live else e.t)

    def rounds(self, name: str, e: Line) -> int:
        """Return how many rounds of its objective a robot has completed. In a live run, a robot at
        its last target has completed at least as many as the outcome states."""
        own, stated = self.robots[name].own, (e.rounds or {}).get(name, 0)
        rounds, wanted = self.robots[name].progress.rounds(own, e.tick), self.scenario.until.rounds
        stays = self.live and own.settles and rounds
        return min(max(wanted, stated), rounds + wanted) if stays else rounds

    def behind(self, name: str, e: Line) -> str:
        """Return the reason, in words, why a robot has not met its objective; '' if it has."""
        robot, wanted = self.robots[name], self.scenario.until.rounds
        if (rounds := self.rounds(name, e)) < wanted:
            return f"{name} has met its objective {rounds} of {wanted} times"
        away = robot.own.settles and (robot.bound is not None or robot.holds - robot.own.last)
        return f"{name} is not at its last target" * bool(away)

    def overdue(self, tick: int) -> set[str]:
        """Return the deadlines that are missed when a tick begins."""
        late = {of for of, due in self.dues.items() if due < tick}
        return late - {name for name, robot in self.robots.items() if robot.away or robot.was_away}

    def restart(self, robot: Robot) -> None:
        """Begin a new round of a robot and its deadline."""
        # a round may begin twice in a tick
        was_away = robot.away or (robot.was_away and robot.begun == self.tick)
        robot.begun, robot.was_away, robot.away = self.tick, was_away, False
        self.dues.pop(robot.name, None)
        if robot.within is not None:
            self.dues[robot.name] = self.tick + robot.within
