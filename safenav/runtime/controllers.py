"""Controllers: from what each robot is to do now to a planner that does it.

One question is asked here, for one robot or for several at once: given these assignments, is
there a strategy for everybody whose specification changed? Nothing is installed until the
answer is yes for all of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from safenav.errors import ResourceLimitError
from safenav.runtime.environment import SimulatedWorld
from safenav.runtime.navigation import Planner
from safenav.runtime.state import TeamState, with_alternation
from safenav.runtime.tasks import Assignment
from safenav.scenario.model import Coordination, Robot, Scenario, Tracking
from safenav.scenario.objective import Hold, Ltl, Target, targets_of
from safenav.spec.assignable import Switch, places
from safenav.spec.circumstances import circumstances
from safenav.spec.compile import assumption_names, compile_task
from safenav.spec.task import LADDERS, Fairness, Known, Observed, Task
from safenav.synthesis.slugs import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.verdict import SynthesisResult, Verdict
from safenav.trace import records
from safenav.trace.header import objective_in_trace
from safenav.world.map import Region
from safenav.world.partition import Partition


@dataclass(frozen=True)
class Answer:
    """The synthesizer's last word on one robot's task."""

    task: Task
    result: SynthesisResult

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE


@dataclass(frozen=True)
class Attempt:
    """Answers for all robots whose specification would change under ``assignments``."""

    assignments: Mapping[str, Assignment]
    answers: Mapping[str, Answer]

    @property
    def failed(self) -> list[str]:
        """The robots that have no strategy."""
        return [name for name, answer in self.answers.items() if not answer.realizable]


class Controllers:
    """Synthesizes and installs planners; counts what that cost. ``asking``: a synthesis is
    under way."""

    def __init__(
        self,
        state: TeamState,
        synthesizer: Synthesizer,
        progress: SynthesisListener | None = None,
    ) -> None:
        self._state = state
        self._synthesizer = synthesizer
        self._progress = progress
        self.asking = False
        self.syntheses = 0
        self.seconds = 0.0

    def attempt(
        self,
        changes: Mapping[str, Assignment],
        strict: Collection[str] | None = None,
        only: Collection[str] | None = None,
    ) -> Attempt:
        """Ask for strategies under the assignments in force with ``changes`` made to them.

        Robots in ``strict`` (default: all that change) take those who wait as obstacles; the
        others may instead rely on their moving on. ``only`` restricts the question to some
        robots. Raises ResourceLimitError if a synthesis
        runs out of time or memory.
        """
        assignments = {**self._state.tasks.current, **changes}
        if strict is None:
            strict = changes.keys()
        stale = [
            (robot, task)
            for robot in self._state.scenario.robots
            if (only is None or robot.name in only)
            and self._differs(robot, task := self._task(robot, assignments, parked=True))
        ]
        answers: dict[str, Answer] = {}
        for ladder in self._rounds(stale, assignments, strict):
            open_tasks = [t for t in ladder if not _answered(answers, t)]
            for answer in self._ask(open_tasks):
                answers[answer.task.robot.name] = answer
        return Attempt(assignments, answers)

    def announce(self, attempt: Attempt, reason: records.Reason, names: Iterable[str]) -> None:
        """Tell what was synthesized for some robots of an attempt."""
        for name in names:
            task, result = attempt.answers[name].task, attempt.answers[name].result
            planner = None
            if result.strategy is not None:
                planner = Planner.start(task, result.strategy, attempt.assignments[name])
            self._state.emit(
                records.Synthesis(
                    self._state.tick,
                    name,
                    reason,
                    records.Verdict(result.verdict.value),
                    round(result.seconds, 6),
                    result.states,
                    result.cached,
                    result.verified,
                    result.spec_sha256,
                    result.strategy_sha256,
                    objective_in_trace(task.objective),
                    tuple(assumption_names(task, self._state.scenario.map)),
                    None if planner is None else planner.node,
                    **circumstances(task, self._state.scenario.map),
                )
            )

    def install(self, attempt: Attempt, reason: records.Reason) -> None:
        """Put a successful attempt in force: its assignments must be the current ones."""
        self.announce(attempt, reason, attempt.answers)
        fresh: list[str] = []
        for name, answer in attempt.answers.items():
            strategy = answer.result.strategy
            assert strategy is not None
            before = self._state.planners.get(name)
            planner = Planner.start(answer.task, strategy, attempt.assignments[name])
            if answer.task.assignable:
                planner.switch = Switch(places(answer.task, self._state.scenario.map))
            self._state.planners[name] = planner
            if before is None or before.assignment is not planner.assignment:
                fresh.append(name)
            else:
                planner.begun, planner.before = before.begun, before.before
        for name in fresh:
            if name not in self._state.transits:
                self.begin(name)

    def begin(self, name: str) -> None:
        """Count what a robot has met already where it stands when its objective begins (for
        one in transit, when it arrives)."""
        planner = self._state.planners[name]
        planner.begun = True
        region = self._state.poses[name].region
        progress = planner.assignment.progress
        for goal in progress.begin(region, planner.values()):
            self._state.emit(
                records.Goal(self._state.tick, name, goal.goal, region, progress.rounds)
            )

    def _rounds(
        self,
        stale: list[tuple[Robot, Task]],
        assignments: Mapping[str, Assignment],
        strict: Collection[str],
    ) -> Iterable[list[Task]]:
        """The tasks to try, from the weakest assumptions to the strongest."""
        hopeful = [
            moving
            for robot, task in stale
            if robot.name not in strict
            and (moving := self._task(robot, assignments, parked=False)) != task
        ]
        for tasks in ([task for _, task in stale], hopeful):
            for rung in range(max(map(len, LADDERS.values()))):
                yield [
                    replace(task, fairness=ladder[rung])
                    for task in tasks
                    if rung < len(ladder := _ladder(task))
                ]

    def _ask(self, tasks: list[Task]) -> list[Answer]:
        if not tasks:
            return []
        world = self._state.scenario.map
        self.asking = True
        try:
            results = self._synthesizer.synthesize_all(
                [compile_task(task, world) for task in tasks], progress=self._progress
            )
        finally:
            self.asking = False
        for result in results:
            self.syntheses += 1
            self.seconds += 0.0 if result.cached else result.seconds
            if result.verdict not in (Verdict.REALIZABLE, Verdict.UNREALIZABLE):
                raise ResourceLimitError(
                    f"the synthesis for {result.robot} ended by {result.verdict.value} after "
                    f"{result.seconds:.1f} s; raise limits.synthesis_seconds or "
                    "limits.synthesis_memory in the scenario"
                )
        return [Answer(task, result) for task, result in zip(tasks, results, strict=True)]

    def _task(self, robot: Robot, assignments: Mapping[str, Assignment], parked: bool) -> Task:
        """What ``robot`` is to be synthesized for, from its current pose.

        With ``parked`` a robot that waits where it stands is an obstacle like any other;
        without, it is one that moves.
        """
        state = self._state
        assignment = assignments[robot.name]
        assignable = state.scenario.coordination is Coordination.ASSIGNABLE
        blocked = list(state.knowledge.known_for(robot, assignment.avoid))
        observed = []
        for other in state.scenario.robots:
            if other is robot:
                continue
            danger = state.scenario.conflict(robot, other)
            where = state.next_pose(other).region
            still = parked and not assignable and other.name not in state.transits
            if danger and still and is_parked(assignments[other.name], where):
                blocked.append(Known(where, f"robots.{other.name}", f"{other.name} waits here"))
            elif danger or other.name in robot.tracks:
                targets = targets_of(assignments[other.name].objective)
                observed.append(self._observed(robot, other, where, targets, danger))
        cells = state.scenario.partition
        return Task(
            robot=robot,
            pose=state.next_pose(robot),
            objective=assignment.specified or assignment.objective,
            memory=assignment.progress.memory,
            blocked=tuple(blocked),
            observed=tuple(observed),
            tracking=robot.tracking,
            assignable=assignable,
            partition=None if cells is None else Partition(cells),
            closed=state.knowledge.standing,
        )

    def _observed(
        self,
        robot: Robot,
        other: Robot,
        where: Region,
        targets: tuple[Target, ...],
        danger: bool,
    ) -> Observed:
        """``other`` as ``robot`` knows it: where it is, or what is believed of it."""
        if robot.tracking is Tracking.BELIEF:
            known = self._state.beliefs.of(robot.name, other.name, where)
            if isinstance(known, frozenset):
                return Observed(other.name, where, targets, danger, known)
            where = known
        return Observed(other.name, where, targets, danger)

    def _differs(self, robot: Robot, task: Task) -> bool:
        """Whether the planner in force is for another task (poses and memory aside)."""
        planner = self._state.planners.get(robot.name)
        if planner is None or planner.node is None:
            return True
        old = planner.task
        if old.objective != task.objective or set(_kept(old)) != set(_kept(task)):
            return True
        if task.tracking is Tracking.BELIEF and old.closed != task.closed:
            return True
        relied = old.fairness is Fairness.AT_ITS_TARGETS
        return {(o.name, o.targets if relied else ()) for o in old.observed} != {
            (o.name, o.targets if relied else ()) for o in task.observed
        }


def first_answers(
    scenario: Scenario,
    synthesizer: Synthesizer,
    progress: SynthesisListener | None = None,
    names: Collection[str] | None = None,
) -> dict[str, Answer]:
    """The synthesizer's answers for the start of a scenario, without a run: for the robots
    with these names (default: all), in the scenario's order."""
    scenario = with_alternation(scenario)
    state = TeamState.initial(scenario, SimulatedWorld(scenario))
    attempt = Controllers(state, synthesizer, progress).attempt({}, strict=(), only=names)
    return dict(attempt.answers)


def _ladder(task: Task) -> tuple[Fairness, ...]:
    """The assumptions that a task can make about others, from weakest to strongest."""
    return LADDERS[task.tracking] if task.endangered else (Fairness.NONE,)


def _answered(answers: Mapping[str, Answer], task: Task) -> bool:
    answer = answers.get(task.robot.name)
    return answer is not None and answer.realizable


def _kept(task: Task) -> list[tuple[Region, str]]:
    return [(known.region, known.item) for known in task.blocked]


def is_parked(assignment: Assignment, where: Region) -> bool:
    """Whether a robot that stands in ``where`` will stay there until it is reassigned."""
    objective = assignment.objective
    if isinstance(objective, Hold):
        return where in objective.target
    if isinstance(objective, Ltl):
        return f"region = {where} -> region' = {where}" in objective.safety
    return False
