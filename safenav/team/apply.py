"""The only transition function, which applies an event to a state. The simulated world, runs and
resumed runs share it."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import replace

from safenav.scenario.objective import Objective
from safenav.spec.guarantees import guarantees_of
from safenav.team import state as now
from safenav.team.acts import is_shut, stands_for
from safenav.team.bound import least_first
from safenav.team.floor import restarted
from safenav.team.formulas import reached
from safenav.team.known import charged
from safenav.team.state import Count, Is, ObstacleNow, RobotNow, State
from safenav.team.team import Member, Team
from safenav.world.poses import bits, plain_graph

_HELPS = (
    *(now.Met, now.Appeared, now.Gone, now.GaveUp, now.Declared, now.Served, now.Flat),
    *(now.Assigned, now.Reopened),
)
_SURPRISES = (
    *(now.Elsewhere, now.Failed, now.Lost, now.Flat, now.Served),
    *(now.Placed, now.Assigned, now.Declared, now.Met),
)
"""Events that no plan foresees."""


def initial(team: Team) -> State:
    """Return the initial state (Algorithm 1, lines 1 to 3): every robot is at its start and has its
    own objective; the stack is empty."""
    robots = tuple(map(_initial, team.members))
    away = ObstacleNow(Is.AWAY)
    obstacles = (ObstacleNow() if each.source.appears is None else away for each in team.obstacles)
    return State(robots, tuple(obstacles))


def _initial(member: Member) -> RobotNow:
    pose = member.graph.number(member.robot.start)
    first = member.objective.begin(member.robot.start.region)
    if member.robot.within is not None:
        _, first = least_first(member, pose, first)
    charge = 0 if member.energy is None else member.energy.battery.start
    values = _values(member, pose, frozenset())
    return RobotNow(pose, member.objective, Count(first), values=values, charge=charge)


def _values(member: Member, pose: int, inputs: frozenset[str]) -> now.Values:
    """Return the initial values of a robot's formulas: of the memory, if its states include one,
    and of the ``inputs`` that are on."""
    formulas = member.objective.formulas
    heard = formulas.heard(inputs) if formulas else {}
    return tuple(sorted({**heard, **member.graph.memory(pose)}.items()))


def apply(team: Team, state: State, event: now.Event) -> State:
    """Return the state after an event. Requests that were set aside return if it changes an
    obstacle, a robot's service or an objective, or reopens given-up obstacles."""
    if isinstance(event, _HELPS) or (isinstance(event, now.Acted) and event.truths):
        for number, each in enumerate(state.obstacles):
            if each.aside:
                state = _obstacle(state, number, aside=False)
    if isinstance(event, _SURPRISES):
        state = replace(state, plan=None)
    match event:  # the most frequent ones first
        case now.Turn():
            return state
        case now.Stayed(i, _, node):
            state = state if team.live else _charged(team, state, i, 1)
            begun = _stepped(team, state, i, state.robots[i].pose, event.values)
            begun |= {} if node is None else {"node": node}
            return _robot(state, i, **begun) if begun else state
        case now.Counted():
            return _with_counts(team, state, event)
        case now.Time(at):
            for i, robot in enumerate(state.robots if team.live else ()):
                if robot.to is None:
                    state = _charged(team, state, i, at - state.time)
            return replace(state, time=at)
        case now.Departed(i, pose, by, node):
            begun = _stepped(team, state, i, pose, event.values)
            plan = None if by == "backtrack" and node is None else state.plan
            begun |= {"to": pose, "due": event.due, "node": node, "command": event.command}
            return replace(_robot(state, i, by=by, **begun), plan=plan)
        case now.Goes(i):
            return _robot(state, i, by="plan" if state.robots[i].by == "plan" else None)
        case now.Arrived(i):
            state = _moved(team, state, i)
            robot, at = state.robots[i], state.robots[i].at
            way = state.plan.ways[i] if state.plan else ()
            planned = at + 1 < len(way) and way[at + 1].pose == robot.to
            region, mine = robot.next % team.size, team.members[i].objective
            here, behind, own = robot.pose % team.size, robot.behind, robot.own
            if region != here:  # a robot may leave an obstacle that appeared around it on any side
                behind = None if is_shut(team, state, i, region) else here
            own = own._replace(held=own.held and mine.stays(own.memory, region))
            ended = {"pose": robot.next, "to": None, "due": None, "by": None, "failed": ()}
            return _robot(state, i, at=at + planned, behind=behind, own=own, **ended)
        case now.Elsewhere(i, pose):
            return _put(team, _moved(team, state, i), i, pose)
        case now.Astray(i, rules):
            return _robot(state, i, node=None, broken=rules)
        case now.Failed(i, pose):
            state = _moved(team, state, i)
            robot = state.robots[i]
            failed = (*robot.failed, robot.next % team.size)
            return _put(team, state, i, pose, failed=failed)
        case now.Lost(i):
            return _put(team, _moved(team, state, i), i, state.robots[i].pose)
        case now.Flat(i, k):
            state = _robot(state, i, active=False, flat=True, node=None)
            here = state.robots[i].pose % team.size
            return state if k is None else _asked(team, state, k, ((i, here),))
        case now.Served(i, active):
            state = _robot(state, i, active=active, flat=False, node=None, cause=event.cause)
            if not active:
                return state
            objective = team.members[i].objective  # until it gets a duty
            return _robot(_forgiven(state, i), i, failed=(), objective=objective)
        case now.Placed(i, pose):
            return _forgiven(_put(team, state, i, pose, active=True, failed=()), i)
        case now.Assigned(i, objective):
            state = _robot(state, i, mode=event.mode, base=event.mode and event.base)
            state = _assigned(team, state, i, objective)
            if event.base is not None and event.mode is None:
                _, _, own, values = event.base
                state = _robot(state, i, own=restarted(team.members[i], own), values=values)
            if event.own:
                return _robot(state, i, objective=objective)
            return state
        case now.Looked(i, seen):
            return _robot(state, i, known=seen)
        case now.Inputs(on):
            return replace(state, inputs=on)
        case now.Declared(k):
            return _obstacle(_dropped(state, k), k, state=Is.SEALED, given_up=False)
        case now.Seen(k):
            match state.obstacles[k].state:
                case Is.HIDDEN | Is.AWAY:  # robots may have fulfilled its needs unknowingly
                    return _obstacle(state, k, state=Is.SEEN)
                case Is.OVER:
                    return replace(_with(state, k, ObstacleNow(Is.SEEN)), plan=None)
            return state
        case now.Introduced():
            return replace(state, obstacles=(*state.obstacles, ObstacleNow()))
        case now.Acts(leader, group):
            for i in group:
                state = _robot(state, i, acting=leader)
            return _robot(state, leader, works=event.obstacles, command=event.command)
        case now.Acted():
            return _acted(team, state, event)
        case now.Met(i, k):
            asked = tuple(one for one in state.obstacles[k].asked if one[0] != i)
            here = state.robots[i].next % team.size
            return _asked(team, state, k, (*asked, (i, here)))
        case now.Appeared(k):
            state = _with(state, k, ObstacleNow())
            if not team.obstacles[k].ordered:
                return state
            return replace(_asked(team, state, k, ()), plan=None)
        case now.Gone(k):
            known = state.obstacles[k].state not in (Is.HIDDEN, Is.AWAY)
            state = _with(_dropped(_forgiven(state, k=k), k), k, ObstacleNow(Is.OVER))
            if (empty := team.obstacles[k].battery_of) is not None and state.robots[empty].flat:
                state = _full(team, state, empty)
            return replace(state, plan=None) if known else state
        case now.GaveUp(k):
            foreseen = state.plan is not None and k in state.plan.foreseen
            state = replace(state, plan=None) if foreseen else state
            return _obstacle(_dropped(state, k), k, state=Is.SEALED, given_up=True)
        case now.Reopened():
            for k, each in enumerate(state.obstacles):
                if each.given_up:
                    state = _asked(team, state, k, each.asked)
            return state
        case now.SetAside(those):
            for k in those:
                state = _obstacle(state, k, aside=True)
            return state
        case now.Told(i, objective, node):
            robot = state.robots[i]
            same = robot.objective == objective
            task = robot.task if same else Count()
            values = robot.values if event.values is None else event.values
            begun = {"fresh": robot.fresh or not same, "came": robot.came if same else None}
            if node is not None:
                begun["broken"] = ()
            if robot.by == "strategy" and node != robot.node:
                begun["by"] = None  # the step under way is by an earlier strategy
            return _robot(
                state, i, objective=objective, task=task, node=node, values=values, **begun
            )
        case now.Turned(i, memory):
            return _robot(state, i, own=_turned(team.members[i], state.robots[i].own, memory))
        case now.Planned(plan):
            robots = tuple(replace(each, at=0) for each in state.robots)
            return replace(state, plan=plan, robots=robots)
    return state


def _robot(state: State, i: int, **changes: object) -> State:
    robots = state.robots
    return replace(state, robots=(*robots[:i], replace(robots[i], **changes), *robots[i + 1 :]))


def _put(team: Team, state: State, i: int, pose: int, **changes: object) -> State:
    """Return the state with a robot in a pose that no decision has chosen."""
    robot, region = state.robots[i], pose % team.size
    changes |= {"pose": pose} | _undone(team, state, i, pose)
    if region != robot.pose % team.size:
        count = robot.own if on_own(team, state, i) else robot.task
        counts = bool(robot.objective.met(count.memory, region))
        changes |= {"behind": None, "fresh": robot.fresh or counts}
    return _robot(state, i, to=None, due=None, node=None, by=None, **changes)


def _moved(team: Team, state: State, i: int) -> State:
    """Return the state after the end of a step. The step uses charge even if it fails."""
    energy, charge = team.members[i].energy, state.robots[i].charge
    return state if energy is None else _robot(state, i, charge=energy.battery.stepped(charge))


def _charged(team: Team, state: State, i: int, time: float) -> State:
    energy, robot = team.members[i].energy, state.robots[i]
    # a robot out of service uses no charge of a new battery
    if energy is None or not time or charged(team, state, i):
        return state
    on = energy.charging(robot.pose)
    return _robot(state, i, charge=energy.battery.stayed(robot.charge, time, charging=on))


def _forgiven(state: State, i: int | None = None, k: int | None = None) -> State:
    """Return the state without the failed actions of a robot, or without those on an obstacle."""
    left = tuple(pair for pair in state.attempts if pair[0] != i and pair[1] != k)
    return state if left == state.attempts else replace(state, attempts=left)


def _assigned(team: Team, state: State, i: int, objective: Objective) -> State:
    """Return the state in which a robot has another own objective: the one in ``team``."""
    robot, graph = state.robots[i], team.members[i].graph
    plain = plain_graph(team.world, graph.mobility)
    pose, to = (
        None if p is None else graph.number(plain.pose(p % (plain.size * plain.blocks)))
        for p in (robot.pose, robot.to)
    )
    own = Count(objective.begin(robot.next % team.size))
    assert pose is not None
    values = _values(team.members[i], pose if to is None else to, state.inputs)
    begun = {"own": own, "node": None, "fresh": True, "values": values, "came": None}
    return _robot(state, i, pose=pose, to=to, **begun)


def _stepped(
    team: Team, state: State, i: int, pose: int, values: now.Values | None
) -> dict[str, object]:
    """Return the fields of a robot that change as its formulas take a step or a stay to ``pose``.
    ``values``: memory and inputs by its strategy; None: memory in ``pose``, or the present one."""
    robot, formulas = state.robots[i], state.robots[i].objective.formulas
    if formulas is None:
        return {}
    if values is None:
        heard, memory = formulas.heard(state.inputs), team.members[i].graph.memory(pose)
        kept = dict(robot.values) | heard | dict(memory)
        values = tuple(sorted(kept.items()))
    return {"came": (robot.pose, robot.values), "values": values}


def _undone(team: Team, state: State, i: int, pose: int) -> dict[str, object]:
    """Return the changed fields of a robot whose step did not end in the intended pose. Its
    formulas return to the memory before the step, unless the actual step requires another one."""
    robot, graph = state.robots[i], team.members[i].graph
    formulas = robot.objective.formulas
    if formulas is None or robot.to is None or robot.came is None:
        return {}
    old = dict(robot.came[1])
    if graph.remembers:
        values = old | dict(graph.memory(pose))
    else:
        here, there = graph.pose(robot.came[0]), graph.pose(pose)
        values = dict(guarantees_of(formulas).memory_after(here, old, there))
    return {"values": tuple(sorted(values.items()))}


def _with(state: State, k: int, obstacle: ObstacleNow) -> State:
    return replace(state, obstacles=(*state.obstacles[:k], obstacle, *state.obstacles[k + 1 :]))


def _obstacle(state: State, k: int, /, **changes: object) -> State:
    return _with(state, k, replace(state.obstacles[k], **changes))


def _asked(team: Team, state: State, k: int, asked: tuple[tuple[int, int], ...]) -> State:
    """Return the state after a known open obstacle is requested, once (Algorithm 1, line 9)."""
    before = state.obstacles[k]
    met = before.state is Is.OVER or team.obstacles[k].next(before.stage) is None
    stage = now.Stage() if met else before.stage  # a reappearing obstacle starts over
    due = before.due
    if k not in state.requests:
        limit = team.scenario.limit_of(team.obstacles[k].source)
        due = None if limit is None else int(state.time) + limit
    state = _with(state, k, ObstacleNow(Is.OPEN, stage, asked, due=due))
    return state if k in state.requests else replace(state, requests=(*state.requests, k))


def _dropped(state: State, k: int) -> State:
    """Return the state with a request removed from the stack (Algorithm 1, line 19)."""
    return replace(state, requests=tuple(each for each in state.requests if each != k))


def _acted(team: Team, state: State, event: now.Acted) -> State:
    """Return the state after an action: stages change, resolved obstacles disappear or, if
    untraversable, become permanent, and rounds restart."""
    for i in [i for i, robot in enumerate(state.robots) if robot.acting == event.robot]:
        state = _robot(state, i, acting=None, works=())
    if event.failed:
        tried = (*state.attempts, *((event.robot, k) for k in event.failed))
        state = replace(state, attempts=tried, plan=None)
    for k, stage in event.stages:
        state = _obstacle(state, k, stage=stage)
    for k in event.again:
        state = _with(_forgiven(state, k=k), k, ObstacleNow(Is.OVER))
    foreseen = state.plan.foreseen if state.plan else frozenset()
    for k, truth in event.truths:
        after = Is.SEALED if truth is False else Is.OVER
        state = _dropped(_forgiven(state, k=k), k)
        state = _obstacle(state, k, state=after, asked=(), given_up=False)
        state = replace(state, over=(*state.over, k))
        if truth is False or k not in foreseen:
            state = replace(state, plan=None)
        if (empty := team.obstacles[k].battery_of) is not None:
            state = _full(team, state, empty)
    if any(team.obstacles[k].restarts for k, _ in event.truths):
        for i, robot in enumerate(state.robots):
            own, task = restarted(team.members[i], robot.own), robot.task._replace(met=0)
            state = _robot(state, i, own=own, task=task)
    return state


def _full(team: Team, state: State, i: int) -> State:
    energy = team.members[i].energy
    return state if energy is None else _robot(state, i, charge=energy.battery.capacity)


# Goals.


def on_own(team: Team, state: State, i: int) -> bool:
    return state.robots[i].objective == team.members[i].objective


def goals(
    team: Team, state: State, i: int, at_once: bool = False, duty: bool = True
) -> Iterator[tuple[int, int, bool]]:
    """Yield each target that a robot counts where it stands, with the rounds completed by then, and
    whether the target is its own. ``duty``: whether targets of its duty also count."""
    for objective, before, after, met in _counts(team, state, i, at_once, duty):
        own = objective == team.members[i].objective
        for goal in met if objective.goals else ():
            yield goal, objective.pursuit.rounds((after if goal == met[-1] else before).met), own


def _remembers(team: Team, state: State, i: int) -> bool:
    """Return whether a robot counts own targets during a duty (not one where it got the duty)."""
    member, robot = team.members[i], state.robots[i]
    assigned = team.assignable(i) and member.objective.formulas is None
    return member.planned or (assigned and not (robot.fresh and robot.own.held))


Counted = tuple[Objective, Count, Count, tuple[int, ...]]
"""An objective, the progress before and after one count, and the targets met."""


def _counts(team: Team, state: State, i: int, at_once: bool, duty: bool) -> Iterator[Counted]:
    """Yield each count of a robot where it stands (none in transit): first for its own objective,
    if it pursues or ``_remembers`` it, then for its duty if ``duty``. A turn that takes no time may
    count each target once, and all rounds if the objective settles. Formulas count one step."""
    robot, own = _begun(team, state, i), team.members[i].objective
    mine = robot.objective == own
    parts = [(own, robot.own, team.rounds)] if mine or _remembers(team, state, i) else []
    parts += [(robot.objective, robot.task, 1)] if duty and not mine else []
    for objective, count, most in parts if robot.to is None else ():
        here, region = reached(objective, team.members[i].graph, robot), robot.pose % team.size
        once, pursuit = not at_once or objective.formulas is not None, objective.pursuit
        for _ in range(1 if once else pursuit.targets + most * pursuit.settles):
            if at_once and pursuit.rounds(count.met) >= most:
                break
            after, met = _count(objective, count, here, region)
            yield objective, count, after, met
            count = after


def _begun(team: Team, state: State, i: int) -> RobotNow:
    """Return the robot. If it has a new strict objective and no plan drives it, it begins with the
    target on which it stands, if any."""
    robot, member = state.robots[i], team.members[i]
    own = member.objective
    if robot.fresh and own.strict and not member.planned and on_own(team, state, i):
        memory = own.begin(robot.pose % team.size, robot.own.memory)
        if memory != robot.own.memory:  # the last met target does not count twice
            met = max(0, robot.own.met - 1)
            robot = replace(robot, own=robot.own._replace(memory=memory, met=met))
    return robot


def _turned(member: Member, count: Count, memory: int) -> Count:
    """Return the progress of a robot whose next target is now ``memory``. If this changes the
    target, the incomplete round is void."""
    if memory == count.memory:
        return count
    return count._replace(memory=memory, met=count.met - count.met % member.pursuit.targets)


def _count(
    objective: Objective, count: Count, here: int, region: int
) -> tuple[Count, tuple[int, ...]]:
    pursuit = objective.pursuit
    met = pursuit.met(count.memory, here)
    memory, more = pursuit.step(count.memory, here)
    stays = objective.stays(count.memory, region)
    fresh = met if pursuit.in_turn or pursuit.settles else met & ~count.memory
    # If the robot stays at its last target, that is recorded only once.
    told = () if stays and count.held else tuple(bits(fresh))
    return Count(memory, count.met + more, stays, told[-1] if told else count.last), told


def _with_counts(team: Team, state: State, event: now.Counted) -> State:
    """Return the state after a robot has counted the goals of its own objective and of its duty."""
    i, member = event.robot, team.members[event.robot]
    robot = _begun(team, state, i)
    changes = {"own": robot.own, "task": robot.task, "fresh": robot.fresh and robot.to is not None}
    for objective, _, after, _ in _counts(team, state, i, event.at_once, event.duty):
        changes["own" if objective == member.objective else "task"] = after
    same = replace(robot, **changes) == state.robots[i]
    return state if same else _robot(state, i, **changes)


def will_count(team: Team, state: State, i: int) -> bool:
    """Return whether a robot will count further goals if it stays where it is."""
    robot, member = state.robots[i], team.members[i]
    here = member.kept(robot.pose)
    after = _count(member.objective, robot.own, here, robot.pose % team.size)[0]
    return robot.fresh or (after != robot.own and not done(team, state, i))


def orders_ahead(team: Team, state: State) -> bool:
    """Return whether the scenario still has orders that the team has not received."""
    pairs = zip(team.obstacles, state.obstacles, strict=True)
    return any(o.ordered and each.state is Is.AWAY for o, each in pairs)


def done(team: Team, state: State, i: int) -> bool:
    return team.members[i].pursuit.rounds(state.robots[i].own.met) >= team.rounds


def stands(team: Team, state: State, i: int) -> bool:
    """Return whether a robot is where its own objective settles (True if it settles nowhere). A
    lost robot may be in several regions."""
    member, robot = team.members[i], state.robots[i]
    if not member.pursuit.settles:
        return True
    pairs = zip(team.obstacles, state.obstacles, strict=True)
    places = {o.region for o, each in pairs if each.known and stands_for(o.source, member.name)}
    places.add(robot.pose % team.size)
    return robot.to is None and all(member.objective.stays(robot.own.memory, r) for r in places)
