"""The deadlines of a run: when each begins, and its verdict (docs/deadlines.md), a fold over
events; deadlines that cannot be met, and charges that do not suffice, found before the start.

Lines follow those of each event, and the turns with new requests or other bounds.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from math import ceil

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.control.ends import End
from safenav.scenario.model import Clock, LatePolicy, switching
from safenav.team import bound
from safenav.team import state as now
from safenav.team.apply import on_own, own_goals, rounds
from safenav.team.battery import NEVER, Energy
from safenav.team.bound import Walk, earliest, least_within, moment_of
from safenav.team.state import Count, State
from safenav.team.team import Member, Team
from safenav.trace import records
from safenav.trace.vocabulary import DeadlineVerdict
from safenav.world.poses import Mask

MISSION = "mission"
Of = int | str
"""The subject of a deadline: an obstacle's number, or ``mission``."""


class RoundClock(Struct, frozen=True):
    """The clock of a robot's rounds. ``disturbed``: in this round the robot did not only pursue its
    objective; ``before``: nor in the previous one. ``over``: this round is already judged, or
    (``reported``) was reported as lost; ``done``: rounds since the last resolution."""

    begun: int = 0
    disturbed: bool = False
    before: bool = False
    over: bool = False
    reported: bool = False
    done: int = 0

    @property
    def excused(self) -> bool:
        return self.disturbed or self.before

    def restarted(self, tick: int, done: int) -> RoundClock:
        return RoundClock(tick, before=self.disturbed, done=done)


class Due(Struct, frozen=True):
    """The deadline of a request or the mission: the tick by whose end it must be met. ``past``: it
    was missed; ``reported``: it was recorded as lost."""

    tick: int
    past: bool = False
    reported: bool = False


class LedgerKept(Struct, frozen=True, forbid_unknown_fields=True):
    """The ledger in a checkpoint."""

    dues: tuple[tuple[Of, Due], ...]
    late: tuple[str, ...]
    clocks: tuple[RoundClock, ...]


class Ledger:
    """``dues``: the deadlines of the mission and the open requests; ``seen``: these requests;
    ``late``: those that were missed; ``had``: how many robots have had their turn."""

    def __init__(self, team: Team, emit: Callable[[records.Record], None]) -> None:
        self.emit, self.scenario = emit, team.scenario
        lockstep = team.scenario.clock is Clock.LOCKSTEP
        self.active = team.scenario.sets_deadlines and lockstep
        by = team.scenario.until.by
        self.dues: dict[Of, Due] = {} if by is None else {MISSION: Due(by)}
        self.seen: set[int] = set()
        self.late: list[str] = []
        self.clocks = [RoundClock() for _ in team.members]
        self.had = self.tick = 0

    def kept(self) -> LedgerKept | None:
        """Return the ledger for a checkpoint."""
        if not self.active:
            return None
        return LedgerKept(tuple(self.dues.items()), tuple(self.late), tuple(self.clocks))

    def resume(self, kept: LedgerKept | None, tick: int) -> None:
        """Continue from that."""
        if kept is not None and self.active:
            self.dues, self.tick = dict(kept.dues), tick
            self.late, self.clocks = [*kept.late], [*kept.clocks]

    @property
    def missed(self) -> tuple[str, ...] | None:
        """The missed deadlines, each once; None if the scenario has none."""
        return tuple(dict.fromkeys(self.late)) if self.active else None

    @property
    def stops(self) -> bool:
        """Whether a missed deadline ends the run."""
        return bool(self.late) and self.scenario.late is LatePolicy.STOP

    def happened(self, team: Team, before: State, event: now.Event) -> None:
        """Learn of an event, the first one of each tick being its ``Time``."""
        if not self.active:
            return
        match event:
            case now.Time(at):
                self.tick, self.had = int(at), 0
                self._overdue(team)
            case now.Turn(i) | now.Goes(i):
                self.had = i + 1
                self._look(team, before)
            case now.Arrived(i) | now.Elsewhere(i) | now.Failed(i):
                self.had = max(self.had, i + 1)
            case now.Assigned(i):
                self.clocks[i] = RoundClock(self.tick)
            case now.Served(i, True) | now.Placed(i):
                self.clocks[i] = self.clocks[i].restarted(self.tick, self.clocks[i].done)
            case now.Counted(i, ticks):
                for _, whole in own_goals(team, before, i, ticks):
                    self._round(team, i, whole)
            case now.Acted():
                for k, _ in event.truths:
                    self._ended(team, k, DeadlineVerdict.KEPT)
                if any(
                    self.scenario.restarts_rounds(team.obstacles[k].name) for k, _ in event.truths
                ):
                    self.clocks = [each.restarted(self.tick, 0) for each in self.clocks]

    def turn_ends(self, team: Team, state: State) -> None:
        """Record what follows from a turn and what was before it, and from its decisions."""
        if not self.active or (self.tick > 0 and not self.had):
            return
        for k in sorted(k for k in self.dues if isinstance(k, int) and k not in state.requests):
            self._ended(team, k, DeadlineVerdict.EXCUSED)
        self._look(team, state)
        known, self.seen = self.dues.keys() | self.seen, {*state.requests}
        new = ((k, state.obstacles[k].due) for k in state.requests if k not in known)
        fresh = {k: Due(due) for k, due in new if due is not None}
        timed = any(member.robot.within is not None for member in team.members)
        timed = timed or not all(due.past for due in self.dues.values())
        if fresh or (self.had == len(team.members) and timed):
            self._foresee(team, state, fresh)

    def completed(self) -> None:
        """Record that the mission has kept its deadline, if it has one."""
        if (due := self.dues.pop(MISSION, None)) is not None and not due.past:
            self._tell(MISSION, due.tick, DeadlineVerdict.KEPT)

    def _overdue(self, team: Team) -> None:
        """Record the missed deadlines of the tick before this one."""
        late = DeadlineVerdict.LATE
        for of, due in self.dues.items():
            if due.tick < self.tick and not due.past:
                self.dues[of] = replace(due, past=True)
                self._tell(_name(team, of), due.tick, late)
        for i, member in enumerate(team.members):
            clock, within = self.clocks[i], member.robot.within
            if within is not None and not clock.over and clock.begun + within < self.tick:
                self.clocks[i] = replace(clock, over=True)
                verdict = DeadlineVerdict.EXCUSED if clock.excused else late
                self._tell(member.name, clock.begun + within, verdict)

    def _tell(
        self,
        of: str,
        due: int,
        verdict: DeadlineVerdict,
        earliest: int | None = None,
    ) -> None:
        self.late += [of] if verdict is DeadlineVerdict.LATE else []
        self.emit(records.Deadline(self.tick, of, due, verdict, earliest))

    def _look(self, team: Team, state: State) -> None:
        """Note the robots that do not pursue their own objective."""
        for i, robot in enumerate(state.robots):
            if not (robot.active and on_own(team, state, i)) and not self.clocks[i].disturbed:
                self.clocks[i] = replace(self.clocks[i], disturbed=True)

    def _round(self, team: Team, i: int, whole: int) -> None:
        member, clock = team.members[i], self.clocks[i]
        if whole <= clock.done:
            return  # the goal completes no round
        within, kept = member.robot.within, DeadlineVerdict.KEPT
        if within is not None and not clock.over:
            self._tell(member.name, clock.begun + within, kept)
        self.clocks[i] = clock.restarted(self.tick, whole)

    def _ended(self, team: Team, k: Of, verdict: DeadlineVerdict) -> None:
        if (due := self.dues.pop(k, None)) is not None and not due.past:
            self._tell(_name(team, k), due.tick, verdict)

    def _foresee(self, team: Team, state: State, fresh: dict[int, Due]) -> None:
        """Begin the deadlines of new requests, and report all that can no longer be met."""
        moment = bound.moment_of(team, state, self.had)
        times, ends = bound.earliest(moment), dict[Of, int | None]()
        for k, turns in zip(bound.gates(team, state), times, strict=True):
            ends[k] = bound.tick_of(turns[-1], moment.count)
        for k, due in fresh.items():
            self.dues[k] = due
            verdict, soonest = DeadlineVerdict.SET, ends.get(k, self.tick)
            self._tell(_name(team, k), due.tick, verdict, soonest)
        open_, lost = {of: d for of, d in self.dues.items() if not d.past}, DeadlineVerdict.LOST
        if MISSION in open_ and not objectives_change(team, self.tick):
            every = [orders_left(team, state, i, team.rounds) for i in range(len(team.members))]
            ends[MISSION] = mission_end(moment, times, self.tick, every)
        for of, due in open_.items():
            if of in ends and not due.reported and _beyond(ends[of], due.tick):
                self.dues[of] = replace(due, reported=True)
                self._tell(_name(team, of), due.tick, lost, ends[of])
        for i, (member, clock) in enumerate(zip(team.members, self.clocks, strict=True)):
            within, robot = member.robot.within, state.robots[i]
            orders = [each for each in orders_left(team, state, i) if each is not None]
            if within is None or not orders or clock.over or clock.reported or clock.excused:
                continue
            if not robot.active or not on_own(team, state, i):
                continue
            end = min(bound.rounds_done(moment, i, times, left) for left in orders)
            soonest = None if end >= bound.NEVER else end
            if _beyond(soonest, clock.begun + within):
                self.clocks[i] = replace(clock, reported=True)
                self._tell(member.name, clock.begun + within, lost, soonest)


def _name(team: Team, of: Of) -> str:
    return of if isinstance(of, str) else team.obstacles[of].name


def _beyond(soonest: int | None, due: int) -> bool:
    return soonest is None or soonest > due


def objectives_change(team: Team, tick: int) -> bool:
    """Return whether the scenario still gives a robot another objective, which changes the bound of
    the mission."""
    scenario = team.scenario
    if any(change.objective is not None and change.at > tick for change in scenario.changes):
        return True
    listed = any(at > tick for at in switching(scenario.inputs))
    return listed and any(robot.when for robot in scenario.robots)


def orders_left(
    team: Team, state: State, i: int, most: int | None = None
) -> list[list[Mask] | None]:
    """Return the sequences of targets of which a robot must still meet one for its round, or for
    ``most`` rounds: several while a joint plan may begin with any. None: it chooses their order."""
    member, own = team.members[i], state.robots[i].own
    free = member.planned and member.either and own.met == 0
    begun = [own._replace(memory=k) for k in range(len(member.targets))] if free else [own]
    return [_goals_left(member, each, most) for each in begun]


def _goals_left(member: Member, own: Count, most: int | None) -> list[Mask] | None:
    if not member.objective.ordered():
        return None
    masks = member.targets
    if not member.pursuit.in_turn:
        return [masks[0]] * max((1 if most is None else most) - own.met, 0)
    if member.pursuit.settles:
        return [*masks[own.memory :]] if own.met < 1 else []
    left = len(masks) - own.met % len(masks)
    if most is not None:
        left += (most - rounds(member.objective, own) - 1) * len(masks)
    return [masks[(own.memory + k) % len(masks)] for k in range(max(left, 0))]


def mission_end(
    moment: bound.BoundMoment,
    times: bound.Times,
    tick: int,
    orders: Sequence[Sequence[Sequence[Mask] | None]],
) -> int | None:
    """Return a tick before whose end the mission cannot be completed; None if it never can.
    ``orders``: for each robot the possible sequences of its goals (None: it chooses)."""
    ends = [tick]
    for i, choices in enumerate(orders):
        each = (bound.rounds_done(moment, i, times, goals) if goals else 0 for goals in choices)
        ends.append(min(each, default=0))
    return None if max(ends) >= bound.NEVER else max(ends)


_NUMBERS = {1: "its target", 2: "both targets"}


def refusal_of(team: Team, state: State) -> End | None:
    """Return the end of a run with a deadline that the robots could not meet even alone, or a
    charge that does not suffice."""
    refused: dict[str, int | None] = {}
    parts = []
    for member, robot in zip(team.members, state.robots, strict=True):
        within = member.robot.within
        if within is not None and ((least := _least(member, robot.pose)) is None or least > within):
            refused[member.name] = least
            parts.append(f"{member.name}: {_words(len(member.targets), within, least)}")
    by = team.scenario.until.by
    if by is not None and not objectives_change(team, 0):
        moment = moment_of(team, state, len(team.members))
        orders = [
            _orders(team, member, r.pose)
            for member, r in zip(team.members, state.robots, strict=True)
        ]
        soonest = mission_end(moment, earliest(moment), 0, orders)
        if soonest is None or soonest > by:
            refused[MISSION] = soonest
            when = "at all" if soonest is None else f"before tick {soonest}"
            parts.append(f"the mission cannot be completed {when}, and is due by {by}")
    for member, robot in zip(team.members, state.robots, strict=True):
        energy = member.energy
        if energy is None or team.scenario.flat is not None:
            continue
        need = energy.need(member.floor, robot.pose, energy.turn(robot.own.memory))
        if need > robot.charge:
            refused[f"{member.name}.battery"] = None if need >= NEVER else ceil(need)
            parts.append(_charge_words(team, member, energy, robot.pose, need))
    return End("unrealizable", "; ".join(parts), refused=refused) if refused else None


def _charge_words(team: Team, member: Member, energy: Energy, pose: int, need: float) -> str:
    battery, word = energy.battery, team.world.word
    here, name = word(pose % team.size), member.name
    if need < NEVER:
        return f"{name} needs a charge of {ceil(need)} at {here}, and has {battery.start}"
    if energy.charging(pose):
        text = f"from the charger {here} (full: {battery.capacity}) {name} reaches no other stop"
    else:
        text = f"from {here}, with any charge up to {battery.capacity}, {name} reaches no stop"
    text += " from which it can continue"
    enough = _least_capacity(member, energy, pose)
    return text if enough is None else f"{text}; a capacity of {enough} suffices"


def _least_capacity(member: Member, energy: Energy, pose: int) -> int | None:
    """Return the least capacity with which a robot could continue forever; None if there is
    none."""
    low, high = energy.battery.capacity, 4 * member.graph.size * (energy.battery.move + 1)

    def enough(capacity: int) -> bool:
        larger = replace(energy, battery=replace(energy.battery, capacity=capacity))
        return larger.need(member.floor, pose, 0) < NEVER

    capacities = range(low + 1, high + 1)
    return capacities[bisect_left(capacities, True, key=enough)] if enough(high) else None


def _orders(team: Team, member: Member, pose: int) -> list[list[Mask]]:
    """Return the targets that a robot must meet in sequence for all rounds, from the start; several
    lists if it may begin with any target (``literal``: with the first, or with the one on which it
    stands); none if it chooses the order. A target on which it stands counts as met."""
    objective, masks, count = member.objective, member.targets, len(member.targets)
    if not objective.ordered():
        return []
    if objective.settles:
        orders = [[*masks, *masks[-1:] * (team.rounds - 1)]]
    else:
        firsts = [0]
        if objective.strict:
            firsts += [k for k in range(1, count) if not objective.literal or masks[k] >> pose & 1]
        orders = [[*masks[first:], *masks[:first]] * team.rounds for first in firsts]
    return [order[order[0] >> pose & 1 :] for order in orders]


def _least(member: Member, pose: int) -> int | None:
    walk = Walk(member.graph, member.targets, member.floor, pose, member.ticks)
    least = least_within(replace(walk, strict=member.objective.literal))
    return least_within(walk) if least is None else least  # else synthesis reports it


def _words(count: int, within: int, least: int | None) -> str:
    what = _NUMBERS.get(count, f"all {count} targets")
    text = f"no walk meets {what} every {within} tick{'s' * (within > 1)}"
    return text if least is None else f"{text}: the fastest round takes {least}"
