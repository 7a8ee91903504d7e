"""The motion of a run with a clock: each step and action at the seconds that its trace records.

A robot that has less time than its motion needs is refused.
"""

from __future__ import annotations

from collections.abc import Mapping

from safenav.errors import Diagnostic, InputError
from safenav.motion.file.records import Line, MotionOutcome
from safenav.motion.geometry import MetricFloor
from safenav.motion.mover import Crossing, Mover
from safenav.motion.timing.actions import actions_of, by_command
from safenav.motion.timing.execution import SLACK, MotionExecution, ReservationLedger
from safenav.trace import records
from safenav.trace.reading import Trace
from safenav.trace.vocabulary import MoveEnd


def motion_at_recorded_times(
    trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]
) -> tuple[tuple[Line, ...], MotionOutcome]:
    """Return the lines of the motion by which these movers, whose time is 0, carry out a trace.
    Raises InputError if they cannot: a step leaves too little time, or a robot changes its region
    without a step."""
    run = _Run(trace, floor, movers)
    for record in trace.records:
        run.take(record)
    return run.end()


class TraceLedger(ReservationLedger):
    """A ledger by the trace alone. ``departs``: the steps in progress."""

    def __init__(self, starts: Mapping[str, int]) -> None:
        super().__init__(starts)
        self.departs: dict[str, records.Depart] = {}
        self._acts: dict[int, records.Act] = {}

    def step(self, record: records.Record) -> tuple[records.Depart, records.Arrive] | None:
        """Take a line of the trace; return the step that it ends, if it ends one."""
        if isinstance(record, records.Depart):
            self.departs[record.robot] = record
            self.reserve(record.robot, record.tick, record.to, _time(record))
        if not isinstance(record, records.Arrive):
            return None
        depart = self.departs.pop(record.robot)
        left = depart.to if record.at == depart.from_ else depart.from_
        if record.result is not MoveEnd.LOST:
            self.release(record.robot, record.tick, left, _time(record))
        self.busy((record.robot,), _time(depart), _time(record))
        return depart, record

    def action(self, record: records.Record) -> tuple[records.Act, records.ActionEnd] | None:
        """Take a line of the trace; return the action that it ends, if it ends one."""
        if isinstance(record, records.Act):
            self._acts[record.command] = record
        if not isinstance(record, records.ActionEnd):
            return None
        act = self._acts.pop(record.command)
        self.busy(act.robots, _time(act), _time(record))
        return act, record


class _Run:
    def __init__(self, trace: Trace, floor: MetricFloor, movers: Mapping[str, Mover]) -> None:
        self._trace, self._floor, self._movers = trace, floor, movers
        self._ledger = TraceLedger({name: mover.region for name, mover in movers.items()})
        self._execution = MotionExecution(movers, self._ledger)
        actions, self._short = actions_of(trace)
        self._actions = by_command(actions)

    def take(self, record: records.Record) -> None:
        if step := self._ledger.step(record):
            self._arrive(*step)
        if action := self._ledger.action(record):
            self._acted(*action)

    def _arrive(self, depart: records.Depart, arrive: records.Arrive) -> None:
        name, region = depart.robot, self._movers[depart.robot].region
        if arrive.at == depart.from_ == region:
            return  # it stays at rest
        if depart.from_ != region:
            found = f"{name} departs from region {depart.from_}, but was in region {region}"
            raise self._refused(depart, f"{found}: no motion shows how it came there")
        if arrive.at != depart.to:
            found = f"{name} was sent to region {depart.to}, but arrives in region {arrive.at}"
            raise self._refused(arrive, f"{found}: no motion shows how it came there")
        begin, end = _time(depart), _time(arrive)
        natural = self._step(depart, end)
        if natural > end + SLACK:
            raise self._refused(
                depart,
                f"{name} takes {end - begin:.2f} s from region {depart.from_} to "
                f"{depart.to}; its motion takes {natural - begin:.2f} s",
                "change 'motion' or 'speed' of its model, or the side of regions: --side",
            )

    def _step(self, depart: records.Depart, end: float | None) -> float:
        """Carry out a step; at the robot's own pace if the trace does not record its end."""
        heading = self._floor.heading(depart.from_, depart.to)
        short = (depart.robot, depart.command) in self._short
        step = Crossing(depart.tick, depart.from_, depart.to, heading, short)
        return self._execution.step(depart.robot, step, _time(depart), end)[1]

    def _acted(self, act: records.Act, acted: records.ActionEnd) -> None:
        actions = self._actions.get(acted.command, [])
        idle = self._movers.keys() - self._ledger.departs.keys()
        unasked = sorted(idle & {name for one in actions for name in one.robots} - {*act.robots})
        team, end = (*act.robots, *unasked), _time(acted)
        (ready, name), _ = self._execution.act(team, actions, acted.tick, _time(act), end)
        if ready > end + SLACK:
            late = f"{name} acts until {end:.2f} s, but comes to rest only at {ready:.2f} s"
            raise self._refused(acted, late)

    def _refused(self, record: records.Record, found: str, hint: str = "") -> InputError:
        return InputError([Diagnostic(self._trace.source, record.line, 1, found, hint)])

    def end(self) -> tuple[tuple[Line, ...], MotionOutcome]:
        for depart in self._ledger.departs.values():  # under way when the run ends
            if depart.from_ == self._movers[depart.robot].region:
                self._step(depart, None)
        return self._execution.finish(max(map(_time, self._trace.records), default=0.0))


def _time(record: records.Record) -> float:
    return record.t or 0.0
