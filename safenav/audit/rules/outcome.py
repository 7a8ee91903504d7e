"""Rules on the end of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from safenav.audit.kinds import shape_of
from safenav.audit.lines import Line, Objective, proof_of
from safenav.audit.rules.rule import Message, Rule
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import ROUNDED, Status


class OutcomeRule(Rule):
    """The outcome agrees with the run: it counts ticks and syntheses correctly, the tick limit
    (live: the limit in seconds) is neither exceeded nor claimed early, no robot acts at completion,
    the seconds with and without a command (live) follow from the lines of the commands, and a
    negative has its cause in the last turn (D 5.7, T). The count of syntheses may be higher than
    the recorded ones, because one may take several attempts."""

    name = "outcome"
    kinds = (
        *("synthesis", "assumption", "move", "order", "waiting"),
        *("depart", "act", "arrive", "acted"),
    )

    def __init__(self) -> None:
        self._syntheses = self._assumptions = 0
        self._moves: dict[str, int] = {}
        self._passed_limit = False
        self._ordered = 0
        self._begun: dict[str, float] = {}  # live: the time of each robot's open command
        self._busy: dict[str, float] = {}
        self._over = 0.0  # live: the time at which the last command ended

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        match record.type:
            case "synthesis":
                self._syntheses += 1
            case "assumption":
                self._assumptions += 1
            case "order":
                self._ordered = record.tick
            case "depart" | "act":
                self._begun[record.robot] = record.t or 0.0
            case "arrive" | "acted":
                self._over, name = record.t or 0.0, record.robot
                took = self._over - self._begun.pop(name, self._over)
                self._busy[name] = self._busy.get(name, 0.0) + took
            case "waiting" if record.proof is not None:
                yield from _wrong_cause(record, now)
            case "move":
                self._moves[record.robot] = record.tick
                limit = None if now.live else now.header.limits.ticks
                if limit is not None and record.tick > limit and not self._passed_limit:
                    self._passed_limit = True
                    yield f"the limit is {limit} ticks"

    def ending(self, now: Situation) -> Iterator[Message]:
        outcome = now.outcome
        if outcome is not None:
            if outcome.syntheses < self._syntheses:
                reports = f"it reports {outcome.syntheses} syntheses"
                yield f"{reports}; the trace records {self._syntheses}"
            yield from (self._live_counts if now.live else self._counts)(outcome, now)
            yield from self._cause(outcome, now)

    def _counts(self, outcome: Line, now: Situation) -> Iterator[str]:
        last = max(self._moves.values(), default=0)
        all_moved = len(self._moves) in (0, len(now.header.robots))
        moved_by_all = all_moved and len(set(self._moves.values())) <= 1
        if outcome.ticks != last and (moved_by_all or outcome.ticks != last - 1):
            yield f"it reports {outcome.ticks} ticks; the last move is of tick {last}"
        complete = outcome.outcome in ("completed", "tick_limit")
        ordered = outcome.outcome == "completed" and self._ordered == last + 1
        if outcome.tick not in ((last,) if complete and not ordered else (last, last + 1)):
            yield f"it is of tick {outcome.tick}; the last move is of tick {last}"
        limit = now.header.limits.ticks
        if outcome.outcome == "tick_limit" and limit is not None and outcome.ticks != limit:
            yield f"it reports the tick limit after {outcome.ticks} ticks, but the limit is {limit}"

    def _live_counts(self, outcome: Line, now: Situation) -> Iterator[str]:
        """Yield contradictions between outcome and commands; a live run has no tick limit."""
        if outcome.outcome == "tick_limit":
            yield "a live run has no tick limit"
        if outcome.ticks != outcome.tick:
            yield f"it reports {outcome.ticks} ticks, but is of tick {outcome.tick}"
        limit = now.header.limits.seconds
        early = limit is not None and outcome.t is not None and outcome.t < limit
        still = not (any(now.toward.values()) or now.acting)  # nothing happens before the limit
        if outcome.outcome == "time_limit" and early and not still:
            yield f"it reports the time limit after {outcome.t} s, but the limit is {limit} s"
        if outcome.outcome == "completed" and now.acting:
            yield f"the run is completed while {', '.join(sorted(now.acting))} act"
        if outcome.makespan is not None and abs(outcome.makespan - self._over) > ROUNDED:
            yield f"the last command ended at {self._over} s, not {outcome.makespan} s"
        for name in now.header.robots:
            busy = self._busy.get(name, 0.0)
            facts = (outcome.busy, busy, "with"), (outcome.waiting, self._over - busy, "without")
            for stated, seconds, how in facts:
                if stated is not None and abs(stated.get(name, -1.0) - seconds) > ROUNDED:
                    yield f"{name} was {seconds:g} s {how} a command, not {stated.get(name)} s"

    def _cause(self, outcome: Line, now: Situation) -> Iterator[str]:
        negative = [s for s in now.turn.all("synthesis") if s.verdict == "unrealizable"]
        if outcome.outcome == "unrealizable":
            if self._moves:
                yield "unrealizable is for runs that never begin, but robots have moved"
            if not negative and not outcome.refused:
                yield "it reports unrealizable, but every synthesis before the start was realizable"
        if outcome.outcome == "assumption_violated" and not self._assumptions:
            yield "it reports a violated assumption, but no line records one"
        if outcome.proof is not None or outcome.unrealizable or outcome.cause is None:
            yield from _wrong_cause(outcome, now)


def _wrong_cause(record: Line, now: Situation) -> Iterator[str]:
    """Yield the error in the cause of an outcome or a wait, if it needs an operator."""
    if record.outcome == "operator_needed":
        causes = _causes(proof_of(record), now)
        if record.cause is None:
            yield "an operator is needed, but the cause is missing"
        elif record.cause not in causes:
            yield f"its cause is {record.cause}; proven is {causes[0]}"


def _causes(proof: Mapping[str, Any] | None, now: Situation) -> tuple[str, ...]:
    """Return the causes that a proof shows."""
    if proof is not None and proof.get("kind") in ("joint", "room"):
        return ("deadlock",)
    if not (proof is not None and proof.get("kind") == "closure" and proof.get("never")):
        return ("unrealizable",)
    short = [now.too_few(name) for name in proof["never"] if name in now.obstacles]
    if any(left[0] for left in short if left):
        return ("no_capable_robot",)
    others = ("never_resolvable", "cyclic_requests")
    later = any(any(left) for left in short)
    return (*others, "no_capable_robot") if later else others


_COUNT = ("goal", "gone", "objective", "operator", "blocked")
"""Lines before all moves of a tick that may complete the run."""


class CompletedRule(Rule):
    """A run is completed if and only if each robot has met its objective ``until.rounds`` times
    since the last resolution and has it in force, and each robot with an objective that ends is at
    its last target in that moment. Requests that no robot needs may be open; open
    orders only once the scenario changes nothing more within its limits (D 5.6). A run that has
    begun does not end with ``operator_needed`` before such changes. Rounds are counted from the
    goal lines; a round begun before the resolution may count at its last target."""

    name = "completed"

    def __init__(self) -> None:
        self._held: dict[str, set[int]] = {}  # the ticks held, by robot
        self._held_before: dict[str, int] = {}
        self._tick = 0
        self._time = 0.0  # the tick; in a live run the seconds
        self._goes_on = False
        self._requested: set[str] = set()
        self._undecided: set[str] = set()
        self._begins = 0  # last tick with a line of ``_COUNT`` before all moves

    def opening(self, now: Situation) -> Iterable[Message]:
        settles = [name for name, own in now.own.items() if shape_of(own.kind).settles]
        self._held_before = {n: now.done[n].rounds or 0 for n in settles if n in now.done}
        return ()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.t is not None or not now.live:
            self._time = record.tick if record.t is None else record.t
        if record.type == "move" and record.tick > self._tick:
            self._tick = record.tick
            ended = 1 < record.tick != self._begins  # at the end of the tick before
            if ended and not self._goes_on and self._over(now):
                self._goes_on = True
                wanted = now.header.until.rounds
                rounds = "1 round" if wanted == 1 else f"{wanted} rounds"
                yield None, f"every robot has completed {rounds}, but the run continues"
        elif record.type in _COUNT and record.tick > self._tick:
            self._begins = record.tick
        if record.type == "request":
            self._requested.add(record.obstacle)
            self._undecided.discard(record.obstacle)
        if record.type in ("violation", "reopened"):
            self._undecided.add(record.obstacle)
        if record.type == "resolved":
            if now.restarts(record):
                self._held.clear()
                self._held_before.clear()
        elif record.type == "objective":
            self._held.pop(record.robot, None)
            self._held_before.pop(record.robot, None)
        elif record.type in ("move", "synthesis"):
            self._hold(record, now)

    def _hold(self, record: Line, now: Situation) -> None:
        """Count a tick that a robot ends at its last target, or in which it resumes its own
        objective there."""
        robot, own, region = record.robot, now.own[record.robot], now.region[record.robot]
        objective = now.objectives[robot]
        if record.type == "move":
            region = record.to
        elif record.tick > 0 and record.node is not None:
            objective = record.objective
        last = own.targets[-1] if own.targets else ()
        if objective == own and _stays(robot, now) and region in last:
            self._held.setdefault(robot, set()).add(record.tick)

    def ending(self, now: Situation) -> Iterator[Message]:
        outcome, wanted = now.outcome, now.header.until.rounds
        if outcome is None:
            return
        if wanted is None:
            yield from ["the scenario sets no rounds"] * (outcome.outcome == "completed")
            return
        for robot in now.header.robots:
            for problem in self._rounds(robot, outcome, wanted, now):
                yield robot, problem
        undone, later = _undone(now), [t for t in _coming(now, surely=True) if t > self._time]
        if outcome.outcome == "completed" and undone and later:
            what = f"{', '.join(undone)} is not done, and the scenario changes something at"
            yield f"{what} {min(later):g}"
        if outcome.outcome == "operator_needed" and outcome.tick > 0 and later:
            yield f"the run ends, but the scenario changes something at {min(later):g}"
        if outcome.outcome == "tick_limit" and self._over(now):
            yield f"every robot has met its objective {wanted} times: the run is completed"

    def _rounds(self, robot: str, outcome: Line, wanted: int, now: Situation) -> Iterator[str]:
        stated = outcome.rounds.get(robot)
        if stated is None:
            yield f"the rounds of {robot} are missing"
            return
        objective, progress = now.own[robot], now.progress[robot]
        held = len(self._held.get(robot, ())) + self._held_before.get(robot, 0)
        _, most = _bounds(progress.goals, objective)
        if outcome.outcome == "completed":
            if now.is_away(robot):
                yield f"an input keeps {robot} from its objective, so the run is not completed"
            elif stated < wanted:
                yield f"{robot} has {stated} rounds of {wanted}, so the run is not completed"
            elif most is not None and most < wanted:
                yield f"{robot} has {most} rounds of {wanted} since the last resolution"
            elif shape_of(objective.kind).ends and progress.ahead < len(objective.targets):
                yield f"{robot} has met {progress.ahead} of its {len(objective.targets)} targets"
            elif not now.live and _stays(robot, now) and held + 1 < wanted:
                # The region where it stands when counting begins may also count. (Beside a running
                # clock, staying takes no time.)
                yield f"{robot} has held for {held} ticks of {wanted}"
            elif not _is_at_its_end(robot, now):
                yield f"{robot} is not at its last target, so the run is not completed"

    def _over(self, now: Situation) -> bool:
        """Return whether the run is certainly completed."""
        wanted = now.header.until.rounds
        if wanted is None or now.stack or now.acting or not now.header.robots:
            return False
        if any(o.ordered and (o.from_ or 0) >= self._time for o in now.header.obstacles):
            return False  # an order is to come
        if _undone(now) and any(time >= self._time for time in _coming(now, surely=False)):
            return False  # a change may make an order possible
        orders = set(_undone(now)) - self._requested
        met = {name for name in self._undecided if name in now.requests}
        if any(now.status[name] is Status.UNRESOLVED for name in orders | met):
            return False  # the team has not decided on it yet
        if any(map(now.is_away, now.header.robots)):
            return False  # an input keeps a robot from its objective
        if not all(_is_at_its_end(robot, now) for robot in now.header.robots):
            return False
        return all(self._surely(robot, now) >= wanted for robot in now.header.robots)

    def _surely(self, robot: str, now: Situation) -> int:
        objective, goals = now.own[robot], now.progress[robot].goals
        shape = shape_of(objective.kind)
        if now.objectives[robot] != objective:
            return 0
        if shape.settles and not shape.ends:
            return len(goals)
        return _bounds(goals, objective)[0]


def _undone(now: Situation) -> list[str]:
    """Return the orders that have appeared and are not fulfilled."""
    return [n for n in now.orders if now.status[n].unmet]


def _coming(now: Situation, *, surely: bool) -> Iterator[float]:
    """Yield the times of changes by the scenario within the limits: all that it lists, or
    (``surely``) only those certain from here on."""
    header, limits = now.header, now.header.limits
    times = [float(change.at) for change in header.changes or ()]
    for each in header.inputs or ():
        spans = each.spans or ()
        edges = {float(tick) for first, last in spans for tick in (first, last + 1)}
        times += [t for t in edges if _is_in(t, spans) != _is_in(t - 1, spans)]
    for name, listed in now.listed.items():
        for each in listed:
            here = not now.status[name].away and len(listed) == 1
            times += [each.from_] if each.from_ and not surely else []
            times += [each.until] if each.until and (here or not surely) else []
    last = limits.seconds if now.live else limits.ticks
    if surely and last is None:  # live: a limit is at least a second for each tick
        last = limits.ticks
    if not (surely and now.external):
        yield from (time for time in times if last is None or time <= last)


def _is_in(time: float, spans: Iterable[tuple[int, int]]) -> bool:
    return any(first <= time <= last for first, last in spans)


def _stays(robot: str, now: Situation) -> bool:
    """Return whether each tick at its last target is a round of a robot's own objective."""
    own, shape = now.own[robot], shape_of(now.own[robot].kind)
    return shape.settles and (not shape.ends or now.progress[robot].ahead >= len(own.targets))


def _is_at_its_end(robot: str, now: Situation) -> bool:
    """Return whether a robot stands in its last target, wherever it may be if it is lost; True if
    its objective has no end."""
    own = now.own[robot]
    if not shape_of(own.kind).settles:
        return True
    return now.toward[robot] is None and now.may_have(robot) <= own.targets[-1]


def _bounds(goals: Sequence[Line], objective: Objective) -> tuple[int, int | None]:
    """Return the fewest and the most rounds that these goals may complete (None: unbounded)."""
    if not shape_of(objective.kind).recurs:
        return 0, None
    count = len(objective.targets)
    if shape_of(objective.kind).covers:
        whole = _covers(goals, count)
        return whole, max(whole, 1 + _covers(goals[1:], count)) if goals else 0
    by_last = sum(goal.goal == count - 1 for goal in goals)
    by_count = len(goals) // count
    # A robot that joint plans move away repeatedly may reach the same target repeatedly.
    return min(by_last, by_count, _covers(goals, count)), max(by_last, by_count)


def _covers(goals: Sequence[Line], count: int) -> int:
    rounds, covered = 0, set[int]()
    for goal in goals:
        covered.add(goal.goal)
        if len(covered) >= count:
            rounds += 1
            covered.clear()
    return rounds
