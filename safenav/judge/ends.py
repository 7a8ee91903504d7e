"""Rules on goals, deadlines and the end of a run, and on the header."""

from collections.abc import Iterator

from safenav.judge.changes import later_change, unread
from safenav.judge.lines import Line
from safenav.judge.proofs.bounds import bound_problems, refused_problems
from safenav.judge.proofs.negatives import negative_problems, shut_problems
from safenav.judge.rules import NotJudged, rule
from safenav.judge.state import Robot, State
from safenav.judge.world import TooLargeError

UNFINISHED = ("tick_limit", "time_limit", "search_limit")
"""Outcomes of incomplete missions."""


@rule("header")
def header(_: Line, s: State) -> Iterator[str]:
    """The scenario is consistent: free starts, different starts for robots in conflict, headings
    where needed, batteries at most full, no deadlines in a live run, and one type per name."""
    for name, robot in s.robots.items():
        region = robot.pose[0]
        if region not in s.world.free:
            yield f"{name} starts at {s.show(region)}, which is not free"
        if robot.faces is (robot.data.start[1] is None):
            yield f"{name} has {'no' if robot.faces else 'a'} heading"
        for other in s.mates[name]:
            if name < other and region in s.kept_out(name, other, s.robots[other].holds):
                yield f"{name} starts where it conflicts with {other}: at {s.show(region)}"
        if region in robot.own.avoid:
            yield f"{name} starts in {s.show(region)}, which it avoids"
        if robot.data.battery and robot.data.battery.start > robot.data.battery.capacity:
            yield f"{name} starts with more charge than its battery has"
        yield from unread(name, robot.own)
        for one in s.closing(name, region):
            yield f"{name} starts at {s.show(region)}, where {one.name} is"
    h = s.scenario
    each = [h, h.until, *h.robots, *h.changes, *h.obstacles, *s.kinds.values()]
    if s.live and any((x.by, x.within, x.resolve_within) != (None, None, None) for x in each):
        yield "a live run has no deadlines in ticks"
    for kind in (one.type for one in s.scenario.obstacles):
        if kind != s.kinds[kind.name]:
            yield f"two types have the name {kind.name}"


@rule()
def time(e: Line, s: State) -> Iterator[str]:
    """Ticks and seconds never decrease, each tick of a live run has its second, and nothing follows
    the outcome. A simulated world changes nothing by itself."""
    if s.ended is not None:
        yield f"a line after the outcome: {e.kind}"
    if e.cause == "world" and not s.external:
        yield "a simulated world changes nothing that the scenario does not list"
    if e.tick < s.tick:
        yield f"tick {e.tick} follows tick {s.tick}"
    if s.live and e.t is None and e.kind != "header":
        yield "the time of this line is missing"
    elif s.live and (e.t or 0.0) < s.time:
        yield f"second {e.t} follows second {s.time}"
    elif s.live and e.tick == s.tick and (e.t or 0.0) != s.time:
        yield f"tick {e.tick} is at second {s.time}, not {e.t}"
    elif e.kind in (("move",) if s.live else ("depart", "arrive", "act", "operator")):
        yield f"a {'live' if s.live else 'lockstep'} run has no '{e.kind}' lines"
    elif not s.live and e.t is not None:
        yield "a lockstep run has no times"


@rule("goal")
def goal(e: Line, s: State) -> Iterator[str]:
    """A robot that meets a target is there, not lost, and in service unless its step or
    action has just ended. The goals of formulas are met by its last move (live: or by staying),
    with some possible memory. In lockstep, a move meets each goal once, and only one of several
    goals in turn. A robot that a strategy drives to another objective meets no own goal."""
    robot = s.robots[e.robot]
    own, here = robot.own, robot.pose[0]
    if e.region != here:
        yield f"{e.robot} is at {s.show(here)}, not at {s.show(e.region)}"
        return
    if e.duty:
        there = (k for k, target in enumerate(robot.given.targets) if here in target)
        if robot.given.targets and e.goal not in there:
            yield f"{s.show(here)} is not target {e.goal} of the duty of {e.robot}"
        return
    if not (s.keeps(e.robot) or robot.given.serves(own)):
        yield f"{e.robot} counts goal {e.goal} of its own while it has another objective"
    if robot.lost or robot.bound is not None or (robot.out and not robot.finishes(e, s.now(e))):
        yield f"{e.robot} is lost, in transit or out of service"
    if not counts(e, robot, s):
        yield f"{s.show(here)} is not target {e.goal} of {e.robot}"
        return
    again, after = robot.again(e, s.live), robot.progress.after(own, e.goal)
    if again and not (own.kind == "cover" or (own.strict and after is robot.progress)):
        yield f"{e.robot} counts goal {e.goal} twice for one step"
    if own.in_turn and after is robot.progress and not (own.strict or after.ended(own)):
        yield f"target {e.goal} of {e.robot} is out of turn"
    rounds = (robot.progress if again else after).rounds(own, e.tick)
    if not own.settles and e.round != rounds:
        yield f"{e.robot} has completed {rounds} rounds, not {e.round}"
    more = s.scenario.until.rounds if s.live and own.settles else 1
    most = robot.progress.rounds(own, e.tick) + more
    if e.round > most:
        yield f"{e.robot} has completed at most {most} rounds, not {e.round}"


@rule("deadline")
def deadline(e: Line, s: State) -> Iterator[str]:
    """`kept` is recorded by the due tick, `late` after it, `lost` only if no behaviour can meet the
    deadline. An obstacle's deadline is excused once the obstacle need not be resolved. A round's
    deadline is excused if the robot pursued something else in this or the previous round."""
    due = {"kept": s.kept, "excused": s.dues | s.excused}.get(e.verdict, s.dues).get(e.of)
    robot, one = s.robots.get(e.of), s.obstacles.get(e.of)
    excused = bool(robot.away or robot.was_away if robot else one and (one.shut or not one.open))
    late = e.due < e.tick and not (robot and excused)
    if (s.by if e.of == "mission" else getattr(robot or one, "within", None)) is None:
        yield f"{e.of} has no deadline"
    elif e.due != due:
        yield f"{e.of} is due in {'no tick' if due is None else f'tick {due}'}, not {e.due}"
    elif e.verdict in ("lost", "set"):
        yield from _proven(bound_problems(e, s))
    elif not {"excused": excused, "late": late, "kept": e.tick <= e.due}[e.verdict]:
        yield f"the deadline of {e.of}, in tick {e.due}, is not {e.verdict} in tick {e.tick}"


@rule("outcome")
def deadlines(e: Line, s: State) -> Iterator[str]:
    """The outcome lists exactly the missed deadlines. The mission's deadline is kept when the
    mission is completed."""
    late, missed = {*(e.late or ())}, s.missed | s.overdue(e.tick)
    if forgotten := (missed if e.outcome == "completed" else s.missed) - late:
        yield f"missed, but not listed: {', '.join(sorted(forgotten))}"
    if more := late - missed:
        yield f"listed as missed, but was not: {', '.join(sorted(more))}"
    stops = not s.live and s.scenario.late == "stop"
    if s.promised is not None and (e.outcome != "completed" or s.promised != e.tick):
        yield f"the mission was not completed in tick {s.promised}"
    stopped = e.outcome not in ("interrupted", "error")
    if stopped and (e.outcome == "late") is not bool(stops and late):
        yield f"{'a' if stops and late else 'no'} missed deadline ends the run"
    yield from _proven(refused_problems(e, s)) if e.refused else ()


@rule("outcome")
def end(e: Line, s: State) -> Iterator[str]:
    """In a completed run each objective has been met as often as required since the last
    resolution, and robots with a last target are there. The stated rounds are those completed (0
    while an input replaces the objective); they may be fewer without goals or at a last target.
    Only a run that needs an operator states a cause. A run ends at a limit exactly when it reaches
    that limit."""
    yield from _unmet(e, s) if e.outcome == "completed" else ()
    for name, robot in s.robots.items():
        rounds, stated = 0 if s.by_inputs(robot) else s.rounds(name, e), e.rounds.get(name)
        exact = robot.own.count and not robot.own.settles
        if stated is None or stated > rounds or (exact and stated < rounds):
            yield f"{name} has {rounds} rounds, not {stated}"
    for name in sorted(e.rounds.keys() - s.robots.keys()):
        yield f"there is no robot {name}"
    if (e.cause or e.proof) and e.outcome != "operator_needed":
        yield f"a {e.outcome} run has no cause of failure"
    elif e.proof and e.cause != "deadlock":
        yield f"{e.cause} has no proof"
    stated = {*(e.unrealizable or {}).items()}
    if stated and e.outcome not in ("operator_needed", "unrealizable"):
        yield f"a {e.outcome} run lists no robots as unrealizable"
    for name, _ in sorted(stated - s.unrealizable):
        yield f"no synthesis of {name} has failed"
    if e.makespan is not None and e.makespan != s.worked:
        yield f"the last command ends at {s.worked:g} s, not {e.makespan:g} s"
    moved = max(robot.moved for robot in s.robots.values())
    if e.ticks != (moved if e.outcome in ("error", "interrupted") and not s.live else e.tick):
        yield f"the run ends in tick {e.tick}, not {e.ticks}"
    if e.outcome == "tick_limit" and (s.live or e.tick != s.limit):
        yield f"the limit of {s.limit} ticks is not reached"
    moves = any(robot.bound is not None or robot.acts for robot in s.robots.values())
    if e.outcome == "time_limit" and s.live and not s.external and moves and e.t < s.limit:
        yield f"the limit of {s.limit:g} s is not reached"
    if (s.time if s.live else s.tick) > s.limit and not (s.live and s.external):
        yield f"the limit is {s.limit:g} {'s' if s.live else 'ticks'}"
    if e.outcome == "unrealizable":
        failed = [name for name, spec in stated if (name, spec) in s.failed]
        if s.moves:
            yield "unrealizable is for runs that never begin, but robots have moved"
        elif not (failed or e.refused):
            yield "no robot is unrealizable, and nothing is refused"
        elif failed:
            names = ", ".join(failed)
            yield NotJudged(f"unrealizability of {names} (a bundle proves it)")
    elif e.refused:
        yield f"{e.outcome} with refused deadlines or charges: only unrealizable has them"


@rule("move", "depart", "arrive", "act", "outcome")
def finished(e: Line, s: State) -> Iterator[str]:
    """A run ends in the tick in which its mission is completed or, with `late: stop`, in which a
    deadline is missed."""
    continues = e.kind != "outcome" and (s.now(e) > s.time if s.live else e.tick > s.tick)
    if continues and s.missed and s.scenario.late == "stop":
        yield f"missed, but the run continues: {', '.join(sorted(s.missed))}"
    if (continues or e.outcome in UNFINISHED) and s.moves and _is_finished(s):
        yield f"the mission is completed in tick {s.tick}"


def _is_finished(s: State) -> bool:
    """Return whether the mission is certainly completed: no obstacle has to be resolved or was
    resolved in this tick, and every robot pursues its own objective."""
    now, robots = Line(tick=s.tick, t=s.time), s.robots
    known = any(one.open and one.known for one in s.obstacles.values())
    todo = known or any(one.ordered for one in s.coming) or s.restarted == s.tick
    busy = any(x.acts is not None or not x.given.serves(x.own) for x in robots.values())
    most = s.scenario.until.rounds + 1  # a stay's first ticks may not have counted
    stays = any(x.own.settles and (s.live or s.rounds(n, now) <= most) for n, x in robots.items())
    return not (todo or busy or stays or any(_unmet(now, s)))


@rule("move", "depart", "outcome")
def counted(e: Line, s: State) -> Iterator[str]:
    """Each met target of a robot's own objective is recorded: in lockstep before the robot's next
    move, in a simulated live run before it departs."""
    ends = e.outcome in (None, *UNFINISHED, "late", "operator_needed")
    if not ends or (s.live and s.external):
        return
    for name in s.arrived & {e.robot} if e.kind == "depart" else sorted(s.arrived):
        robot = s.robots[name]
        rests = robot.bound is None and robot.acts is None and not (robot.out or robot.lost)
        own = robot.given.serves(robot.own) and not robot.met
        if rests and own and (goals := _unrecorded(robot)):
            yield f"{name} has met its target {goals[0]}, but no line records that"


def _unrecorded(robot: Robot) -> list[int]:
    """Return the targets that a robot has met where it is and that no line records."""
    own, progress = robot.own, robot.progress
    if own.kind in ("hold", "ltl") or progress.ended(own):
        return []
    here = (k for k, target in enumerate(own.targets) if robot.pose[0] in target)
    met = [k for k in here if progress.after(own, k) != progress]
    return [k for k in met if k == progress.turn] if own.strict else met


@rule("outcome", "waiting")
def negative(e: Line, s: State) -> Iterator[str]:
    """A run that needs an operator proves that no sequence of moves completes the mission so that
    each robot can continue. No later change of the scenario may help."""
    if e.outcome != "operator_needed":
        return
    if e.kind == "outcome" and (later := later_change(e, s)) is not None:
        yield f"the run ends, but the scenario changes something at {later:g}"
    for name, robot in s.robots.items():
        if s.disobeys(robot):
            yield f"{name} lacks the objective that the inputs give it"
    out = any(robot.out and robot.own.settles for robot in s.robots.values())
    # Rounds of a robot out of service may not have counted.
    if not out and next(_unmet(e, s), None) is None:
        yield "every robot has met its objective: the mission is completed"
    yield from _proven(negative_problems(e, s))


@rule("blocked", "reopened")
def permanence(e: Line, s: State) -> Iterator[str]:
    """An obstacle becomes permanent if it was found untraversable, an operator declares it, or no
    robot can ever resolve it."""
    one = s.obstacles[e.obstacle]
    if e.kind == "reopened":
        if not one.shut or one.resolved or one.declared:
            yield f"{one.name} is reopened, but was not given up"
    elif not (one.there and (one.known or one.declared)):
        yield f"the team does not know {one.name}"
    elif e.robots != one.blocks:
        yield f"{one.name} blocks {', '.join(sorted(one.blocks)) or 'no robot'}"
    elif one.declared:
        return  # for any reason
    elif e.reason == "untraversable" and not (one.resolved and one.shut):
        yield f"{one.name} was not found untraversable"
    elif e.reason == "operator":
        yield f"no operator has declared {one.name} permanent"
    elif e.reason == "no_capable_robot" and not one.short:
        yield f"enough robots have the actions that {one.name} needs"
    elif e.reason == "unresolvable":
        yield from _proven(shut_problems(e, s))


def _unmet(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons, in words, why the mission is not completed."""
    for name, robot in s.robots.items():
        if why := s.behind(name, e):
            yield why
        elif s.by_inputs(robot) or s.disobeys(robot):
            yield f"an input keeps {name} from its objective"
    orders, later = (s.obstacles[name] for name in sorted(s.orders)), later_change(e, s)
    undone = [x.name for x in orders if x.open and not (x.declared or x.short)]
    if undone and later is not None:
        yield f"{undone[0]} is still open, and the scenario changes something at {later:g}"
    to_come = [one for one in s.coming if one.ordered]
    if to_come and not s.external:
        yield f"{to_come[0].name} has not been ordered yet"


def _proven(problems: Iterator[str]) -> Iterator[str]:
    """Yield the errors in a proof. Raise NotJudged if the proof is too large."""
    try:
        yield from problems
    except TooLargeError as error:
        yield NotJudged(f"whether the proof holds: {error}")


def counts(e: Line, robot: Robot, s: State) -> bool:
    """Return whether a goal line is a goal of the robot's own objective."""
    own = robot.own
    if e.goal >= own.count or own.kind != "ltl":
        return e.goal < own.count and e.region in own.targets[e.goal]
    return robot.memories is None or bool(meeting(e, robot, s))  # None: not judged


def meeting(e: Line, robot: Robot, s: State) -> set[int]:
    """Return the memories that a robot's formulas may have when a line records their goal."""
    formulas, here, live = robot.own.formulas, robot.pose, s.live
    known = robot.memories or set()
    known = formulas.lasting(known, here, robot.heard) if live else known
    fresh = any(s.switched.get(name) == e.tick for name in formulas.inputs)
    known = known & robot.hears(s.inputs) if live and not fresh else known
    rests = live or robot.before == here
    each = [(robot.recalled, robot.before)] * (not live or e.goal not in robot.met)
    each += [(known, here)] * rests
    steps = ((start, formulas.steps(before, here)) for start, before in each)
    met = {j for start, some in steps for i, j, goals in some if i in start and e.goal in goals}
    stays = {one for one in known if rests and e.goal in formulas.met_by_staying(here, one)}
    return (met & robot.heard) | stays
