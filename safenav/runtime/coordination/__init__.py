"""Coordination by resynthesis: Algorithm 1 of the paper, made precise (DESIGN section 5).

A violation leads to a request; the nearest capable robot that has a strategy for it helps, the
requester waits, and everybody's objectives are kept on a stack until the obstacle is gone.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum

from safenav.runtime.controllers import Attempt, Controllers
from safenav.runtime.environment import Violation
from safenav.runtime.refuge import Refuge
from safenav.runtime.resolution import Bid, bids, ranking
from safenav.runtime.state import TeamState
from safenav.runtime.tasks import Assignment, Frame, helping, holding
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.objective import Target, targets_of
from safenav.trace import records
from safenav.trace.objective import Objective
from safenav.world.map import Region
from safenav.world.moves import distances


class Cause(StrEnum):
    """Why an operator is needed."""

    NO_CAPABLE_ROBOT = "no_capable_robot"
    CYCLIC_REQUESTS = "cyclic_requests"
    UNREALIZABLE = "unrealizable"
    DEADLOCK = "deadlock"


@dataclass(frozen=True)
class Impasse:
    """The team cannot go on by itself. ``robots`` are those that cannot get on, ``obstacle``
    what it is about (None for a deadlock)."""

    cause: Cause
    obstacle: Obstacle | None
    robots: tuple[str, ...]


@dataclass(frozen=True)
class _Plan:
    """A way to serve a request that has a strategy for everybody."""

    helper: str
    attempt: Attempt
    changes: Mapping[str, Assignment]


class Resynthesis:
    """Reassigns robots by new specifications and new strategies."""

    def __init__(self, state: TeamState, controllers: Controllers) -> None:
        self._state = state
        self._controllers = controllers

    def on_violation(self, violation: Violation) -> Impasse | None:
        """Find help for a robot that has just kept out of a hidden obstacle."""
        state, obstacle = self._state, violation.obstacle
        state.knowledge.meet(obstacle)
        return self._request(obstacle, violation.robot, {})

    def on_resolved(
        self, robot: Robot, obstacle: Obstacle, traversable: bool | None
    ) -> Impasse | None:
        """Take note of a resolved obstacle, whether or not anybody had asked for it."""
        state = self._state
        region = state.region(robot)
        state.knowledge.resolve(obstacle)
        requested = state.tasks.finish(obstacle)
        state.emit(
            records.Resolved(state.tick, obstacle.name, robot.name, region, requested, traversable)
        )
        if traversable is False:
            self._join(obstacle, records.BlockReason.UNTRAVERSABLE, "found to be untraversable")
        self._pop_done()
        for assignment in state.tasks.current.values():
            assignment.progress.restart_count()
        return self._settle(obstacle, records.Reason.RESOLVED)

    def resynthesize(self) -> list[str]:
        """Synthesize anew whoever needs it, objectives unchanged; those without a strategy."""
        attempt = self._controllers.attempt({})
        if attempt.failed:
            self._controllers.announce(attempt, records.Reason.BLOCKED, attempt.answers)
        else:
            self._controllers.install(attempt, records.Reason.BLOCKED)
        return attempt.failed

    def give_way(self, refuge: Refuge) -> bool:
        """Let robots stand aside for another one; whether they have a strategy for that."""
        state = self._state
        pending = set(state.knowledge.pending)
        changes = {}
        for name, place in refuge.places:
            current = state.tasks.current[name]
            aside = holding(current.objective, place)
            changes[name] = Assignment.meanwhile(aside, current, pending)
        attempt = self._controllers.attempt(changes, strict=())
        if attempt.failed:
            return False
        helper = refuge.places[-1][0]
        frame = state.tasks.push(None, refuge.stuck, helper, state.tick, changes)
        self._tell_push(frame)
        self._controllers.install(attempt, records.Reason.YIELD)
        return True

    def end_way(self, frame: Frame) -> Impasse | None:
        """Those who stood aside go back to what they did, once their frame is on top."""
        frame.done = True
        self._pop_done()
        waiting_or_helping = [n for n, a in self._state.tasks.current.items() if a.temporary]
        attempt = self._controllers.attempt({}, strict=waiting_or_helping)
        if attempt.failed:
            self._controllers.announce(attempt, records.Reason.YIELD, attempt.answers)
            return Impasse(Cause.DEADLOCK, None, tuple(attempt.failed))
        self._controllers.install(attempt, records.Reason.YIELD)
        return None

    def _request(
        self, obstacle: Obstacle, requester: Robot, changes: Mapping[str, Assignment]
    ) -> Impasse | None:
        """Broadcast a request and reassign the team; ``changes`` come with it in any case."""
        state = self._state
        offers = self._offers(obstacle, requester)
        refused: list[Attempt] = []
        plan = self._plan(obstacle, requester, offers, changes, refused)
        state.emit(
            records.Request(
                state.tick,
                obstacle.name,
                requester.name,
                {bid.robot.name: bid.distance for bid in offers},
                plan.helper if plan else None,
                obstacle.resolution_regions(state.scenario.map),
            )
        )
        for attempt in refused:
            self._controllers.announce(attempt, records.Reason.REQUEST, attempt.failed)
        if plan is None:
            return self._without_help(obstacle, requester, offers)
        frame = state.tasks.push(obstacle, requester.name, plan.helper, state.tick, plan.changes)
        self._tell_push(frame)
        self._controllers.install(plan.attempt, records.Reason.REQUEST)
        return None

    def _offers(self, obstacle: Obstacle, requester: Robot) -> list[Bid]:
        """Bids with all pending obstacles avoided where that is possible; where it is not, with
        only those avoided whose resolution itself waits for the requester."""
        cautious = self._bids(obstacle, self._state.knowledge.pending)
        patient = self._bids(obstacle, self._stuck_behind(requester))
        return [
            careful if careful.distance is not None else other
            for careful, other in zip(cautious, patient, strict=True)
        ]

    def _bids(self, obstacle: Obstacle, avoid: Collection[str]) -> list[Bid]:
        state = self._state
        blocked = {r.name: self._blocked(r, avoid) for r in state.scenario.robots}
        poses = {robot.name: state.next_pose(robot) for robot in state.scenario.robots}
        return bids(obstacle, state.scenario.robots, poses, state.scenario.map, blocked)

    def _blocked(self, robot: Robot, avoid: Collection[str]) -> set[Region]:
        return {known.region for known in self._state.knowledge.known_for(robot, avoid)}

    def _stuck_behind(self, requester: Robot) -> set[str]:
        """Pending obstacles that nobody will resolve before ``requester`` moves on."""
        return {
            name
            for name, obstacle in self._state.knowledge.pending.items()
            if (frame := self._state.tasks.request_for(obstacle)) is None
            or self._waits_for(frame.helper, requester.name)
        }

    def _waits_for(self, robot: str, other: str) -> bool:
        """Whether ``robot`` is ``other``, or waits for help that comes from it in the end."""
        waiting = self._state.tasks.waiting()
        seen: set[str] = set()
        while robot != other:
            if robot in seen or robot not in waiting:
                return False
            seen.add(robot)
            robot = waiting[robot].helper
        return True

    def _plan(
        self,
        obstacle: Obstacle,
        requester: Robot,
        offers: list[Bid],
        changes: Mapping[str, Assignment],
        refused: list[Attempt],
    ) -> _Plan | None:
        """The first bidder, nearest first, for whom all that change have a strategy."""
        open_frame = self._state.tasks.request_for(obstacle)
        for helper in self._candidates(obstacle, requester, offers):
            serving = open_frame is not None and open_frame.helper == helper.name
            for change in self._reassignments(obstacle, requester, helper, serving):
                attempt = self._controllers.attempt({**changes, **change})
                if not attempt.failed:
                    return _Plan(helper.name, attempt, {**changes, **change})
                refused.append(attempt)
        return None

    def _candidates(
        self, obstacle: Obstacle, requester: Robot, offers: list[Bid]
    ) -> Iterator[Robot]:
        """Bidders in order; the one that serves the obstacle already comes first, and nobody
        who waits for the requester is asked for what the requester had asked for before."""
        ranked = ranking(offers)
        frame = self._state.tasks.request_for(obstacle)
        if frame is not None:
            ranked.sort(key=lambda robot: robot.name != frame.helper)
        relieved = self._state.tasks.relieved_of(obstacle)
        for robot in ranked:
            if robot.name in relieved:
                continue
            if frame is None or not self._waits_for(robot.name, requester.name):
                yield robot

    def _reassignments(
        self, obstacle: Obstacle, requester: Robot, helper: Robot, serving: bool
    ) -> Iterator[dict[str, Assignment]]:
        """What requester and helper could do, the plainest first: the requester waits where it
        stands or else out of the way, the helper keeps one of its own targets or else none."""
        state = self._state
        pending = set(state.knowledge.pending)
        places = frozenset(obstacle.resolution_regions(state.scenario.map))
        waiting = state.tasks.current[requester.name]
        for region in self._waiting_places(requester, helper, places):
            wait = Assignment.meanwhile(holding(waiting.objective, region), waiting, pending)
            if serving:
                yield {requester.name: wait}
                continue
            current = state.tasks.current[helper.name]
            reachable = self._bids(obstacle, pending)
            careful = any(b.robot is helper and b.distance is not None for b in reachable)
            avoid = pending if careful else self._stuck_behind(requester)
            for own in (*targets_of(current.objective), None):
                task = helping(current.objective, places, own)
                help_ = Assignment.meanwhile(task, current, avoid)
                yield {requester.name: wait, helper.name: help_}

    def _waiting_places(self, requester: Robot, helper: Robot, places: Target) -> Iterator[Region]:
        """Where the requester could wait: where it stands, and if it shares the floor with the
        helper also where it leaves the helper a way, nearest first."""
        state = self._state
        here = state.region(requester)
        yield here
        if requester.model.layer != helper.model.layer:
            return
        pending = set(state.knowledge.pending)
        world = state.scenario.map
        taken = {state.region(r) for r in state.scenario.robots if r is not requester}
        reach = distances(
            requester.model.mobility,
            state.poses[requester.name],
            world,
            self._blocked(requester, pending),
        )
        for region in sorted(reach, key=lambda place: (reach[place], place)):
            if region == here or region in taken or region in places:
                continue
            blocked = {*self._blocked(helper, pending), region}
            way = distances(helper.model.mobility, state.poses[helper.name], world, blocked)
            if any(place in way for place in places):
                yield region

    def _without_help(
        self, obstacle: Obstacle, requester: Robot, offers: list[Bid]
    ) -> Impasse | None:
        """Nobody helps: go on as if the obstacle were a wall, if that is possible."""
        if not offers:
            because, cause = records.BlockReason.NO_CAPABLE_ROBOT, Cause.NO_CAPABLE_ROBOT
        else:
            because = records.BlockReason.NO_HELPER
            cyclic = self._cyclic(obstacle, requester, offers)
            cause = Cause.CYCLIC_REQUESTS if cyclic else Cause.UNREALIZABLE
        self._join(obstacle, because, f"met by {requester.name}, and nobody can remove it")
        self._state.tasks.finish(obstacle)
        self._pop_done()
        return self._settle(obstacle, records.Reason.BLOCKED, cause)

    def _cyclic(self, obstacle: Obstacle, requester: Robot, offers: list[Bid]) -> bool:
        """Whether it is only the waiting for each other that keeps all bidders away."""
        if any(bid.distance is not None for bid in offers):
            return not list(self._candidates(obstacle, requester, offers))
        return any(bid.distance is not None for bid in self._bids(obstacle, ()))

    def _settle(
        self, obstacle: Obstacle, reason: records.Reason, cause: Cause = Cause.UNREALIZABLE
    ) -> Impasse | None:
        """Resynthesize whoever is affected by what is known now. If a helper cannot do its
        part any more, ask the next bidder for it."""
        waiting_or_helping = [n for n, a in self._state.tasks.current.items() if a.temporary]
        attempt = self._controllers.attempt({}, strict=waiting_or_helping)
        if not attempt.failed:
            self._controllers.install(attempt, reason)
            return None
        self._controllers.announce(attempt, reason, attempt.answers)
        frame = self._served_by(attempt.failed)
        if frame is not None and frame.obstacle is not None and self._others_capable(frame):
            saved = frame.saved[frame.helper]
            requester = self._state.scenario.robot(frame.requester)
            frame.relieved = True
            return self._request(frame.obstacle, requester, {frame.helper: saved})
        return Impasse(cause, obstacle, tuple(attempt.failed))

    def _served_by(self, failed: list[str]) -> Frame | None:
        """The newest open frame whose helper is among those who failed."""
        for frame in reversed(self._state.tasks.frames):
            if frame.obstacle is None:
                continue
            if not frame.done and not frame.relieved and frame.helper in failed:
                return frame
        return None

    def _others_capable(self, frame: Frame) -> bool:
        """Whether anybody else than those who have failed could serve a frame."""
        assert frame.obstacle is not None
        failed = {frame.helper, *self._state.tasks.relieved_of(frame.obstacle)}
        return any(
            frame.obstacle.type.action in robot.capabilities and robot.name not in failed
            for robot in self._state.scenario.robots
        )

    def _join(self, obstacle: Obstacle, because: records.BlockReason, reason: str) -> None:
        state = self._state
        state.knowledge.join(obstacle, reason)
        robots = frozenset(r.name for r in state.scenario.robots if obstacle.blocks(r))
        state.emit(records.Blocked(state.tick, obstacle.name, robots, because))

    def _pop_done(self) -> None:
        """Drop the frames on top that have served their purpose."""
        state = self._state
        while frame := state.tasks.pop_done():
            state.emit(records.Pop(*self._frame_data(frame)))

    def _tell_push(self, frame: Frame) -> None:
        self._state.emit(records.Push(*self._frame_data(frame)))

    def _frame_data(
        self, frame: Frame
    ) -> tuple[int, int, dict[str, Objective], str | None, str, str, records.StackReason]:
        """Tick, depth, objectives, obstacle, requester, helper and reason of a stack event."""
        state, obstacle = self._state, frame.obstacle
        return (
            state.tick,
            state.tasks.depth,
            state.objectives(),
            obstacle.name if obstacle is not None else None,
            frame.requester,
            frame.helper,
            records.StackReason.REQUEST if obstacle is not None else records.StackReason.YIELD,
        )
