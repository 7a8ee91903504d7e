"""All rules, applied to the lines of a run in their order.

The joint-trace checker of the design (section 10). It shares no code with the runtime: it knows the
format (docs/trace.md) and computes everything else from the header.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import chain

from safenav.audit.lines import Line, Made
from safenav.audit.needs import Need
from safenav.audit.rules import (
    batteries,
    changes,
    deadlines,
    live,
    motion,
    objectives,
    obstacles,
    order,
    outcome,
    plans,
    proofs,
    requests,
    stack,
    synthesis,
)
from safenav.audit.rules.deadlines import MISSION
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.run.passes import Passes
from safenav.audit.run.situation import Situation

_MODULES = (
    *(order, deadlines, batteries, motion, obstacles, requests, stack, objectives),
    *(synthesis, changes, plans, outcome, proofs, live),
)
RULES: tuple[type[Rule], ...] = tuple(
    rule
    for module in _MODULES
    for rule in vars(module).values()
    if isinstance(rule, type) and issubclass(rule, Rule) and rule.__module__ == module.__name__
)
"""Every rule, in the order in which findings on one line are reported."""

NAMES_RULE = "names"
"""Lines refer only to robots and obstacles of the header, or to obstacles discovered before. This
rule is checked here, because the other rules cannot interpret a line that breaks it."""

_ROLES = (
    *("robot", "requester", "helper", "of", "helpers", "robots"),
    *("bids", "objectives", "rounds", "nodes", "unrealizable"),
)
"""Fields of lines that name robots."""


def findings(now: Situation, records: Sequence[Line], rules: Iterable[Rule]) -> Iterator[Finding]:
    """Yield the findings of a run, each no later than the end of the turn that shows it. ``now``:
    the situation at its header; the lines are applied to it."""
    opening, rules = now.turn, list(rules)
    announced = {obstacle.name for obstacle in now.header.obstacles}
    ends = [rule for rule in rules if _judges(rule, "turn")]
    judges: dict[str, list[Rule]] = {}  # for each type of line
    if faults := [*findings_before(now)]:
        yield from faults
        return  # the initial state would contain them
    for rule in rules:
        for message in rule.opening(now):
            yield rule.finding(message, opening, None)
    moves = Passes(now)
    for record in moves.expand(records) if now.live else records:
        if record.type == "discovered":
            name = record.obstacle.name
            if name in announced or name in now.header.robots:
                yield _of_run(record, f"{name!r} is discovered, but is known already")
            announced.add(name)
        stranger = _stranger(record, now.header.robots, announced)
        if stranger is not None:
            yield _of_run(record, f"{stranger!r} is not in the scenario")
            continue
        if now.outcome is not None:
            problem = f"a {record.type} line after the outcome, which is the last line"
            yield _of_run(record, problem, rule="order")
            continue
        kind = record.type
        if kind not in judges:
            about = [rule for rule in rules if not rule.kinds or kind in rule.kinds]
            judges[kind] = [rule for rule in about if _judges(rule, "line")]
        robot = getattr(record, "robot", None)
        if kind == "move" and not now.live:
            now.ends_step(record)
        for rule in judges[kind]:
            for message in rule.line(record, now):
                yield rule.finding(message, record, robot)
        if now.starts_turn(record):
            yield from _turn_over(ends, now, last=False)
            now.begin_turn(record)
        now.apply(record)
    yield from _turn_over(ends, now, last=True)
    for rule in rules:
        for message in rule.ending(now):
            yield rule.finding(message, now.outcome or opening, None)


def _of_run(record: Line, problem: str, rule: str = NAMES_RULE) -> Finding:
    return Finding(rule, record.tick, None, record.line, problem)


def _judges(rule: Rule, moment: str) -> bool:
    """Return whether a rule overrides a method of Rule: most rules judge either lines or turns."""
    return getattr(type(rule), moment) is not getattr(Rule, moment)


def _turn_over(rules: Iterable[Rule], now: Situation, *, last: bool) -> Iterator[Finding]:
    now.finish_turn(last)
    for rule in rules:
        for message in rule.turn(now):
            yield rule.finding(message, now.turn, now.turn.robot)


def findings_before(now: Situation) -> Iterator[Finding]:
    """Yield the robots and obstacles of the earlier run that this header does not have, and the
    obstacles whose first needs it cannot have met so."""
    begun = now.begun
    asked, met, plan = begun.asked or {}, begun.met or {}, begun.plan or Made()
    orders = [(first, then) for first, _, then, _ in plan.orders or ()]
    robots = {*now.done, *(begun.had or ()), *(begun.charging or ()), *(begun.waited or ())}
    robots = robots.union(plan.robots or (), *orders, *asked.values(), *chain(*met.values()))
    obstacles = {*asked, *met, *(begun.stays or ()), *(begun.closed or ())}
    obstacles |= {*(begun.due or ()), *(begun.late or ())} - {MISSION}
    strangers = (robots - now.header.robots.keys()) | (obstacles - now.obstacles.keys())
    for name in sorted(strangers):
        yield _of_run(now.turn, f"{name!r} is not in the scenario")
    for name, groups in met.items():
        if name not in strangers and not can_have_met(now.obstacles[name].all_needs, groups):
            groups_of_robots = ", then ".join(" and ".join(group) for group in groups) or "no robot"
            yield _of_run(
                now.turn, f"{groups_of_robots} cannot have met the first needs of {name}", "header"
            )


def can_have_met(needs: Sequence[Need], groups: Sequence[Sequence[str]]) -> bool:
    """Return whether groups of robots may have met the first needs of an obstacle, so that the same
    robots must meet the next one."""
    chain, able = needs[1 : len(groups) + 1], needs[0].able
    for need, group in zip(needs, groups, strict=False):
        able = need.able.intersection(group, able)
        if len(able) < max(need.robots, len(group)):
            return False
    return 0 < len(groups) == len(chain) and all(need.same for need in chain)


def _stranger(record: Line, team: Collection[str], announced: Collection[str]) -> str | None:
    """Return a robot or obstacle that the line names but no earlier line has announced, if any;
    of several robots, the first in alphabetical order."""
    if record.type == "move":
        return None if record.robot in team else str(record.robot)
    obstacle = getattr(record, "obstacle", None)
    roles = () if record.type == "deadline" else _ROLES
    robots = [robot for role in roles for robot in _listed(getattr(record, role, None))]
    if record.type == "discovered":
        robots += record.obstacle.blocks
    elif obstacle is not None and obstacle not in announced:
        return str(obstacle)  # even if it is the name of a robot
    return min((name for name in robots if name not in team), default=None)


def _listed(value: object) -> list[str]:
    if value is None or isinstance(value, str):
        return [] if value is None else [value]
    return [str(name) for name in value] if isinstance(value, Iterable) else []
