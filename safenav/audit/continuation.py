"""Rule on the header of a run that continues another one.

Replays the trace of the earlier run and compares its end with the start of the later run. Robots
that have joined are new. A robot that an input keeps from its objective may begin with either
objective.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from safenav.audit.judging import findings, findings_before
from safenav.audit.kinds import STAYING, shape_of
from safenav.audit.lines import Line, Made
from safenav.audit.rules.deadlines import DeadlineRule
from safenav.audit.rules.plans import FollowsPlanRule, Left
from safenav.audit.rules.rule import Rule
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status

NAME = "continuation"
"""Name of this rule."""


class _Standing(Rule):
    """In lockstep: the tick since which each robot has stood without a new target."""

    name = NAME
    kinds = (
        *("move", "goal", "push", "pop", "told", "synthesis", "objective", "resolved", "blocked"),
        *("met", "service", "plan_end", "gone", "appeared"),
    )
    since: dict[str, int]

    def opening(self, now: Situation) -> tuple[()]:
        before = dict(now.begun.waited or {})
        self.since = {robot: 1 - before.get(robot, 0) for robot in now.header.robots}
        return ()

    def line(self, record: Line, now: Situation) -> tuple[()]:
        if not record.tick:
            return ()
        if record.type not in ("goal", "move"):
            self.since = dict.fromkeys(self.since, record.tick)
        elif record.type == "goal" or (
            record.toward is None and record.to != now.region[record.robot]
        ):
            self.since[record.robot] = record.tick
        return ()

    def waited(self, tick: int, now: Situation) -> dict[str, int]:
        """Return the ticks for which each robot has stood so at the end of a tick, without the
        robots that stay by their objective."""
        standing = ((robot, at) for robot, at in self.since.items() if not _stays(robot, now))
        return {robot: tick + 1 - at for robot, at in standing if at <= tick}


def continuation_problems(
    first: Line, records: Sequence[Line], digest: str, rest: Line
) -> Iterator[str]:
    """Yield how the header ``rest`` contradicts the trace that it continues, which has the header
    ``first``, the lines ``records`` and the sha256 ``digest``."""
    begun, robots = rest.scenario.begun, rest.scenario.robots
    if begun is None:
        yield "its header does not record that it continues another run"
        return
    if begun.trace is not None and begun.trace != digest:
        yield "it continues another trace than this one"
        return
    now, deadlines = Situation(first, records), DeadlineRule()
    if any(findings_before(now)):
        yield "the header of the first run breaks a rule"
        return
    plan, standing = FollowsPlanRule(), _Standing()
    for _ in findings(now, records, [deadlines, plan, standing]):
        pass
    tick, had = _last_tick(now, records, {*(begun.had or ())})
    yield from _others(begun.had, had, "robot", "moved in tick 1; in the first run:")
    earlier = begun.robots or {}
    for name in now.header.robots:
        if name not in robots:
            yield f"{name} is missing"
        else:
            done = earlier.get(name)
            yield from _robot_problems(name, robots[name], now, done)
            timed = not now.live and now.header.promises is not None
            if timed and done is not None and not now.is_away(name):
                yield from _clock_problems(name, done.clock or Made(), deadlines, tick, now)
    for name in now.memories.possible:
        if name in earlier and now.own[name].kind == "ltl":
            told = earlier[name].memory or {}
            begins = not told and name not in now.memories.begun
            if not begins and not now.memories.may_be(name, told, now):
                yield f"{name} begins with the memory {told or 'of no step'}, which it cannot have"
    yield from _obstacle_problems(rest, now)
    follows = any(record.type in ("plan", "move", "depart") for record in records)
    left, before = plan.left(), now.begun.plan
    if before is not None and not follows:
        left = before.robots, {*before.orders}
    if robots.keys() == now.header.robots.keys():
        yield from _plan_problems(begun.plan, left)
    waited = {} if now.live else standing.waited(tick, now)
    if dict(begun.waited or {}) != waited:
        yield f"the waiting times {begun.waited or 'none'}; in the first run: {waited or 'none'}"
    charging = {name for name in now.header.robots if name in robots and _charges(name, now)}
    yield from _others(begun.charging, charging, "robot", "charges at first; in the first run")
    known = {obstacle.name for obstacle in rest.scenario.obstacles}  # some go with the next lines
    known |= {name for name, one in now.obstacles.items() if one.type == now.header.flat}
    due = {of: max(0, at - tick) for of, at in deadlines.open().items() if of in known}
    told = dict(begun.due or {})
    if not now.live and told != due:
        yield f"{told or 'nothing'} is due, but the first run leaves {due or 'nothing'}"
    late = deadlines.late() & known if not now.live else set[str]()
    yield from _others(begun.late, late, "obstacle", "is late; in the first run:")


def _others(told: Sequence[str] | None, truth: set[str], kind: str, claim: str) -> Iterator[str]:
    """Yield the claim about the names in a header, if they differ from the true ones."""
    if {*(told or ())} != truth:
        said = ", ".join(told or ()) or f"no {kind}"
        yield f"{said} {claim} {', '.join(sorted(truth)) or 'none'}"


def _clock_problems(
    name: str, told: Line, deadlines: DeadlineRule, tick: int, now: Situation
) -> Iterator[str]:
    within, (begun, away, *rest) = deadlines.within(name), deadlines.clock(name)
    since, ways = tick - begun, {away, away or now.objectives[name] != now.own[name]}
    if name in now.out:
        ways.add(True)
    if now.is_to_return(name):
        since, ways, rest = -1, {False}, [False, False]
    if told.since not in (since, since if within is None else min(since, within)):
        yield f"the round of {name} began {since} ticks earlier, not {told.since}"
    flags = bool(told.disturbed), bool(told.before), bool(told.over)
    if flags not in [(way, *rest) for way in ways]:
        facts = zip(("disturbed", "disturbed before", "judged"), flags, strict=True)
        said = ", ".join(f"is {'' if holds else 'not '}{fact}" for fact, holds in facts)
        yield f"the round of {name} {said}; in the first run it is otherwise"


def _plan_problems(told: Line | None, left: Left | None) -> Iterator[str]:
    ways, orders = left or ({}, set())
    if (told is None) is not (left is None):
        yield f"{'no' if told is None else 'a'} joint plan must be continued"
    elif told is not None:
        for robot, way in ways.items():
            if len(way) > 1 and told.robots.get(robot) != way:
                yield f"{robot} has a joint plan other than the rest of that of the first run"
        if {*told.orders} != orders:
            yield "the orders of the joint plan differ from those of the first run"


def _last_tick(now: Situation, records: Sequence[Line], told: set[str]) -> tuple[int, set[str]]:
    """Return the last completed tick, and the robots that have had a turn in the next one.
    ``told``: such robots by the header; it decides whether a robot with a strict objective has met
    its target."""
    last = max((record.tick for record in records), default=0)
    moved = {r.robot for r in records if r.type == "move" and r.tick == last}
    if now.live or not last:
        return last, set()
    robot = now.turn.robot
    owes = robot is not None and not _has_met(now) and _may_owe_goal(robot, now)
    if owes and shape_of(now.own[str(robot)].kind).strict:
        owes = bool(told)
    over = moved == {*now.header.robots} and not owes
    return (last, set()) if over else (last - 1, moved)


def _has_met(now: Situation) -> bool:
    """Return whether the last robot has met a target with its present strategy, since it last left
    for a charger."""
    charge = (r.line for r in now.turn.all("synthesis") if r.reason == "charge")
    since = max(charge, default=0)
    return any(goal.line > since for goal in now.turn.all("goal"))


def _may_owe_goal(robot: str, now: Situation) -> bool:
    """Return whether a robot is in a target that it may have just met, without a goal line."""
    own, here = now.own[robot], now.region[robot]
    if now.is_away(robot) or now.objectives[robot] != own or now.toward[robot] is not None:
        return False
    shape, rounds, seen = shape_of(own.kind), now.progress[robot].rounds, _seen(robot, now)
    met = not shape.ends or now.progress[robot].ahead >= len(own.targets)
    ended = rounds or (now.turn.origin == here and met)  # a stay there has no line
    if shape.settles and ended and here in own.targets[-1]:
        return False
    turn = _turn(robot, now)
    return any(
        here in target and index not in seen and (not shape.in_turn or index in turn)
        for index, target in enumerate(own.targets)
    )


def _has_new_battery(robot: str, now: Situation) -> bool:
    """Return whether a robot got a new battery in this turn, and is back in service in the next."""
    resolved = (now.obstacles[line.obstacle] for line in now.turn.all("resolved"))
    return any(
        (each.type, each.region) == (now.header.flat, now.region[robot]) for each in resolved
    )


def _robot_problems(name: str, begins: Line, now: Situation, done: Line | None) -> Iterator[str]:
    at, way = now.region[name], now.heading[name]
    if (begins.start, begins.heading) != (at, way):
        yield f"{name} begins at {now.show(begins.start)}, but was at {now.show(at)}"
    if begins.battery is not None and name in now.charge:
        charge = now.charge_at(name, now.time) if now.live else now.charge[name]
        if _has_new_battery(name, now):
            charge = begins.battery.capacity
        if begins.battery.start != int(charge):
            yield f"{name} begins with a charge of {begins.battery.start:g}, but had {charge:g}"
    if begins.objective not in (now.own[name], now.base[name]):
        yield f"{name} has the objective '{begins.objective}', but had '{now.own[name]}'"
        return
    if now.is_away(name) or begins.objective != now.own[name]:
        return  # its rounds restart when it resumes its own objective
    shape, rounds = shape_of(now.own[name].kind), now.progress[name].rounds
    told = 0 if done is None else done.rounds or 0
    if told < rounds or (told > rounds and shape.recurs):
        yield f"{name} begins with {told} rounds, but had {rounds}"
    seen = set() if done is None else {*(done.seen or ())}
    if seen != _seen(name, now):
        yield f"{name} begins with the targets {sorted(seen)}, but had {sorted(_seen(name, now))}"
    turn = 0 if done is None else done.turn or 0
    if shape.in_turn and turn not in _turn(name, now):
        yield f"{name} begins with target {turn}, but {_turn(name, now)[0]} was next"


def _charges(robot: str, now: Situation) -> bool:
    """Return whether a robot charges where it stands: it stays, and not because of a request."""
    here = now.region[robot]
    if now.header.robots[robot].battery is None or here not in (now.header.chargers or ()):
        return False
    if any(waits.get(robot) == here for waits in (now.requests | now.given_up).values()):
        return False
    return _stays(robot, now) and now.objectives[robot] != now.own[robot]


def _stays(robot: str, now: Situation) -> bool:
    """Return whether a robot has arrived at the region where it stays."""
    objective = now.objectives[robot]
    return objective.kind == STAYING and now.region[robot] in objective.targets[0]


def _waits(requests: Mapping[str, Mapping[str, int]], now: Situation) -> dict[str, Any]:
    """Return the region where each requester waits; None if its step has no end."""
    return {
        name: {robot: at if now.toward.get(robot) is None else None for robot, at in waits.items()}
        for name, waits in requests.items()
    }


def _seen(robot: str, now: Situation) -> set[int]:
    """Return the targets that a robot has met in its present round."""
    progress = now.progress[robot]
    settled = shape_of(now.own[robot].kind).settles and progress.rounds
    return set() if settled else {*progress.met}


def _turn(robot: str, now: Situation) -> Sequence[int]:
    """Return the targets that may be next: with a strict objective, any of them."""
    own, progress = now.own[robot], now.progress[robot]
    count = max(len(own.targets), 1)
    if shape_of(own.kind).ends:
        return [min(progress.ahead, count - 1)]
    if shape_of(own.kind).strict:
        return range(count)
    return [progress.next(own) or 0]


def _obstacle_problems(rest: Line, now: Situation) -> Iterator[str]:
    begun, listed = rest.scenario.begun, rest.scenario.obstacles
    closed = {name for name, is_ in now.status.items() if is_ is Status.UNTRAVERSABLE}
    closed &= {obstacle.name for obstacle in listed}
    yield from _others(begun.closed, closed, "obstacle", "is untraversable; the first run found")
    for obstacle in listed:
        gone = now.status.get(obstacle.name) is Status.RESOLVED
        if gone and obstacle.from_ is None:
            yield f"{obstacle.name} is present, but the first run resolved it"
    there = {obstacle.name for obstacle in listed if obstacle.from_ is None}
    stay = now.permanent & there
    there -= closed | stay
    requests = now.requests | now.given_up
    asked = _waits({name: waits for name, waits in requests.items() if name in there}, now)
    told = _waits(begun.asked or {}, now)
    if told != asked:
        yield f"{told or 'nothing'} is requested; in the first run: {asked or 'nothing'}"
    yield from _others(begun.stays, stay, "obstacle", "is kept; in the first run:")
    for obstacle in listed:
        first = now.obstacles.get(obstacle.name)
        if first is None or (obstacle.from_ is not None and not obstacle.ordered):
            continue
        if now.status[first.name].unmet:
            fulfilled = len((begun.met or {}).get(first.name, ())) + len(first.all_needs)
            fulfilled -= len(obstacle.needs or (obstacle,))
            stage = now.open[first.name].stage
            if fulfilled != stage:
                yield f"{fulfilled} needs of {first.name} are fulfilled; in the first run: {stage}"
    for name, groups in (begun.met or {}).items():
        before = (now.begun.met or {}).get(name, ((),))[-1]  # it appears again in tick 1
        carriers = now.open[name].carriers() if name in now.open else frozenset()
        carriers = carriers or frozenset(before)
        last = groups[-1] if groups else ()
        if {*last} != carriers:
            robots = ", ".join(sorted(carriers)) or "no robot"
            yield f"{', '.join(last)} carries {name}, but it was {robots}"
