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
from safenav.runtime.deadlock import Watch
from safenav.runtime.environment import SimulatedWorld, World
from safenav.runtime.explanation import explain_impasse, explain_unrealizable
from safenav.runtime.state import TeamState, with_alternation
from safenav.runtime.steering import Steering
from safenav.runtime.traffic import Traffic
from safenav.runtime.turn import LostError, Turns
from safenav.scenario.model import Coordination, Outcome, Robot, Scenario
from safenav.synthesis.slugs import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records
from safenav.trace.header import scenario_header
from safenav.trace.writing import Listener
from safenav.verify.verification import first_failure


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
        self.scenario = scenario = with_alternation(scenario)
        self.result: RunResult | None = None
        self._world = world or SimulatedWorld(scenario)
        self.state = TeamState.initial(scenario, self._world, listeners)
        self._controllers = Controllers(
            self.state, synthesizer or default_synthesizer(scenario), progress
        )
        kind = Steering if scenario.coordination is Coordination.ASSIGNABLE else Resynthesis
        self._coordination = kind(self.state, self._controllers)
        traffic = Traffic(self.state)
        self._watch = Watch(self.state, self._coordination, traffic)
        self.state.listeners += (self._watch,)
        self._turns = Turns(self.state, self._world, self._controllers, self._coordination, traffic)
        self._begun = time.monotonic()
        self._stopping = False

    def run(self) -> RunResult:
        """Run to the end. Ctrl-C ends the run with the outcome ``interrupted``, recorded.

        A program that handles signals calls ``stop`` instead of letting KeyboardInterrupt be
        raised anywhere: then the run ends between two turns.

        Raises SafenavError if the synthesizer fails or runs out of its limits; the trace then
        ends in ``error``.
        """
        try:
            self.start()
            while self.result is None:
                self.step()
        except KeyboardInterrupt:
            return self.give_up()
        except SafenavError as error:
            self._emit_end("error", str(error), None)
            raise
        assert self.result is not None
        return self.result

    def stop(self) -> None:
        """End the run, ``interrupted``, before the next turn; a synthesis that is under way is
        given up (by KeyboardInterrupt, so this is to be called in the run's own thread)."""
        self._stopping = True
        if self._controllers.asking:
            raise KeyboardInterrupt

    def give_up(self, explanation: str = "interrupted by the user") -> RunResult:
        """End a run that was started, with the outcome ``interrupted``: for programs that call
        ``step`` and will not go on. A run that has ended stays as it is."""
        if self.result is None:
            self._end(Outcome.INTERRUPTED, explanation)
        assert self.result is not None
        return self.result

    def start(self) -> None:
        """Synthesize the first controllers; a robot without one ends the run here."""
        state = self.state
        self._begun = time.monotonic()
        state.emit(
            records.Header(
                0,
                records.VERSION,
                safenav.__version__,
                scenario_header(self.scenario, self._truths()),
            )
        )
        attempt = self._controllers.attempt({}, strict=())
        if attempt.failed:
            self._controllers.announce(attempt, records.Reason.INITIAL, attempt.answers)
            robots = [self.scenario.robot(name) for name in attempt.failed]
            explanation = "; ".join(
                explain_unrealizable(robot, attempt.answers[robot.name].task, self.scenario.map)
                for robot in robots
            )
            self._end(Outcome.UNREALIZABLE, explanation)
            return
        self._controllers.install(attempt, records.Reason.INITIAL)

    def step(self) -> None:
        """One tick: every robot takes its turn, in the scenario's order."""
        state = self.state
        for robot in self.scenario.robots:
            if self._stopping:
                raise KeyboardInterrupt
            if robot is self.scenario.robots[0]:
                state.tick += 1
            self._take_turn(robot)
            if self.result is not None:
                return
        if self.scenario.deadlock:
            self._end_if_stuck(self._watch.tick())
        if self.result is not None:
            return
        if self._completed():
            rounds = self.scenario.until.rounds
            plural = "round" if rounds == 1 else "rounds"
            self._end(Outcome.COMPLETED, f"every robot has met its objective for {rounds} {plural}")
        elif state.tick >= self.scenario.limits.ticks:
            unmet = self._turns.monitors.unmet_fairness()
            said = [self._what_is_left(), *unmet]
            self._end(Outcome.TICK_LIMIT, "; ".join(said))

    def _take_turn(self, robot: Robot) -> None:
        try:
            impasse = self._turns.take(robot)
        except LostError as lost:
            rules = f" ({lost})" if lost.rules else ""
            self._end(
                Outcome.ASSUMPTION_VIOLATED,
                f"the others did what {robot.name} assumed they never do{rules}, and from there "
                "it has no strategy",
            )
            return
        self._end_if_stuck(impasse)

    def _end_if_stuck(self, impasse: Impasse | None) -> None:
        if impasse is not None:
            said = [explain_impasse(impasse, self.state), *self._turns.monitors.unmet_fairness()]
            explanation = "; ".join(said)
            self._end(Outcome.OPERATOR_NEEDED, explanation, impasse.cause.value)

    def _what_is_left(self) -> str:
        """What keeps the run from being completed now."""
        tasks, wanted = self.state.tasks, self.scenario.until.rounds
        left = [
            f"{name} has done {assignment.progress.rounds} of {wanted} rounds"
            for name, assignment in tasks.current.items()
            if not assignment.temporary and assignment.progress.rounds < wanted
        ]
        left += [
            f"{frame.requester} waits for {frame.helper}"
            + (f" to resolve {frame.obstacle.name}" if frame.obstacle else " to make way")
            for frame in tasks.frames
        ]
        return f"not completed after {self.state.tick} ticks: {'; '.join(left)}"

    def _completed(self) -> bool:
        tasks, wanted = self.state.tasks, self.scenario.until.rounds
        return tasks.depth == 0 and all(
            assignment.progress.rounds >= wanted for assignment in tasks.current.values()
        )

    def _truths(self) -> dict[str, bool | None] | None:
        return self._world.truths if isinstance(self._world, SimulatedWorld) else None

    def _end(self, outcome: Outcome, explanation: str, cause: str | None = None) -> None:
        ended = self._emit_end(outcome.value, explanation, cause)
        self.result = RunResult(
            outcome,
            explanation,
            cause,
            dict(ended.rounds),
            ended.ticks,
            ended.seconds,
            ended.syntheses,
            ended.synthesis_seconds,
        )

    def _emit_end(self, outcome: str, explanation: str, cause: str | None) -> records.Outcome:
        ended = records.Outcome(
            self.state.tick,
            records.Ending(outcome),
            explanation,
            {n: a.progress.rounds for n, a in self.state.tasks.current.items()},
            self.state.tick,
            round(time.monotonic() - self._begun, 6),
            self._controllers.syntheses,
            round(self._controllers.seconds, 6),
            None if cause is None else records.OperatorCause(cause),
        )
        self.state.emit(ended)
        return ended


def default_synthesizer(scenario: Scenario) -> Synthesizer:
    """A synthesizer with the scenario's limits that verifies every strategy."""
    limits = scenario.limits
    return Synthesizer(
        seconds=limits.synthesis_seconds, memory_mb=limits.synthesis_memory, verifier=first_failure
    )
