"""Rules on deadlines in ticks (docs/deadlines.md)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from safenav.audit.language import RefusedError
from safenav.audit.lines import Line
from safenav.audit.possibilities.bound import (
    Bound,
    goals_left,
    least_within,
    mission_end,
    mission_ends,
)
from safenav.audit.rules.batteries import BATTERY, lasts_until
from safenav.audit.rules.rule import UNREAD, Message, Rule, differences
from safenav.audit.run.situation import Situation

MISSION = "mission"
ENDS = ("kept", "late", "excused")


@dataclass
class _Clock:
    """The time of a robot's present round. ``begun``: its first tick; ``away``, ``before``: the
    robot did something else in it, or in the round before; ``over``: it has been judged; ``lost``:
    it was recorded as lost. ``rounds``: the number of rounds before it, from the header and then
    judged."""

    begun: int = 0
    away: bool = False
    before: bool = False
    over: bool = False
    lost: bool = False
    rounds: int = 0

    @classmethod
    def continued(cls, stated: Line) -> _Clock:
        """Return the clock of a round that began in the earlier run."""
        return cls(-stated.since, bool(stated.disturbed), bool(stated.before), bool(stated.over))

    def restart(self, tick: int) -> None:
        self.before, self.away = self.away, False
        self.begun, self.over, self.lost = tick, False, False


def _promised(outcome: Line) -> list[str]:
    """Return the refused deadlines in ticks."""
    return [of for of in outcome.refused or {} if not of.endswith(BATTERY)]


class DeadlineRule(Rule):
    """Each request for an obstacle with ``resolve_within`` has a ``set`` line in its turn, due that
    many ticks later. Each promise has one end, as the other lines imply: ``kept`` in its turn, or
    ``late`` among the first lines of the tick after it was due (``excused``: a round in which the
    robot did something else, or the round after it). A ``lost`` line is true by the bound of this
    check, and ``earliest`` is that bound. The outcome lists the late promises; a refused promise
    could not be kept (T Deadlines)."""

    name = "deadline"

    def __init__(self) -> None:
        self._open: dict[str, int] = {}
        self._lost: set[str] = set()
        self._changed = False  # whether an objective changed since the mission was lost
        self._past: set[str] = set()
        self._by_charge: set[str] = set()
        self._late: list[str] = []
        self._owed: list[tuple[str, int, str]] = []
        self._turn_owes: list[tuple[str, int, str]] = []
        self._requested: list[Line] = []  # in this turn
        self._within: dict[str, int] = {}
        self._first: dict[str, int] = {}  # the target with which a strict strategy begins
        self._tick, self._had = 0, 0
        self._bound: tuple[int, int, Bound] | None = None

    def opening(self, now: Situation) -> Iterable[Message]:
        promises = now.header.promises
        self._active = promises is not None
        clocks = {name: done.clock for name, done in now.done.items() if done.clock is not None}
        continued = {name: _Clock.continued(clock) for name, clock in clocks.items()}
        self._clocks = {name: continued.get(name) or _Clock() for name in now.header.robots}
        for name, done in now.done.items():
            self._clocks[name].rounds = done.rounds or 0
        if promises is not None:
            self._within = dict(promises.within)
            if promises.by is not None:
                self._open[MISSION] = promises.by
            self._open |= now.begun.due or {}
            self._past |= {*(now.begun.late or ())}
        return ()

    def open(self) -> dict[str, int]:
        """Return the pending deadlines with their ticks, except those that a charge implies."""
        return {of: due for of, due in self._open.items() if of not in self._by_charge}

    def late(self) -> set[str]:
        """Return the promises that are overdue: their end is not recorded."""
        return {*self._past}

    def round(self, robot: str) -> tuple[int | None, tuple[int, bool, bool, bool]]:
        """Return the most ticks of a robot's round; when the present one began, whether the robot
        did something else in it or in the one before, and whether it has been judged."""
        clock = self._clocks[robot]
        return self._within.get(robot), (clock.begun, clock.away, clock.before, clock.over)

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if self._had or record.type != "move":  # the first turn includes the lines before it
            over = record.type in ("deadline", "move") or record.tick > self._tick
            self._limit(now) if over else None
        if record.type == "deadline":
            self._look(now)
            yield from self._judged(record, now)
            return
        if not self._active:
            return
        if record.tick > self._tick or record.type in ("outcome", "move"):
            self._look(now)
        if record.tick > self._tick:
            yield from self._tick_begins(record.tick)
        yield from self._missing(self._owed)
        if record.type == "move":
            if self._had:  # the first turn includes the lines before it
                yield from self._missing(self._turn_owes)
            self._had = [*now.header.robots].index(record.robot) + 1
        self._happened(record, now)

    def ending(self, now: Situation) -> Iterator[Message]:
        outcome = now.outcome
        if outcome is None:
            return
        if not self._active:
            if outcome.outcome == "late" or outcome.late is not None or _promised(outcome):
                yield "it reports missed deadlines; there are none"
            return
        if outcome.late is None or set(outcome.late) != set(self._late):
            listed = ", ".join(outcome.late or ()) or "nothing"
            truth = ", ".join(dict.fromkeys(self._late)) or "nothing"
            yield f"the outcome lists {listed} as late, but {truth} was"
        stops = now.header.promises is not None and now.header.promises.late == "stop"
        ends_late = (outcome.outcome == "late") is not (stops and bool(self._late))
        if ends_late and outcome.outcome not in ("interrupted", "error"):
            yield "the outcome must be 'late' if and only if a missed deadline ends it"
        if outcome.outcome == "completed" and MISSION in self._open:
            yield "no line records that the mission was in time"
        self._limit(now)
        over = outcome.outcome in ("completed", "tick_limit") or outcome.cause == "deadlock"
        if over:  # the last turn has ended: deadlocks are found between ticks
            yield from self._missing([o for o in self._turn_owes if o[0] != MISSION])
        for of in _promised(outcome):
            yield from self._refused(of, outcome, now)

    def _look(self, now: Situation) -> None:
        for name, clock in self._clocks.items():
            own = now.own[name]
            clock.away |= now.objectives[name] != own or name in now.out

    def _tick_begins(self, tick: int) -> Iterator[tuple[None, str]]:
        """Require a first line for each promise that was due by the end of the tick before."""
        yield from self._missing([o for o in self._turn_owes if o[0] != MISSION])
        self._turn_owes = []
        self._tick, self._had = tick, 0
        for of, due in list(self._open.items()):
            if due < tick:
                del self._open[of]
                self._owed.append((of, due, "late"))
        for name, within in self._within.items():
            clock = self._clocks[name]
            if not clock.over and clock.begun + within < tick:
                clock.over = True
                verdict = "excused" if clock.away or clock.before else "late"
                self._owed.append((name, clock.begun + within, verdict))

    def _missing(self, owed: list[tuple[str, int, str]]) -> Iterator[tuple[None, str]]:
        for of, due, verdict in owed:
            problem = f"no earlier line records that the deadline of {of} at {due} is {verdict}"
            yield None, problem
        owed.clear()

    def _happened(self, record: Line, now: Situation) -> None:
        tick = record.tick
        match record.type:
            case "request":
                if record.obstacle not in self._open.keys() | self._past:
                    self._requested.append(record)
            case "resolved":
                self._ends(record.obstacle, "kept")
                for clock in self._clocks.values() if now.restarts(record) else ():
                    clock.restart(tick)
                    clock.rounds = 0
            case "gone" | "blocked":
                self._ends(record.obstacle, "excused")
            case "synthesis":
                memory = record.memory or {}
                first = memory.get("goal", memory.get("scout"))
                if first is not None and record.objective == now.own[record.robot]:
                    self._first[record.robot] = first
            case "objective":
                self._changed |= MISSION in self._lost
                self._first.pop(record.robot, None)
                self._clocks[record.robot] = _Clock(tick)
                self._within.pop(record.robot, None)
                if record.within is not None:
                    self._within[record.robot] = record.within
            case "service" if record.active is True:
                self._clocks[record.robot].restart(tick)
            case "goal":
                self._goal(record, now)

    def _limit(self, now: Situation) -> None:
        """Start the deadlines of the requests of a turn that has ended."""
        requested, self._requested = self._requested, []
        for record in requested:
            name, limit = record.obstacle, now.obstacles[record.obstacle].resolve_within
            lasts = self._lasts(record, now)
            dues = [record.tick + limit] if limit is not None else []
            dues += [lasts] if lasts is not None else []
            if dues:
                owed = name, min(dues), "set"
                by_charge = limit is None or (lasts is not None and lasts < dues[0])
                (self._by_charge.add if by_charge else self._by_charge.discard)(name)
                self._turn_owes += [owed] if owed not in self._turn_owes else []

    def _lasts(self, record: Line, now: Situation) -> int | None:
        """Return the last tick for which the charge of an obstacle's first requester lasts; None if
        it sets no limit."""
        first = next(iter(now.requests.get(record.obstacle, {})), None)
        if first is None or first not in now.charge:
            return None
        turn = now.progress[first].next(now.own[first]) or 0
        had = [*now.region].index(first) < self._had or now.had_turn(first, record.tick)
        try:
            return lasts_until(now, record.tick, first, record.obstacle, turn, had=had)
        except RefusedError:
            return None

    def _goal(self, record: Line, now: Situation) -> None:
        robot, clock = record.robot, self._clocks[record.robot]
        own = now.objectives[robot] == now.own[robot]
        if not own or record.round <= clock.rounds:
            return
        clock.rounds = record.round
        within = self._within.get(robot)
        if within is not None and not clock.over:
            self._turn_owes.append((robot, clock.begun + within, "kept"))
        clock.restart(record.tick)

    def _ends(self, of: str, verdict: str) -> None:
        self._turn_owes = [o for o in self._turn_owes if (o[0], o[2]) != (of, "set")]
        self._requested = [request for request in self._requested if request.obstacle != of]
        self._past.discard(of)
        due = self._open.pop(of, None)
        if due is not None:
            self._turn_owes.append((of, due, verdict))

    def _judged(self, record: Line, now: Situation) -> Iterator[str]:
        entry = (record.of, record.due, record.verdict)
        if not self._active:
            yield "the scenario has no deadline"
            return
        by_charge = record.verdict != "lost" and record.of in self._by_charge
        yield from differences(record, now, cause="battery" if by_charge else None)
        if record.tick > self._tick:
            for _, problem in self._tick_begins(record.tick):
                yield problem
        if record.verdict == "lost":
            yield from self._is_lost(record, now)
            return
        kept = (MISSION, self._open.get(MISSION), "kept")
        if entry == kept:
            del self._open[MISSION]
        elif entry in self._owed:
            self._owed.remove(entry)
        elif entry in self._turn_owes:
            self._turn_owes.remove(entry)
        else:
            yield f"{record.of}, due {record.due}, is not {record.verdict} here"
            return
        if record.verdict == "late":
            self._late.append(record.of)
            self._past.add(record.of)
        elif record.verdict == "set":
            self._open[record.of] = record.due
            yield from differences(record, now, earliest=self._bounds(now).resolution(record.of))
        elif (
            record.verdict == "kept"
            and record.of in self._lost
            and not (record.of == MISSION and self._changed)
        ):
            yield f"{record.of} is recorded as lost, but can still be met"
        if record.verdict in ENDS:
            self._lost.discard(record.of)

    def _is_lost(self, record: Line, now: Situation) -> Iterator[str]:
        of = record.of
        if of in self._within and of in self._clocks:
            clock = self._clocks[of]
            if record.due != clock.begun + self._within[of] or clock.over or clock.lost:
                yield f"no round of {of} is due at {record.due}"
            clock.lost = True
            left = goals_left(of, now, self._first)
            truths = {self._bounds(now).round(of, goals) for goals in left}
        elif self._open.get(of) != record.due or of in self._lost:
            yield f"{of} has no promise that is due at {record.due}"
            return
        else:
            self._lost.add(of)
            bounds = self._bounds(now)
            ends = of == MISSION and mission_ends(bounds, self._tick, self._first)
            truths = ends or {bounds.resolution(of)}
        if record.earliest not in truths:
            ticks = " or ".join(str(truth) for truth in truths)
            yield f"{of} is possible from tick {ticks} on, not {record.earliest}"
        elif record.earliest is not None and record.earliest <= record.due:
            yield f"the trace claims that {of} is lost, but tick {record.due} is possible"

    def _bounds(self, now: Situation) -> Bound:
        if self._bound is None or self._bound[:2] != (self._tick, self._had):
            bound = Bound(now, self._tick, self._had)
            self._bound = (self._tick, self._had, bound)
        return self._bound[2]

    def _refused(self, of: str, outcome: Line, now: Situation) -> Iterator[Message]:
        least = (outcome.refused or {})[of]
        promised = self._within.get(of)
        if of == MISSION and now.header.promises is not None:
            promised = now.header.promises.by
        if promised is None:
            yield f"{of} has no deadline"
            return
        bound = Bound(now, 0, len(now.header.robots))
        try:
            truth = mission_end(bound) if of == MISSION else least_within(now, of)
        except RefusedError:
            yield self.not_judged(outcome, of, UNREAD)
            return
        if least != truth:
            yield f"{of} is refused with a least time of {least}; the least time is {truth}"
        elif least is not None and least <= promised:
            yield f"{of} is refused, but its least, {least}, is within the promised {promised}"
