"""Trace check: replays a trace line by line and applies every rule.

The joint-trace checker of the design (section 10). It shares no code with what happens in a run: it
reads the format (safenav.trace.records) and computes the rest from the header."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from safenav.audit.passes import expanded
from safenav.audit.rules.batteries import ChargeRule
from safenav.audit.rules.beliefs import BeliefRule, MissedBeliefRule
from safenav.audit.rules.changes import ChangesRule, InputsRule, ServiceRule
from safenav.audit.rules.deadlines import DeadlineRule
from safenav.audit.rules.live import (
    ActRule,
    ClockRule,
    CommandRule,
    HoldsRule,
    LateRule,
    WaitingRule,
)
from safenav.audit.rules.motion import (
    AlwaysRule,
    CollisionRule,
    ContinuityRule,
    KnownObstacleRule,
    MapRule,
    MobilityRule,
    NeverTogetherRule,
    SwapRule,
    TransitRule,
    UnresolvedObstacleRule,
)
from safenav.audit.rules.objectives import (
    GoalOrderRule,
    GoalRule,
    HoldRule,
    MissedGoalRule,
    PatrolRule,
    RoundsRule,
)
from safenav.audit.rules.obstacles import (
    BacktrackRule,
    BlockedRule,
    MissedResolutionRule,
    NeedRule,
    ResolutionRule,
    ViolationRule,
)
from safenav.audit.rules.order import HeaderRule, OrderRule
from safenav.audit.rules.outcome import CompletedRule, OutcomeRule
from safenav.audit.rules.passing import AppearedRule, GoneRule, OrderedRule
from safenav.audit.rules.plans import FollowsPlanRule, PlanRule
from safenav.audit.rules.proofs import ProofRule
from safenav.audit.rules.requests import BidsRule, HelperRule, RequestRule
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.rules.stack import MissedPopRule, PopRule, PushRule, ToldRule
from safenav.audit.rules.synthesis import StrategyRule, SynthesisRule, VerdictsRule
from safenav.audit.situation import Situation
from safenav.trace.reading import read_lines, read_trace
from safenav.trace.records import (
    Arrive,
    Backtrack,
    Blocked,
    Deadline,
    Discovered,
    Goal,
    Move,
    Push,
    Record,
    Request,
    Resolved,
    Synthesis,
    Violation,
)
from safenav.trace.trace import Trace

RULES: tuple[type[Rule], ...] = (
    HeaderRule,
    OrderRule,
    DeadlineRule,
    ChargeRule,
    ContinuityRule,
    MapRule,
    MobilityRule,
    TransitRule,
    UnresolvedObstacleRule,
    KnownObstacleRule,
    AlwaysRule,
    CollisionRule,
    NeverTogetherRule,
    SwapRule,
    BeliefRule,
    MissedBeliefRule,
    ViolationRule,
    BacktrackRule,
    NeedRule,
    ResolutionRule,
    MissedResolutionRule,
    BlockedRule,
    RequestRule,
    BidsRule,
    HelperRule,
    PushRule,
    ToldRule,
    PopRule,
    MissedPopRule,
    GoalRule,
    GoalOrderRule,
    PatrolRule,
    MissedGoalRule,
    RoundsRule,
    HoldRule,
    SynthesisRule,
    StrategyRule,
    VerdictsRule,
    AppearedRule,
    OrderedRule,
    GoneRule,
    ChangesRule,
    InputsRule,
    ServiceRule,
    PlanRule,
    FollowsPlanRule,
    OutcomeRule,
    CompletedRule,
    ProofRule,
    ClockRule,
    CommandRule,
    ActRule,
    HoldsRule,
    LateRule,
    WaitingRule,
)
"""Every rule, in the order in which findings on one line are reported."""

NAMES_RULE = "names"
"""Lines refer only to robots and obstacles of the header, or to obstacles that were discovered
before. Kept here, since lines that break it mean nothing to the other rules and are left out."""


_ROLES = (
    *("robot", "requester", "helper", "of", "helpers", "robots"),
    *("bids", "objectives", "rounds", "nodes", "unrealizable"),
)
"""The fields of lines that name robots."""


@dataclass(frozen=True)
class Statistics:
    """Counts of what the trace holds. ``steps`` are the moves other than stays."""

    robots: int
    ticks: int
    moves: int
    steps: int
    goals: int
    violations: int
    requests: int
    resolved: int
    blocked: int
    deepest_stack: int
    syntheses: int
    ignored_lines: int


@dataclass(frozen=True)
class Audit:
    """Result of a check. ``complete``: the trace has its outcome; otherwise it was cut off (by a
    crash, say), and the result does not cover what came after."""

    source: str
    outcome: str | None
    complete: bool
    findings: tuple[Finding, ...]
    statistics: Statistics

    @property
    def ok(self) -> bool:
        """Return whether no rule was broken, as far as the trace goes."""
        return not self.findings


def check_trace(trace: str | Path | Iterable[str]) -> Audit:
    """Check a trace in a file (its path) or in lines. Raises InputError if it is not a trace."""
    if isinstance(trace, str | Path):
        return audit(read_trace(trace))
    return audit(read_lines(trace))


def audit(trace: Trace) -> Audit:
    """Check a trace that was read. Findings come in the order of the lines they concern."""
    rank = {rule.name: position for position, rule in enumerate(RULES, start=1)}
    findings = sorted(_findings(trace), key=lambda f: (f.line, rank.get(f.rule, 0)))
    outcome = trace.outcome
    return Audit(
        trace.source,
        outcome.outcome.value if outcome else None,
        outcome is not None and not trace.cut_off,
        tuple(findings),
        _statistics(trace),
    )


def _findings(trace: Trace) -> Iterator[Finding]:
    trace = expanded(trace)
    now = Situation(trace)
    announced = {obstacle.name for obstacle in now.header.obstacles}
    rules = [rule() for rule in RULES]
    for rule in rules:
        yield from rule.opening(now)
    for record in trace.records:
        if isinstance(record, Discovered):
            announced.add(record.obstacle.name)
        stranger = _stranger(record, now.header.robots, announced)
        if stranger is not None:
            problem = f"{stranger!r} is not in the scenario"
            yield Finding(NAMES_RULE, record.tick, None, record.line, problem)
            continue
        if now.outcome is not None:
            yield from _after_the_end(record)
            continue
        for rule in rules:
            yield from rule.line(record, now)
        if isinstance(record, Violation | Backtrack | Move) and now.starts_turn(record):
            now.finish_turn(last=False)
            for rule in rules:
                yield from rule.turn(now)
            now.begin_turn(record)
        now.apply(record)
    now.finish_turn(last=True)
    for rule in rules:
        yield from rule.turn(now)
    for rule in rules:
        yield from rule.ending(now)


def _after_the_end(record: Record) -> Iterator[Finding]:
    kind = type(record).__name__.lower()
    problem = f"a {kind} line after the outcome, which is the last line"
    yield Finding(OrderRule.name, record.tick, None, record.line, problem)


def _stranger(record: Record, team: Collection[str], announced: Collection[str]) -> str | None:
    """Return a robot or obstacle that the line refers to and that no earlier line has announced."""
    obstacle = getattr(record, "obstacle", None)
    roles = () if isinstance(record, Deadline) else _ROLES
    robots = [robot for role in roles for robot in _listed(getattr(record, role, None))]
    if isinstance(record, Discovered):
        robots += record.obstacle.blocks
    elif obstacle is not None and obstacle not in announced:
        return str(obstacle)  # be it the name of a robot
    return next((name for name in robots if name not in team), None)


def _listed(value: object) -> list[str]:
    if value is None or isinstance(value, str):
        return [] if value is None else [value]
    return [str(name) for name in value] if isinstance(value, Iterable) else []


def _statistics(trace: Trace) -> Statistics:
    def count(kind: type[Record]) -> int:
        return sum(isinstance(record, kind) for record in trace.records)

    moves = [record for record in trace.records if isinstance(record, Move | Arrive)]
    return Statistics(
        robots=len(trace.header.scenario.robots),
        ticks=max((move.tick for move in moves), default=0),
        moves=len(moves),
        steps=sum(not isinstance(one, Move) or one.from_ != one.to for one in moves),
        goals=count(Goal),
        violations=count(Violation),
        requests=count(Request),
        resolved=count(Resolved),
        blocked=count(Blocked),
        deepest_stack=max((r.depth for r in trace.records if isinstance(r, Push)), default=0),
        syntheses=count(Synthesis),
        ignored_lines=trace.ignored,
    )
