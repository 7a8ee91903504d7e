"""A mission: the tick loop that executes a team's controllers in the actual world.

    result = Mission(load_scenario(path)).run()

or one tick after the other with ``start`` and ``step``. Source: paper, Section V; DESIGN,
section 5. Nothing here depends on a simulation: whoever implements ``World`` drives real robots.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import safenav
from safenav.errors import SafenavError
from safenav.runtime.controllers import Controllers
from safenav.runtime.coordination import Impasse, Resynthesis
from safenav.runtime.environment import (
    SimulatedWorld,
    Violation,
    World,
    draw_truths,
)
from safenav.runtime.events import (
    AssumptionViolated,
    Backtracked,
    Ended,
    GoalReached,
    Header,
    Moved,
    Reason,
    Violated,
)
from safenav.runtime.explanation import explain_impasse, explain_unrealizable
from safenav.runtime.navigation import Planner, Proposal
from safenav.runtime.state import TeamState
from safenav.runtime.trace import Listener, scenario_record
from safenav.scenario.model import Outcome, Robot, Scenario
from safenav.synthesis.slugs import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer


@dataclass(frozen=True)
class RunResult:
    """How a run ended. ``cause`` says more about ``operator_needed``."""

    outcome: Outcome
    explanation: str
    cause: str | None
    rounds: dict[str, int]
    ticks: int
    seconds: float
    syntheses: int
    synthesis_seconds: float


class Mission:
    """One run of a scenario.

    ``world``: default a simulation of the scenario's hidden obstacles. ``listeners`` see every
    event as it happens (a ``TraceWriter`` is one). ``progress`` hears of running syntheses.
    """

    def __init__(
        self,
        scenario: Scenario,
        synthesizer: Synthesizer | None = None,
        *,
        world: World | None = None,
        listeners: Iterable[Listener] = (),
        progress: SynthesisListener | None = None,
    ) -> None:
        self.scenario = scenario
        self.result: RunResult | None = None
        self._world = world or SimulatedWorld(scenario)
        self.state = TeamState.initial(scenario, self._world, listeners)
        self._controllers = Controllers(
            self.state, synthesizer or default_synthesizer(scenario), progress
        )
        self._coordination = Resynthesis(self.state, self._controllers)
        self._begun = time.monotonic()

    def run(self) -> RunResult:
        """Run to the end. Ctrl-C ends the run with the outcome ``interrupted``, recorded.

        Raises SafenavError if the synthesizer fails or runs out of its limits; the trace then
        ends in ``error``.
        """
        try:
            self.start()
            while self.result is None:
                self.step()
        except KeyboardInterrupt:
            self._end(Outcome.INTERRUPTED, "interrupted by the user")
        except SafenavError as error:
            self._emit_end("error", str(error), None)
            raise
        assert self.result is not None
        return self.result

    def start(self) -> None:
        """Synthesize the first controllers; a robot without one ends the run here."""
        state = self.state
        self._begun = time.monotonic()
        state.emit(Header(0, safenav.__version__, scenario_record(self.scenario, self._truths())))
        attempt = self._controllers.attempt({}, strict=())
        if attempt.failed:
            self._controllers.announce(attempt, Reason.INITIAL, attempt.answers)
            robots = [self.scenario.robot(name) for name in attempt.failed]
            explanation = "; ".join(
                explain_unrealizable(robot, attempt.answers[robot.name].task, self.scenario.map)
                for robot in robots
            )
            self._end(Outcome.UNREALIZABLE, explanation)
            return
        self._controllers.install(attempt, Reason.INITIAL)

    def step(self) -> None:
        """One tick: every robot takes its turn, in the scenario's order."""
        state = self.state
        state.tick += 1
        for robot in self.scenario.robots:
            self._turn(robot)
            if self.result is not None:
                return
        if self._completed():
            rounds = self.scenario.until.rounds
            plural = "round" if rounds == 1 else "rounds"
            self._end(Outcome.COMPLETED, f"every robot has met its objective for {rounds} {plural}")
        elif state.tick >= self.scenario.limits.ticks:
            self._end(Outcome.TICK_LIMIT, f"not completed after {state.tick} ticks")

    def _turn(self, robot: Robot) -> None:
        state, name = self.state, robot.name
        planner = state.planners[name]
        observed = {
            other.variable: state.poses[other.name].region for other in planner.task.observed
        }
        proposal = planner.propose(observed)
        lost = proposal is None
        if proposal is None:
            self._report_broken_assumption(robot, planner, observed)
            proposal = Proposal(state.poses[name], None)
        violation = self._check(robot, proposal)
        if violation is not None:
            proposal = self._backtrack(robot, planner, observed, proposal, violation)
        before = planner.values()
        self._move(robot, planner, proposal)
        assignment = state.tasks.current[name]
        after = planner.values()
        impasse = self._act(robot)
        if impasse is None and state.tasks.current[name] is assignment:
            region = state.region(robot)
            for goal in assignment.progress.arrive(region, before, after):
                rounds = assignment.progress.rounds
                state.emit(GoalReached(state.tick, name, goal.goal, region, rounds))
        if impasse is None and violation is not None:
            impasse = self._coordination.on_violation(violation)
        if impasse is not None:
            explanation = explain_impasse(impasse, state)
            self._end(Outcome.OPERATOR_NEEDED, explanation, impasse.cause.value)
        elif lost and (failed := self._coordination.resynthesize()):
            self._end(
                Outcome.ASSUMPTION_VIOLATED,
                f"the others did what {name} assumed they never do, and from there "
                f"{', '.join(failed)} has no strategy",
            )

    def _check(self, robot: Robot, proposal: Proposal) -> Violation | None:
        pose = self.state.poses[robot.name]
        return self.state.knowledge.check(robot, pose, proposal.pose.region)

    def _backtrack(
        self,
        robot: Robot,
        planner: Planner,
        observed: dict[str, int],
        refused: Proposal,
        violation: Violation,
    ) -> Proposal:
        """Go back to the state before and take what is safe (paper, Section V-B)."""
        state, name = self.state, robot.name
        obstacle = violation.obstacle
        state.emit(
            Violated(
                state.tick,
                name,
                violation.at,
                violation.proposed,
                obstacle.name,
                obstacle.type.action,
            )
        )
        options = planner.alternatives(state.poses[name], observed, refused)
        safe = next(p for p in options if self._check(robot, p) is None)
        state.emit(Backtracked(state.tick, name, safe.pose.region))
        return safe

    def _move(self, robot: Robot, planner: Planner, proposal: Proposal) -> None:
        state, name = self.state, robot.name
        start = state.poses[name].region
        pose = proposal.pose
        self._world.move(robot, pose)
        state.poses[name] = pose
        planner.follow(proposal)
        heading = pose.heading.label if pose.heading is not None else None
        state.emit(Moved(state.tick, name, start, pose.region, heading))

    def _act(self, robot: Robot) -> Impasse | None:
        for obstacle, traversable in self._world.act(robot):
            impasse = self._coordination.on_resolved(robot, obstacle, traversable)
            if impasse is not None:
                return impasse
        return None

    def _report_broken_assumption(
        self, robot: Robot, planner: Planner, observed: dict[str, int]
    ) -> None:
        where = ", ".join(f"{name} = {region}" for name, region in observed.items())
        if planner.node is None:
            return
        name = f"how the others move (now {where})"
        self.state.emit(AssumptionViolated(self.state.tick, robot.name, name))

    def _completed(self) -> bool:
        tasks, wanted = self.state.tasks, self.scenario.until.rounds
        return tasks.depth == 0 and all(
            assignment.progress.rounds >= wanted for assignment in tasks.current.values()
        )

    def _truths(self) -> dict[str, bool | None]:
        if isinstance(self._world, SimulatedWorld):
            return self._world.truths
        return draw_truths(self.scenario)

    def _end(self, outcome: Outcome, explanation: str, cause: str | None = None) -> None:
        ended = self._emit_end(outcome.value, explanation, cause)
        self.result = RunResult(
            outcome,
            explanation,
            cause,
            ended.rounds,
            ended.ticks,
            ended.seconds,
            ended.syntheses,
            ended.synthesis_seconds,
        )

    def _emit_end(self, outcome: str, explanation: str, cause: str | None) -> Ended:
        ended = Ended(
            self.state.tick,
            outcome,
            explanation,
            {n: a.progress.rounds for n, a in self.state.tasks.current.items()},
            self.state.tick,
            round(time.monotonic() - self._begun, 6),
            self._controllers.syntheses,
            round(self._controllers.seconds, 6),
            cause,
        )
        self.state.emit(ended)
        return ended


def default_synthesizer(scenario: Scenario) -> Synthesizer:
    """A synthesizer with the scenario's limits that verifies every strategy."""
    limits = scenario.limits
    return Synthesizer(
        seconds=limits.synthesis_seconds, memory_mb=limits.synthesis_memory, verify=True
    )
