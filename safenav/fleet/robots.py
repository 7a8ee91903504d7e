"""Actions of a fleet: the robots that take part in each need of an obstacle, and the meanings of
their replies.

If several robots lift a crate together, the service of each is called, and all must succeed. After
a fulfilled need, the obstacle's next need applies.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum, auto
from math import hypot, inf

from msgspec import Struct, field

from safenav.fleet.file import FleetFile, Station
from safenav.fleet.transport import Located, Scanned, turned
from safenav.runtime.run.checkpoint import Resumption
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.floor import Floor, Stages
from safenav.team.known import floor_of
from safenav.team.state import Stage
from safenav.team.team import introduced, team_of
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.poses import Pose

PASSED = 2.0
"""Seconds after which a ray can no longer have hit a robot that has left or a resolved obstacle. A
scan may be as late as odometry may be old."""


class View(Enum):
    """The result of a scan for one region."""

    SEEN = auto()
    """The region is free, has a reported obstacle, or is reached by no ray."""
    DOUBT = auto()
    """A ray has hit something that may have left since: another robot, or a resolved obstacle."""
    BEFORE = auto()
    """A ray has hit something before the region, such as the leaf of an opening door."""
    ROBOT = auto()
    """A ray has hit something that may be another robot."""


UNREAD = 100
"""Maximum number of scans of a robot that wait for its odometry."""
STILL = 0.05
"""Maximum difference (metres, radians) between two measurements of a robot at rest."""


class Phase(Enum):
    """A phase of a command. INSPECTING: before departure the robot senses the region that it will
    enter."""

    INSPECTING = auto()
    GOING = auto()
    STOPPING = auto()
    RETURNING = auto()
    LOOKING = auto()
    ACTING = auto()


class FleetTask(Struct):
    """A command in progress. ``sent``, ``due``: the time when its goal was last sent, and the time
    limit of its present phase, on the world's clock; ``back``: whether it failed and the robot was
    sent back to its departure region, first at time ``since``; ``there``: whether odometry has
    confirmed the arrival, at time ``since``; ``over``: the results of an action and the reason of a
    failure, reported once odometry places the robot in its region again; ``known``: the known
    obstacle at the destination."""

    command: int
    start: Pose
    to: Pose
    phase: Phase
    goal: int = 0
    sent: float = 0.0
    due: float = inf
    reason: str = ""
    team_action: TeamAction | None = None
    back: bool = False
    there: bool = False
    since: float = -inf
    over: tuple[list[tuple[Obstacle, ActResult]], str] | None = None
    known: Obstacle | None = None


class TrailPoint(Struct, frozen=True):
    """A robot's past position, the time of its receipt in seconds, and the regions that the robot
    then occupied."""

    at: float
    place: Located
    regions: frozenset[Region]


class DrivenRobot(Struct):
    """The state of a robot. ``heard``: the time of receipt of its newest odometry, on the world's
    clock; ``looked``: the stamp of its newest reading; ``arrived``: the stamp of its odometry at
    its last arrival, since when it has not moved; ``view``: its reading of the adjacent regions
    since then, received at ``viewed``; ``trail``: its positions in the last seconds, oldest first;
    ``unread``: scans newer than its odometry, each with the time of its receipt; ``newest``: the
    stamp of its newest scan; ``lost``: the regions in one of which it is, until an operator places
    it."""

    robot: Robot
    station: Station
    pose: Pose
    place: Located | None = None
    heard: float = -inf
    looked: float = -inf
    arrived: float = -inf
    view: Mapping[Region, View] = field(default_factory=dict)
    viewed: float = -inf
    trail: deque[TrailPoint] = field(default_factory=deque)
    unread: deque[tuple[float, Scanned]] = field(default_factory=lambda: deque(maxlen=UNREAD))
    newest: float = -inf
    lost: frozenset[Region] = frozenset()
    task: FleetTask | None = None

    @property
    def regions(self) -> frozenset[Region]:
        """The regions that the robot occupies: its own, those of its step, and those that it
        reaches during an action."""
        task = self.task
        if task is None:
            return self.lost | {self.pose.region}
        acts = () if task.team_action is None else task.team_action.obstacles
        found = {self.pose.region, task.start.region, task.to.region}
        return self.lost | found | {obstacle.region for obstacle in acts}

    @property
    def stands(self) -> Region | None:
        """The region in which the robot is at rest; None if it moves or its arrival is not
        confirmed."""
        task = self.task
        if task is None or task.phase is Phase.INSPECTING:
            return self.pose.region
        if task.phase is not Phase.LOOKING or not task.there:
            return None
        return (task.start if task.back else task.to).region

    def stood(self, stamp: float) -> Located | None:
        """Return the position at which the robot was at rest at a stamp of its clock; None if it
        moved then or the odometry before and after differs."""
        newer: Located | None = None
        for point in reversed(self.trail):
            at = point.place
            if at.stamp <= stamp:
                after = newer or at
                still = hypot(at.x - after.x, at.y - after.y) <= STILL
                exact = newer is not None or at.stamp == stamp
                return at if exact and still and abs(turned(at.yaw - after.yaw)) <= STILL else None
            newer = at
        return None


STALE = 2.0
"""Seconds without odometry after which a robot's position is unknown."""
WORST = (ActResult.DONE, ActResult.UNTRAVERSABLE, ActResult.NOTHING, ActResult.FAILED)
"""Results of a group in ascending order, of which the worst counts."""
GOOD = frozenset({ActResult.DONE, ActResult.UNTRAVERSABLE})


def unserved(scenario: Scenario, fleet: FleetFile) -> Iterator[str]:
    """Yield warnings about actions for listed obstacles for which a robot has no service."""
    named = [*scenario.obstacles, *fleet.obstacles]
    types = {obstacle.type.name: obstacle.type for obstacle in named}
    for station in fleet.stations.values():
        if station.scan is not None:
            types[station.scan.obstacle.name] = station.scan.obstacle
    for robot in scenario.robots:
        for kind in types.values():
            needed = {need.action for need in kind.needs} & {*robot.capabilities}
            for action in sorted(needed - fleet.stations[robot.name].act.keys()):
                yield (
                    f"{robot.name} has no service for '{action}', which {kind.name} needs; add "
                    f"'act: {{{action}: SERVICE}}' to it in the fleet file"
                )


class FleetProgress:
    """The fleet's progress with the obstacles that it knows, computed by the team's model.
    ``begun``: the run to continue."""

    def __init__(self, scenario: Scenario, begun: Resumption | None) -> None:
        self._team = team_of(scenario)
        self._stages = begun.stages if begun else {}

    def need(self, obstacle: Obstacle) -> int:
        """Return the index of the next need of an obstacle."""
        return self._stage(obstacle).need

    def forget(self, obstacle: Obstacle) -> None:
        """Discard the progress with a resolved or absent obstacle. Other work in its region, such
        as a second parcel, is unchanged."""
        self._stages.pop(obstacle.name, None)

    def group(self, obstacle: Obstacle, robot: str, idle: Mapping[str, Region]) -> tuple[str, ...]:
        """Return the robots that act if this robot now acts on an obstacle's next need: the whole
        group if the need is joint, else only this robot; none if the robot cannot act or the group
        is too small. ``idle``: the regions of the robots that can take part."""
        floor, stages = self._floor(obstacle)
        need, members = floor.need(0, stages), self._team.members
        at = [idle.get(member.name) for member in members]
        there = [members[i].name for i in floor.there(0, stages, at)]
        if robot not in there:
            return ()
        if not need.together:
            return (robot,)
        return tuple(there) if len(there) >= need.robots else ()

    def meet(self, obstacle: Obstacle, robot: str, idle: Mapping[str, Region]) -> bool:
        """Record that ``group`` has acted. Return whether the obstacle is then resolved."""
        floor, stages = self._floor(obstacle)
        names = self.group(obstacle, robot, idle)
        group = [i for i, member in enumerate(self._team.members) if member.name in names]
        (stage,) = floor.took_part(0, stages, group)
        self._stages[obstacle.name] = stage
        return not floor.open((stage,))

    def _stage(self, obstacle: Obstacle) -> Stage:
        return self._stages.setdefault(obstacle.name, Stage())

    def _floor(self, obstacle: Obstacle) -> tuple[Floor, Stages]:
        """Return the model of the floor with only this obstacle, and its progress."""
        if obstacle not in (each.source for each in self._team.obstacles):
            self._team = introduced(self._team, obstacle)
        sources = [each.source for each in self._team.obstacles]
        floor = floor_of(self._team, (sources.index(obstacle),), frozenset(), frozenset())
        return floor, (self._stage(obstacle),)


class TeamAction(Struct):
    """A command to act. ``on``: the obstacle of the present action; ``team``: each participant's
    reply; ``advanced``: obstacles with a need that the command has fulfilled, but not the last one;
    ``reasons``: reasons of failed parts; ``need``: the need that the action must fulfil."""

    robot: Robot
    obstacles: Sequence[Obstacle]
    progress: FleetProgress
    results: dict[str, ActResult] = field(default_factory=dict)
    on: Obstacle | None = None
    team: dict[str, ActResult | None] = field(default_factory=dict)
    advanced: set[str] = field(default_factory=set)
    reasons: list[str] = field(default_factory=list)
    need: int = 0

    def next(self, idle: Mapping[str, Region], stations: Mapping[str, Station]) -> dict[str, str]:
        """Set ``on`` and return the service that each participant of the next action must call;
        empty if no action is left. ``idle``: regions of robots without another command."""
        self.on, self.team = None, {}
        for obstacle in self.obstacles:
            group = self.progress.group(obstacle, self.robot.name, idle)
            if obstacle.name in self.results or (obstacle.name in self.advanced and not group):
                continue
            self.need = self.progress.need(obstacle)
            action = obstacle.needs[self.need].action
            names = group or (self.robot.name,)
            if all(action in stations[name].act for name in names):
                self.on, self.team = obstacle, dict.fromkeys(names)
                return {name: stations[name].act[action] for name in names}
            self.results[obstacle.name] = ActResult.FAILED
            self.reasons.append(f"no service for {action!r} in the fleet file")
        return {}

    def answer(
        self, robot: str, result: ActResult, idle: Mapping[str, Region], reason: str = ""
    ) -> bool:
        """Record a participant's reply. Return whether all have replied."""
        if robot not in self.team or self.team[robot] is not None or self.on is None:
            return False
        self.team[robot] = result
        if reason and result is ActResult.FAILED:
            self.reasons.append(reason if robot == self.robot.name else f"{robot}: {reason}")
        answers = [answer for answer in self.team.values() if answer is not None]
        if len(answers) < len(self.team):
            return False
        worst, obstacle = max(answers, key=WORST.index), self.on
        if self.progress.need(obstacle) != self.need:  # other robots fulfilled the need first
            self.advanced.add(obstacle.name)
            return True
        more = worst in GOOD and bool(self.progress.group(obstacle, self.robot.name, idle))
        if more and not self.progress.meet(obstacle, self.robot.name, idle):
            self.advanced.add(obstacle.name)
        else:
            self.results[obstacle.name] = worst
        return True

    @property
    def resolved(self) -> Obstacle | None:
        """The obstacle that the last action has resolved, if any."""
        gone = self.on is not None and self.results.get(self.on.name, ActResult.FAILED)
        return self.on if self.on is not None and gone is not ActResult.FAILED else None

    @property
    def silent(self) -> list[str]:
        """The participants that have not yet replied."""
        return [name for name, answer in self.team.items() if answer is None]

    @property
    def found(self) -> list[tuple[Obstacle, ActResult]]:
        return [(o, self.results[o.name]) for o in self.obstacles if o.name in self.results]
