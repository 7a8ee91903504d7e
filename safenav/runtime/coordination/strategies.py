"""Strategies: from what each robot is to do now to a planner that does it.

One question is asked here, for one robot or for several at once: is there a strategy for everybody
whose specification changed? Each robot has a ladder of specifications, the plainest first: its
objective literally, with its other memory, as plain alternation; and the weakest assumption about
others that will do. Nothing is installed until the answer is yes for all of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from weakref import WeakSet

from safenav.errors import ResourceLimitError
from safenav.explain.undisturbed import play
from safenav.runtime.coordination.objectives import alternating
from safenav.runtime.navigation import Planner
from safenav.runtime.on_demand import OnDemand
from safenav.runtime.over import Stop
from safenav.runtime.team import Assignment, RobotState, Role, TeamState
from safenav.scenario.model import Coordination, Scenario, Tracking
from safenav.scenario.objective import Hold, Ltl, Objective, Patrol, Target, Visit, targets_of
from safenav.scenario.pursuit import Pursuit
from safenav.spec.assignable import Switch, places
from safenav.spec.compile import assumption_names, compile_task
from safenav.spec.objective import Memory
from safenav.spec.others.belief import models
from safenav.spec.task import LADDERS, Fairness, Observed, Task
from safenav.synthesis.serving.served import ServedStrategy
from safenav.synthesis.slugs import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.verdict import SynthesisResult, Verdict
from safenav.trace import records, vocabulary
from safenav.trace.header import heading_in_trace, objective_in_trace
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.partition import Partition


@dataclass(frozen=True)
class Answer:
    """The synthesizer's last word on one robot's task. ``told``: the objective that is to be in
    force, and ``form`` how it stands in the task; ``tried``: what failed before."""

    task: Task
    result: SynthesisResult
    told: Objective
    form: vocabulary.Form = vocabulary.Form.LITERAL
    tried: tuple[records.Tried, ...] = ()

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE


@dataclass(frozen=True)
class Errand:
    """What one robot is to be synthesized for: ``objective`` (with assignable goals not that of
    its ``assignment``). ``avoid``: pending obstacles that it takes for walls, ``must``: those that
    a strategy which it has must know, too. ``forbidden``: poses that it must keep out of for the
    team's sake."""

    assignment: Assignment
    objective: Objective
    avoid: frozenset[str] = frozenset()
    must: frozenset[str] = frozenset()
    forbidden: frozenset[Pose] = frozenset()


@dataclass(frozen=True)
class Attempt:
    """Answers for the robots that were asked about."""

    errands: Mapping[str, Errand]
    answers: Mapping[str, Answer]

    @property
    def failed(self) -> list[str]:
        """The robots that have no strategy."""
        return [name for name, answer in self.answers.items() if not answer.realizable]


Candidate = tuple[vocabulary.Form, Task]


class Strategies:
    """Synthesizes and installs planners; counts what that cost. ``asking``: a synthesis is
    under way. ``literally``: objectives are asked about as they are written, and no other way."""

    def __init__(
        self,
        state: TeamState,
        synthesizer: Synthesizer,
        stop: Stop,
        progress: SynthesisListener | None = None,
        *,
        literally: bool = False,
    ) -> None:
        self._literally = literally
        self._state = state
        self._synthesizer = synthesizer
        self._stop = stop
        self._progress = progress
        self.asking = False
        self._served: WeakSet[ServedStrategy] = WeakSet()
        self.syntheses = 0
        self.seconds = 0.0

    def attempt(self, errands: Mapping[str, Errand]) -> Attempt:
        """Ask for strategies for these robots. Raises ResourceLimitError if a synthesis runs out
        of time or memory, RunOver if the run is to end."""
        ladders = {name: list(self._ladder(name, errand)) for name, errand in errands.items()}
        answers: dict[str, Answer] = {}
        rung = 0
        while True:
            asked = {
                name: ladder[rung]
                for name, ladder in ladders.items()
                if rung < len(ladder) and not (name in answers and answers[name].realizable)
            }
            if not asked:
                return Attempt(errands, answers)
            results = self._ask([task for _, task in asked.values()])
            for (name, (form, task)), result in zip(asked.items(), results, strict=True):
                before = answers.get(name)
                tried = before.tried if before is not None else ()
                if before is not None:
                    failed = before.result
                    verdict = vocabulary.Verdict(failed.verdict.value)
                    tried += (
                        records.Tried(before.task.fairness.value, failed.spec_sha256, verdict),
                    )
                told = errands[name].assignment.objective
                answers[name] = Answer(task, result, told, form, tried)
            rung += 1

    def announce(self, answer: Answer, reason: vocabulary.Reason, node: int | None = None) -> None:
        """Tell what was synthesized for a robot; ``node``: where its strategy begins."""
        task, result = answer.task, answer.result
        world = self._state.scenario.map
        assigned = places(task, world) if task.assignable else None
        believed = task.tracking is Tracking.BELIEF and bool(task.observed)
        self._state.emit(
            records.Synthesis(
                self._state.tick,
                task.robot.name,
                reason,
                vocabulary.Verdict(result.verdict.value),
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
                    other.name: other.region
                    if other.belief is None
                    else tuple(sorted(other.belief))
                    for other in task.observed
                },
                beliefs={
                    model.other.name: tuple(tuple(sorted(b)) for b in model.beliefs)
                    for model in models(task, world)
                }
                if believed
                else None,
                sight_closed=tuple(sorted(task.closed)) if believed else None,
                places=tuple(sorted(assigned)) if assigned is not None else None,
                neutral=min(assigned) if assigned else None,
                forbidden=tuple(
                    (pose.region, heading_in_trace(pose)) for pose in _sorted(task.forbidden)
                )
                or None,
                form=answer.form,
                tried=answer.tried or None,
            )
        )

    def install(self, answer: Answer, reason: vocabulary.Reason) -> None:
        """Put a strategy in force; its robot's assignment must be the one that it is for."""
        served = answer.result.served
        strategy = answer.result.strategy if served is None else OnDemand(served)
        assert strategy is not None
        state = self._state.robots[answer.task.robot.name]
        planner = Planner.start(answer.task, strategy)
        if answer.task.assignable:
            planner.switch = Switch(places(answer.task, self._state.scenario.map))
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

    def close(self) -> None:
        """End the processes that give moves on demand."""
        for served in tuple(self._served):
            served.close()

    def begin(self, state: RobotState) -> None:
        """Count what a robot has met already where it stands when its objective begins (for
        one in transit, when it arrives)."""
        state.begun = True
        values = state.planner.values() if state.planner is not None else {}
        region = state.pose.region
        for goal in state.progress.begin(region, values):
            self._state.emit(
                records.Goal(self._state.tick, state.name, goal, region, state.progress.rounds)
            )

    def outdated(self, name: str, errand: Errand) -> bool:
        """Whether the strategy in force does not do for an errand: another objective, a wall that
        it does not know, a pose that it does not keep out of."""
        state = self._state.robots[name]
        planner = state.planner
        if planner is None or planner.node is None:
            return True
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

    def _ask(self, tasks: list[Task]) -> list[SynthesisResult]:
        self._stop.check()
        world = self._state.scenario.map
        self.asking = True

        def hear(progress: object) -> None:
            self._stop.check()
            if self._progress is not None:
                self._progress(progress)  # type: ignore[arg-type]

        try:
            results = self._synthesizer.synthesize_all(
                [compile_task(task, world) for task in tasks], progress=hear
            )
        finally:
            self.asking = False
        for result in results:
            if result.served is not None:
                self._served.add(result.served)
            self.syntheses += 1
            self.seconds += 0.0 if result.cached else result.seconds
            if result.verdict not in (Verdict.REALIZABLE, Verdict.UNREALIZABLE):
                raise ResourceLimitError(
                    f"the synthesis for {result.robot} ended by {result.verdict.value} after "
                    f"{result.seconds:.1f} s; raise limits.synthesis_seconds or "
                    "limits.synthesis_memory in the scenario"
                )
        return results

    def _ladder(self, name: str, errand: Errand) -> Iterator[Candidate]:
        """The specifications to try for a robot, the plainest and weakest first."""
        state = self._state.robots[name]
        for form, objective, memory in self._forms(state, errand):
            task = self._task(state, errand, objective, memory)
            for fairness in rungs(task):
                yield form, replace(task, fairness=fairness)

    def _forms(
        self, state: RobotState, errand: Errand
    ) -> Iterator[tuple[vocabulary.Form, Objective, Memory]]:
        """The spellings of an objective that a robot could meet alone on the map; the last one
        in any case, so that there is something to ask."""
        objective = errand.objective
        literal = vocabulary.Form.LITERAL
        if not isinstance(objective, Patrol):
            own = errand.assignment.role is Role.OWN or self._is_assignable
            keeps = own or isinstance(objective, Ltl)
            yield literal, objective, state.memory if keeps else Memory()
            return
        index = state.own.memory.index
        plain = alternating(objective)
        if self._literally and not (self._state.rivals(state.robot) or self._is_assignable):
            yield literal, objective, Memory(index)
            return
        if self._state.rivals(state.robot) or self._is_assignable:
            yield vocabulary.Form.ALTERNATION, plain, Memory(index)
            return
        walls = self._state.knowledge.walls_for(state.robot, errand.avoid)
        blocked = frozenset(known.region for known in walls)
        mobility, pose = state.robot.model.mobility, state.next_pose
        for form, memory in (
            (literal, Memory(index)),
            (vocabulary.Form.OTHER_MEMORY, Memory(1 - index)),
        ):
            solo = play(mobility, pose, objective, memory, self._state.scenario.map, blocked)
            if solo.winnable:
                yield form, objective, memory
        yield vocabulary.Form.ALTERNATION, plain, Memory(index)

    @property
    def _is_assignable(self) -> bool:
        return self._state.scenario.coordination is Coordination.ASSIGNABLE

    def _task(
        self, state: RobotState, errand: Errand, objective: Objective, memory: Memory
    ) -> Task:
        """What a robot is to be synthesized for, from where it can next decide anything."""
        team, robot = self._state, state.robot
        observed = []
        for other in team.robots.values():
            if other is state:
                continue
            danger = team.scenario.conflict(robot, other.robot)
            if danger or other.name in robot.tracks:
                targets = targets_of(other.assignment.objective)
                observed.append(self._observed(state, other, targets, danger))
        cells = team.scenario.partition
        return Task(
            robot=robot,
            pose=state.next_pose,
            objective=objective,
            memory=memory,
            blocked=team.knowledge.walls_for(robot, errand.avoid),
            observed=tuple(observed),
            tracking=robot.tracking,
            assignable=self._is_assignable,
            partition=None if cells is None else Partition(cells),
            closed=team.knowledge.standing,
            forbidden=errand.forbidden,
        )

    def _observed(
        self, state: RobotState, other: RobotState, targets: tuple[Target, ...], danger: bool
    ) -> Observed:
        """``other`` as a robot knows it: where it is, or what is believed of it."""
        where: Region = other.next_pose.region
        if state.robot.tracking is Tracking.BELIEF:
            known = self._state.beliefs.of(state.name, other.name, where)
            if isinstance(known, frozenset):
                return Observed(other.name, where, targets, danger, known)
            where = known
        return Observed(other.name, where, targets, danger)


def rungs(task: Task) -> tuple[Fairness, ...]:
    """The assumptions that a task can make about others, from weakest to strongest, without
    those that cannot do.

    By what is next to it, a robot that has anywhere to go can be kept from it for ever: whoever is
    in the way may always be on the side of the target. So only one that is where it stays needs no
    assumption.
    """
    if not task.endangered:
        return (Fairness.NONE,)
    objective = task.objective
    if task.tracking is Tracking.NEARBY and not isinstance(objective, Ltl):
        targets = task.targets
        settled = isinstance(objective, Hold | Visit) and len(targets) == 1
        if task.assignable or not (settled and task.pose.region in targets[0]):
            return (Fairness.OUT_OF_MY_WAY,)
    return LADDERS[task.tracking]


def first_answers(
    scenario: Scenario,
    synthesizer: Synthesizer,
    progress: SynthesisListener | None = None,
    names: Collection[str] | None = None,
) -> dict[str, Answer]:
    """The synthesizer's answers for the start of a scenario, without a run: for the robots
    with these names (default: all), in the scenario's order, their objectives as written."""
    state = TeamState.initial(scenario)
    strategies = Strategies(state, synthesizer, Stop(), progress, literally=True)
    errands = {
        name: Errand(entry.assignment, entry.robot.objective)
        for name, entry in state.robots.items()
        if names is None or name in names
    }
    return dict(strategies.attempt(errands).answers)


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


def _sorted(poses: frozenset[Pose]) -> list[Pose]:
    return sorted(poses, key=lambda pose: (pose.region, pose.heading or 0))
