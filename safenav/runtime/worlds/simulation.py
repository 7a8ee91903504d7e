"""The simulated actual world of a scenario, with all its obstacles, known to the team or not; also
in seconds, where time passes only in ``wait``.

The modelled world is the map with its known obstacles O. The actual one also has the hidden
obstacles R, found when a robot is about to enter one (paper, Sections III and V-A). The truth is a
state of the team's model in which each present obstacle is open; no other module has it.
"""

import heapq
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import count

from msgspec import Struct
from msgspec.structs import replace

from safenav.pace.robot import acted_by
from safenav.runtime.worlds.protocol import Acted, Arrived, Blocked, Change, Ended, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team import state as now
from safenav.team.acts import acting_group, acts_on, participants
from safenav.team.apply import apply, initial
from safenav.team.state import Is, ObstacleNow, RobotNow, Stage
from safenav.team.team import Team, based, introduced, pace_on, team_of
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.poses import Pose


class Truth(Struct, frozen=True, forbid_unknown_fields=True):
    """The state of a simulated world. ``named``: the truth of the last obstacle of each name;
    ``added``: the obstacles (the last ones) that the scenario omits, each with the robot whose
    empty battery it is, or None."""

    obstacles: tuple[ObstacleNow, ...]
    named: dict[str, bool | None]
    added: tuple[tuple[Obstacle, int | None], ...] = ()


class SimulatedWorld:
    """The obstacles of a scenario with their truths: a ``BlockingWorld``.

    ``cleared``: names of the loads that the team knows, which robots take; ``absent``: robots that
    take part in no action that begins now."""

    def __init__(self, scenario: Scenario) -> None:
        self._team = team_of(scenario)
        self._number = {robot.name: i for i, robot in enumerate(scenario.robots)}
        self._listed = len(scenario.obstacles)
        there = initial(self._team)
        opened = tuple(
            each if each.state is Is.AWAY else ObstacleNow(Is.OPEN) for each in there.obstacles
        )
        self._state = replace(there, obstacles=opened)
        self._regions: list[Region | None] = [robot.start.region for robot in scenario.robots]
        self.truths: dict[str, bool | None] = {}
        """The truth of each name's latest obstacle; at first, of its earliest one."""
        for obstacle in sorted(scenario.obstacles, key=lambda each: each.appears or 0):
            self.truths.setdefault(obstacle.name, obstacle.traversable)
        self.cleared: Collection[str] = ()
        self.absent: Collection[int] = ()
        self._idle = set[int]()
        """The robots that had no command when ``excuse`` was last called."""
        self._groups = dict[int, frozenset[int]]()
        """The robots that take part in each action under way, by its robot."""
        self._parts: dict[str, tuple[tuple[Obstacle, Stage], ...]] = {}

    def kept(self) -> Truth:
        """Return the state for a checkpoint."""
        added = tuple((e.source, e.battery_of) for e in self._team.obstacles[self._listed :])
        return Truth(self._state.obstacles, {**self.truths}, added)

    def resume(self, truth: Truth, regions: Sequence[Region]) -> None:
        """Continue with the state ``truth``, and the robots in these regions."""
        for source, battery_of in truth.added:
            self._team = introduced(self._team, source, battery_of)
        self._state = replace(self._state, obstacles=truth.obstacles)
        self.truths = {**truth.named}
        self._regions = [*regions]

    # A blocking world.

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return the obstacle in a region; None if there is none. Every robot notices the obstacles
        in neighbouring regions, except orders."""
        del robot
        return self.standing().get(region)

    def move(self, robot: Robot, pose: Pose | None) -> None:
        """Move a robot. None: it has departed and no longer acts in the region that it left."""
        self._regions[self.leave(robot)] = None if pose is None else pose.region

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        i, team = self._number[robot.name], self._team
        stages = self._changes(i)
        self._groups.pop(i, None)
        done = [k for k, stage in stages if team.obstacles[k].next(stage) is None]
        sources = {k: team.obstacles[k].source for k, _ in stages}
        if stages:
            over = tuple((k, sources[k].traversable) for k in done)
            self._state = apply(team, self._state, now.Acted(i, stages, over))
        parts = ((sources[k], stage) for k, stage in stages if k not in done)
        self._parts[robot.name] = tuple(parts)
        return [(sources[k], sources[k].traversable) for k in done]

    def excuse(self, robots: Sequence[RobotNow]) -> None:
        """Exclude robots that the team knows to be out of service or busy from new actions. Robots
        out of service without a command also leave their present actions."""
        live, every = self._team.live, [*enumerate(robots)]
        self.absent = {i for i, r in every if not r.active or (live and not r.idle)}
        self._idle = {i for i, r in every if r.idle}
        pairs = zip(self._number, robots, strict=True)
        self.leave_service(name for name, robot in pairs if not robot.active)

    def leave_service(self, robots: Iterable[str]) -> None:
        """Exclude robots out of service and without a command from the actions under way."""
        out = self._idle.intersection(self._number[name] for name in robots)
        self._groups = {j: group - out for j, group in self._groups.items()}

    def parts(self, robot: Robot) -> Sequence[tuple[Obstacle, Stage]]:
        """Return the obstacles that a robot's last action changed but did not resolve, each with
        its new stage."""
        return self._parts.get(robot.name, ())

    # Simulation of durations.

    def begin(self, robot: Robot) -> None:
        """Let a robot begin an action with the robots that are there now. If the action is on
        obstacles that the team knows, they leave actions unknown to the team."""
        i, before = self.leave(robot), self._groups
        if self.cleared:
            self._groups = {j: group & {j, *self.absent} for j, group in before.items()}
        at, changes = self._present(i), self._changes(i)
        group = acting_group(self._team, self._state, at, i, changes)
        self._groups = {j: each - group for j, each in before.items()} | {i: group}

    def leave(self, robot: Robot) -> int:
        """Exclude a robot from all actions that are under way. Return the robot's index."""
        i = self._number[robot.name]
        self._groups = {j: group - {i} for j, group in self._groups.items() if j != i}
        return i

    def within_reach(self, robot: Robot) -> list[tuple[Obstacle, tuple[str, ...]]]:
        """Return the obstacles with a need that a robot can fulfil where it stands, each with the
        robots that take part. Obstacles that the robot takes as a load come last."""
        i, found = self._number[robot.name], list[tuple[Obstacle, tuple[str, ...]]]()
        for k in sorted((k for k, _ in self._changes(i)), key=self._as_moved):
            group = participants(self._team, self._state, self._present(i), i, k)
            names = tuple(self._team.members[j].name for j in group)
            found.append((self._team.obstacles[k].source, names))
        return found

    def stands(self, obstacle: Obstacle) -> bool:
        """Return whether an obstacle is present and unresolved."""
        return any(source.name == obstacle.name for source in self._there())

    def stopping(self, robot: Robot, region: Region) -> Obstacle | None:
        """Return the obstacle in a region whose next need closes the region to a robot, or None."""
        i = self._number[robot.name]
        for k, each in enumerate(self._state.obstacles):
            obstacle = self._team.obstacles[k]
            there = each.state is Is.OPEN and obstacle.region == region
            if there and obstacle.closes(i, each):
                return obstacle.source
        return None

    # Changes by the scenario and by a user.

    def times(self) -> list[int]:
        """Return the ticks at which obstacles will appear or disappear."""
        found = []
        for each, there in zip(self._team.obstacles, self._state.obstacles, strict=True):
            if there.state is Is.AWAY and each.source.appears is not None:
                found.append(each.source.appears)
            if there.state is not Is.OVER and each.source.goes is not None:
                found.append(each.source.goes)
        return found

    def helpful_times(self) -> list[int]:
        """Return the ticks at which present obstacles will disappear."""
        every = zip(self._team.obstacles, self._state.obstacles, strict=True)
        here = (each for each, there in every if there.state not in (Is.AWAY, Is.OVER))
        return [each.source.goes for each in here if each.source.goes is not None]

    def inputs(self, tick: int) -> dict[str, bool]:
        """Return the values that the scenario lists for the inputs in a tick."""
        listed = self._team.scenario.inputs
        return {e.name: any(first <= tick <= last for first, last in e.spans) for e in listed}

    def standing(self) -> Mapping[Region, Obstacle]:
        """Return the present obstacles that robots notice: all except orders. (The team already
        knows empty batteries, which may share their regions with other obstacles.)"""
        there = (each for each in self._there() if not each.ordered)
        ranked = sorted(there, key=lambda each: each.type.blocks != frozenset())
        return {each.region: each for each in ranked}

    def changes(self, tick: int, occupied: Collection[Region]) -> list[Change]:
        """Return the changes. Obstacles appear at their tick, or once their region is free."""
        found = []
        for k, each in enumerate(self._state.obstacles):
            source = self._team.obstacles[k].source
            if each.state is not Is.OVER and source.goes is not None and source.goes <= tick:
                self._put(k, Is.OVER)
                found += [] if each.state is Is.AWAY else [Change(source, appeared=False)]
        for k in self._due(tick):
            source = self._team.obstacles[k].source
            if self._fits(source, occupied):
                truth = source.traversable
                self._put(k, Is.OPEN)
                before, self.truths[source.name] = self.truths[source.name], truth
                new = None if truth is before else truth
                found.append(Change(source, True, k >= self._listed, new))
        return found

    def place(self, obstacle: Obstacle, state: Is = Is.OPEN, battery_of: int | None = None) -> None:
        """Add an obstacle. By default it appears now, even where a robot stands; with ``AWAY`` it
        appears at its tick ``appears``. ``battery_of``: the robot whose empty battery it is."""
        self._team = introduced(self._team, obstacle, battery_of)
        self._state = replace(self._state, obstacles=(*self._state.obstacles, ObstacleNow(state)))
        self.truths.setdefault(obstacle.name, obstacle.traversable)

    def follow(self, team: Team) -> None:
        """Let robots take the loads that they can deliver under their current rules."""
        self._team = based(replace(self._team, members=team.members), {})

    def remove(self, name: str) -> bool:
        """Remove an obstacle immediately. Return whether it was present."""
        each = enumerate(self._state.obstacles)
        found = [k for k, at in each if at.stands and self._team.obstacles[k].name == name]
        for k in found:
            self._put(k, Is.OVER)
        return bool(found)

    def _changes(self, i: int) -> tuple[tuple[int, Stage], ...]:
        pairs = enumerate(zip(self._team.obstacles, self._state.obstacles, strict=True))
        there = ((k, each, now.stage.need) for k, (each, now) in pairs if now.known)
        known = [
            k
            for k, each, number in there
            if each.name in self.cleared or not any(n.takes for n in each.needs[: number + 1])
        ]
        return acts_on(self._team, self._state, self._present(i), i, known)

    def _present(self, i: int) -> list[Region | None]:
        """Return each robot's region if it can take part in an action of robot i, else None."""
        every = enumerate(self._regions)
        if i in self._groups:
            return [place if j in self._groups[i] else None for j, place in every]
        out = frozenset(self.absent).union(*self._groups.values())
        return [None if j in out else place for j, place in every]

    def _as_moved(self, k: int) -> tuple[bool, str]:
        """Return the sort key of a part of an action in the order of motions: loads are last."""
        need = self._state.obstacles[k].stage.need
        return self._team.obstacles[k].needs[need].takes, self._team.obstacles[k].name

    def _put(self, k: int, state: Is) -> None:
        there = [*self._state.obstacles]
        there[k] = ObstacleNow(state)
        self._state = replace(self._state, obstacles=tuple(there))

    def _there(self) -> Iterator[Obstacle]:
        for each, there in zip(self._team.obstacles, self._state.obstacles, strict=True):
            if there.state is Is.OPEN:
                yield each.source

    def _due(self, tick: int) -> list[int]:
        """Return the obstacles that have to appear, the earliest first."""
        pairs = enumerate(self._state.obstacles)
        away = [(self._team.obstacles[k].source.appears, k) for k, e in pairs if e.state is Is.AWAY]
        return [k for _, k in sorted((at, k) for at, k in away if at is not None and at <= tick)]

    def _fits(self, obstacle: Obstacle, occupied: Collection[Region]) -> bool:
        """Return whether an obstacle can appear now. An order can, even in an occupied region."""
        if obstacle.ordered:
            return not self.stands(obstacle)
        return obstacle.region not in occupied and obstacle.region not in self.standing()


class LiveSimulation:
    """A live simulation. ``truth``: its hidden obstacles."""

    def __init__(self, scenario: Scenario) -> None:
        self.truth = SimulatedWorld(scenario)
        self._scenario = scenario
        self._paces = {robot.name: pace_on(scenario.map, robot) for robot in scenario.robots}
        self._poses = {robot.name: robot.start for robot in scenario.robots}
        self._now = 0.0
        self._numbers = count()
        self._coming: list[tuple[float, int, WorldEvent, Robot, Sequence[Obstacle]]] = []
        self._takes: dict[str, float] = {}
        self._cleared: dict[str, set[str]] = {}

    def resume(self, now: float, poses: Mapping[str, Pose]) -> None:
        """Continue at a moment, with the robots in these poses and without open commands."""
        self._now = now
        for name, pose in poses.items():
            self._poses[name] = pose
            self._paces[name].placed(now, pose.facing)

    def now(self) -> float:
        return self._now

    def expected(self, robot: Robot) -> float | None:
        """Return the seconds that a robot's last command takes; None if there is none."""
        return self._takes.get(robot.name)

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self.truth.sense(robot, region)

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        name, here = robot.name, self._poses[robot.name]
        took = self.step_seconds(name, here.region, pose.region)
        end = self._now + took
        event: Ended = Arrived(end, name, command=command)
        obstacle = self.truth.stopping(robot, pose.region)
        if obstacle is not None:
            event = Blocked(end, name, here, obstacle, command=command)
        else:
            self._poses[name] = pose
        self.truth.move(robot, None)
        self._push(took, event, robot)

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self._cleared[robot.name] = self.truth.cleared = {o.name for o in obstacles}
        self.truth.begin(robot)
        works = self.truth.within_reach(robot)
        there = {obstacle.name for obstacle, _ in works}
        event = Acted(self._now, robot.name, command=command)
        took = 0.0
        for obstacle, group in works:
            took += self.action_seconds(obstacle, group, self._now + took)
        if not works and all(self.truth.stands(obstacle) for obstacle in obstacles):
            self.truth.leave(robot)
            return event
        missing = [o for o in obstacles if o.name not in there and not self.truth.stands(o)]
        self._push(took, event, robot, missing)
        return None

    def step_seconds(self, name: str, here: Region, there: Region) -> float:
        """Return the duration of a step that a robot begins now."""
        return self._paces[name].step(self._now, here, there)

    def action_seconds(self, obstacle: Obstacle, group: Sequence[str], now: float) -> float:
        """Return the seconds from ``now`` until a group has acted."""
        team = [(self._paces[name], self._poses[name].region) for name in group]
        return acted_by(team, now, obstacle.region)

    def cancel(self, robot: Robot) -> None:
        """Do nothing: each command of the simulation ends by itself."""

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        """Return all events of the next moment at which something happens."""
        times = [self._now + timeout] if timeout is not None else []
        times += [self._coming[0][0]] if self._coming else []
        times += self.times()
        began, self._now = self._now, max(self._now, min(times, default=self._now))
        # The scenario's changes of this moment come before the ends of actions.
        listed = (each for each in self._scenario.changes if began < each.at <= self._now)
        service = {each.robot: each.active for each in listed if each.active is not None}
        self.truth.leave_service(name for name, active in service.items() if not active)
        found: list[WorldEvent] = []
        while self._coming and self._coming[0][0] <= self._now:
            _, _, event, robot, missing = heapq.heappop(self._coming)
            found.append(self._happens(event, robot, missing))
        return found

    def placed(self, robot: Robot, pose: Pose) -> None:
        """Record that an operator has put a robot in ``pose``."""
        self._poses[robot.name] = pose
        self._paces[robot.name].placed(self._now, pose.facing)
        self.truth.move(robot, pose)

    def times(self) -> list[float]:
        return [float(tick) for tick in self.truth.times() if tick > self._now]

    def changes(self, at: float, occupied: Collection[Region]) -> list[Change]:
        return self.truth.changes(int(at), occupied)

    def _push(
        self, took: float, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle] = ()
    ) -> None:
        self._takes[robot.name] = took
        item = (self._now + took, next(self._numbers), event, robot, missing)
        heapq.heappush(self._coming, item)

    def _happens(self, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle]) -> WorldEvent:
        pace, pose = self._paces[robot.name], self._poses[robot.name]
        if isinstance(event, Arrived):
            pace.arrived(self._now)
            self.truth.move(robot, pose)
        elif isinstance(event, Acted):
            self.truth.cleared = self._cleared[robot.name]
            found = [(obstacle, ActResult.of(truth)) for obstacle, truth in self.truth.act(robot)]
            found += [(obstacle, ActResult.NOTHING) for obstacle in missing]
            return replace(event, at=self._now, found=tuple(found))
        else:
            pace.placed(self._now, None)
            self.truth.move(robot, pose)
        return event
