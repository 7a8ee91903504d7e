"""The deadlines of a run: their starts and verdicts (docs/deadlines.md), as a fold over events.
Their lines follow those of the event, or of the turn with new requests or bounds. Before the start,
infeasible deadlines and insufficient charges are refused."""

from collections.abc import Callable, Iterable
from math import ceil

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.control.ends import End
from safenav.scenario.model import Clock, LatePolicy, switching
from safenav.scenario.objective import formulas_in
from safenav.team import state as now
from safenav.team.apply import goals, on_own
from safenav.team.battery import Energy
from safenav.team.bound import NEVER, Bound, least_first
from safenav.team.state import Count, State
from safenav.team.team import Member, Team
from safenav.trace import records
from safenav.trace.vocabulary import DeadlineVerdict
from safenav.world.poses import Mask

MISSION = "mission"
THE_MISSION, REQUEST, ROUND = range(3)
Of = tuple[int, int]
"""The subject of a deadline and its number: the mission, an obstacle's request, or a robot's
round."""


class Due(Struct, frozen=True):
    """A deadline, due by the end of tick ``due``. ``past``: whether it was missed; ``reported``:
    whether it was recorded as lost. For a round: ``disturbed``, ``before``: whether the robot
    waited, helped or was out of service in this and in the previous round; ``done``: the number of
    rounds since the last resolution."""

    tick: int
    past: bool = False
    reported: bool = False
    disturbed: bool = False
    before: bool = False
    done: int = 0

    @property
    def excused(self) -> bool:
        return self.disturbed or self.before


class Ledger:
    """The deadlines of a run. ``dues``: the deadlines of the mission, open requests and rounds;
    ``late``: the missed ones; ``had``: the number of robots that have had their turn."""

    def __init__(self, team: Team, emit: Callable[[records.Record], None]) -> None:
        self.emit, self.scenario = emit, team.scenario
        lockstep = team.scenario.clock is Clock.LOCKSTEP
        self.active = lockstep and bool(team.scenario.deadlines)
        by = team.scenario.until.by
        self.dues: dict[Of, Due] = {} if by is None else {(THE_MISSION, 0): Due(by)}
        self.late: list[str] = []
        self.had = self.tick = 0
        for i in range(len(team.members)):
            self._begins(team, i)

    @property
    def missed(self) -> tuple[str, ...] | None:
        """The missed deadlines, each once; None if the scenario has no deadlines."""
        return tuple(dict.fromkeys(self.late)) if self.active else None

    @property
    def stops(self) -> bool:
        """Whether a missed deadline ends the run."""
        return bool(self.late) and self.scenario.late is LatePolicy.STOP

    def happened(self, team: Team, before: State, event: now.Event) -> None:
        """Update the deadlines after an event. The first event of each tick is its ``Time``."""
        if not self.active:
            return
        match event:
            case now.Time(at):
                self.tick, self.had = int(at), 0
                for of, due in self._open():  # due in the previous tick but not met
                    if due.tick < self.tick:
                        self.dues[of] = replace(due, past=True)
                        verdict = DeadlineVerdict.EXCUSED if due.excused else DeadlineVerdict.LATE
                        self._tell(team, of, due, verdict)
            case now.Turn(i) | now.Goes(i):
                self.had = i + 1
                round_, mine = self.dues.get((ROUND, i)), on_own(team, before, i)
                if round_ is not None and not (before.robots[i].active and mine):
                    self.dues[ROUND, i] = replace(round_, disturbed=True)
            case now.Arrived(i) | now.Elsewhere(i) | now.Failed(i):
                self.had = max(self.had, i + 1)
            case now.Assigned(i):
                self.dues.pop((ROUND, i), None)
                self._begins(team, i)
            case now.Served(i, True) | now.Placed(i):
                self._begins(team, i)
            case now.Counted(i, at_once):
                for _, whole, _ in goals(team, before, i, at_once, duty=False):
                    round_ = self.dues.get((ROUND, i))
                    if round_ is not None and whole > round_.done:  # the goal completes the round
                        if not round_.past:
                            self._tell(team, (ROUND, i), round_, DeadlineVerdict.KEPT)
                        self._begins(team, i, whole)
            case now.Acted(_, _, truths):
                for k, _ in truths:
                    self._ends(team, (REQUEST, k), DeadlineVerdict.KEPT)
                if any(team.obstacles[k].restarts for k, _ in truths):
                    for i in range(len(team.members)):
                        self._begins(team, i, done=0)

    def turn_ends(self, team: Team, state: State) -> None:
        """Record the verdicts that follow from a turn. ``state``: the team's state after it."""
        if not self.active:
            return
        for kind, k in sorted(self.dues):
            if kind == REQUEST and k not in state.requests:
                self._ends(team, (kind, k), DeadlineVerdict.EXCUSED)
        dues = (((REQUEST, k), state.obstacles[k].due) for k in state.requests)
        fresh = {of: Due(due) for of, due in dues if due is not None and of not in self.dues}
        if fresh or (self.had == len(team.members) and self._open()):
            bound = Bound(team, state, self.had)
            for of, due in fresh.items():
                self._tell(team, of, due, DeadlineVerdict.SET, self._soonest(bound, of))
            self.dues |= fresh
            for of, due in self._open():
                if not due.reported and (soonest := self._soonest(bound, of)) > due.tick:
                    self.dues[of] = replace(due, reported=True)
                    self._tell(team, of, due, DeadlineVerdict.LOST, soonest)

    def completed(self, team: Team) -> None:
        """Record that the mission's deadline, if there is one, was kept."""
        self._ends(team, (THE_MISSION, 0), DeadlineVerdict.KEPT)

    def _open(self) -> list[tuple[Of, Due]]:
        """Return the deadlines of the mission, requests and rounds that are not yet missed."""
        return [(of, self.dues[of]) for of in sorted(self.dues) if not self.dues[of].past]

    def _begins(self, team: Team, i: int, done: int | None = None) -> None:
        """Begin a round of a robot if its rounds have deadlines. ``done``: the number of rounds
        that it has completed (default: unchanged)."""
        former, within = self.dues.pop((ROUND, i), Due(0)), team.members[i].robot.within
        if within is not None:
            tick, done = self.tick + within, former.done if done is None else done
            # a round may begin twice in a tick
            before = former.disturbed or (former.before and former.tick == tick)
            self.dues[ROUND, i] = Due(tick, before=before, done=done)

    def _ends(self, team: Team, of: Of, verdict: DeadlineVerdict) -> None:
        if (due := self.dues.pop(of, None)) is not None and not due.past:
            self._tell(team, of, due, verdict)

    def _tell(
        self, team: Team, of: Of, due: Due, verdict: DeadlineVerdict, soonest: int = NEVER
    ) -> None:
        kind, number = of
        name = MISSION
        if kind != THE_MISSION:
            name = (team.obstacles if kind == REQUEST else team.members)[number].name
        self.late += [name] if verdict is DeadlineVerdict.LATE else []
        earliest = None if soonest >= NEVER else soonest
        self.emit(records.Deadline(self.tick, name, due.tick, verdict, earliest))

    def _soonest(self, bound: Bound, of: Of) -> int:
        """Return a lower bound on the tick in which a deadline is met (0: there is no bound)."""
        team, state, (kind, number) = bound.team, bound.state, of
        ruled = any(formulas_in(member.objective) for member in team.members)
        if (ruled or kind == THE_MISSION) and objectives_change(team, self.tick):
            return 0
        if kind == REQUEST:
            return bound.resolved(number)
        if kind == ROUND:
            due = self.dues[of].tick
            if objectives_change(team, self.tick, [team.members[number]], due):
                return 0
            served = state.robots[number].active and on_own(team, state, number)
            ready = served and not self.dues[of].excused
            member, own = team.members[number], state.robots[number].own
            most = 1 + (member.pursuit.rounds(own.met) if member.pursuit.in_turn else 0)
            left = _orders_left(team, state, number, most) if ready else []
            return min((bound.rounds_done(number, goals) for goals in left), default=0)
        every = (_orders_left(team, state, i, team.rounds) for i in range(len(team.members)))
        return mission_end(bound, every)


def objectives_change(
    team: Team, tick: int, members: Iterable[Member] | None = None, most: int = NEVER
) -> bool:
    """Return whether the scenario assigns another objective to one of the robots ``names`` (None:
    any) after ``tick`` and until ``most``. This changes the mission's bound, and perhaps the
    robot's rules for steps."""
    robots = {each.name: each.robot for each in members or team.members}
    changes = (one for one in team.scenario.changes if one.robot in robots)
    times = [change.at for change in changes if change.objective is not None]
    if any(robot.when for robot in robots.values()):
        times += switching(team.scenario.inputs)
    return any(tick < at <= most for at in times)


Orders = list[list[Mask]]
"""Alternative sequences of targets, one of which a robot must meet; none if it may choose the
order."""


def _orders_left(team: Team, state: State, i: int, most: int, *, begun: bool = True) -> Orders:
    """Return the sequences of targets that a robot must still meet for ``most`` rounds: several if
    it may begin with any target, or with the one on which it stands. ``begun``: whether it has
    counted goals; if not, a target on which it stands counts as met."""
    member, robot = team.members[i], state.robots[i]
    if not member.objective.ordered():
        return []
    own, masks, count = robot.own if begun else Count(), member.targets, len(member.targets)
    if member.pursuit.settles:
        orders = [[*masks[own.memory : -1], *masks[-1:] * (most - own.met)]]
    else:
        fixed = begun and own.last < 0 and not (member.planned or robot.fresh)  # by the strategy
        free = member.objective.strict and own.met == 0 and not fixed
        here = (k for k, t in enumerate(masks) if member.either or t >> robot.pose & 1)
        firsts = {own.memory, *here} if free else {own.memory}
        left = range(count * most - own.met)
        orders = [[masks[(first + k) % count] for k in left] for first in firsts]
    return orders if begun else [order[order[0] >> robot.pose & 1 :] for order in orders]


def mission_end(bound: Bound, orders: Iterable[Orders]) -> int:
    """Return a lower bound on the tick in which the mission is completed; NEVER if it never can be.
    ``orders``: the alternative sequences of each robot's targets."""
    received = (each.source.appears or 0 for each in bound.team.obstacles if each.ordered)
    ends = [int(bound.state.time), *received]
    for i, choices in enumerate(orders):
        each = (bound.rounds_done(i, goals) if goals else 0 for goals in choices)
        ends.append(min(each, default=0))
    return max(ends)


def refusal_of(team: Team, state: State) -> End | None:
    """Return the end of a run with a deadline that its robots could not meet even alone, or with an
    insufficient charge; None if there is neither."""
    refused: dict[str, int | None] = {}
    parts = []
    pairs = [*zip(team.members, state.robots, strict=True)]
    for member, robot in pairs:
        within = member.robot.within
        if within is None or objectives_change(team, 0, [member], within):
            continue
        first = member.objective.begin(robot.pose % team.size)  # it may count already
        least, _ = least_first(member, robot.pose, first)
        if least is None or least > within:
            refused[member.name] = least
            parts.append(f"{member.name}: {_words(len(member.targets), within, least)}")
    by = team.scenario.until.by
    if by is not None and not objectives_change(team, 0):
        every = range(len(pairs))
        orders = (_orders_left(team, state, i, team.rounds, begun=False) for i in every)
        soonest = mission_end(Bound(team, state, len(pairs)), orders)
        if soonest > by:
            never = soonest >= NEVER
            refused[MISSION] = None if never else soonest
            when = "at all" if never else f"before tick {soonest}"
            parts.append(f"the mission cannot be completed {when}, and is due by {by}")
    for member, robot in pairs:
        energy = member.energy
        needless = team.scenario.flat is not None or objectives_change(team, 0, [member])
        if energy is None or needless:
            continue
        energy = replace(energy, returns=False)  # only the charge that its own objective needs
        need = energy.need(member.floor, robot.pose, energy.turn(robot.own.memory))
        if need > robot.charge:
            most = energy.battery.capacity
            refused[f"{member.name}.battery"] = None if need > most else ceil(need)
            parts.append(_charge_words(team, member, energy, robot.pose, need))
    return End("unrealizable", "; ".join(parts), refused=refused) if refused else None


def _charge_words(team: Team, member: Member, energy: Energy, pose: int, need: float) -> str:
    battery, here, name = energy.battery, team.world.word(pose % team.size), member.name
    if need <= battery.capacity:
        return f"{name} needs a charge of {ceil(need)} at {here}, and has {battery.start}"
    text = f"from {here}, with any charge up to {battery.capacity}, {name} reaches no"
    if energy.charging(pose):
        text = f"from the charger {here} (full: {battery.capacity}), {name} reaches no other"
    lack = "" if energy.chargers else "; the scenario has no 'chargers'"
    return f"{text} charger or target from which it can continue{lack}"


def _words(count: int, within: int, least: int | None) -> str:
    what = {1: "its target", 2: "both targets"}.get(count, f"all {count} targets")
    text = f"no path meets {what} every {within} tick{'s' * (within > 1)}"
    return text if least is None else f"{text}: the fastest round takes {least}"
