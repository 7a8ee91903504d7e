"""The strategies in force: told in the trace, installed, begun, and when they no longer do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from safenav.dataclass import dataclass
from safenav.runtime.coordination.asking import Answer, Attempt
from safenav.runtime.coordination.ladder import Errand
from safenav.runtime.navigation import Planner
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl, Patrol, Visit
from safenav.scenario.pursuit import Pursuit
from safenav.spec.assignable import Switch, neutral
from safenav.spec.compile import assumption_names
from safenav.spec.forms import alternating
from safenav.spec.others.belief import models
from safenav.spec.sending import Sending, sending
from safenav.spec.task import Fairness, Task
from safenav.synthesis.verdict import SynthesisResult
from safenav.trace import records, vocabulary
from safenav.trace.header import heading_in_trace, objective_in_trace
from safenav.trace.vocabulary import Place
from safenav.world.moves import Pose

if TYPE_CHECKING:
    from safenav.runtime.on_demand import OnDemand
    from safenav.synthesis.serving.served import ServedStrategy


@dataclass(frozen=True)
class Strategies:
    """Puts strategies in force for the robots of a team, and knows which no longer do."""

    _state: TeamState

    def install_all(
        self, attempt: Attempt, errands: Mapping[str, Errand], reason: vocabulary.Reason
    ) -> None:
        """Put errands in force, with the strategies found for them. All assignments first, so
        that each line of the trace is true when it is written."""
        robots = self._state.robots
        for name, errand in errands.items():
            robots[name].assign(errand.assignment)
        for answer in attempt.answers.values():
            self._install(answer, reason)
        for robot in robots.values():
            if not robot.begun and robot.transit is None:
                self.begin(robot)

    def announce(self, answer: Answer, reason: vocabulary.Reason, node: int | None = None) -> None:
        """Tell what was synthesized for a robot; ``node``: where its strategy begins."""
        self._state.emit(synthesis_told(answer, reason, self._state, node))

    def _install(self, answer: Answer, reason: vocabulary.Reason) -> None:
        """Put a strategy in force; its robot's assignment must be the one that it is for."""
        served = answer.result.served
        most = self._state.scenario.limits.states
        strategy = _on_demand(served, most) if served is not None else answer.result.strategy
        assert strategy is not None
        state = self._state.robots[answer.task.robot.name]
        planner = Planner.start(answer.task, strategy)
        if answer.task.assignable:
            planner.switch = Switch(sending(answer.task, self._state.scenario.map))
        if (
            answer.form is vocabulary.Form.OTHER_MEMORY
            and state.assignment.role is Role.OWN
            and answer.task.memory.index != state.own.memory.index
        ):
            state.own.other_way_round()
        if state.planner is not None:
            state.planner.strategy.close()
        state.planner = planner
        self.announce(answer, reason, planner.node)

    def begin(self, state: RobotState) -> None:
        """Count what a robot has met already where it stands when its objective begins (for
        one in transit, when it arrives)."""
        state.begun = True
        values = state.planner.values() if state.planner is not None else {}
        region = state.pose.region
        met = state.progress.begin(region, values)
        for goal, rounds in state.progress.counted(met):
            self._state.emit(records.Goal(self._state.tick, state.name, goal, region, rounds))

    def stale(self, errands: Mapping[str, Errand], *, always: bool) -> dict[str, Errand]:
        """The errands for which a robot's strategy does not do (``always``: all)."""
        return {
            name: errand
            for name, errand in errands.items()
            if always or self._outdated(name, errand)
        }

    def _outdated(self, name: str, errand: Errand) -> bool:
        """Whether the strategy in force does not do for an errand: another objective, a wall that
        it does not know, a pose that it does not keep out of."""
        state = self._state.robots[name]
        planner = state.planner
        if not state.active and errand.assignment == state.assignment:
            return False  # it asks for a move when it is back
        if planner is None:
            return True
        if planner.node is None and state.transit is None and not state.arriving:
            return True  # others find their node when they have arrived
        old = planner.task
        if alternating(old.objective) != alternating(errand.objective):
            return True
        known = {(k.region, k.item) for k in old.blocked}
        walls = self._state.knowledge.walls_for(state.robot, errand.must)
        if not {(k.region, k.item) for k in walls} <= known:
            return True
        if not errand.forbidden <= old.forbidden:
            return True
        if old.tracking is Tracking.BELIEF and old.observed:
            return old.closed != self._state.knowledge.standing
        return False

    def relocate(self, state: RobotState) -> bool:
        """Find the node of a robot's strategy for where it stands and what it remembers; whether
        there is one."""
        planner = state.planner
        if planner is None:
            return False
        return planner.relocate(state.pose, state.progress, self._seen_now(state, planner.task))

    def catch_up(self, state: RobotState) -> None:
        """A robot was kept from answering its last look: it goes on in a node that remembers that
        look. If there is none it stays in its node, which may do."""
        planner = state.planner
        if planner is None:
            return
        node = planner.node
        if not self._seen_now(state, planner.task) and planner.switch is None:
            planner.behind = False  # its nodes remember nothing of a look
        elif node is not None and not self.relocate(state):
            planner.node = node

    def _seen_now(self, state: RobotState, task: Task) -> dict[str, int]:
        """The inputs that a strategy remembers from the last step, as they are now."""
        if task.tracking is Tracking.NEARBY or not task.observed:
            return {}
        found = {}
        if task.tracking is Tracking.EXACT:
            return {o.variable: self._state.robots[o.name].pose.region for o in task.observed}
        for model in models(task, self._state.scenario.map):
            other = model.other
            told = self._state.robots[other.name].pose.region
            known = self._state.beliefs.of(state.name, other.name, told)
            found[other.variable] = model.number(known)
        return found


def synthesis_told(
    answer: Answer, reason: vocabulary.Reason, state: TeamState, node: int | None
) -> records.Synthesis:
    """The line of a trace about a synthesis: its result, and all that its specification was made
    from."""
    task, result = answer.task, answer.result
    world = state.scenario.map
    possible = sending(task, world) if task.assignable else None
    believed = task.tracking is Tracking.BELIEF and bool(task.observed)
    return records.Synthesis(
        state.tick,
        task.robot.name,
        reason,
        vocabulary.RecordedVerdict(result.verdict.value),
        round(result.seconds, 6),
        result.states,
        result.cached,
        _verified(result),
        result.spec_sha256,
        result.strategy_sha256,
        objective_in_trace(answer.told),
        tuple(assumption_names(task, world)),
        node=node,
        region=task.pose.region,
        heading=heading_in_trace(task.pose),
        memory=_memory(task),
        closed=tuple((known.region, known.item) for known in task.blocked),
        moving=tuple(other.name for other in task.observed if other.danger),
        tracked=tuple(other.name for other in task.observed if not other.danger),
        tracking=task.tracking.value,
        fairness=task.fairness.value,
        others_targets={
            other.name: tuple(tuple(sorted(target)) for target in other.targets)
            for other in task.observed
            if task.fairness is Fairness.AT_ITS_TARGETS
        },
        knowledge={
            other.name: other.region if other.belief is None else tuple(sorted(other.belief))
            for other in task.observed
        },
        beliefs={
            model.other.name: tuple(tuple(sorted(b)) for b in model.beliefs)
            for model in models(task, world)
        }
        if believed
        else None,
        sight_closed=tuple(sorted(task.closed)) if believed else None,
        places=tuple(sorted(possible.places)) if possible is not None else None,
        neutral=neutral(possible) if possible is not None else None,
        places_from=_places_from(possible) if possible is not None else None,
        forbidden=_told(task.forbidden) or None,
        form=answer.form,
        allows=answer.allows(world.word),
        tried=answer.tried or None,
    )


def _places_from(possible: Sending) -> tuple[records.PlacesFrom, ...] | None:
    found = (
        records.PlacesFrom(tuple(sorted(part.regions)), _told(poses), dict(memory) or None)
        for part in possible.parts
        for memory, poses in part.poses().items()
    )
    return tuple(found) or None


def _verified(result: SynthesisResult) -> bool | vocabulary.Verified | None:
    return result.verified if result.served is None else vocabulary.Verified.MOVES


def _memory(task: Task) -> dict[str, int] | None:
    """The variables that remember, and their values at the start."""
    match task.objective:
        case Patrol():
            return {"scout": Pursuit(task.objective).begin(task.pose.region, task.memory.index)}
        case Visit(targets) if len(targets) > 1:
            return {"goal": task.memory.index}
        case Ltl():
            return dict(task.memory.values)
        case _:
            return None


def _on_demand(served: ServedStrategy, most: int) -> OnDemand:
    # Imported where it is needed: most strategies are listed.
    from safenav.runtime.on_demand import OnDemand

    return OnDemand(served, most)


def _told(poses: frozenset[Pose]) -> tuple[Place, ...]:
    """Poses as a trace tells them."""
    ordered = sorted(poses, key=lambda pose: (pose.region, pose.heading or 0))
    return tuple((pose.region, heading_in_trace(pose)) for pose in ordered)
