"""Rules on requests: requests, bids, the choice of helpers, and the objectives that follow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

from safenav.audit.kinds import ALTERNATION, STAYING
from safenav.audit.lines import Line, Objective
from safenav.audit.possibilities.deriving import (
    is_stop,
    meets_own_first,
    open_obstacles,
    serving,
    team_of,
)
from safenav.audit.possibilities.members import Duty, Settlement
from safenav.audit.possibilities.team import MOST_NODES, TooManyError
from safenav.audit.rules.rule import Finding, Message, Postponed, Rule, differences, judges, names
from safenav.audit.run.situation import RESYNTHESIS, Situation
from safenav.audit.run.turn import FINAL, helpers_of

SETTLES = ("blocked", "pop", "request", "push", "told", "synthesis")
"""The lines of a settlement."""
Serving = Mapping[str, frozenset[str]]
"""The robots that serve each obstacle."""


class RequestRule(Rule):
    """A robot that encounters an obstacle requests help in the same turn, for the next need and its
    regions. The request is recorded again only when another robot has encountered the obstacle,
    other robots serve it now, it joins O, it is set aside (judged by the rule on proofs), or a
    robot that would serve it still has no strategy for that. Each request has its entries on the
    stack, one for each requester, unless the obstacle joins O; there are no others (D 5.2, T Time).
    """

    name = "request"
    kinds = ("request", "push", "violation", "resolved", "gone", "appeared", "blocked")

    def __init__(self) -> None:
        self._named: dict[str, tuple[str, ...]] = {}
        self._latest: dict[str, int] = {}
        self._asked: set[str] = set()
        self._again: list[Line] = []
        self._owed = Postponed()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type == "request":
            for problem in self._problems(record, now):
                yield record.requester, problem
            helpers = helpers_of(record)
            again = record.obstacle in self._named and helpers in ((), self._named[record.obstacle])
            if again and not record.aside:
                self._again.append(record)
            self._named[record.obstacle] = helpers
            self._latest[record.obstacle] = record.line
            self._asked.add(record.obstacle)
        elif record.type == "push":
            if record.obstacle not in self._asked:
                problem = f"objectives are pushed for {record.obstacle}, which is not requested"
                yield record.requester, problem
        else:
            given_up = record.type == "blocked" and record.reason not in FINAL
            if given_up and record.obstacle not in self._named:
                problem = f"{record.obstacle} is given up, but no robot has requested help"
                yield now.turn.robot, problem
            self._named.pop(record.obstacle, None)
            if record.type == "appeared":
                self._asked.discard(record.obstacle)

    def turn(self, now: Situation) -> Iterator[Message]:
        turn, violations = now.turn, now.turn.all("violation")
        given_up = {record.obstacle for record in turn.all("blocked")}
        for request in self._again:
            others = (other for other in turn.all("request") if other is not request)
            twice = any(request == other for other in others)
            final = request.obstacle in given_up and not helpers_of(request)
            if not turn.is_refused(request) and (twice or not final):
                problem = f"the request for {request.obstacle} is recorded again without a reason"
                yield request.requester, problem, request
        self._again.clear()
        if now.is_cut_short():
            return
        asked = {record.obstacle for record in turn.all("request")}
        if now.waits is not None or turn.first("waiting") is not None:
            violations = []  # the request follows after the wait
            self._owed = Postponed()
        missing = []
        for violation in violations:
            name = violation.obstacle
            problem = f"{turn.robot} encounters {name} and does not request help"
            found = turn.robot, problem, violation
            if name in now.requests.keys() - asked:
                missing.append((found, partial(self._is_answered, violation, now)))
        yield from self._owed.judge(missing, now)
        pushed = {(entry.obstacle, entry.requester) for entry in now.stack}
        again = {record.obstacle: record.line for record in turn.all("reopened")}
        for request in turn.all("request"):
            if again.get(request.obstacle, 0) > request.line:
                continue  # it was given up and reopened, and is decided again
            ordered = [None] if request.obstacle in now.orders & now.requests.keys() else []
            for requester in (*ordered, *now.requests.get(request.obstacle, ())):
                if (request.obstacle, requester) not in pushed:
                    who = requester or "an order"
                    problem = f"{who} waits for {request.obstacle}, but no push follows"
                    yield requester, problem, request

    def _is_answered(self, violation: Line, now: Situation) -> bool:
        """Return whether a request has followed, possibly of another robot that has encountered the
        obstacle since."""
        name = violation.obstacle
        return self._latest.get(name, 0) > violation.line or name not in now.requests

    def _problems(self, record: Line, now: Situation) -> Iterator[str]:
        name = record.obstacle
        made = {*now.requests.get(name, ()), *([None] if name in now.orders else [])}
        if record.requester not in made:
            yield f"{record.requester or 'nobody'} requests {name} without having encountered it"
        if record.need is not None:
            yield from differences(record, now, need=now.open[name].stage)
        listed = now.need(name).regions
        wanted = {region for region in listed if now.grid.is_free(region)}
        if not wanted <= set(record.regions) <= set(listed):
            stated, truth = _list(record.regions), _list(sorted(wanted))
            yield f"{name} is resolved from {truth}, but {stated} is requested"


@judges("line", "request")
def bids(record: Line, now: Situation) -> Iterator[Message]:
    """Exactly the robots with the action of the next need bid: the ticks at their slowest step to
    the nearest region of the need, null if they cannot reach one. Walls, permanent obstacles, and
    open obstacles that they may not enter are closed. A robot out of service reaches none (D 5.2).
    """
    name = record.obstacle
    if name not in now.requests:
        return
    able = now.need(name).able
    for robot in sorted(set(record.bids) - able):
        yield robot, f"{robot} bids for {name}, but lacks the action"
    for robot in sorted(able - set(record.bids)):
        yield robot, f"{robot} could resolve {name}, but does not bid"
    team, obstacles, where = team_of(now), open_obstacles(now), set(now.need(name).regions)
    if team is None:
        return
    for robot in sorted(able & set(record.bids)):
        there = frozenset(pose for pose in team.members[robot].steps if pose[0] in where)
        here = frozenset([now.pose(robot)])
        truth, bid = team.ticks(robot, here, there, obstacles), record.bids[robot]
        if bid != truth:
            yield robot, f"{robot} bids {_ticks(bid)} for {name}; it takes {_ticks(truth)}"


class HelperRule(Rule):
    """Helpers are the robots to which the rules of docs/coordination.md (Who helps) give a duty,
    recomputed from all poses and the known state. A robot without a strategy for the duty is passed
    over. The other objectives are recomputed likewise: a helper goes to the regions where it can
    meet the need; a requester that is served waits (with
    free mobility, in no helper's way if possible) or pursues its objective for that time; the
    others have their own objective or wait (D 5.2)."""

    name = "helper"

    def __init__(self) -> None:
        self._lines: list[Line] = []
        self._present: tuple[Serving, ...] = ()
        self._before: Mapping[str, Objective] = {}
        self._duties: Mapping[str, Duty] | None = None

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type == "request":
            for robot in helpers_of(record):
                if record.bids.get(robot) is None:
                    yield robot, f"{robot} is chosen for {record.obstacle} without a bid"
        names_helper = record.type in ("request", "push", "pop")
        if names_helper and record.helper != (*helpers_of(record), None)[0]:
            problem = f"the first of its helpers is not {record.helper}"
            yield Finding(record.type, record.tick, record.requester, record.line, problem)
        settles = record.type in SETTLES
        again = record.type == "request" and any(
            line.type == "request" and line.obstacle == record.obstacle for line in self._lines
        )
        if self._lines and (not settles or again):
            yield from self._judged(now)
        if settles:
            if not self._lines:
                others = self._serving(now, own=True), self._serving(now, exact=True)
                self._present = self._serving(now), *others
                self._before = dict(now.objectives)
            self._lines.append(record)

    def turn(self, now: Situation) -> Iterator[Message]:
        if self._lines:
            yield from self._judged(now)

    def ending(self, now: Situation) -> Iterator[Message]:
        yield from self._judged(now)

    def _serving(self, now: Situation, **reading: bool) -> Serving:
        """Return the robots that serve each obstacle. No line records the end of a duty, so it
        follows from the last settlement, if that was judged."""
        found, duties = serving(now, **reading), self._duties
        if duties is None:
            return found
        given = {(robot, duty.obstacle) for robot, duty in duties.items()}
        return {
            name: frozenset(r for r in who if (r, name) in given) for name, who in found.items()
        }

    def _judged(self, now: Situation) -> Iterator[Message]:
        """Yield the errors of the last settlement, whose lines have taken effect."""
        lines, self._lines, self._duties = self._lines, [], None
        recorded = [line for line in lines if line.type in ("request", "push", "pop", "told")]
        if not recorded or now.is_cut_short() or now.external:
            return
        sure, *perhaps = self._present
        problems = [*self._problems(lines, recorded, sure, now)]
        others = [each for each in perhaps if each != sure] if problems else []
        if any(not [*self._problems(lines, recorded, each, now)] for each in others):
            return
        if problems:
            self._duties = None
        yield from problems

    def _problems(
        self, lines: list[Line], recorded: list[Line], present: Serving, now: Situation
    ) -> Iterator[Message]:
        """Yield the errors of a settlement. ``present``: the robots that served each obstacle
        before it."""
        try:
            found = self._derived(lines, present, now)
        except TooManyError:
            what = f"which robots serve which requests (a search of more than {MOST_NODES} steps)"
            yield self.not_judged(recorded[0], None, what)
            return
        if found is None:
            return
        self._duties = found.duties
        wrong = list[Message]()
        for line in recorded:
            if line.type == "request" and line.obstacle in now.requests:
                wrong += self._helpers(line, found, now)
        yield from wrong
        if now.header.coordination == RESYNTHESIS:
            yield from _other_syntheses(lines)
        for line in () if wrong else recorded:  # the robots' objectives follow from the helpers
            given = line.objectives if line.type in ("push", "pop") else {}
            if line.type == "told" and now.header.coordination != RESYNTHESIS:
                given = {line.robot: line.objective}
            for robot, objective in given.items():
                if problem := self._wrong(robot, objective, found, now):
                    yield Finding(line.type, line.tick, robot, line.line, problem)

    def _derived(self, lines: list[Line], present: Serving, now: Situation) -> Settlement | None:
        refused, asked = set[tuple[str, str]](), ""
        for line in lines:
            if line.type == "request":
                asked = line.obstacle
            elif line.type == "synthesis" and line.verdict != "realizable":
                refused.add((line.robot, asked))
        team = team_of(now)
        if team is None:
            return None
        poses = {name: now.pose(name) for name in now.header.robots}
        return team.settle(poses, open_obstacles(now, refused), present, now.aside)

    def _helpers(self, line: Line, found: Settlement, now: Situation) -> Iterator[Message]:
        truth = {n for n, duty in found.duties.items() if duty.obstacle == line.obstacle}
        # A robot out of service acts where it stands, without an objective for it.
        named, truth = {*helpers_of(line)} - now.out, truth - now.out
        if named != truth:
            wrong = [name for name in now.header.robots if name in truth - named]
            right = f"the rules choose {names(truth)}"
            problem = f"{names(named)} helps with {line.obstacle}, but {right}"
            yield (wrong or sorted(named))[0], problem, line

    def _wrong(self, robot: str, objective: Objective, found: Settlement, now: Situation) -> str:
        """Return why an objective does not follow from the known state, or an empty text."""
        own = now.own[robot]
        own_wait = now.header.robots[robot].while_waiting
        duty = found.duties.get(robot)
        if objective.kind == "ltl" == own.kind:
            return ""  # formulas keep their safety and get another goal
        if robot in now.out:
            stays = objective in (self._before[robot], own) or objective.kind == STAYING
            return "" if stays else f"{robot} is out of service, but gets {objective}"
        if duty is not None:
            kind = STAYING if duty.stays else ALTERNATION
            serves = objective.kind == kind and objective.targets[:1] == (duty.regions,)
            if serves or is_stop(robot, objective.targets, now):
                return ""
            first = partial(meets_own_first, robot, duty.obstacle, duty.regions, now)
            if objective == own and first():
                return ""
            where = _list(sorted(duty.regions))
            return f"{robot} must serve {duty.obstacle} from {where}, but gets {objective}"
        for obstacle in found.served:
            if robot not in now.requests.get(obstacle, ()):
                continue
            if objective == self._before[robot] and is_stop(robot, objective.targets, now):
                return ""  # it moves aside once it has charged
            if objective not in (own_wait, None) and objective.kind != STAYING:
                return f"{robot} waits for {obstacle}, but gets {objective}"
            return "" if objective == own_wait else self._hinders(robot, objective, found, now)
        stays = objective.kind == STAYING or is_stop(robot, objective.targets, now)
        if objective != own and not stays:
            return f"{robot} has no part in this, but gets {objective}"
        return ""

    def _hinders(self, robot: str, objective: Objective, found: Settlement, now: Situation) -> str:
        """Return the error of a robot that blocks a helper without need, or an empty text."""
        team = team_of(now)
        turns = now.has_heading(robot) or now.own[robot].kind == "ltl"
        if team is None or turns or not team.members[robot].rivals & {*found.duties}:
            return ""
        (place,) = objective.targets[0] if len(objective.targets[0]) == 1 else (None,)
        at = {name: now.pose(name) for name in now.header.robots}
        derived = at, open_obstacles(now), found.duties
        if place is None or not team.in_the_way(robot, place, *derived):
            return ""
        held = {
            r for n in now.objectives if n != robot for t in now.objectives[n].targets for r in t
        }
        clear = team.clear(robot, *derived) - held - {region for region, _ in at.values()}
        way = f"{robot} waits at {now.show(place)} in a helper's way"
        return f"{way}, not at {now.show(min(clear))}" if clear else ""


def _other_syntheses(lines: list[Line]) -> Iterator[Message]:
    """Yield installed strategies whose objective differs from that on the stack."""
    assigned: Mapping[str, Objective] = {}
    for line in lines:
        if line.type in ("push", "pop"):
            assigned = line.objectives
        elif line.type == "synthesis" and line.node is not None and line.reason != "charge":
            objective = assigned.get(line.robot, line.objective)
            if objective != line.objective:
                problem = f"{line.robot} must {objective}, but gets {line.objective}"
                yield Finding("synthesis", line.tick, line.robot, line.line, problem)


def _ticks(bid: int | None) -> str:
    return "no path" if bid is None else f"{bid} ticks"


def _list(regions: tuple[int, ...] | list[int]) -> str:
    return ", ".join(map(str, regions)) or "nowhere"
