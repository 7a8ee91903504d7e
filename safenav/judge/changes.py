"""Rules on changes: obstacles, inputs, objectives and service follow the scenario."""

from collections.abc import Iterator

from safenav.judge.lines import Line, Objective
from safenav.judge.rules import NotJudged, rule
from safenav.judge.state import State


@rule("discovered")
def listed(e: Line, s: State) -> Iterator[str]:
    """An unlisted obstacle has no end or deadline of its own; in a simulated world it has appeared
    before it is discovered. Types of the same name are equal, except those of lost robots."""
    one, kind = e.obstacle, e.obstacle.type
    if s.kinds.get(kind.name, kind) != kind and not kind.name.startswith("lost_"):
        yield f"another type has the name {kind.name}"
    if not s.external and (one.appears is None or one.appears > s.now(e)):
        yield f"the scenario has no {one.name}"
    if one.goes is not None or one.resolve_within is not None:
        yield f"{one.name} is unlisted, but has an end or a deadline"


@rule("appeared", "gone", "order", "truth")
def timetable(e: Line, s: State) -> Iterator[str]:
    """The scenario, a user or a user's world lets obstacles appear and disappear, and orders them.
    Obstacles of a scenario or user, except orders, never appear where a robot is. Truths change
    only when obstacles appear."""
    one, now = s.obstacles[e.obstacle], s.now(e)
    if e.kind == "order":
        caused = (e.cause == "scenario") is (one.since < 0)
        if not one.open or one.blocks or not (one.ordered and caused):
            yield f"{one.name} is not an order of the scenario"
        return
    if e.kind == "truth":
        stated = e.traversable == one.truth if e.cause == "scenario" else one.since == e.tick
        if not (s.external or (stated and one.there)):
            yield f"the scenario does not list the truth {e.traversable} of {one.name} at {now:g}"
        return
    if (e.kind == "appeared") is one.present:
        yield f"{one.name} has {e.kind}, but was {'present' if one.present else 'absent'} before"
    if e.cause == "battery":
        empty = (r for r in s.robots.values() if r.pose[0] == one.region and s.is_empty(r, now))
        flat = one.type == s.flat_type and one.truth is None and not one.ordered
        if not flat or not any(empty):
            yield f"{one.name} appears, but not as an empty battery"
        return
    noticed = e.cause == "world" and s.external
    for name in s.names if e.kind == "appeared" and not (one.ordered or noticed) else ():
        if one.region in s.robots[name].holds:
            yield f"{one.name} appears at {s.show(one.region)}, where {name} is"
    if e.cause == "scenario":
        listed = (each.appears for each in s.coming if each.name == one.name)
        due = next(listed, None) if e.kind == "appeared" else one.goes
        if due is None or due > now:
            yield f"{one.name} has {e.kind} at {now:g}, which the scenario does not list"


@rule("objective", "service", "inputs")
def changes(e: Line, s: State) -> Iterator[str]:
    """Inputs change as the scenario lists, or by a user; objectives and service also with an input
    or a battery, or in a user's world. The scenario's changes of a robot keep their order."""
    if e.kind == "inputs":
        if e.values.items() <= s.inputs.items() and not e.user:
            yield "no input changes"
        if unknown := e.values.keys() - s.inputs.keys():
            yield f"not inputs of the scenario: {', '.join(sorted(unknown))}"
        for each in s.scenario.inputs:
            told = e.values.get(each.name) not in (None, _is_on(each, s.now(e)))
            if told and each.name not in (e.user or ()) and not s.external:
                yield f"{each.name} is not {'on' if e.values[each.name] else 'off'} at {s.now(e):g}"
        return
    robot = s.robots[e.robot]
    yield from unread(e.robot, e.objective)
    if e.active is not None and e.active is not robot.out:
        yield f"{e.robot} is {'in' if e.active else 'out of'} service already"
    still = (one for one in s.changes if one.at > s.now(e) or not in_force(one, s))
    found = [one for one in still if one.robot == e.robot][:1]  # changes keep the listed order
    found += [one for one in s.scenario.changes if one.at == s.now(e) and e.kind == "service"]
    if e.cause == "scenario" and not any(applies(one, e, s) for one in found):
        yield f"not the next change of {e.robot} that the scenario lists by {s.now(e):g}"
    elif e.cause == "scenario" and e.kind == "service":
        each = (one for one in s.scenario.changes if one.robot == e.robot and one.at <= s.now(e))
        if s.told.get((e.robot, e.active), 0) >= sum(one.active is e.active for one in each):
            yield f"the scenario lists fewer changes of the service of {e.robot}"
    elif e.cause == "input":
        other = s.by_inputs(robot)
        within = None if other else robot.data.within
        if e.objective != (other or robot.data.objective) or e.within != within:
            yield f"the inputs do not give {e.robot} that objective"
        elif not any(s.switched.get(name) == e.tick for name, _ in robot.data.when):
            yield f"no input changes for {e.robot}"
    elif e.cause == "battery" and s.flat_type and not e.active and e.robot not in s.flat.values():
        yield f"no {s.flat_type} appears for {e.robot}"
    elif e.cause == "battery" and not (e.active or s.is_empty(robot, s.now(e))):
        yield f"{e.robot} is out of service, but its charge is not used up"


def unread(robot: str, own: Objective | None) -> Iterator[NotJudged]:
    """Report that an objective's formulas with too many memory values are not judged."""
    if own is not None and own.formulas is not None and not own.formulas.whole:
        yield NotJudged(f"the formulas of {robot}: too many memory values")


@rule("move", "depart", "act", "part", "resolved", "outcome")
def due_changes(e: Line, s: State) -> Iterator[str]:
    """Changes of robots happen when the scenario lists them; in a simulated world, so do changes of
    obstacles and inputs."""
    # in lockstep, before the first robot's turn
    first = s.live or (e.robot == s.names[0] and e.kind == "move")
    ends = e.outcome in (None, "completed", "operator_needed")
    if not first or not ends:
        return
    now = s.now(e)

    def due(at: float | None) -> bool:
        return at is not None and (at < now or (at == now and not s.live))

    for one in s.coming if not s.external else ():
        stays = (one.goes is None or now < one.goes) and not s.obstacles[one.name].open
        if due(one.appears) and stays and (one.ordered or not _taken(one.region, now, s)):
            yield f"{one.name} does not appear by {now:g}"
    for one in s.obstacles.values() if not s.external else ():
        if one.present and due(one.goes):
            yield f"{one.name} does not disappear by {now:g}"
    for name, robot in s.robots.items() if s.live else ():
        new = any(s.switched.get(one) == e.tick for one, _ in robot.data.when)
        if s.disobeys(robot) and not new:
            yield f"{name} lacks the objective that the inputs give it"
    for change in s.changes:
        if due(change.at) and change.objective is not None:
            yield f"{change.robot} does not get its objective at {change.at}"
        elif due(change.at) and change.active is s.robots[change.robot].out:
            yield f"the service of {change.robot} does not change at {change.at}"
    for each in s.scenario.inputs if not s.external else ():
        on = s.inputs[each.name]
        if each.name not in s.by_user and on is not _is_on(each, now):
            yield f"{each.name} must be {'off' if on else 'on'} at {now:g}"


def applies(change: Line, e: Line, s: State) -> bool:
    """Return whether line ``e`` applies this change of the scenario."""
    if change.robot != e.robot or e.cause != "scenario" or change.at > s.now(e):
        return False
    if e.kind == "service":
        return bool(change.active == e.active)
    return bool(change.objective == e.objective and change.within == e.within)


def in_force(change: Line, s: State) -> bool:
    """Return whether a change of a robot's service has no effect: the robot already has the
    demanded service, or it is lost and only an operator can bring it back."""
    robot = s.robots[change.robot]
    return change.objective is None and (robot.lost or change.active is not robot.out)


def _is_on(each: Line, now: float) -> bool:
    """Return whether the scenario sets an input on at time ``now``."""
    return any(first <= now < last + 1 for first, last in each.spans)


def _taken(region: int, now: float, s: State) -> bool:
    """Return whether no obstacle may appear in a region now: a robot or an open obstacle (not an
    order) is in it, or a robot leaves it at this instant."""
    held = any(region in robot.holds for robot in s.robots.values())
    left = s.live and s.left.get(region) == now
    return held or left or any(one.open and not one.ordered for one in s.at[region])


def later_change(e: Line, s: State) -> float | None:
    """Return the time of the scenario's next certain change before the run's limit; None if there
    is none. In a user's world, only changes of robots are certain."""
    now = (e.t or s.time) if s.live else s.tick
    late = (x for x in s.scenario.inputs if s.inputs[x.name] is not _is_on(x, now))
    spans = [span for each in s.scenario.inputs for span in each.spans]
    times = [t for a, b in spans for t in (a, b + 1) if t > now]
    times += [now for each in late if each.name not in s.by_user]
    goes = (one.goes for one in s.obstacles.values() if one.goes is not None and one.present)
    times += [t for t in goes if t >= now]
    times += [x.appears for x in s.scenario.obstacles if x.ordered and (x.appears or 0) > now]
    times = [one.at for one in s.scenario.changes if one.at > now] + times * (not s.external)
    for change in s.changes:
        times += [now] * (change.at == now and not in_force(change, s))
    return min((float(t) for t in times if t <= s.limit), default=None)


@rule("synthesis")
def memory(e: Line, s: State) -> Iterator[str]:
    """A strategy begins with a memory that its robot may have, if its verdict depends on that."""
    robot, stated = s.robots[e.robot], e.memory or {}
    own, duty = robot.own, not e.objective.serves(robot.own)
    if e.objective.kind == "ltl":
        formulas = own.formulas or e.objective.formulas
        known = s.arriving(robot) if robot.memories else set[int]()
        begins = {*formulas.begins(s.destination(e.robot))}
        if stated:
            begins = formulas.remembering(stated) if {*stated} <= {*formulas.names} else set()
        if (stated if duty else robot.memories and formulas.names) and known.isdisjoint(begins):
            what = ", ".join(stated or formulas.names)
            yield f"the formulas of {e.robot} exclude this memory: {what}"
        return
    # If targets count in turn, any may be first; otherwise the memory matters.
    refutes = e.objective.strict and e.form != "alternation" and e.verdict == "unrealizable"
    if not (stated and (e.objective.ends or refutes)):
        return
    here, turns, last = s.destination(e.robot)[0], {0}, own.count - 1
    if not duty:
        first = 0 if own.ends or robot.first is None else robot.first
        turn = min(first if robot.progress.turn is None else robot.progress.turn, last)
        turns = {k for k, target in enumerate(own.targets) if here in target} | {first}
        turns = {turn} | turns if own.strict else {turn}
        while here in own.targets[turn] and turn < last:
            turns.add(turn := turn + 1)
    if not {*stated.values()} <= turns:
        yield f"{e.robot} continues with target {min(turns)}, not {max(stated.values())}"


@rule("duty", "synthesis", "objective", "move", "depart")
def duties(e: Line, s: State) -> Iterator[str]:
    """A robot has an objective other than its own only for an unresolved obstacle that the team
    knows. The robot has encountered it, can perform its action, or has the empty battery that it
    represents. Its strategy pursues the present objective."""
    if e.kind in ("move", "depart"):
        robot = s.robots[e.robot]
        idle = robot.given.serves(robot.own) or robot.out or s.waits
        if not idle and e.robot not in _busy(s, given_up=False):
            yield f"{e.robot} keeps another objective, but there is nothing to resolve"
        return
    busy = _busy(s, given_up=True)
    others = [n for n, one in (e.objectives or {}).items() if not one.serves(s.robots[n].own)]
    if e.at_once is False and s.robots[e.robot].given.serves(s.robots[e.robot].own):
        others.append(e.robot)
    for name in others:
        if not (name in busy or s.robots[name].out):
            yield f"{name} gets another objective, but there is nothing to resolve"
    begins = e.kind == "synthesis" and e.node is not None and e.places is None
    if begins and not e.objective.serves(s.robots[e.robot].given):
        yield f"{e.robot} has a strategy for an objective that it does not have"


def _busy(s: State, *, given_up: bool) -> frozenset[str]:
    """Return the robots that have encountered a known unresolved obstacle or have an action that it
    needs, and the robots without charge."""
    every = [x for x in s.obstacles.values() if x.open and x.known and (given_up or not x.shut)]
    flat = {s.flat[x.name] for x in every if x.name in s.flat}
    return frozenset(flat).union(*(x.asked.union(*(n.able for n in x.needs)) for x in every))
