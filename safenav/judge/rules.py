"""The table of rules, and the rules on robots: motion, charge, actions.

A rule is a generator function of a line and the state before it. It yields violations.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from safenav.judge.formulas import Pose
from safenav.judge.lines import Line
from safenav.judge.state import MARGIN, Obstacle, Robot, State


class NotJudged(str):
    """A part that a rule cannot judge. The message states the reason."""


Judge = Callable[[Line, State], Iterator[str]]


class Rule(NamedTuple):
    """A rule. ``kinds``: the types of lines that it judges. ``text``: its requirement in words."""

    name: str
    kinds: tuple[str, ...]
    judge: Judge
    text: str


RULES: list[Rule] = []
STEPS, RESULTS = ("move", "depart", "arrive"), ("part", "resolved", "goal")


def rule(*kinds: str) -> Callable[[Judge], Judge]:
    """Add a function to the table. Its docstring documents the rule."""

    def add(judge: Judge) -> Judge:
        name = judge.__name__.replace("_", "-")
        RULES.append(Rule(name, kinds, judge, " ".join((judge.__doc__ or "").split())))
        return judge

    return add


@rule(*STEPS)
def continuity(e: Line, s: State) -> Iterator[str]:
    """A robot departs from its present pose, and arrives only if it has departed. A robot out of
    service, or lost, begins no step."""
    robot, step = s.robots[e.robot], e.step
    begins = robot.bound is None and step.to != step.start and not step.strays
    if begins and (robot.out or robot.lost):
        yield f"{e.robot} moves, but is {'out of service' if robot.out else 'lost'}"
    if e.step.start != robot.pose[0]:
        yield f"{e.robot} is at {s.show(robot.pose[0])}, not at {s.show(e.step.start)}"
    if e.kind == "arrive" and robot.bound is None:
        yield f"{e.robot} arrives, but has not departed"
    if e.kind == "depart" and robot.bound is not None:
        yield f"{e.robot} departs before its last step has ended"
    if e.kind == "depart" and robot.acts is not None:
        yield f"{e.robot} departs while it takes part in an action"


@rule("operator")
def placed(e: Line, s: State) -> Iterator[str]:
    """An operator puts a resting or lost robot in a free region that no obstacle closes."""
    if e.region is None or e.robot is None:
        return
    robot = s.robots[e.robot]
    if e.intervention != "put_back":
        yield f"{e.robot} is put in {s.show(e.region)} by '{e.intervention}'"
    if e.region not in s.world.free:
        yield f"{e.robot} is put in {s.show(e.region)}, which is not free"
    for one in s.closing(e.robot, e.region):
        if one.type != f"lost_{e.robot}":
            yield f"{e.robot} is put in {s.show(e.region)}, where {one.name} is"
    if robot.bound is not None or robot.acts is not None:
        yield f"{e.robot} is put in {s.show(e.region)} while it executes a command"
    if robot.faces is (e.heading is None):
        yield f"{e.robot} has {'no' if robot.faces else 'a'} heading"


@rule(*STEPS)
def mobility(e: Line, s: State) -> Iterator[str]:
    """A robot stays or steps to a free neighbouring region. A robot with a heading never steps
    backwards. A step ends at its destination or, interrupted in a live run, where it began. Only in
    a user's world may a step fail or end elsewhere."""
    robot, step = s.robots[e.robot], e.step
    if (e.result == "lost") is not bool(e.regions):
        yield f"{e.robot} is {e.result}, with {len(e.regions or ())} regions in which it may be"
    if step.to not in s.world.free:
        yield f"{e.robot} enters {s.show(step.to)}, which is not free"
    if step.strays:
        undone = s.live and e.result == "elsewhere" and (step.at, step.heading) == robot.pose
        if step.bound is not None or not (s.external or undone):
            yield f"{e.robot} fails, or ends elsewhere than commanded, in a simulated world"
        return
    if robot.bound is not None and step.to != robot.bound:
        yield f"{e.robot} is in transit to {s.show(robot.bound)}, not to {s.show(step.to)}"
    here, after = (step.start, robot.pose[1]), (step.at, step.heading)
    legal = s.world.steps(robot.faces, here)
    if after not in (here, *legal) if step.bound is None else after != here:
        yield f"{e.robot} cannot be at {_pose(after, s)} after {_pose(here, s)}"
    if step.bound is not None and step.bound not in dict(legal):
        yield f"{e.robot} cannot step from {_pose(here, s)} to {s.show(step.bound)}"


def _pose(pose: Pose, s: State) -> str:
    return s.show(pose[0]) + (f" facing {pose[1]}" if pose[1] else "")


@rule("move", "outcome", *RESULTS)
def pace(e: Line, s: State) -> Iterator[str]:
    """In lockstep each robot has one move per tick, then acts, in the header's order. A step takes
    the ticks that its model states. A `lost` deadline follows all results of its turn."""
    if e.kind in RESULTS and s.over == e.tick:
        yield "a lost deadline is recorded before the end of a turn"
    had = [name for name in s.names if s.robots[name].moved >= e.tick]
    acts = e.kind in ("part", "resolved") and not (s.live or s.external)
    if acts and (not e.tick or had[-1:] != [e.robot]):
        yield f"{e.robot} acts on {e.obstacle}, but not in its turn"
    if s.live or e.kind not in ("move", "outcome"):
        return
    whole = e.outcome == "tick_limit"  # other runs may end within a tick
    before = s.names if whole else s.names[: s.names.index(e.robot)] if e.kind == "move" else ()
    for name in s.names:
        if (moved := s.robots[name].moved) < e.tick - (name not in before):
            yield f"{name} has no move in tick {moved + 1}"
    if e.kind == "outcome":
        if e.outcome == "completed" and e.tick and not had:
            yield f"the run is completed in tick {e.tick}, in which no robot has a move"
        return
    robot, takes = s.robots[e.robot], s.robots[e.robot].data.timing
    if e.tick != robot.moved + 1:
        yield f"{e.robot} moves in tick {e.tick} after its move of tick {robot.moved}"
    step, begun = e.step, robot.began if robot.bound is not None else e.tick
    took, lasts = e.tick - begun + 1, step.bound is not None
    if step.to != step.start and not step.strays and lasts is not (took < takes):
        yield f"a step of {e.robot} takes {'more than ' * lasts}{took} ticks, not {takes}"


@rule(*STEPS, "operator")
def collision(e: Line, s: State) -> Iterator[str]:
    """Robots in conflict never occupy the same region; a robot in transit occupies two, and a lost
    robot all regions in which it may be. At most one robot of a `never_together` entry is in the
    entry's regions."""
    for other in s.mates[e.robot] if e.step else ():
        held = s.robots[other].holds
        if both := e.step.holds & s.kept_out(e.robot, other, held):
            yield f"{e.robot} is at {s.show(min(both))} while {other} is at {s.show(min(held))}"


@rule(*STEPS)
def unresolved_obstacle(e: Line, s: State) -> Iterator[str]:
    """A robot enters the region of an unresolved obstacle that blocks it only to resolve it by
    entering. Inside, it returns the way it came; if the obstacle appeared around it (user's
    worlds), it leaves on any side."""
    robot, step = s.robots[e.robot], e.step
    entered = step.holds - robot.holds
    if not entered or (step.strays and s.external):
        return
    for region in entered:
        for one in s.closing(e.robot, region):
            yield f"{e.robot} enters {s.show(region)}, where {one.name} is not resolved"
    for one in s.at.get(step.start, ()):
        inside = one.open and e.robot in one.blocks
        inside = inside and not (s.external and not one.known) and robot.came is not None
        if inside and not entered <= {robot.came, one.region}:
            yield f"{e.robot} passes {one.name}, which is not resolved"


@rule("move", "depart")
def own_rules(e: Line, s: State) -> Iterator[str]:
    """No robot enters a region that its own objective avoids. Each of its steps satisfies its
    `always` and the `safety` of its `ltl`, with some possible memory. A literal patrol that no plan
    drives enters no target out of turn. A robot moves with the objective that the inputs select."""
    robot, step = s.robots[e.robot], e.step
    if s.disobeys(robot):
        yield f"{e.robot} lacks the objective that the inputs give it"
    if step.strays and s.external:
        return
    for region in (step.holds - robot.holds) & robot.own.avoid:
        yield f"{e.robot} enters {s.show(region)}, which it must avoid"
    own, turn, drives = robot.own, robot.progress.turn, s.scenario.coordination == "resynthesis"
    if own.literal and own.strict and drives and turn is not None and robot.given.serves(own):
        others = frozenset[int]().union(*own.targets) - own.targets[turn]
        for region in () if s.is_planned(e.robot) else (step.holds - robot.holds) & others:
            yield f"{e.robot} enters its target {s.show(region)} out of turn"
    formulas = own.formulas
    if formulas is None or step.start == step.to or robot.bound is not None:
        return  # rules may change during a step
    way = s.world.side(step.start, step.to) if robot.faces else None
    here = step.start, robot.pose[1]
    known = range(len(formulas.values)) if robot.memories is None else s.memories(robot)
    if formulas.after(known, here, (step.to, way)).isdisjoint(robot.hears(s.inputs)):
        yield f"{e.robot} steps from {s.show(here[0])} to {s.show(step.to)} against its formulas"


@rule("move", "depart", "act", "service", "outcome")
def charge(e: Line, s: State) -> Iterator[str]:
    """No step uses more charge than its robot has. A robot without charge goes out of service when
    its `flat` obstacle appears: in lockstep at the latest in its turn, live after an action begun
    on arrival. Its battery is replaced only when that obstacle is resolved or gone; then the robot
    returns."""
    if e.kind == "outcome":
        for name, one in s.robots.items() if s.live and e.outcome == "completed" else ():
            idle = not (one.out or one.acts or one.bound is not None) and one.ended < s.now(e)
            if idle and s.is_empty(one, s.now(e), MARGIN):
                yield f"{name} is in service, but its charge is used up"
        return
    robot = s.robots[e.robot]
    if e.kind == "service":
        early = not s.live and any(one.moved >= e.tick for one in s.robots.values())
        if e.active and e.cause == "battery" and (early or not robot.filled):
            yield f"the battery of {e.robot} was not replaced before"
        return
    first = not s.live and e.robot == s.names[0]
    for name in s.names if first and not s.external else ():
        if 0 < s.robots[name].filled < e.tick and s.robots[name].out:
            yield f"{name} has a new battery, but is not in service"
    battery, steps = robot.data.battery, e.to != e.start
    if steps and battery and (charge := s.charge(robot, s.now(e))) < battery.move - MARGIN:
        yield f"{e.robot} takes a step with a charge of {charge:g}"
    serves = not robot.out and robot.bound is None
    arrives = e.kind == "act" and robot.stands == s.now(e)
    empty = serves and not arrives and s.is_empty(robot, s.now(e), MARGIN)
    for name in sorted(s.drained.union([e.robot] * empty)):
        yield f"{name} is in service, but its charge is used up"


@rule("act", "acted", "part", "resolved")
def actions(e: Line, s: State) -> Iterator[str]:
    """Robots that begin an action are in service, and neither in transit nor in another action. The
    action ends with results for obstacles on which the robot can act there; in lockstep only
    failures are recorded. In a simulated world, only robots in service (live: that have just acted)
    resolve obstacles, with the recorded result, and no action fails."""
    robot = s.robots[e.robot]
    if e.kind == "act":
        for name in e.robots:
            if s.rests(s.robots[name], s.now(e)) or s.robots[name].bound is not None:
                yield f"{name} acts, but is out of service or in transit"
            if s.robots[name].acts is not None:
                yield f"{name} begins another action while it takes part in one"
    elif e.kind == "acted":
        if s.live and robot.acts is None:
            yield f"{e.robot} ends an action that it has not begun"
        failed = {name for name, result in e.results.items() if result == "failed"}
        if not s.external and (failed or e.barred):
            yield f"an action of {e.robot} fails, in a simulated world"
        if {*(e.barred or ())} - failed or not (s.live or failed == e.results.keys() != {*()}):
            yield f"the action of {e.robot} has not failed"
        for one in map(s.obstacles.get, e.results):
            left = one.rest.left if one and one.open else ()
            acts = (e.robot in x.able and robot.pose[0] in x.regions for x in left)
            if one is None or (left and not any(acts)):
                yield f"{e.robot} cannot act on each of {', '.join(e.results)}"
    elif s.live and not s.external:
        results = ["untraversable" if e.traversable is False else "done"]
        results += ["untraversable"] * (e.kind == "part")  # a later need may reveal it
        if robot.acted.tick != e.tick:
            yield f"{e.robot} has not ended an action"
        elif (stated := robot.acted.results.get(e.obstacle, results[0])) not in results:
            yield f"the action of {e.robot} on {e.obstacle} ends as {results[0]}, not {stated}"
    elif s.rests(robot, s.now(e)) and not (s.live or s.external):
        yield f"{e.robot} acts, but is out of service"


def _may_act(robot: Robot, one: Obstacle, s: State, *, knew: bool) -> bool:
    """Return whether a robot of a simulated world can take part in an action on an obstacle where
    it stands. ``knew``: the team knew the obstacle when the action began. In a live run, only the
    robots of that action then take part, otherwise also all idle robots in service."""
    act = robot.acts or (robot.acted if robot.acted.tick == s.tick else None)
    if s.live and (knew or act is not None):
        return act is not None and (not knew or one.name in (act.obstacles or [one.name]))
    moves = s.live and robot.bound is not None
    return not (moves or s.rests(robot, s.time if s.live else s.tick))


@rule("move", "depart", "act", "outcome")
def done(e: Line, s: State) -> Iterator[str]:
    """An obstacle without open needs is resolved. In a simulated lockstep world, a robot in service
    in a need's regions does its part in each turn, unless this takes a load. A need with `together`
    waits for enough robots."""
    whole = e.outcome in ("completed", "tick_limit")
    names = s.names if whole else [e.robot] * (e.outcome is None)
    for one in s.obstacles.values():
        if one.open and not (one.rest.left or one.shut):
            yield f"each need of {one.name} is fulfilled, but it is not resolved"
    for one in s.obstacles.values() if not (s.live or s.external) else ():
        for name in names if one.open and one.rest.left and not one.rest.takes() else ():
            need = one.rest.left[0]
            there = {n for n in need.able if s.robots[n].pose[0] in need.regions}
            there = {name for name in there if not s.robots[name].out}
            late = name in there - one.rest.done and one.begun < s.robots[name].turn
            if late and (not need.together or len(there) >= need.robots):
                yield f"{one.name} is not resolved, but {name} can do that"


@rule("violation", "request")
def encounter(e: Line, s: State) -> Iterator[str]:
    """A robot encounters an obstacle that blocks it, in or beside its region; in a simulated world
    the obstacle is present. Only known obstacles are requested."""
    one = s.obstacles[e.obstacle]
    if e.kind != "violation":
        if not (one.open and one.known):
            yield f"{one.name} is requested, but is not a known open obstacle"
        return
    here, _ = s.robots[e.robot].pose
    near = one.region == here or s.world.side(here, one.region) or one.type == f"lost_{e.robot}"
    if not near or e.robot not in one.blocks:
        yield f"{e.robot} cannot encounter {one.name} from {s.show(here)}"
    elif not one.open and not s.external:
        yield f"{one.name} is absent or resolved"


@rule("part", "resolved")
def resolution(e: Line, s: State) -> Iterator[str]:
    """A present obstacle is resolved need by need, each by enough robots that have its action and
    stand in its regions (simultaneously, if together). The last need reveals the truth."""
    one, last = s.obstacles[e.obstacle], e.kind == "resolved"
    number = len(one.needs) - 1 if last else e.need
    # Earlier needs may have been fulfilled without the team's knowledge.
    untold = s.external and (one.declared or one.shut or not one.known)
    if not one.there and not s.external:
        yield f"{one.name} is absent"
    elif one.resolved:
        yield f"{one.name} was resolved before"
    elif number >= len(one.needs) or (one.stage < number and not untold):
        yield f"need {one.stage + 1} of {one.name} is the next one, not {number + 1}"
    elif one.stage <= number:
        yield from _part(e, one, number, s, told=not untold)
    elif not last or e.robot not in one.group:
        yield f"need {number + 1} of {one.name} is already fulfilled"
    elif e.at != s.robots[e.robot].pose[0]:
        yield f"{e.robot} resolves {one.name} from {s.show(e.at)}, but is not there"
    if last and not s.external and e.traversable != one.truth:
        yield f"the truth of {one.name} is {e.traversable}, but {one.truth} in the scenario"


def _part(e: Line, one: Obstacle, number: int, s: State, *, told: bool) -> Iterator[str]:
    """Yield the reasons why robots cannot do a part of a need. ``told``: whether earlier lines
    record all other parts."""
    need, who = one.rest.left[number - one.stage], frozenset(e.robots or [e.robot])
    knew = one.known and (one.name, number) in s.robots[e.robot].knew
    near = (n for n in need.able if s.robots[n].pose[0] in need.regions)
    there = frozenset(n for n in near if s.external or _may_act(s.robots[n], one, s, knew=knew))
    before = frozenset[str]() if need.together or number > one.stage else one.rest.done
    missing = need.robots - len(before | who)
    if one.rest.takes() and not (one.known or s.external):
        yield f"{e.robot} takes a load that the team does not know"
    if e.at != s.robots[e.robot].pose[0] or e.robot not in there - before:
        yield f"{e.robot} cannot {need.action} at {one.name} from {s.show(e.at)}"
    elif others := who - before - (there if need.together else {e.robot}):
        yield f"{', '.join(sorted(others))} cannot {need.action} at {one.name}"
    elif missing > 0 and told and (need.together or e.kind == "resolved"):
        yield f"{one.name} needs {need.robots} robots that {need.action}, not {len(before | who)}"
    for name in who if e.kind == "part" and one.rest.takes() else ():
        for other in s.obstacles.values():
            if other.open and other is not one and name in other.rest.laden():
                yield f"{name} carries {other.name}, and takes {one.name} as well"
