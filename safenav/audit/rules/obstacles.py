"""Rules on the discovery and resolution of obstacles."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Message, Rule, differences, judges, names
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status, taken


@judges("line", "violation")
def violation(record: Line, now: Situation) -> Iterator[Message]:
    """A violation is real: the robot is in the recorded region, could have taken the proposed step,
    and an unresolved obstacle that it must not enter is there; or it has entered one to resolve it,
    which has failed so far. The line names the action of its next need (D 5.1)."""
    robot, obstacle = record.robot, now.obstacles[record.obstacle]
    status, acts = now.status[obstacle.name], record.at == record.proposed
    again = now.external and status.away  # with all needs unmet
    action = (obstacle.all_needs[0] if again else now.need(obstacle.name)).action
    where = {"at": now.region[robot], "proposed": obstacle.region}
    yield from differences(record, now, **where, action=action)
    heading, mobility = now.heading[robot], now.header.robots[robot].mobility
    steps = now.grid.steps(mobility, (record.at, heading))
    # A robot that acts, or is lost, has proposed no step: it is, or may be, in that region.
    proposes = not acts and not (now.lost.get(robot) and obstacle.type == f"lost_{robot}")
    if proposes and record.proposed not in {region for region, _ in steps}:
        faces = f", facing {heading}," if heading else ""
        step = f"{now.show(record.at)}{faces} to {now.show(record.proposed)}"
        yield f"{robot} cannot step from {step}"
    fails = acts or (robot, obstacle.name) in now.barred
    stopped = now.stopped_by if fails else now.blocked_by
    if robot not in stopped(obstacle.name):
        yield f"{obstacle.name} does not block {robot}"
    if status is Status.RESOLVED or (status is Status.ABSENT and now.external):
        if not now.external:  # there a door may close again
            yield f"{obstacle.name} was resolved before"
    elif status is not Status.UNRESOLVED and now.toward[robot] != record.proposed:  # in transit
        yield f"{obstacle.name} is known; {robot} must not propose to enter it"


@judges("turn")
def backtrack(now: Situation) -> Iterator[Message]:
    """Each violation, and nothing else, is followed by a backtrack; the move of that turn goes to
    the region in the backtrack (T Time; D 5.3). If the robot acted, that action has failed."""
    turn = now.turn
    violations, backtracks = turn.all("violation"), turn.all("backtrack")
    for violation in () if turn.torn else violations[len(backtracks) :]:
        obstacle = violation.obstacle
        yield turn.robot, f"{turn.robot} does not back up from {obstacle}", violation
    acted = turn.first("acted")
    for each in violations:
        vain = acted is None or acted.results.get(each.obstacle) == "failed"
        if each.at == each.proposed and not vain:
            yield turn.robot, f"{turn.robot} has not failed to resolve {each.obstacle}", each
    move = turn.first("move")
    for backtrack in backtracks:
        if not violations:
            yield turn.robot, f"{turn.robot} backs up, but no obstacle was in its way", backtrack
        if move is not None and move.to != backtrack.to and not turn.failed:
            back, to = now.show(backtrack.to), now.show(move.to)
            yield turn.robot, f"{turn.robot} backs up to {back} but then moves to {to}", move


@judges("line", "resolved")
def resolution(record: Line, now: Situation) -> Iterator[Message]:
    """An obstacle is resolved once, when its last need is met by enough distinct robots that have
    its action and stand, simultaneously if required, in its regions. In a simulated world the
    resolution reveals the truth of the header. The line states correctly whether a request was open
    (D 3, 5.1 and 5.2, T). A trace of another world omits the needs met before the discovery."""
    robot, name, at = record.robot, record.obstacle, now.show(record.at)
    obstacle, need = now.obstacles[name], now.need(name)
    untold = now.external and name not in now.discovered
    if untold:
        need = obstacle.all_needs[-1]
    if robot not in need.able:
        yield f"{robot} cannot {need.action}, which {name} needs"
    left = len(obstacle.all_needs) - 1 - now.open[name].stage
    if left > 0 and not untold:
        yield f"{name} has {left} more open needs"
    yield from differences(record, now, at=now.region[robot])
    if record.at not in need.regions:
        yield f"{name} cannot be resolved from {at}"
    if now.status[name] is Status.ABSENT and not now.external:  # there appearances are not recorded
        yield f"{name} is absent"
        return
    again = now.status[name] is Status.RESOLVED and (now.live or not now.external)
    if again or now.status[name] is Status.UNTRAVERSABLE:
        yield f"{name} was resolved before"
        return
    if not untold:
        yield from _group_problems(record, now)
    truth = record.traversable if now.external else now.truth[name]
    requested = any(entry.obstacle == name for entry in now.stack)
    yield from differences(record, now, traversable=truth, requested=requested)


def _group_problems(record: Line, now: Situation) -> Iterator[str]:
    """Yield the errors in the group of robots that resolve an obstacle."""
    name, need = record.obstacle, now.need(record.obstacle)
    able = now.standing(name) if need.together else now.open[name].done
    group = able | {record.robot}
    if record.robots and len(now.obstacles[name].all_needs) == 1:
        group = set(record.robots)
    if len(group) < need.robots:
        yield f"{name} needs {need.robots} robots, not {len(group)}"
    for one in sorted(group - able - {record.robot}):
        when = "now" if need.together else "or stood"
        yield f"{one} cannot take part: {when} in a resolution region of {name}"


class NeedRule(Rule):
    """Each of several needs has a line when it is met: it is the next one, and met in this turn by
    robots that have its action and stand, simultaneously if required, in its regions (D 3, T)."""

    name, kinds = "need", ("met",)

    def turn(self, now: Situation) -> Iterator[Message]:
        move = now.turn.first("move")
        if not now.turn.met or now.turn.torn or now.external or move is None:
            return
        stated = {(record.obstacle, record.need) for record in now.turn.all("met")}
        resolved = {record.obstacle for record in now.turn.all("resolved")}
        for name, need in now.turn.met.keys() - stated:
            count = len(now.obstacles[name].all_needs)
            failed = need + 1 == count and name not in resolved  # another rule judges that
            if count > 1 and not failed and now.status[name] is not Status.GIVEN_UP:
                problem = f"the line for need {need + 1} of {name} is missing"
                yield now.turn.robot, problem, move

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        name, needs = record.obstacle, now.obstacles[record.obstacle].all_needs
        what = f"need {record.need + 1} of {name}"
        group = now.turn.met.get((name, record.need))
        if group is None and record.need == now.open[name].stage:
            group = now.takers(record.robot, name) or now.meets_without_line(record.robot, name)
        if group is None or len(needs) < 2:
            full = [n for n in record.robots or (record.robot,) if now.loads(n)]
            for robot in (
                full if record.need == now.open[name].stage and now.open[name].takes() else ()
            ):
                yield f"{robot} carries {names({*now.loads(robot)})}, and takes {name} as well"
            yield f"{what} is not fulfilled in this turn"
            return
        if any((r.obstacle, r.need) == (name, record.need) for r in now.turn.all("met")):
            yield f"{what} is fulfilled twice"
        action, at = needs[record.need].action, now.region[record.robot]
        yield from differences(record, now, action=action, at=at)
        stated = frozenset(record.robots or (record.robot,))
        if stated != group:
            yield f"{what} is fulfilled by {names(group)}, not by {names(stated)}"


class MissedResolutionRule(Rule):
    """If enough robots with the action of an obstacle's next need stand in its regions after a
    turn, they have met the need, even without a request (D 5.2). They act before they depart.
    Live, they act on an obstacle without a request only on arrival, and not while enough others act
    on it. If two obstacles could be resolved and the first resolution ended the run, the second is
    not missed. Outside a simulated world actions may fail.
    """

    name, kinds = "missed-resolution", ("acted", "appeared", "arrive", "depart", "met", "move")

    def __init__(self) -> None:
        self._tried: set[tuple[str, str]] = set()
        self._came: dict[str, int] = {}
        self._changed: dict[str, int] = {}

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type in ("appeared", "met"):
            self._changed[record.obstacle] = record.line
            return
        robot = record.robot
        if record.type == "acted":
            self._tried |= {(robot, name) for name in record.results}
        elif record.type == "arrive":
            self._came[robot] = record.line
            self._tried = {tried for tried in self._tried if tried[0] != robot}
        elif _departs(record, now) and not now.external:
            for name, status in now.status.items():
                if status is not Status.UNRESOLVED:
                    continue
                need, standing, done = now.need(name), now.standing(name), now.open[name].done
                acts = {one for one, act in now.acting.items() if name in act.obstacles}
                lacks = len(standing) < need.robots if need.together else robot in done
                met = need.together or len(acts.union(done)) >= need.robots
                if acts and met:
                    continue  # no part of the need is left
                tried = (robot, name) in self._tried
                later = self._changed.get(name, 0) > self._came.get(robot, 0)
                if now.live and name not in now.requests and (later or need.robots > 1):
                    continue  # it acts on arrival; the possibilities since then are unknown
                if not lacks and not tried and _can_act(robot, name, now):
                    yield f"{robot} departs without acting on {name}, though it could act"

    def turn(self, now: Situation) -> Iterator[Message]:
        robot, move = now.turn.robot, now.turn.first("move")
        if move is None or now.is_cut_short() or now.external or now.live:
            return
        lines = (*now.turn.all("resolved"), *now.turn.all("appeared"))  # one may appear again
        for name, number in now.turn.met.keys() if robot is not None else ():
            last = number + 1 == len(now.obstacles[name].all_needs)
            resolved = name in (line.obstacle for line in lines)
            if last and not resolved and now.status[name] is Status.UNRESOLVED:
                can = f"can {now.need(name).action} and is at {now.show(move.to)}"
                yield robot, f"{robot} {can}, but does not resolve {name}", move


def _departs(record: Line, now: Situation) -> bool:
    if now.live or record.type != "move" or now.toward[record.robot] is not None:
        return bool(record.type == "depart")
    return bool(taken(record) != {now.region[record.robot]})


def _can_act(robot: str, obstacle: str, now: Situation) -> bool:
    """Return whether a robot can act on an obstacle where it stands. Loads are excluded: a robot
    may leave them to others."""
    if now.status[obstacle] is not Status.UNRESOLVED or now.open[obstacle].takes():
        return False
    return robot in now.standing(obstacle)


class BlockedRule(Rule):
    """An obstacle joins O once, for all robots that it stops, and for a true reason: it was just
    found untraversable, or its request is open and a proof shows that it can never be resolved
    (``no_capable_robot``: a need takes more robots than have the action). Each obstacle found
    untraversable joins O (D 5.1 and 5.2)."""

    name, kinds = "blocked", ("blocked", "appeared", "gone", "reopened")

    def __init__(self) -> None:
        self._blocked: set[str] = set()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type == "blocked":
            for problem in self._problems(record, now):
                yield now.turn.robot, problem
            self._blocked.add(record.obstacle)
        else:
            self._blocked.discard(record.obstacle)

    def turn(self, now: Situation) -> Iterator[Message]:
        joined = {record.obstacle for record in now.turn.all("blocked")}
        for record in now.turn.all("resolved"):
            joins = record.traversable is not False or record.obstacle in joined
            if not joins and not now.turn.torn:
                problem = f"{record.obstacle} is untraversable but does not become permanent"
                yield record.robot, problem, record

    def _problems(self, record: Line, now: Situation) -> Iterator[str]:
        name, turn = record.obstacle, now.turn
        if name in self._blocked:
            yield f"{name} became permanent before"
        yield from differences(record, now, robots=now.stopped_by(name))
        if record.reason == "untraversable":
            if not any(r.obstacle == name and r.traversable is False for r in turn.all("resolved")):
                yield f"no robot found {name} untraversable in this turn"
            return
        if record.reason == "operator":
            if name not in now.permanent:
                yield f"no operator reports that {name} is permanent"
            return
        # Another rule judges the proof that it can never be resolved.
        if name not in now.requests:
            yield f"no request for {name} is open"
        reason = "no_capable_robot" if any(now.too_few(name)) else "unresolvable"
        yield from differences(record, now, reason=reason)
