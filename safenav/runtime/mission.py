"""A mission: the tick loop that executes a team's controllers in the actual world.

    result = Mission(load_scenario(path)).run()

or one tick after the other with ``start`` and ``step``. Source: paper, Section V;
docs/coordination.md. Nothing here depends on a simulation: an implementation of ``World`` can drive
real robots.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from threading import get_ident
from typing import NoReturn, cast

from msgspec import Struct
from msgspec.structs import replace

import safenav
from safenav.errors import SafenavError, UsageError
from safenav.outcome import Outcome
from safenav.runtime.command_times import CommandTimes
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.coordination.strategy_search import StrategySearch, TaskResult
from safenav.runtime.deadline_monitor.ledger import Deadlines
from safenav.runtime.deadline_monitor.refusal import refusal_of
from safenav.runtime.duties.reasons import Shortfall
from safenav.runtime.energy.batteries import Batteries
from safenav.runtime.intervention.applying import Interventions
from safenav.runtime.intervention.inputs import EnvironmentInputs
from safenav.runtime.intervention.kinds import Intervention
from safenav.runtime.passes import Passes
from safenav.runtime.team import TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turns.turn import Turns
from safenav.runtime.turns.while_waiting import may_continue
from safenav.runtime.worlds.adapter import BlockingAdapter
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.protocol import BlockingWorld, World, WorldEvent, implements
from safenav.runtime.worlds.simulation import LiveSimulation
from safenav.runtime.worlds.world import InputWorld, SimulatedWorld
from safenav.scenario.model import Scenario
from safenav.scenario.reading.compatibility import unsafe_live, unsafe_lockstep
from safenav.scenario.settings import Clock
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
from safenav.synthesis.request import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records, vocabulary
from safenav.trace.header import scenario_header
from safenav.trace.writing import Listener
from safenav.verify.verification import first_failure

WAITED = 0.05
"""Seconds between two checks for an intervention."""


class RunResult(Struct, frozen=True):
    """The result of a run. ``cause`` classifies ``operator_needed``, ``links`` lists its reasons;
    ``stuck``: the robots that cannot continue. ``makespan`` (live): the time in seconds at which
    the last command ended. ``lost``: why deadlines could not be met, one sentence each."""

    outcome: Outcome
    explanation: str
    cause: str | None
    rounds: dict[str, int]
    ticks: int
    seconds: float
    syntheses: int
    synthesis_seconds: float
    links: tuple[str, ...] = ()
    stuck: tuple[str, ...] = ()
    makespan: float | None = None
    lost: tuple[str, ...] = ()


def uninterrupted(ended: RunResult) -> RunResult:
    """Return the result of a run; raise KeyboardInterrupt again that ended it."""
    if ended.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return ended


class Mission:
    """One run of a scenario.

    ``world``: by default a simulation of the scenario's hidden obstacles, with the scenario's
    ``clock``. A ``World`` makes the run live, a ``BlockingWorld`` lockstep. ``listeners`` receive
    every event as it happens (a ``TraceWriter`` is one). ``progress`` receives the state of running
    syntheses. ``attended``: a live run waits for an operator instead of ending.

    Raises UsageError for a scenario whose strategies would not be correct in a live run.
    """

    def __init__(
        self,
        scenario: Scenario,
        synthesizer: Synthesizer | None = None,
        *,
        world: World | BlockingWorld | None = None,
        listeners: Iterable[Listener] = (),
        progress: SynthesisListener | None = None,
        attended: bool = False,
    ) -> None:
        if not isinstance(scenario, Scenario):
            raise UsageError(f"{scenario!r} is not a Scenario: pass load_scenario(PATH)")
        self.scenario = scenario
        self.result: RunResult | None = None
        self._moved = 0  # the tick of the last move
        self._times = CommandTimes()
        self.state = TeamState.initial(scenario, (*listeners, self._note, self._times))
        self._deadlines = Deadlines(self.state)
        self.state.dues = self._deadlines.due
        self.state.listeners = (*self.state.listeners, self._deadlines)
        if world is None:
            live = scenario.clock is Clock.LIVE
            world = LiveSimulation(scenario) if live else SimulatedWorld(scenario)
        truth = world.truth if isinstance(world, LiveSimulation) else world
        self._truth = truth if isinstance(truth, SimulatedWorld) else None
        blocks = cast("BlockingWorld", world)
        protocol = world if implements(world, World) else BlockingAdapter(blocks, scenario)
        self._commands = commands = Commands(protocol, scenario)
        unsafe = unsafe_live if commands.live else unsafe_lockstep
        if (found := unsafe(scenario)) is not None:
            raise UsageError(found)
        if commands.live:
            self.state.now, self._deadlines.active = commands.now, False
        self._stop = Stop(None if commands.live else scenario.limits.seconds)
        synthesizer = synthesizer or default_synthesizer(scenario)
        self._search = StrategySearch(scenario.map, synthesizer, self._stop, progress)
        strategies = Strategies(self.state)
        self._traffic = Traffic(self.state, self._stop, commands.steps)
        self.state.frees = self._traffic.occasions.frees
        turns = Turns(self.state, commands, strategies, self._traffic)
        batteries = Batteries(self.state, turns.relocation, self._truth)
        self.state.listeners = (*self.state.listeners, batteries)
        self._deadlines.lasts_until = batteries.lasts_until
        self.state.stops = batteries.stops
        inputs = EnvironmentInputs(self.state, truth if implements(truth, InputWorld) else None)
        self._interventions = Interventions(self.state, self._truth, turns, inputs)
        self._algorithm = Passes(
            self.state,
            commands,
            self._search,
            strategies,
            turns,
            self._traffic,
            self._interventions,
            self._stop,
            self._deadlines,
            batteries,
            attended=attended and commands.live,
        )
        self.ending = False
        """Whether the run has ended, or is about to record its end."""
        self._started = False
        self._thread: int | None = None

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Mission is a running program: pickle its scenario or its result")

    def refusal(self) -> str | None:
        """Return the reason why this run is unrealizable although each robot has a strategy: a
        deadline that cannot be met, or an insufficient charge."""
        found = refusal_of(self.state, self._algorithm.batteries)
        return None if found is None else found.explanation

    def run(self) -> RunResult:
        """Run to the end. Ctrl-C ends the run with the outcome ``interrupted``, recorded.

        Raises SafenavError if the synthesizer or the world fails; the trace then ends in
        ``error``.
        """
        self.start()
        while self.result is None:
            if self.waiting is not None and self._commands.idle and not self._interventions.asked:
                time.sleep(WAITED)  # an operator intervenes from another thread
            self.step()
        return self.result

    def stop(self, why: str = "interrupted by the user") -> None:
        """End the run, ``interrupted``, at the next opportunity: between two turns, or within a
        search. Called in the run's own thread, by a signal handler, it gives up a running synthesis
        or verification immediately, by an exception."""
        self._stop.ask(why)
        self.check_time_limit()

    def check_time_limit(self) -> None:
        """Abort, by an exception, a running synthesis or verification if the run must end. No
        effect in other threads."""
        if self._search.busy and get_ident() == self._thread:
            self._stop.check()

    def intervene(self, intervention: Intervention, *, late: bool = False) -> None:
        """Change the world at the beginning of the next tick. The robots are not notified, and
        encounter the change. Raises UsageError, with the reason, for an impossible change; with
        ``late`` that is dropped and recorded (``late``)."""
        self._interventions.ask(intervention, late=late)

    def post(self, event: WorldEvent) -> None:
        """Report an event of the world to a live run, from any thread."""
        self._commands.post(event)

    @property
    def began(self) -> float:
        """Start of a live run, in seconds on the world's clock: time 0 of its trace."""
        return self._commands.zero

    @property
    def waiting(self) -> Conclusion | None:
        """The conclusion with which the run would end without an operator; None if it does not wait
        for one."""
        return self.state.waiting if self.state.waits_for_operator else None

    @property
    def still(self) -> bool:
        """Whether no robot has a command, except those that continue while the team waits."""
        robots = self.state.robots.values()
        under_way = [r for r in robots if r.transit is not None or r.acting is not None]
        return all(
            self.state.waiting is not None and may_continue(self.state, r) for r in under_way
        )

    def exclude_idle_time(self, seconds: float) -> None:
        """Exclude the time in which no tick was requested from the time limit of the run."""
        self._stop.rest(seconds)

    @property
    def stopping(self) -> bool:
        """Whether a stop of the run was requested."""
        return self._stop.asked is not None

    def give_up(self, explanation: str = "interrupted by the user") -> RunResult:
        """End a run that was started, with the outcome ``interrupted``: for programs that call
        ``step`` and will not continue. A run that has ended stays as it is."""
        if not self._started:
            raise UsageError("give_up() before start(): this mission has not begun")
        if self.result is None:
            self._end(Conclusion(Outcome.INTERRUPTED, explanation))
        assert self.result is not None
        return self.result

    def start(self) -> None:
        """Synthesize the first controllers; a robot without one ends the run here.

        Raises UsageError if the mission was started before.
        """
        if self._started:
            raise UsageError("start() or run() a second time: a Mission runs once; create another")
        self._started = True
        self._thread = get_ident()
        self._stop.begin()
        self._commands.begin()
        truths = None if self._truth is None else self._truth.truths
        header = scenario_header(self.scenario, truths, live=self.state.live)
        clock = Clock.LIVE.value if self.state.live else None
        self.state.emit(records.Header(0, records.VERSION, safenav.__version__, header, clock))
        self._guarded(self._algorithm.begin)
        self._search.background = self.state.live and not self._commands.pauses
        self._traffic.thinking.background = self._search.background

    def step(self) -> None:
        """One tick: every robot takes its turn, in the scenario's order. In a live run one pass:
        it waits for events of the world, and each idle robot decides.

        Raises UsageError before ``start`` and after the end.
        """
        if not self._started:
            raise UsageError("step() before start(): this mission has not begun")
        if self.result is not None:
            raise UsageError(f"step() after the end: the outcome is {self.result.outcome.value}")
        self._thread = get_ident()
        self._guarded(self._algorithm.tick)

    def _guarded(self, part: Callable[[], None]) -> None:
        """Run a part of the mission; end the run if the part raises."""
        try:
            part()
        except RunEnded as over:
            self._end(over.conclusion)
        except KeyboardInterrupt:
            self._end(Conclusion(Outcome.INTERRUPTED, "interrupted by the user"))
        except SafenavError as error:
            with suppress(SafenavError):  # writing the trace may be what failed
                self._tell_end(Conclusion(Outcome.ERROR, str(error)))
            self._close()
            raise
        except BaseException:
            self._close()
            raise

    def _close(self) -> None:
        """End the background searches."""
        self._search.close()
        self._traffic.thinking.close()

    def _end(self, conclusion: Conclusion) -> None:
        self.ending = True
        self._close()
        ended = self._tell_end(conclusion)
        self.result = RunResult(
            conclusion.outcome,
            conclusion.explanation,
            conclusion.cause,
            dict(ended.rounds),
            ended.ticks,
            ended.seconds,
            ended.syntheses,
            ended.synthesis_seconds,
            conclusion.links or (conclusion.explanation,),
            conclusion.stuck,
            ended.makespan,
            tuple(self._deadlines.reasons),
        )

    @property
    def lacks(self) -> tuple[Shortfall, ...]:
        """The shortfalls of obstacles that could not be resolved at some time."""
        return tuple(self.state.lacks.values())

    def _note(self, record: records.Record) -> None:
        if isinstance(record, records.Move):
            self._moved = record.tick

    def _tell_end(self, conclusion: Conclusion) -> records.End:
        if self._traffic.plan.active:
            self._traffic.end(vocabulary.PlanEndReason.CHANGED)
        live = self._times.fields(self.state.robots) if self.state.live else {}
        ended = records.End(
            self.state.tick,
            conclusion.outcome,
            conclusion.explanation,
            {name: robot.own.rounds for name, robot in self.state.robots.items()},
            self.state.tick if self.state.live else self._moved,
            round(self._stop.elapsed, 6),
            self._search.syntheses,
            round(self._search.seconds, 6),
            None if conclusion.cause is None else vocabulary.OperatorCause(conclusion.cause),
            conclusion.proof,
            conclusion.unrealizable,
            late=self._deadlines.missed,
            refused=conclusion.refused,
            **live,
        )
        self.state.emit(ended)
        return ended


def first_results(
    scenario: Scenario,
    synthesizer: Synthesizer,
    progress: SynthesisListener | None = None,
    names: Collection[str] | None = None,
) -> dict[str, TaskResult]:
    """Return the initial synthesis results of the named robots (default: all), in the scenario's
    order, within the time limit of a run, without running the scenario."""
    untimed = replace(scenario, limits=replace(scenario.limits, seconds=None))
    mission = Mission(untimed, synthesizer, progress=progress)
    return mission._algorithm.first_results(mission.state.robots if names is None else names)


def default_synthesizer(
    scenario: Scenario,
    *,
    verify: bool = True,
    binary: Binary | None = None,
    cache: Cache | None = None,
    at_once: int | None = None,
) -> Synthesizer:
    """The synthesizer with the scenario's settings; it verifies every strategy."""
    limits = scenario.limits
    return Synthesizer(
        binary,
        seconds=limits.synthesis_seconds,
        memory_mb=limits.synthesis_memory,
        cache=cache,
        verifier=first_failure if verify else None,
        at_once=at_once,
    )


if os.environ.get("SAFENAV_KERNEL"):  # tries the tests on the runtime that replaces this one
    from safenav.runtime.run import mission as kernel
    from safenav.runtime.worlds import live_simulation, simulation, truth, world

    Mission, RunResult = kernel.Mission, kernel.RunResult  # type: ignore[misc,assignment]
    simulation.LiveSimulation = live_simulation.LiveSimulation  # type: ignore[misc,assignment]
    world.SimulatedWorld = truth.SimulatedWorld  # type: ignore[misc,assignment]
