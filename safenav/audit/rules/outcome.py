"""Rules on how a run ends."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.progress import ENDS
from safenav.audit.rules.objectives import COUNTED_KINDS
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation
from safenav.trace.objective import Objective
from safenav.trace.proofs import Closure, Joint, Proof
from safenav.trace.records import (
    Assumption,
    Goal,
    Move,
    NewObjective,
    Outcome,
    Record,
    Resolved,
    Synthesis,
)
from safenav.trace.vocabulary import Ending, OperatorCause, RecordedVerdict


class OutcomeRule(Rule):
    """The outcome agrees with the run: ticks and syntheses are counted correctly, the tick limit
    (live: the limit in seconds) is neither passed nor claimed early, nobody acts when it is
    completed, a negative has its cause in the last turn (D 5.7, T). A recorded synthesis may have
    taken several attempts, so there may be more of them."""

    name = "outcome"

    def __init__(self) -> None:
        self._syntheses: list[Synthesis] = []
        self._assumptions = 0
        self._moves: dict[str, int] = {}
        self._passed_limit = False

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        match record:
            case Synthesis():
                self._syntheses.append(record)
            case Assumption():
                self._assumptions += 1
            case Move():
                self._moves[record.robot] = record.tick
                limit = None if now.live else now.header.limits.ticks
                if limit is not None and record.tick > limit and not self._passed_limit:
                    self._passed_limit = True
                    yield self.broken_by(record, record.robot, f"the limit is {limit} ticks")
            case _:
                pass

    def ending(self, now: Situation) -> Iterator[Finding]:
        outcome = now.outcome
        if outcome is not None:
            for problem in (*self._counts(outcome, now), *self._cause(outcome, now)):
                yield self.broken_by(outcome, None, problem)

    def _counts(self, outcome: Outcome, now: Situation) -> Iterator[str]:
        if now.live:
            yield from self._live_counts(outcome, now)
            return
        last = max(self._moves.values(), default=0)
        moved_by_all = len(set(self._moves.values())) <= 1 and (
            len(self._moves) in (0, len(now.header.robots))
        )
        if outcome.ticks != last and (moved_by_all or outcome.ticks != last - 1):
            yield f"it reports {outcome.ticks} ticks; the last move is of tick {last}"
        complete = outcome.outcome in (Ending.COMPLETED, Ending.TICK_LIMIT)
        if outcome.tick not in ((last,) if complete else (last, last + 1)):
            yield f"it is of tick {outcome.tick}; the last move is of tick {last}"
        if outcome.syntheses < len(self._syntheses):
            yield f"it reports {outcome.syntheses} syntheses; the trace has {len(self._syntheses)}"
        limit = now.header.limits.ticks
        if outcome.outcome is Ending.TICK_LIMIT and limit is not None and outcome.ticks != limit:
            yield f"it reports the tick limit after {outcome.ticks} ticks, but the limit is {limit}"

    def _live_counts(self, outcome: Outcome, now: Situation) -> Iterator[str]:
        """Yield what differs from the commands; a run in seconds has no limit of ticks."""
        if outcome.syntheses < len(self._syntheses):
            yield f"it says {outcome.syntheses} syntheses, but the trace has {len(self._syntheses)}"
        if outcome.outcome is Ending.TICK_LIMIT:
            yield "a live run has no limit of ticks"
        limit = now.header.limits.seconds
        early = limit is not None and outcome.t is not None and outcome.t < limit
        if outcome.outcome is Ending.TIME_LIMIT and early:
            yield f"it reports the time limit after {outcome.t} s, but the limit is {limit} s"
        if outcome.outcome is Ending.COMPLETED and now.acting:
            yield f"the run is completed while {', '.join(sorted(now.acting))} act"

    def _cause(self, outcome: Outcome, now: Situation) -> Iterator[str]:
        negative = [s for s in now.turn.all(Synthesis) if s.verdict is RecordedVerdict.UNREALIZABLE]
        if outcome.outcome is Ending.UNREALIZABLE:
            if self._moves:
                yield "unrealizable is for runs that never begin, but robots have moved"
            if not negative and not outcome.refused:
                yield "it reports unrealizable, but no synthesis before the start was"
        if outcome.outcome is Ending.ASSUMPTION_VIOLATED and not self._assumptions:
            yield "it reports a violated assumption, but no line records one"
        proven = outcome.proof is not None or outcome.unrealizable
        if outcome.outcome is Ending.OPERATOR_NEEDED and (proven or outcome.cause is None):
            causes = _causes(outcome.proof, now)
            if outcome.cause is None:
                yield "an operator is needed, but the cause is missing"
            elif outcome.cause not in causes:
                yield f"its cause is {outcome.cause}; proven is {causes[0]}"


def _causes(proof: Proof | None, now: Situation) -> tuple[OperatorCause, ...]:
    """Return the causes that a proof shows."""
    if isinstance(proof, Joint):
        return (OperatorCause.DEADLOCK,)
    if not (isinstance(proof, Closure) and proof.never):
        return (OperatorCause.UNREALIZABLE,)
    short = [now.too_few(name) for name in proof.never]
    if any(left[0] for left in short if left):
        return (OperatorCause.NO_CAPABLE_ROBOT,)
    others = (OperatorCause.NEVER_RESOLVABLE, OperatorCause.CYCLIC_REQUESTS)
    later = any(any(left) for left in short)
    return (*others, OperatorCause.NO_CAPABLE_ROBOT) if later else others


class CompletedRule(Rule):
    """A run is completed if and only if each robot has met its objective ``until.rounds`` times
    since the last resolution and has it in force; requests that no robot needs any longer may be
    open (D 5.6). A round counts from the goal lines; one that was begun before the resolution may
    be counted at its last target."""

    name = "completed"

    def __init__(self) -> None:
        self._goals: dict[str, list[Goal]] = {}
        self._held: dict[str, int] = {}
        self._tick = 0
        self._time = 0.0  # the tick; in a live run the seconds
        self._goes_on = False

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if record.t is not None or not now.live:
            self._time = record.tick if record.t is None else record.t
        if isinstance(record, Move) and record.tick > self._tick:
            self._tick = record.tick
            if record.tick > 1 and not self._goes_on and self._over(now):
                self._goes_on = True
                wanted = now.header.until.rounds
                rounds = "1 round" if wanted == 1 else f"{wanted} rounds"
                problem = f"every robot has completed {rounds}, but the run continues"
                yield self.broken_by(record, None, problem)
        if isinstance(record, Resolved):
            self._goals.clear()
            self._held.clear()
        elif isinstance(record, NewObjective):
            self._goals.pop(record.robot, None)
            self._held.pop(record.robot, None)
        elif isinstance(record, Goal | Move):
            objective = now.objectives[record.robot]
            if objective != now.header.robots[record.robot].objective:
                return  # goals met while it waits or helps are not rounds of its own
            if isinstance(record, Goal):
                self._goals.setdefault(record.robot, []).append(record)
            elif _stays(record.robot, now) and record.to in objective.targets[-1]:
                self._held[record.robot] = self._held.get(record.robot, 0) + 1

    def ending(self, now: Situation) -> Iterator[Finding]:
        outcome, wanted = now.outcome, now.header.until.rounds
        if outcome is None or wanted is None:
            return
        for robot in now.header.robots:
            for problem in self._rounds(robot, outcome, wanted, now):
                yield self.broken_by(outcome, robot, problem)
        if outcome.outcome is Ending.TICK_LIMIT and self._over(now):
            problem = f"every robot has met its objective {wanted} times: it is completed"
            yield self.broken_by(outcome, None, problem)

    def _rounds(self, robot: str, outcome: Outcome, wanted: int, now: Situation) -> Iterator[str]:
        told = outcome.rounds.get(robot)
        if told is None:
            yield f"the rounds of {robot} are missing"
            return
        objective = now.objectives[robot]
        _, most = _bounds(self._goals.get(robot, []), objective)
        if outcome.outcome is Ending.COMPLETED:
            if now.due(robot) != now.base[robot]:
                yield f"an input keeps {robot} from its objective, so the run is not completed"
            elif told < wanted:
                yield f"{robot} has {told} rounds of {wanted}, so the run is not completed"
            elif most is not None and most < wanted:
                yield f"{robot} has {most} rounds of {wanted} since the last resolution"
            elif objective.kind in ENDS and now.ahead[robot] < len(objective.targets):
                yield f"{robot} has met {now.ahead[robot]} of its {len(objective.targets)} targets"
            elif _stays(robot, now) and self._held.get(robot, 0) + 1 < wanted:
                # The region where it stands when counting begins may also count.
                yield f"{robot} has held for {self._held.get(robot, 0)} ticks of {wanted}"

    def _over(self, now: Situation) -> bool:
        """Return whether the run is certainly completed."""
        wanted = now.header.until.rounds
        if wanted is None or now.stack or now.acting or not now.header.robots:
            return False
        if any(o.ordered and (o.from_ or 0) >= self._time for o in now.header.obstacles):
            return False  # an order is to come
        if any(now.due(robot) != now.base[robot] for robot in now.header.robots):
            return False  # an input keeps a robot from its objective
        return all(self._surely(robot, now) >= wanted for robot in now.header.robots)

    def _surely(self, robot: str, now: Situation) -> int:
        objective = now.header.robots[robot].objective
        if now.objectives[robot] != objective:
            return 0
        if objective.kind == "hold":
            return len(self._goals.get(robot, []))
        return _bounds(self._goals.get(robot, []), objective)[0]


def _stays(robot: str, now: Situation) -> bool:
    """Return whether each tick at its last target is a round of a robot's own objective."""
    own = now.header.robots[robot].objective
    ended = own.kind in ENDS and now.ahead[robot] >= len(own.targets)
    return own.kind == "hold" or ended


def _bounds(goals: list[Goal], objective: Objective) -> tuple[int, int | None]:
    """Return the least and the greatest number of rounds that these goals can be (None: no
    bound)."""
    if objective.kind not in COUNTED_KINDS:
        return 0, None
    count = len(objective.targets)
    if objective.kind == "cover":
        whole = _covers(goals, count)
        return whole, max(whole, 1 + _covers(goals[1:], count)) if goals else 0
    by_last = sum(goal.goal == count - 1 for goal in goals)
    by_count = len(goals) // count
    # A robot that makes way repeatedly may reach the same target repeatedly.
    return min(by_last, by_count, _covers(goals, count)), max(by_last, by_count)


def _covers(goals: list[Goal], count: int) -> int:
    rounds, covered = 0, set[int]()
    for goal in goals:
        covered.add(goal.goal)
        if len(covered) >= count:
            rounds += 1
            covered.clear()
    return rounds
