"""What the coordination layer tells the trace: requests and bids, the stack, what joins O."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from safenav.dataclass import dataclass
from safenav.runtime.coordination.asking import Answer
from safenav.runtime.coordination.duties import Settlement
from safenav.runtime.coordination.floor import Floor
from safenav.runtime.coordination.ladder import Errand
from safenav.runtime.coordination.negatives import closure_told
from safenav.runtime.coordination.proofs import Closure
from safenav.runtime.coordination.reasons import Shortfall, shortfall_words, why_nobody
from safenav.runtime.coordination.requests import Request, Requests
from safenav.runtime.knowledge import UNTRAVERSABLE, Met
from safenav.runtime.team import Role, TeamState
from safenav.runtime.world import Change
from safenav.scenario.model import Coordination, Obstacle, Robot
from safenav.trace import records, vocabulary
from safenav.trace.header import objective_in_trace
from safenav.trace.objective import Objective
from safenav.trace.proofs import Proof


@dataclass
class Announcing:
    """Emits the records of one mission's coordination."""

    state: TeamState
    requests: Requests

    def __post_init__(self) -> None:
        self._over: list[Request] = []
        self._said: Mapping[str, Objective] = self.state.objectives()

    def opened(self, obstacle: Obstacle, requester: str) -> None:
        """A robot asks for help with an obstacle."""
        request = self.requests.open(
            obstacle,
            requester,
            self.state.robots[requester].next_pose.region,
            self.state.tick,
            self.state.objectives(),
        )
        request.told = None

    def met(self, robot: Robot, met: Met) -> None:
        """``robot`` has met one of the needs of an obstacle, with others or alone."""
        self.state.emit(
            records.Met(
                self.state.tick,
                met.obstacle.name,
                met.need,
                met.obstacle.needs[met.need].action,
                robot.name,
                self.state.robots[robot.name].pose.region,
                robots=met.group if len(met.group) > 1 else None,
            )
        )

    def resolved(self, robot: Robot, obstacle: Obstacle, traversable: bool | None) -> None:
        """``robot`` has resolved an obstacle."""
        state = self.state
        request = self.requests.of(obstacle.name)
        if request is not None:
            self._over.append(request)
        helped = state.knowledge.helped(obstacle)
        state.emit(
            records.Resolved(
                state.tick,
                obstacle.name,
                robot.name,
                state.robots[robot.name].pose.region,
                request is not None and request.told is not None,
                traversable,
                robots=helped if len(helped) > 1 else None,
            )
        )

    def changed(self, change: Change) -> None:
        """An obstacle has come or gone by itself."""
        state, name = self.state, change.obstacle.name
        state.introduce(change.obstacle, change.truth)
        cause = vocabulary.ChangeCause.SCENARIO
        if change.by_user:
            cause = vocabulary.ChangeCause.USER
        elif change.obstacle not in state.scenario.obstacles:
            cause = vocabulary.ChangeCause.WORLD
        kind = records.Appeared if change.appeared else records.Gone
        state.emit(kind(state.tick, name, cause))
        if change.another and change.truth is not None:
            state.emit(records.Truth(state.tick, name, change.truth, cause))
        request = self.requests.of(name)
        if request is not None:
            self._over.append(request)

    def joined(
        self,
        obstacle: Obstacle,
        reason: vocabulary.BlockReason,
        proof: Proof | None = None,
        because: str | None = None,
    ) -> None:
        """An obstacle stays for good."""
        state = self.state
        known = {
            vocabulary.BlockReason.UNTRAVERSABLE: UNTRAVERSABLE,
            vocabulary.BlockReason.NO_CAPABLE_ROBOT: "too few robots can remove it",
        }
        state.knowledge.join(obstacle, known.get(reason, "nobody can ever resolve it"))
        blocked = frozenset(
            name for name, robot in state.robots.items() if obstacle.blocks(robot.robot)
        )
        state.emit(records.Blocked(state.tick, obstacle.name, blocked, reason, proof, because))

    def never_resolved(self, floor: Floor, gate: int, closure: Closure, lacks: Shortfall) -> None:
        """An obstacle joins O because the closure never brings it any further."""
        request = self.requests.of(floor.gates[gate])
        assert request is not None
        needs = request.obstacle.needs
        able = all(
            sum(need.action in r.robot.capabilities for r in self.state.robots.values())
            >= need.robots
            for need in needs
        )
        because = shortfall_words(lacks, self.state.scenario.map.word, "it")
        if request.told is None or not able:
            self._request(request, floor, (), because)
        reason = vocabulary.BlockReason.UNRESOLVABLE
        if not able:
            reason = vocabulary.BlockReason.NO_CAPABLE_ROBOT
        self.joined(request.obstacle, reason, closure_told(floor, closure), because)
        self._over.append(request)

    def stack(
        self,
        floor: Floor,
        found: Settlement,
        errands: Mapping[str, Errand],
        refused: Mapping[tuple[str, str], Answer],
        announce: Callable[[Answer, vocabulary.Reason], None],
    ) -> None:
        """What came of the requests, once strategies for everybody are found."""
        state = self.state
        objectives = {
            name: objective_in_trace(errand.assignment.objective)
            for name, errand in errands.items()
        }
        depth = self.requests.depth + sum(len(request.entries) for request in self._over)
        changes = any(request.entries for request in self._over)
        for request in self._over:
            for entry in reversed(request.entries):
                depth -= 1
                state.emit(self._entry(records.Pop, request, entry, depth, objectives))
        self._over.clear()
        for request in self.requests:
            helpers = tuple(
                name
                for name, errand in errands.items()
                if errand.assignment.role is Role.HELPS
                and errand.assignment.obstacle == request.obstacle.name
            )
            request.helpers = helpers
            if request.told is None or helpers not in ((), request.told):
                gate = floor.gates.index(request.obstacle.name)
                word = state.scenario.map.word
                because = None if helpers else why_nobody(floor, found, gate, word)
                self._request(request, floor, helpers, because)
                request.told = helpers
                for (_, obstacle), answer in refused.items():
                    if obstacle == request.obstacle.name:
                        announce(answer, vocabulary.Reason.REQUEST)
            changes = changes or bool(request.unpushed)
            for requester in request.unpushed:
                entry = (requester, helpers)
                request.entries.append(entry)
                depth += 1
                state.emit(self._entry(records.Push, request, entry, depth, objectives))
        if state.scenario.coordination is Coordination.ASSIGNABLE and not changes:
            for name, objective in objectives.items():  # else lines of syntheses say so
                if objective != self._said[name]:
                    state.emit(records.Told(state.tick, name, objective))
        self._said = objectives

    def _entry(
        self,
        kind: type[records.Push] | type[records.Pop],
        request: Request,
        entry: tuple[str, tuple[str, ...]],
        depth: int,
        objectives: Mapping[str, Objective],
    ) -> records.Record:
        requester, helpers = entry
        return kind(
            self.state.tick,
            depth,
            objectives,
            request.obstacle.name,
            requester,
            helpers[0] if helpers else None,
            helpers=helpers if len(helpers) > 1 else None,
        )

    def _request(
        self, request: Request, floor: Floor, helpers: tuple[str, ...], because: str | None
    ) -> None:
        """The request with its bids: ticks to the nearest region of the need that is next."""
        state = self.state
        gate = floor.gates.index(request.obstacle.name)
        need = floor.stages[gate].need
        regions = request.obstacle.resolution_regions(state.scenario.map, need)
        bids = {  # one out of service gets nowhere, though it may be counted on to come back
            name: ticks if state.robots[name].active or ticks == 0 else None
            for name, ticks in bids_for(floor, gate).items()
        }
        state.emit(
            records.Request(
                state.tick,
                request.obstacle.name,
                list(request.requesters)[-1],
                bids,
                helpers[0] if helpers else None,
                regions,
                helpers=helpers if len(helpers) > 1 else None,
                need=need if len(request.obstacle.needs) > 1 else None,
                because=because,
            )
        )


def bids_for(floor: Floor, gate: int) -> dict[str, int | None]:
    """How many ticks each robot with the action needs to where it can perform it; None if it
    cannot get there while the open obstacles are walls."""
    problem, stages = floor.problem, floor.stages
    need = problem.next_need(gate, stages)
    found: dict[str, int | None] = {}
    for index, member in enumerate(problem.members):
        if need.action not in member.capabilities:
            continue
        steps = member.graph.steps_between(
            1 << floor.poses[index],
            member.graph.poses_on(need.regions),
            problem.allowed(index, stages),
        )
        found[member.name] = None if steps is None else steps * member.ticks
    return found
