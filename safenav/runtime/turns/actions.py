"""Actions of robots on obstacles, and their results: resolved, gone, failed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination.events import Event, ObstacleChanged, ObstaclesResolved, Unsettled
from safenav.runtime.coordination.snapshot import takers
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turns.move_recorder import MoveRecorder
from safenav.runtime.turns.relocation import Relocation
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.protocol import Acted, Arrived
from safenav.runtime.worlds.world import Change, Takers
from safenav.scenario.model import Obstacle, Robot
from safenav.trace import records, vocabulary
from safenav.trace.vocabulary import ActResult, HoldReason


class Actions(Struct):
    """Carries out actions in a world. ``stand_still``: the turn of a robot that stays."""

    state: TeamState
    world: Commands
    recorder: MoveRecorder
    traffic: Traffic
    relocation: Relocation
    stand_still: Callable[[RobotState, HoldReason], Iterator[Event]]

    def act(self, robot: RobotState) -> Iterator[Event]:
        """Let the robot perform its actions where it stands; changes are decided immediately."""
        event, robot.acted = robot.acted, None
        event = event or self._done_by(robot)
        robot.asked, robot.acts_on = True, tuple(self._within_reach(robot)[0])
        if self._world_reaches(robot) is not None:  # a simulated action never fails
            yield from self._resolve(robot, event)
            return
        results = {obstacle.name for obstacle, _ in event.found}
        failed = [o for o in robot.acts_on if o.name not in results and self._is_last(o)]
        yield from self._resolve(robot, event, self.state.knowledge.affected(results))
        yield from self._fail(robot, [o for o in failed if self.state.knowledge.knows(o)])

    def _is_last(self, obstacle: Obstacle) -> bool:
        """Whether a single action resolves an obstacle now, so that it has failed without a
        result."""
        last = self.state.knowledge.need_of(obstacle) == len(obstacle.needs) - 1
        return last and obstacle.needs[-1].robots == 1

    def _fail(self, robot: RobotState, failed: Collection[Obstacle]) -> Iterator[Event]:
        """Lockstep: count the failed actions of a robot, after which it leaves obstacles to
        others."""
        if not failed:
            return
        results = {obstacle.name: ActResult.FAILED for obstacle in failed}
        left = self._count(robot, results)
        self.state.emit(records.ActionEnd(self.state.tick, 0, robot.name, results, left or None))
        if left:
            yield from self.relocation.leave_plan()
            yield Unsettled(vocabulary.Reason.REQUEST)

    def _count(self, robot: RobotState, results: Mapping[str, ActResult]) -> tuple[str, ...]:
        """Count failed actions; return the obstacles that the robot leaves to others."""
        state = self.state
        failed = [name for name, result in results.items() if result is ActResult.FAILED]
        policy = state.scenario.failures
        return tuple(n for n in failed if state.failures.action_failed(policy, robot.name, n))

    def acts_first(self, robot: RobotState) -> bool:
        """Lockstep: whether a robot stays to act before it leaves, as a live one does: at its
        start, or on obstacles on which it could not act when it arrived."""
        if not robot.active or not robot.robot.capabilities:
            return False
        reach = self._world_reaches(robot)
        if reach is not None:
            return reach
        if not robot.asked:
            robot.asked = True
            here = self.world.start(robot.robot, robot.pose, robot.pose)  # as before every action
            if not isinstance(here, Arrived):
                robot.moved = here  # its stay in this turn ends in that pose
                return True
            event = self._done_by(robot)
            robot.acted = event if event.found else None
            return robot.acted is not None
        return any(obstacle not in robot.acts_on for obstacle in self._within_reach(robot)[0])

    def _done_by(self, robot: RobotState) -> Acted:
        event = self.world.act(robot.robot, robot.pose, self._cleared(robot), self._takers())
        assert event is not None, "actions take no time in lockstep"
        external = self._world_reaches(robot) is None
        return self._without_echoes(event, ()) if external else event

    def _world_reaches(self, robot: RobotState) -> bool | None:
        return self.world.within_reach(robot.robot, self._cleared(robot), self._takers())

    def acts(self, robot: RobotState) -> Generator[Event, None, bool]:
        """Live: let an idle robot act before it leaves; return whether that is its turn."""
        if robot.acting is None:
            return (yield from self._begin(robot))
        event = self.world.acted(robot.robot) if robot.acting == robot.name else None
        event = self._answered(event, robot.acts_on)
        yield from self.stand_still(robot, HoldReason.ACTING)
        if event is not None:
            yield from self._end(robot, event)
        return True

    def _begin(self, robot: RobotState) -> Generator[Event, None, bool]:
        """Let a robot begin an action on the obstacles within its reach; return whether it has."""
        state, name = self.state, robot.name
        if not robot.active or robot.held is not None or not robot.robot.capabilities:
            return False
        obstacles, group, busy = self._within_reach(robot)
        if not obstacles and (robot.asked or busy):
            return False  # it may act again once the others are done
        robot.asked, robot.acts_on = True, tuple(obstacles)
        begun = self.world.act(robot.robot, robot.pose, obstacles, self._takers())
        event = self._answered(begun, obstacles)
        if event is not None and not (event.found or event.reason):
            if obstacles or self.world.simulated:  # other worlds do nothing unrequested
                yield from self._resolve(robot, event)
            return False
        command = self.world.number(name) if event is None else event.command or 0
        if event is None:
            for member in group:
                state.robots[member].acting = name
        names = tuple(obstacle.name for obstacle in obstacles)
        state.emit(records.Act(state.tick, command, name, group, names))
        yield from self.stand_still(robot, HoldReason.ACTING)
        state.changes += 1
        if event is not None:
            yield from self._end(robot, event)
        return True

    def _end(self, robot: RobotState, event: Acted) -> Iterator[Event]:
        """Record the end of an action, and process its results."""
        state, name, who = self.state, robot.name, self._takers()
        for other in state.robots.values():
            other.acting = None if other.acting == name else other.acting
        results = {obstacle.name: result for obstacle, result in event.found}
        failed = [obstacle for obstacle, result in event.found if result is ActResult.FAILED]
        found = [self._found(robot, each) for each in failed if self._finds(event, each)]
        left_to_others = self._count(robot, results)
        ended = results, left_to_others or None, event.reason or None
        state.emit(records.ActionEnd(state.tick, event.command or 0, name, *ended))
        robot.asked = {*results.values()} <= {ActResult.FAILED}  # else there may be more to do
        state.changes += 1
        for violation in filter(None, found):
            yield from self.relocation.request_help(violation)
        yield from self._acted(robot, event, who, left_to_others=bool(left_to_others))

    def gone(self, obstacle: Obstacle, *, by_user: bool = False) -> Iterator[Event]:
        """Process the disappearance of an obstacle, known or not."""
        self.state.failures.gone(obstacle.name, self.world.now())
        self.state.knowledge.sighted.pop(obstacle.name, None)
        if self.state.knowledge.knows(obstacle):
            yield from self.relocation.leave_plan()
            yield ObstacleChanged(Change(obstacle, appeared=False, by_user=by_user))

    def _resolve(
        self,
        robot: RobotState,
        event: Acted,
        only: Collection[str] | None = None,
        who: Takers | None = None,
    ) -> Iterator[Event]:
        """Process the obstacles that an action has resolved, and the other needs that it fulfilled
        (``only``: of these obstacles). ``who``: the robots that take each load (None: now)."""
        state = self.state
        cleared = robot.acts_on if state.live else self._cleared(robot)
        names, who = [obstacle.name for obstacle in cleared], self._takers() if who is None else who
        further, met = state.knowledge.perform(robot.robot, state.standing(), names, only, who)
        resolved = []
        for obstacle, result in event.found:
            state.introduce(obstacle)
            state.failures.gone(obstacle.name, self.world.now())
            open_ = result is ActResult.DONE
            resolved.append(
                (obstacle, open_ if obstacle.type.has_truth else None if open_ else False)
            )
        gone = {obstacle.name for obstacle, _ in resolved}
        for one in met:
            if not one.last or one.obstacle.name in gone:  # else the world reports a failure
                self.recorder.met(robot, one)
        if resolved:
            yield from self.relocation.leave_plan()
            yield ObstaclesResolved(robot.robot, tuple(resolved))
        elif further:
            yield from self.relocation.leave_plan()
            yield Unsettled(vocabulary.Reason.REQUEST)

    def _cleared(self, robot: RobotState) -> list[Obstacle]:
        return _loads(self.state, robot.robot)

    def _takers(self) -> dict[str, frozenset[str]]:
        pending = self.state.knowledge.pending.values()
        return takers(self.state, (work.obstacle for work in pending if work.takes))

    def _answered(self, event: Acted | None, obstacles: Sequence[Obstacle]) -> Acted | None:
        """The results of an action without those that change nothing. Without a result for an
        obstacle's last need the action has failed, or the obstacle is gone."""
        if event is None:
            return None
        event = self._without_echoes(event, {obstacle.name for obstacle in obstacles})
        told, knowledge = {obstacle.name for obstacle, _ in event.found}, self.state.knowledge
        missing = []
        for obstacle in (o for o in obstacles if o.name not in told):
            if not knowledge.knows(obstacle):
                missing.append((obstacle, ActResult.NOTHING))
            elif self._is_last(obstacle):
                missing.append((obstacle, ActResult.FAILED))
        return replace(event, found=(*event.found, *missing))

    def _without_echoes(self, event: Acted, named: Collection[str]) -> Acted:
        """Return the results without echoes: results on obstacles that the action did not name and
        the team does not know as present (a failure, or an earlier resolution). A world that
        repeats them would keep the robot acting forever. Also drop results that report an obstacle
        as resolved while its last need cannot be fulfilled yet."""
        told, dropped = list[tuple[Obstacle, ActResult]](), list[tuple[Obstacle, ActResult]]()
        knowledge = self.state.knowledge
        early = [pair for pair in event.found if self._is_early(event.robot, *pair)]
        if early and self.state.live:
            words = ", ".join(f"{obstacle.name}: done" for obstacle, _ in early)
            said = f"other needs are still open ({words})"
            self.world.dropped.append((replace(event, found=tuple(early)), said))
        for obstacle, result in (pair for pair in event.found if pair not in early):
            new = obstacle.name not in self.state.failures.opened
            known = obstacle.name in named or obstacle.name in knowledge.pending
            changes = result in (ActResult.DONE, ActResult.UNTRAVERSABLE) and new
            changes = changes or (result is ActResult.FAILED and self._finds(event, obstacle))
            (told if known or changes else dropped).append((obstacle, result))
            if result is ActResult.DONE and not (known or changes):
                knowledge.sighted.pop(obstacle.name, None)  # it has been opened in passing again
        if dropped and self.state.live:
            words = ", ".join(f"{obstacle.name}: {result.value}" for obstacle, result in dropped)
            echo = replace(event, found=tuple(dropped))
            self.world.dropped.append((echo, f"it adds nothing to the knowledge ({words})"))
        return replace(event, found=tuple(told))

    def _finds(self, event: Acted, obstacle: Obstacle) -> bool:
        """Whether a failed action shows an obstacle that the team did not know as present."""
        state, last, robot = self.state, len(obstacle.needs) - 1, self.state.robots[event.robot]
        known, here = state.knowledge, robot.pose.region
        if known.knows(obstacle) or state.failures.is_late(obstacle.name, self.world.at(event)):
            return False
        able = obstacle.needs[last].action in robot.robot.capabilities
        able = able and here in obstacle.resolution_regions(state.scenario.map, last)
        return able and (here == obstacle.region or obstacle.name not in known.sighted)

    def _found(self, robot: RobotState, obstacle: Obstacle) -> ForbiddenMove | None:
        """Record an obstacle that a failed action has shown, before the end of the action. If it
        stops the robot where it stands, the robot encounters it; otherwise return None."""
        self.state.introduce(obstacle)
        if obstacle.region != robot.pose.region or not obstacle.blocks(robot.robot):
            self.state.knowledge.sight(obstacle)
            return None
        violation = ForbiddenMove(robot.robot, robot.pose.region, obstacle.region, obstacle)
        self.recorder.encounter(robot, violation)
        return violation

    def _is_early(self, name: str, obstacle: Obstacle, result: ActResult) -> bool:
        """Whether a world reports that a robot has delivered a load which it has only taken: one of
        the remaining needs must be fulfilled by the same robot elsewhere."""
        state = self.state
        known = result is ActResult.DONE and obstacle.name in state.knowledge.pending
        if not known or self.world.simulated:
            return False
        region, left = state.robots[name].pose.region, state.knowledge.need_of(obstacle)
        return any(
            need.same and region not in obstacle.resolution_regions(state.scenario.map, number)
            for number, need in [*enumerate(obstacle.needs)][left:]
        )

    def _within_reach(self, robot: RobotState) -> tuple[list[Obstacle], tuple[str, ...], bool]:
        """The pending obstacles on which a robot can act where it stands, the robots that take
        part, and whether it leaves others to robots that already act on them."""
        state, group, busy = self.state, {robot.name}, False
        idle = {
            name: other.pose.region
            for name, other in state.robots.items()
            if other.transit is None and other.acting is None and other.active
        }
        found, left_to_others = [], state.failures.barred
        names = {o.name for o in _loads(state, robot.robot)}
        free = {name for name in names if (robot.name, name) not in left_to_others}
        reach = state.knowledge.within_reach(robot.robot, idle, free, self._takers())
        for obstacle, robots in reach:
            if (robot.name, obstacle.name) in left_to_others:
                continue
            if state.knowledge.is_being_met(obstacle, _leading(state, obstacle)):
                busy = True
                continue
            found.append(obstacle)
            group |= set(robots)
        return found, tuple(name for name in state.robots if name in group), busy

    def _acted(
        self, robot: RobotState, event: Acted, who: Takers, *, left_to_others: bool
    ) -> Iterator[Event]:
        """Process the results of an action. ``who``: the robots that could take each load when it
        ended; ``left_to_others``: the robot leaves an obstacle to others."""
        for obstacle, result in event.found:
            if result is ActResult.NOTHING:
                yield from self.gone(obstacle)
        gone = [o for o in robot.acts_on if not self.state.knowledge.knows(o)]  # meanwhile
        done = [
            pair
            for pair in event.found
            if pair[1] in (ActResult.DONE, ActResult.UNTRAVERSABLE) and pair[0] not in gone
        ]
        if left_to_others:
            yield from self.relocation.leave_plan()
            yield Unsettled(vocabulary.Reason.REQUEST)
        # A failed action has the reported effects only. One that finds its obstacle gone still
        # fulfils the other needs that the robots can fulfil where they stand.
        failed = any(result is ActResult.FAILED for _, result in event.found)
        failed = failed or bool(event.reason and not event.found)
        if done or not failed:
            told = {obstacle.name for obstacle, _ in done}
            only = told if failed else self.state.knowledge.affected(told)
            yield from self._resolve(robot, replace(event, found=tuple(done)), only, who)


def _leading(team: TeamState, obstacle: Obstacle) -> set[str]:
    """Return the robots that lead an action on an obstacle."""
    robots = team.robots.items()
    return {name for name, r in robots if r.acting == name and obstacle in r.acts_on}


def _loads(team: TeamState, robot: Robot) -> list[Obstacle]:
    """Return the known loads that a robot may take now: one that is sent for a load takes no
    other."""
    pending = team.knowledge.pending.values()
    assignment = team.robots[robot.name].assignment
    sent_for = assignment.obstacle if assignment.role is Role.HELPS else None
    may = takers(team, (work.obstacle for work in pending if work.takes))
    left = {name for name, robots in may.items() if robot.name not in robots}
    loads = team.knowledge.to_take(sent_for, left)
    return [work.obstacle for work in pending if work.takes and work.obstacle in loads]
