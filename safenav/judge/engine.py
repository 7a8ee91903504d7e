"""The judge of a trace. The rules judge each line; then ``after``, the only function that changes
the state, applies it."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from safenav.judge.changes import applies, in_force
from safenav.judge.ends import counts, meeting
from safenav.judge.lines import KINDS, Line, Reader, Text
from safenav.judge.progress import Progress
from safenav.judge.rules import RULES, NotJudged, Rule
from safenav.judge.state import DECIMALS, Obstacle, Robot, State

BATTERY = "battery"


def after(e: Line, s: State) -> None:
    """Update the state by the effect of a line."""
    if e.tick > s.tick:
        s.missed |= s.overdue(e.tick)
    s.tick, s.time = e.tick, s.time if e.t is None else e.t
    s.worked = s.time if e.kind in ("arrive", "acted") else s.worked
    by_hand = e.cause in ("user", "world") and e.kind != "order"
    s.hands += bool(by_hand or e.user or e.kind == "operator")
    if e.robot is not None:
        _robot(e, s.robots[e.robot], s)
    if isinstance(e.obstacle, str):
        _obstacle(e, s.obstacles[e.obstacle], s)
    match e.kind:
        case "discovered":
            s.add(e.obstacle)
        case "inputs":
            s.switched |= {n: e.tick for n, on in e.values.items() if on is not s.inputs.get(n)}
            s.inputs |= e.values
            s.by_user = {*(e.user or ())}
            # In lockstep, each robot observes them at its next move.
            for robot in s.robots.values() if s.live else ():
                robot.hear(s.inputs)
        case "waiting":
            s.waits = e.outcome == "operator_needed"
        case "duty":
            s.waits = False
            for name, objective in e.objectives.items():
                robot = s.robots[name]
                if s.keeps(name) and not robot.given.serves(robot.own):
                    s.arrived.discard(name)  # the robot counts in its turn
                robot.given = objective
        case "deadline" if e.verdict == "kept" and e.of == "mission":
            s.promised = e.tick if s.promised is None else s.promised
        case "deadline" if e.verdict == "lost":
            s.over = e.tick
        case "outcome":
            s.ended = e.outcome
    _find_changes(e, s)


def _robot(e: Line, robot: Robot, s: State) -> None:
    if e.kind in ("operator", "objective", "service"):
        s.arrived.discard(robot.name)
    match e.kind:
        case "move" | "depart" | "arrive":
            _moved(e, robot, s)
        case "operator" if e.region is not None:
            _use_charge(e, robot, s)
            robot.pose = robot.before = (e.region, e.heading if robot.faces else None)
            robot.holds, robot.bound = frozenset([e.region]), None
            robot.came, robot.lost = None, False
            # Its battery stays empty if the obstacle that represents it disappears.
            s.flat = {one: name for one, name in s.flat.items() if name != robot.name}
            s.barred = {pair for pair in s.barred if pair[0] != robot.name}
            robot.progress.stayed += robot.stays
        case "act":
            there = ((name, one) for name, one in s.obstacles.items() if not one.permanent)
            knew = frozenset((name, one.stage) for name, one in there if one.known)
            for name in e.robots:
                s.robots[name].acts, s.robots[name].knew = e, knew
        case "acted":
            _acted(e, robot, s)
            robot.progress.stayed += s.live and robot.stays
        case "goal":
            _goal(e, robot, s)
        case "objective":
            away, fresh = s.by_inputs(robot), Progress()
            if e.cause == "input" and away:
                robot.kept = robot.kept or robot.progress
            elif e.cause == "input" and robot.kept is not None:
                fresh = robot.kept.anew()
            robot.kept = robot.kept if e.cause != "input" or away else None
            robot.own, robot.progress, robot.first = e.objective, fresh, None
            robot.told, robot.since = e.cause == "user", e.tick
            robot.met.clear()
            robot.given = e.objective if e.at_once else robot.given
            applied = next((one for one in s.changes if applies(one, e, s)), None)
            s.changes = [one for one in s.changes if one is not applied]
            robot.within = e.within
            s.restart(robot)
            robot.was_away, robot.away = False, not robot.given.serves(robot.own)
            robot.follow(s.inputs)
            robot.progress.stayed += robot.stays  # now, and again in the robot's turn
        case "service":
            if s.live or e.cause != "battery":  # in lockstep the tick's changes follow this line
                _find_changes(e, s)
            robot.out = not e.active
            if e.cause == "scenario":
                s.told[e.robot, e.active] = s.told.get((e.robot, e.active), 0) + 1
            s.drained.discard(robot.name)
            again = robot.first is None and not s.keeps(e.robot)  # it also counts in its turn
            robot.progress.stayed += (s.live or again) and robot.stays
            if e.active:
                robot.given = robot.own  # until a line gives the robot a duty
                s.barred = {pair for pair in s.barred if pair[0] != robot.name}
                s.restart(robot)
                for one in s.obstacles.values():
                    one.begun = e.number
            if e.active and robot.filled:
                _fill(e, robot, s)
        case "synthesis":
            if e.verdict == "unrealizable":
                s.unrealizable.add((e.robot, e.spec))
                if e.objective == robot.own and not (robot.own.literal and e.form == "alternation"):
                    s.failed[e.robot, e.spec] = e.memory or {}
            elif e.node is not None and e.objective == robot.own and e.memory:
                robot.first = max(0, next(iter(e.memory.values())))
                here = s.destination(e.robot)[0]
                robot.progress = robot.progress.begun(robot.own, robot.first, here)
            elif e.node is not None and e.objective == robot.own and not s.keeps(e.robot):
                robot.first = robot.first or 0
            begins = e.verdict == "realizable" and e.node is not None and e.places is None
            if begins and e.objective == robot.own and robot.since == e.tick:
                s.arrived.add(robot.name)
            if begins and s.live:  # with the present inputs
                robot.hear(s.inputs)
            if begins and robot.memories is not None and e.memory and e.objective == robot.own:
                told = robot.own.formulas.remembering(e.memory)
                robot.memories = {m for m in s.memories(robot) if told & s.arriving(robot, [m])}


def _moved(e: Line, robot: Robot, s: State) -> None:
    step, here = e.step, robot.pose
    s.moves, s.strays = s.moves + (e.kind != "arrive"), s.strays + step.strays
    if robot.bound is None and step.bound is not None:
        robot.began = e.tick
    robot.away = robot.away or robot.out or not robot.given.serves(robot.own)
    if robot.bound is None and robot.memories is not None:
        robot.memories, robot.heard = s.memories(robot), robot.hears(s.inputs)
    _use_charge(e, robot, s)
    if step.at != here[0]:
        there = (one for one in s.at.get(step.at, ()) if one.present)
        appeared = s.external and any(one.rest.closes(robot.name) for one in there)
        robot.came = None if step.strays or appeared else here[0]
    robot.pose = step.at, step.heading if robot.faces else None
    s.left |= dict.fromkeys(robot.holds - step.holds, s.time)
    robot.holds, robot.bound, robot.before = step.holds, step.bound, here
    robot.ended = s.now(e) if e.kind != "depart" else robot.ended
    robot.lost = e.kind == "arrive" and bool(e.regions)
    robot.moved, s.over = e.tick if e.kind == "move" else robot.moved, None
    robot.met.clear()
    robot.acted = Line() if e.kind == "depart" else robot.acted
    _memories(robot, here)
    robot.turn = e.number if e.kind == "move" else robot.turn
    others = set[str]() if e.kind == "move" else s.arrived - {robot.name}
    s.arrived = others | {robot.name} if e.kind == "move" or e.result == "arrived" else others
    robot.progress.stayed += robot.stays


def _memories(robot: Robot, here: tuple[int, str | None]) -> None:
    """Update the set of memories that a robot's formulas may have after a line."""
    formulas = robot.own.formulas
    if robot.memories is None or robot.bound is not None:
        return
    stays, robot.recalled = robot.pose == here, robot.memories
    after = formulas.after(robot.recalled, here, robot.pose) & robot.heard
    kept = formulas.hearing(robot.recalled, robot.heard)
    robot.memories = kept | after if stays else after or robot.recalled


def _find_changes(e: Line, s: State) -> None:
    """Remove the due changes of service without an effect. A change remains if an earlier change of
    its robot remains."""
    left, waits = list[Line](), set[str]()
    for change in s.changes:
        if not in_force(change, s) or change.at > s.now(e) or change.robot in waits:
            left.append(change)
            waits.add(change.robot)
    s.changes = left


def _acted(e: Line, robot: Robot, s: State) -> None:
    acts = robot.acts
    for each in s.robots.values():
        if each.acts is acts and acts is not None:
            each.acts, each.acted = None, Line(**vars(acts) | vars(e))
    s.barred |= {(robot.name, name) for name in e.barred or ()}


def _use_charge(e: Line, robot: Robot, s: State) -> None:
    """Update a robot's charge: first for the time in which it stood, then for its step."""
    if robot.charge is None:
        return
    now = s.now(e) if s.live else robot.moved
    robot.charge, robot.stands = s.charge(robot, now), now
    if e.kind == "depart" or e.toward is not None:
        robot.stands = None
    elif e.kind == "arrive" or e.to != e.start:
        robot.charge = round(max(0.0, robot.charge - robot.data.battery.move), DECIMALS)
        robot.stands = s.now(e)


def _goal(e: Line, robot: Robot, s: State) -> None:
    own, progress = robot.own, robot.progress
    meets = counts(e, robot, s) and not robot.again(e, s.live)
    if e.duty or not meets or (robot.out and not robot.finishes(e, s.now(e))):
        return
    if robot.memories is not None:
        robot.memories = meeting(e, robot, s)
    robot.progress = progress.after(own, e.goal)
    if own.ends and robot.progress is not progress:
        robot.progress.stayed += robot.stays
    if robot.out and own.settles and (not own.ends or robot.progress.ended(own)):
        robot.progress.stayed += 1
    robot.met[e.goal] = e.tick
    if robot.progress.rounds(own, e.tick) > progress.rounds(own, e.tick) and not own.settles:
        s.kept |= {robot.name: s.dues[robot.name]} if robot.name in s.dues else {}
        s.restart(robot)


def _obstacle(e: Line, one: Obstacle, s: State) -> None:
    if e.kind in ("gone", "resolved"):
        s.barred = {pair for pair in s.barred if pair[1] != one.name}
    match e.kind:
        case "violation":
            if s.external and not one.present:
                one.begin()
            one.known, one.asked = True, one.asked | {e.robot}
            _due(e, one, s)
        case "request":
            _due(e, one, s)
            # The team tries given-up obstacles again, but not those that an operator declared.
            one.shut = one.shut and (one.resolved or one.declared)
        case "appeared":
            one.begin()
            one.since = -1 if e.cause == "scenario" else e.tick
            one.begun, one.goes = e.number, None
            for robot in (s.robots[name] for name in one.blocks if s.external):
                robot.came = None if robot.pose[0] == one.region else robot.came
            s.orders.discard(one.name)
            listed = [each for each in s.coming if each.name == one.name]
            listed.sort(key=lambda x: x.goes is not None and x.goes <= s.now(e))
            if listed and e.cause != "user":
                s.coming.remove(listed[0])
                one.goes, one.truth = listed[0].goes, listed[0].traversable
                one.within = s.due_within(listed[0])
            if one.ordered:  # an order is due even if its line is missing
                one.known = True
                s.orders.add(one.name)
                _due(e, one, s)
            if e.cause == BATTERY:
                here = (r for r in s.robots.values() if r.pose[0] == one.region)
                empty = (r.name for r in here if s.is_empty(r, s.now(e)))
                name = next((n for n in empty if n not in s.flat.values()), None)
                if name:  # another robot must replace its battery
                    s.flat[one.name] = name
                    s.drained.add(name)
                    one.needs = tuple(n._replace(able=n.able - {name}) for n in one.needs)
                    one.rest = one.rest._replace(left=one.needs)
                one.known = True
                _due(e, one, s)
        case "gone":
            one.there = one.known = one.shut = False
            _excuse(one, s)
            if one.name in s.flat:
                drained = s.robots[s.flat.pop(one.name)]
                drained.filled = e.tick * drained.out
            for robot in s.robots.values() if one.type.startswith("lost_") else ():
                if one.type == f"lost_{robot.name}" and robot.lost:
                    robot.holds -= {one.region}
        case "part" if e.need == one.stage < len(one.needs):
            one.group = frozenset(e.robots or [e.robot])
            one.rest = one.rest.acted(one.group)
            one.begun = e.number if e.need < one.stage else one.begun
        case "resolved":
            one.there = one.resolved = one.known = True
            one.rest = one.rest._replace(left=())
            one.shut = e.traversable is False
            s.kept |= {one.name: s.dues.pop(one.name)} if one.name in s.dues else {}
            if one.name in s.flat:
                drained = s.robots[s.flat.pop(one.name)]
                drained.filled = e.tick
                if not drained.out:  # an operator has already put it back
                    _fill(e, drained, s)
            if one.type != s.flat_type:
                _restart_rounds(e, s)
        case "truth":
            one.truth = e.traversable
        case "blocked":
            one.shut = one.known = True
            _excuse(one, s)
        case "reopened":
            one.shut = False
            _due(e, one, s)
        case "operator" if e.intervention == "permanent":
            one.declared = True


def _fill(e: Line, robot: Robot, s: State) -> None:
    robot.charge, robot.filled = float(robot.data.battery.capacity), 0
    robot.stands = s.now(e) if s.live else robot.moved


def _due(e: Line, one: Obstacle, s: State) -> None:
    """Begin the deadline of an obstacle when it is requested for the first time."""
    if one.within is not None:
        s.dues.setdefault(one.name, e.tick + one.within)


def _excuse(one: Obstacle, s: State) -> None:
    """End the deadline of an obstacle that need not be resolved."""
    if one.name in s.dues:
        s.excused[one.name] = s.dues.pop(one.name)


def _restart_rounds(e: Line, s: State) -> None:
    s.restarted = e.tick
    s.arrived &= {e.robot}
    for robot in s.robots.values():
        robot.progress = robot.progress.anew()
        s.restart(robot)
        robot.met.clear()
        acts = robot.acts or robot.acted.tick == e.tick  # its step counts when its action ends
        if robot.bound is None and not acts and robot.ended < s.now(e):
            robot.before = robot.pose
            robot.recalled = robot.memories & robot.hears(s.inputs) if robot.memories else set()
        if s.live or robot.moved >= s.tick:
            robot.progress.stayed += robot.stays or bool(acts and robot.settled)
        own = s.is_planned(robot.name) or robot.given == robot.own
        counts = robot.moved < s.tick or (robot.name == e.robot and own)
        if not s.live:
            robot.progress.since = s.tick - counts


FACTS: tuple[Rule, ...] = tuple(RULES)
"""The rules of the modules ``rules``, ``changes`` and ``ends``, in their order."""


@dataclass(frozen=True)
class Finding:
    """A broken rule at a line, or the reason for a part of a line that is not judged."""

    rule: str
    tick: int
    robot: str | None
    line: int
    explanation: str

    def __str__(self) -> str:
        whom = "" if self.robot is None else f", {self.robot}"
        return f"line {self.line}: {self.rule} (tick {self.tick}{whom}): {self.explanation}"


@dataclass
class Judgement:
    """The result of a trace. ``findings``: broken rules; ``notes``: parts that are not judged;
    ``outcome``: None if the trace ends before it; ``strays``: the number of steps that did not end
    as commanded; ``hands``: the number of changes by a user, an operator or the world."""

    findings: list[Finding] = field(default_factory=list)
    notes: list[Finding] = field(default_factory=list)
    outcome: str | None = None
    strays: int = 0
    hands: int = 0

    @property
    def ok(self) -> bool:
        return not self.findings


def judge(texts: Iterable[Text], rules: Iterable[Rule] = FACTS) -> Judgement:
    """Judge the lines of a trace. Raises NotATraceError."""
    found, reader, rules, state = Judgement(), Reader(), [*rules], None
    of_kind = {kind: [r for r in rules if not r.kinds or kind in r.kinds] for kind in KINDS}
    for line in reader.lines(texts):
        state = state or State(line)
        if line.kind == "outcome":  # the outcome's proofs get the whole limit
            state.world.work = 0
        line.step = state.step(line)
        for rule in of_kind[line.kind]:
            for text in rule.judge(line, state):
                noted = isinstance(text, NotJudged)
                said = f"not judged: {text}" if noted else text
                finding = Finding(rule.name, line.tick, line.robot, line.number, str(said))
                (found.notes if noted else found.findings).append(finding)
        after(line, state)
    assert state is not None, "a reader yields a header"
    found.outcome, found.strays, found.hands = state.ended, state.strays, state.hands
    return found
