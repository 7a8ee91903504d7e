"""Missions: runs of a scenario in the actual world, in one call or tick by tick.

    result = Mission(load_scenario(path)).run()

No part depends on a simulation: an implementation of ``World`` can drive real robots.
"""

import time
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from threading import get_ident
from typing import Any, NoReturn

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, Outcome, SafenavError, UsageError
from safenav.runtime.control.answers import Answers
from safenav.runtime.control.ends import End, Stopped, lacks_of
from safenav.runtime.control.roles import Role
from safenav.runtime.control.strategies import Controller, shown_by_poses, synthesized
from safenav.runtime.run.checkpoint import ENDED, Checkpoints, Resumption
from safenav.runtime.run.loop import Run
from safenav.runtime.run.record import Recorder
from safenav.runtime.run.world import World
from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.commands import Commands
from safenav.runtime.worlds.protocol import BlockingWorld
from safenav.runtime.worlds.simulation import LiveSimulation, SimulatedWorld
from safenav.scenario.model import Clock, Scenario
from safenav.scenario.reading.loader import refused_by_clock
from safenav.solve.reasons import Shortfall
from safenav.synthesis.slugs import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer
from safenav.team.apply import initial
from safenav.team.team import team_of
from safenav.trace import records
from safenav.trace.file import Listener
from safenav.trace.records import Record
from safenav.verify.verification import first_failure

WAITED = 0.05
"""Seconds between two checks for an intervention."""


RunResult = records.End
"""The result of a run: the last line of its trace."""


def uninterrupted(ended: RunResult) -> RunResult:
    """Return the result of a run. If a KeyboardInterrupt ended it, raise that again."""
    if ended.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return ended


class Mission:
    """One run of a scenario.

    ``world``: by default a simulation of the scenario's hidden obstacles, with the scenario's
    ``clock``. A ``World`` makes the run live, a ``BlockingWorld`` lockstep. ``listeners`` receive
    every event as it happens (a ``TraceWriter`` is one). ``progress`` receives the state of running
    syntheses. ``attended``: whether a live run waits for an operator instead of ending. ``begun``:
    an interrupted run to continue, whose lines the listeners receive first; ``checkpoints``:
    whether the trace gets the lines from which an interrupted run can continue. ``ending``: whether
    the run has ended or is about to record its end. ``end``: the reasons of the ``result``.

    Raises InputError for a scenario that cannot run on the clock of its world.
    """

    def __init__(
        self,
        scenario: Scenario,
        synthesizer: Synthesizer | None = None,
        *,
        world: protocol.World | BlockingWorld | None = None,
        listeners: Iterable[Listener] = (),
        progress: SynthesisListener | None = None,
        attended: bool = False,
        begun: Resumption | None = None,
        checkpoints: bool = False,
    ) -> None:
        if not isinstance(scenario, Scenario):
            raise UsageError(f"{scenario!r} is not a Scenario: pass load_scenario(PATH)")
        self.scenario, self.listeners = scenario, tuple(listeners)
        self.result: RunResult | None = None
        self.end: End | None = None
        if world is None:
            live = scenario.clock is Clock.LIVE
            world = LiveSimulation(scenario) if live else SimulatedWorld(scenario)
        self._world = World(scenario, world, attended=attended)
        live = self._world.live
        scenario = self.scenario = replace(scenario, clock=Clock.LIVE if live else Clock.LOCKSTEP)
        if (found := refused_by_clock(scenario)) is not None:
            raise InputError([Diagnostic(scenario.source or scenario.name, 0, 0, found)])
        self._asked, self._begun_at, team = "", time.monotonic(), team_of(scenario)
        synthesizer = synthesizer or default_synthesizer(scenario)
        answers = Answers(synthesizer, self._check, progress)
        recorder = Recorder(team, self._tell, simulated=self._world.simulated)
        self._begun = begun
        real = live and self._world.truth is None
        self._checkpoints = Checkpoints(recorder.emit, real=real) if checkpoints else None
        self._run = Run(team, self._world, answers, recorder, self._check)
        self.ending = self._started = False
        self._thread: int | None = None

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Mission is a running program: pickle its scenario or its result")

    def run(self) -> RunResult:
        """Run to the end. Ctrl-C ends the run and its trace with the outcome ``interrupted``.

        Raises SafenavError if the synthesizer or the world fails, or a synthesis reaches a limit;
        the trace then ends in ``error``.
        """
        self.start()
        while self.result is None:  # Algorithm 1, line 5
            if self._world.stands(self._run):
                time.sleep(WAITED)  # an operator intervenes from another thread
            self.step()
        return self.result

    def start(self) -> None:
        """Synthesize the first controllers. The run ends here if a robot has none.

        Raises UsageError if the mission was started before.
        """
        if self._started:
            raise UsageError("start() or run() a second time: a Mission runs once; create another")
        self._started = True
        self._begun_at = time.monotonic()
        if isinstance(self._world.commands, Commands):
            self._world.commands.begin()
        begun, run = self._begun, self._run
        self._guarded(run.begin if begun is None else lambda: run.resume(begun))
        self._run.answers.background = self._world.live and not self._world.commands.pauses

    def step(self) -> None:
        """Run one tick, in which every robot takes its turn, in the scenario's order. In a live
        run, run one pass: wait for events of the world, and let each idle robot decide.

        Raises UsageError before ``start`` and after the end.
        """
        if not self._started:
            raise UsageError("step() before start(): this mission has not begun")
        if self.result is not None:
            raise UsageError(f"step() after the end: the outcome is {self.result.outcome.value}")
        if self._checkpoints is not None:
            self._checkpoints.take(self._run.kept())
        self._guarded(self._run.step)

    def stop(self, why: str = "stopped by the user") -> None:
        """End the run, as ``interrupted``, at the next opportunity: between two turns, or within a
        search. If a signal handler calls this in the run's own thread, an exception immediately
        ends a running computation."""
        self._asked = self._asked or why
        self.check_time_limit()

    def check_time_limit(self) -> None:
        """Abort a running computation by an exception if the run must end. This has no effect in
        threads other than the run's own."""
        if self._run.answers.busy and get_ident() == self._thread:
            self._check()

    @property
    def stopping(self) -> bool:
        """Whether the end of the run was requested."""
        return bool(self._asked)

    def give_up(self, explanation: str = "stopped by the user") -> RunResult:
        """End a run that was started, as ``interrupted``, for programs that call ``step`` and will
        not continue. A run that has ended is not changed."""
        if not self._started:
            raise UsageError("give_up() before start(): this mission has not begun")
        if self.result is None:
            self._end(End(Outcome.INTERRUPTED, explanation))
        assert self.result is not None
        return self.result

    def intervene(self, wanted: str | Mapping[str, Any]) -> None:
        """Change the world at the beginning of the next tick, by an operator's line or data. Robots
        have to encounter a closed region; the team immediately knows all other changes. Raises
        UsageError, with the reason, if the change is impossible."""
        self._world.operator.ask(self._run, wanted)

    def exclude_idle_time(self, seconds: float) -> None:
        """Exclude the time without requested ticks from the run's time limit."""
        self._begun_at += seconds

    def post(self, event: protocol.WorldEvent) -> None:
        """Report an event of the world to a live run, from any thread."""
        if isinstance(self._world.commands, Commands):
            self._world.commands.post(event)

    @property
    def tick(self) -> int:
        """The index of the last tick or, in a live run, of the last pass."""
        return self._run.recorder.tick

    @property
    def began(self) -> float:
        """The start of a live run (time 0 of its trace), in seconds on the world's clock."""
        return self._world.commands.zero

    @property
    def waiting(self) -> End | None:
        """The end of the run if no operator helps; None if the run does not wait for an
        operator."""
        run = self._run
        if run.may_hear() and (still := run.still()) is not None:
            return still
        pause = self._world.pause(run)
        return pause[0] if pause is not None and pause[1] is None else None

    @property
    def lacks(self) -> tuple[Shortfall, ...]:
        """The shortfalls of known obstacles that are never resolved."""
        return tuple(lacks_of(self._run.team, self._run.state).values())

    @property
    def still(self) -> bool:
        """Whether no robot has a command, except robots that may continue while the team waits."""
        run = self._run
        moves = [run.control.end is not None and run.moves(i) for i in range(len(run.state.robots))]
        return all(robot.idle or moves[i] for i, robot in enumerate(run.state.robots))

    def _tell(self, record: Record) -> None:
        if self._checkpoints is not None:
            self._checkpoints.follow(record)
        for listener in self.listeners:
            listener(record)

    @property
    def _elapsed(self) -> float:
        return time.monotonic() - self._begun_at

    def _check(self) -> None:
        """Raise Stopped if the run must end now."""
        most = None if self._world.live else self.scenario.limits.seconds
        if self._asked:
            raise Stopped(End(Outcome.INTERRUPTED, self._asked))
        if most is not None and self._elapsed > most:
            why = f"not completed after {most:g} s, the limit of the run"
            raise Stopped(End(Outcome.TIME_LIMIT, why))

    def _guarded(self, part: Callable[[], None]) -> None:
        """Execute a part of the run. End the run if its end is due or the part raises an
        exception."""
        self._thread = get_ident()
        try:
            part()
            end = self._run.over()
            if end is None:
                self._check()  # even without an event
        except Stopped as stopped:
            end = stopped.end
        except KeyboardInterrupt:
            self._end(End(Outcome.INTERRUPTED, "stopped by the user"))
            return
        except SafenavError as error:
            with suppress(SafenavError):  # the trace itself may have been the cause
                self._end(End(Outcome.ERROR, str(error)))
            self.result = None
            raise
        except BaseException:
            self._run.answers.close()
            raise
        if end is not None:
            self._end(end)

    def _end(self, end: End) -> None:
        self.ending = True
        run = self._run
        run.answers.close()
        if self._checkpoints is not None and end.outcome not in ENDED:
            self._checkpoints.write()
        self.end = end
        self.result = run.recorder.ends(run.state, end, run.answers, self._elapsed)


def first_results(
    scenario: Scenario,
    synthesizer: Synthesizer,
    progress: SynthesisListener | None = None,
    names: Collection[str] | None = None,
    *,
    strategies: bool = False,
) -> dict[str, Controller]:
    """Return the first controllers of the named robots (default: all), in the scenario's order,
    without a run. No obstacle is known yet, so each robot pursues its own objective. As in a run,
    robots whose poses prove this possible get no strategy, except with ``strategies``."""
    team, answers = team_of(scenario), Answers(synthesizer, progress=progress)
    state, every = initial(team), enumerate(team.members)
    asked = {i: Role(m.objective) for i, m in every if names is None or m.name in names}
    shown = {} if strategies else shown_by_poses(team, state, asked)
    left = {i: role for i, role in asked.items() if i not in shown}
    found = shown | synthesized(team, state, left, answers)
    return {team.members[i].name: found[i] for i in asked}


def default_synthesizer(
    scenario: Scenario, *, binary: Path | None = None, at_once: int | None = None
) -> Synthesizer:
    """Return a synthesizer with the scenario's settings, which verifies every strategy."""
    limits = scenario.limits
    return Synthesizer(
        binary,
        seconds=limits.synthesis_seconds,
        memory_mb=limits.synthesis_memory,
        verifier=first_failure,
        at_once=at_once,
    )
