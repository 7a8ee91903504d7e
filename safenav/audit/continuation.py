"""Rule on the header of a run that continues another one.

Replays the trace of the earlier run and compares its end with the start of the later run. Robots
that have joined are new. A robot that an input keeps from its objective may begin with either
objective.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from sys import maxsize
from typing import Any

from safenav.audit.judging import findings, findings_before
from safenav.audit.kinds import STAYING, shape_of
from safenav.audit.lines import Line, Made
from safenav.audit.rules.deadlines import DeadlineRule
from safenav.audit.rules.plans import FollowsPlanRule
from safenav.audit.rules.rule import Rule
from safenav.audit.run.remembering import remembered, row_of
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status

NAME = "continuation"
"""Name of this rule."""

Fact = tuple[str, Any, Sequence[Any]]
"""A statement of a header: its subject, its value, and the values that the first run allows, the
likeliest first."""


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
    begun = rest.scenario.begun
    if begun is None:
        yield "its header does not record that it continues another run"
        return
    if begun.trace is not None and begun.trace != digest:
        yield "it continues another trace than this one"
        return
    now, rules = Situation(first, records), (DeadlineRule(), FollowsPlanRule(), _Standing())
    if any(findings_before(now)):
        yield "the header of the first run breaks a rule"
        return
    for _ in findings(now, records, rules):
        pass
    deadlines, plan, standing = rules
    tick, had = _last_tick(now, records, {*(begun.had or ())})
    missing = sorted(now.header.robots.keys() - rest.scenario.robots.keys())
    facts: Iterable[Fact] = chain(
        [("missing robots", missing, [[]])],
        [("robots that moved in tick 1", {*(begun.had or ())}, [had])],
        *(_robot(name, rest, now) for name in now.header.robots if name not in missing),
        *(_clock(n, rest, deadlines, tick, now) for n in now.header.robots if n not in missing),
        _plan(begun.plan, plan, records, now) if {*rest.scenario.robots} == {*now.region} else (),
        _obstacles(rest, now),
        _times(rest, deadlines, standing, tick, now),
    )
    for subject, value, allowed in facts:
        if value not in allowed:
            yield f"{subject}: {_shown(value)}; in the first run: {_shown(allowed[0])}"


def _shown(value: Any) -> str:
    if isinstance(value, set | frozenset | list):
        value = ", ".join(map(str, sorted(value)))
    return "none" if value in (None, "", {}) else str(value)


def _last_tick(now: Situation, records: Sequence[Line], stated: set[str]) -> tuple[int, set[str]]:
    """Return the last completed tick, and the robots that have had a turn in the next one.
    ``stated``: such robots by the header; it decides whether a robot with a strict objective has
    met its target."""
    last = max((record.tick for record in records), default=0)
    moved = {r.robot for r in records if r.type == "move" and r.tick == last}
    if now.live or not last:
        return last, set()
    robot = now.turn.robot
    owes = robot is not None and not _has_met(now) and _may_owe_goal(robot, now)
    if owes and shape_of(now.own[str(robot)].kind).strict:
        owes = bool(stated)
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


def _robot(name: str, rest: Line, now: Situation) -> Iterator[Fact]:
    """Yield the pose, the charge and the progress with which a robot begins."""
    begins, done = rest.scenario.robots[name], (rest.scenario.begun.robots or {}).get(name)
    own, progress, stated = now.own[name], now.progress[name], done or Made()
    yield f"pose of {name}", (begins.start, begins.heading), [(now.region[name], now.heading[name])]
    if begins.battery is not None and name in now.charge:
        charge = now.charge_at(name, now.time) if now.live else now.charge[name]
        charge = begins.battery.capacity if _has_new_battery(name, now) else charge
        yield f"charge of {name}", begins.battery.start, [int(charge)]
    yield f"objective of {name}", begins.objective, [own, now.base[name]]
    if not now.is_away(name) and begins.objective == own:  # otherwise its rounds restart later
        shape, rounds = shape_of(own.kind), progress.rounds
        most = rounds if shape.recurs else maxsize - 1
        yield f"rounds of {name}", stated.rounds or 0, range(rounds, most + 1)
        yield f"targets that {name} has met", {*(stated.seen or ())}, [_seen(name, now)]
        if shape.in_turn:
            yield f"next target of {name}", stated.turn or 0, _turn(name, now)
        if done is not None:
            yield f"uncounted target of {name}", bool(stated.uncounted), _uncounted(name, now)
    if done is not None and own.kind == "ltl" and name in now.memories.possible:
        names, rows = remembered(name, now) or (), [*now.memories.possible[name]]
        rows += [] if name in now.memories.begun else [row_of({}, names)]
        yield f"memory of {name}", row_of(stated.memory or {}, names), rows


def _uncounted(robot: str, now: Situation) -> Sequence[bool]:
    """Return whether a target at a robot's pose may still have to be counted: always if the robot
    has another duty, never off its targets after its turn."""
    own, pursued = now.own[robot], now.objectives[robot]
    if pursued != own:
        return [False] if _charges(robot, now) else [True]
    off = not any(now.region[robot] in target for target in own.targets)
    sure = shape_of(own.kind).known and off and robot != now.turn.robot and not now.live
    return [False] if sure else [False, True]


def _clock(
    name: str, rest: Line, deadlines: DeadlineRule, tick: int, now: Situation
) -> Iterator[Fact]:
    """Yield the time of a robot's present round."""
    done = (rest.scenario.begun.robots or {}).get(name)
    if now.live or now.header.promises is None or done is None or now.is_away(name):
        return
    stated, within, (begun, away, *before) = done.clock or Made(), *deadlines.round(name)
    since, disturbed = tick - begun, {away, away or now.objectives[name] != now.own[name]}
    if name in now.out:
        disturbed.add(True)
    if now.is_to_return(name):
        since, disturbed, before = -1, {False}, [False, False]
    ticks = [since, since if within is None else min(since, within)]
    yield f"ticks of {name} in its round", stated.since, ticks
    flags = bool(stated.disturbed), bool(stated.before), bool(stated.over)
    subject = f"round of {name} (disturbed, disturbed before, judged)"
    yield subject, flags, [(each, *before) for each in disturbed]


def _plan(
    stated: Line | None, plan: FollowsPlanRule, records: Sequence[Line], now: Situation
) -> Iterator[Fact]:
    """Yield the rest of the joint plan."""
    left, before = plan.left(), now.begun.plan
    if before is not None and not any(r.type in ("plan", "move", "depart") for r in records):
        left = before.robots, {*before.orders}
    yield "joint plan", stated and "present", [left and "present"]
    if stated is not None and left is not None:
        for robot, places in left[0].items():
            if len(places) > 1:
                yield f"joint plan of {robot}", stated.robots.get(robot), [places]
        yield "orders of the joint plan", {*stated.orders}, [left[1]]


def _obstacles(rest: Line, now: Situation) -> Iterator[Fact]:
    """Yield the state of the obstacles and of the requests for them."""
    begun, listed = rest.scenario.begun, rest.scenario.obstacles
    there = {obstacle.name for obstacle in listed if obstacle.from_ is None}
    again = {name for name in there if now.status.get(name) is Status.RESOLVED}
    yield "resolved obstacles that are present", again, [set()]
    closed = {o.name for o in listed if now.status.get(o.name) is Status.UNTRAVERSABLE}
    yield "untraversable obstacles", {*(begun.closed or ())}, [closed]
    stay = now.permanent & there
    yield "permanent obstacles", {*(begun.stays or ())}, [stay]
    requests = (now.requests | now.given_up).items()
    asked = {name: waits for name, waits in requests if name in there - closed - stay}
    yield "requests", _waits(begun.asked or {}, now), [_waits(asked, now)]
    for obstacle in listed:
        name = obstacle.name
        first = now.obstacles.get(name) if obstacle.from_ is None or obstacle.ordered else None
        if first is not None and now.status[name].unmet:
            fulfilled = len((begun.met or {}).get(name, ())) + len(first.all_needs)
            fulfilled -= len(obstacle.needs or (obstacle,))
            yield f"fulfilled needs of {name}", fulfilled, [now.open[name].stage]
    for name, groups in (begun.met or {}).items():
        before = (now.begun.met or {}).get(name, ((),))[-1]  # it appears again in tick 1
        carriers = now.open[name].carriers() if name in now.open else frozenset()
        stated = {*(groups[-1] if groups else ())}
        yield f"robots that carry {name}", stated, [carriers or frozenset(before)]


def _times(
    rest: Line, deadlines: DeadlineRule, standing: _Standing, tick: int, now: Situation
) -> Iterator[Fact]:
    """Yield the ticks without progress, the robots that charge, and the deadlines."""
    begun, robots = rest.scenario.begun, rest.scenario.robots
    waited = {} if now.live else standing.waited(tick, now)
    yield "ticks without progress", dict(begun.waited or {}), [waited]
    charging = {name for name in now.header.robots if name in robots and _charges(name, now)}
    yield "charging robots", {*(begun.charging or ())}, [charging]
    known = {obstacle.name for obstacle in rest.scenario.obstacles}  # some go with the next lines
    known |= {name for name, one in now.obstacles.items() if one.type == now.header.flat}
    if not now.live:
        due = {of: max(0, at - tick) for of, at in deadlines.open().items() if of in known}
        yield "deadlines", dict(begun.due or {}), [due]
    late = set() if now.live else deadlines.late() & known
    yield "late obstacles", {*(begun.late or ())}, [late]


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
