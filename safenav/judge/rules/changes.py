"""Rules on obstacles, and on changes of the world and of the mission."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.judge.lines import Line
from safenav.judge.rule import rule
from safenav.judge.state import Obstacle, Robot, State


@rule("met", "resolved")
def resolution(e: Line, s: State) -> Iterator[str]:
    """An obstacle that is there is resolved need by need, each by enough robots that have its
    action and stand where it is done (simultaneously, if together); that reveals its truth."""
    one, last = s.obstacles[e.obstacle], e.kind == "resolved"
    number = len(one.needs) - 1 if last else e.need
    untold = s.external and not one.known  # its first needs may have been met before
    if not one.there and not s.external:
        yield f"{one.name} is absent"
    elif one.resolved and not (s.external and not s.live):
        yield f"{one.name} was resolved before"
    elif number >= len(one.needs) or (one.stage < number and not untold):
        yield f"need {one.stage + 1} of {one.name} is the next one, not {number + 1}"
    else:
        yield from _group(e, one, number, s)
    if last and not s.external and e.traversable != one.truth:
        yield f"{one.name} is revealed as {e.traversable}, but the scenario states {one.truth}"


def _group(e: Line, one: Obstacle, number: int, s: State) -> Iterator[str]:
    need, who = one.needs[number], frozenset(e.robots or [e.robot])
    if one.stage > number:  # all its needs are met
        if e.kind == "met" or e.robot not in one.group:
            yield f"need {number + 1} of {one.name} is met already"
        return
    if e.kind == "met" and e.action != need.action:
        yield f"need {number + 1} of {one.name} is {need.action}, not {e.action}"
    able = need.able & one.group if need.same and not s.external else need.able
    there = frozenset(n for n in able if s.robots[n].pose[0] in need.regions)
    parts = there if need.together else there | (one.done & able)
    many = who if e.robots else parts | who
    if e.at != s.robots[e.robot].pose[0] or e.robot not in there:
        yield f"{e.robot} cannot {need.action} at {one.name} from {s.show(e.at)}"
    elif not who <= parts:
        yield f"{', '.join(sorted(who - parts))} cannot {need.action} at {one.name}"
    elif len(many) < need.robots:
        yield f"{one.name} needs {need.robots} robots that {need.action}, not {len(many)}"
    for name in who if e.kind == "met" and one.takes() else ():
        if loads := s.loads(name):
            yield f"{name} carries {loads[0]}, and takes {one.name} as well"


@rule("appeared", "gone", "order", "truth")
def timetable(e: Line, s: State) -> Iterator[str]:
    """Obstacles appear, disappear and are ordered as the scenario says, by a user, or by a world
    that is not simulated; none that a scenario or a user adds appears where a robot is."""
    one, now = s.obstacles[e.obstacle], s.now(e)
    if e.kind == "order":
        if not one.there or one.blocks or not (one.ordered or s.external or e.cause == "user"):
            yield f"{one.name} is not an order of the scenario"
        return
    if e.cause == "world" and not (s.external or s.live):
        yield f"a simulated world changes {one.name}, which the scenario does not"
    if e.kind == "truth":
        return
    if (e.kind == "appeared") is one.present:
        yield f"{one.name} has {e.kind}, but it is {'present' if one.present else 'absent'}"
    if e.cause == "battery":
        empty = (r for r in s.robots.values() if r.pose[0] == one.region and _is_empty(r, s, now))
        if one.type != s.scenario.flat or not any(empty):
            yield f"{one.name} appears, but no charge is used up there"
        return
    noticed = e.cause == "world" and s.external
    for name in s.names if e.kind == "appeared" and not (one.ordered or noticed) else ():
        if one.region in s.robots[name].holds:
            yield f"{one.name} appears at {s.show(one.region)}, where {name} is"
    if e.cause == "scenario":
        listed = [each.start for each in s.coming if each.name == one.name]
        ends = [] if one.until is None else [one.until]
        due = listed[:1] if e.kind == "appeared" else ends
        if not due or due[0] > now:
            yield f"the scenario does not let {one.name} be {e.kind} at {now:g}"


def _is_empty(robot: Robot, s: State, now: float) -> bool:
    charge, battery = robot.charge, robot.data.battery
    if charge is None:
        return False
    if s.live:
        charge = robot.charge_at(now, s.scenario.chargers or ())
    return bool(charge < battery.move)


@rule("objective", "service", "inputs")
def changes(e: Line, s: State) -> Iterator[str]:
    """Robots get other objectives, and leave or return to service, as the scenario lists it, by a
    user, by the inputs, or in a world that is not simulated."""
    if e.kind == "inputs":
        if unknown := e.values.keys() - s.inputs.keys():
            yield f"there is no input {', '.join(sorted(unknown))}"
        return
    if e.cause == "scenario":
        for one in s.changes:
            same = one.active is e.active if e.kind == "service" else one.objective == e.objective
            if one.robot == e.robot and same and one.at <= s.now(e):
                return
        yield f"the scenario lists no such change of {e.robot} at {s.now(e):g}"
    elif e.kind == "objective" and e.cause == "input" and e.objective != _by_inputs(e.robot, s):
        yield f"the inputs do not give {e.robot} that objective"
    elif e.cause == "world" and not (s.external or s.live):
        yield f"a simulated world changes the service of {e.robot}"


def _by_inputs(robot: str, s: State) -> Line:
    """Return the objective that the inputs assign to a robot."""
    data = s.robots[robot].data
    listed = (each.objective for each in data.when or () if s.inputs.get(each.input))
    found: Line = next(listed, data.objective)
    return found


@rule("move", "depart", "outcome")
def due_changes(e: Line, s: State) -> Iterator[str]:
    """A simulated world applies each appearance, change and input of the scenario at its time."""
    first = e.kind == "depart" or e.robot == s.names[0]
    if s.external or not first or (e.kind == "outcome" and e.outcome != "completed"):
        return
    now = s.now(e)
    for one in s.coming:
        if one.start > now or (s.live and one.start >= now):
            break
        here = one.until is None or now < one.until
        if here and not s.obstacles[one.name].open and (one.ordered or not _taken(one.region, s)):
            yield f"{one.name} does not appear by {now:g}"
    for change in s.changes:
        if change.at > now or (s.live and change.at >= now):
            break
        if change.objective is not None:
            yield f"{change.robot} does not get its objective of {change.at}"
        elif change.active is s.robots[change.robot].out and not (s.live and s.hands):
            yield f"the service of {change.robot} does not change at {change.at}"
    if s.live or e.kind != "move":
        return
    for each in s.scenario.inputs or ():
        on = any(first <= e.tick <= last for first, last in each.spans or ())
        if each.name not in s.by_user and s.inputs[each.name] is not on:
            yield f"{each.name} must be {'on' if on else 'off'} in tick {e.tick}"


def _taken(region: int, s: State) -> bool:
    """Return whether a robot or another obstacle, not an order, is in a region."""
    if any(region in robot.holds for robot in s.robots.values()):
        return True
    return any(one.open and not one.ordered for one in s.at[region])


@rule("move", "depart")
def obeys_inputs(e: Line, s: State) -> Iterator[str]:
    """A robot that moves has the objective that the inputs give it."""
    robot = s.robots[e.robot]
    listed = {change.robot for change in s.scenario.changes or () if change.objective is not None}
    judged = robot.data.when and e.robot not in listed and not s.hands
    if judged and robot.own != _by_inputs(e.robot, s):
        yield f"{e.robot} has another objective than the inputs give it"


@rule("blocked", "reopened")
def permanence(e: Line, s: State) -> Iterator[str]:
    """An obstacle becomes permanent because it was just found untraversable, because an operator
    says so, or with a proof that it can never be resolved."""
    one = s.obstacles[e.obstacle]
    if e.kind == "reopened":
        if not one.shut or one.resolved:
            yield f"{one.name} is reopened, but was not given up"
    elif e.robots != one.blocks:
        yield f"{one.name} blocks {', '.join(sorted(one.blocks)) or 'no robot'}"
    elif e.reason == "untraversable" and one.name not in s.found:
        yield f"{one.name} was not found untraversable in this tick"
    elif e.reason == "operator" and not one.declared:
        yield f"no operator has declared {one.name} permanent"
    elif e.reason in ("no_capable_robot", "unresolvable") and e.proof is None:
        yield f"{one.name} is given up without proof"
    elif e.reason == "no_capable_robot" and all(
        len(need.able) >= need.robots for need in one.needs[one.stage :]
    ):
        yield f"enough robots have the actions that {one.name} needs"
