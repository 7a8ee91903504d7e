"""The regions that robots occupy, their actions where they stand, and the consequences of failed
steps, unknown obstacles and lost robots."""

from collections.abc import Collection, Iterator, Sequence

from safenav.scenario.model import OPERATOR_ACTION, FailedMoves, Need, Obstacle, ObstacleType, Robot
from safenav.team import state as now
from safenav.team.floor import put
from safenav.team.known import acting_floor, barred, stages_of
from safenav.team.state import Is, State
from safenav.team.team import Team, introduced
from safenav.world.map import Region

FAILURE = "world"
"""The ``cause`` of a robot that its own failures put out of service."""


def standing(
    team: Team, state: State, *, moving: bool, leader: int | None = None
) -> list[int | None]:
    """Return, for each robot, its region if it can take part in an action, else None. ``moving``:
    whether robots in transit can. With a ``leader``, only robots in its action count; if it does
    not act yet, only robots that do not act."""
    acts = None if leader is None else state.robots[leader].acting
    found = list[int | None]()
    for robot in state.robots:
        can = robot.active and (moving or robot.to is None)
        if leader is not None:
            can = robot.acting == acts and (can or acts is not None)
        found.append(robot.pose % team.size if can else None)
    return found


def driven(team: Team, state: State) -> tuple[int, ...]:
    """Return the robots in service that follow joint plans."""
    return tuple(i for i in team.sharing if state.robots[i].active)


def occupied(team: Team, state: State) -> frozenset[int]:
    """Return the regions that robots occupy. A robot in transit occupies two."""
    size = team.size
    return frozenset(p % size for robot in state.robots for p in (robot.pose, robot.next))


def is_reserved(team: Team, state: State, i: int, region: int) -> bool:
    """Return whether robot ``i`` must not enter a region now: a rival occupies it, or another robot
    is in a zone that contains it."""
    at = [1 << r.pose % team.size | 1 << r.next % team.size for r in state.robots]
    return bool(team.members[i].closed(at) >> region & 1)


def is_shut(team: Team, state: State, i: int, region: int) -> bool:
    """Return whether a present obstacle, known or not, closes a region to a robot that cannot
    resolve it by entering."""
    pairs = zip(team.obstacles, state.obstacles, strict=True)
    here = ((one, each) for one, each in pairs if one.region == region)
    return any(one.closes(i, each) and not one.lets_in(i, each) for one, each in here)


def acts_on(
    team: Team, state: State, at: Sequence[int | None], i: int, among: Collection[int] | None = None
) -> tuple[tuple[int, now.Stage], ...]:
    """Return the obstacles that robot ``i`` changes if it acts where it stands, with their new
    stages. ``at``: the region of each robot (None: it cannot take part); ``among``: the obstacles
    to consider (None: all known ones)."""
    region = at[i]
    if region is None or not team.members[i].robot.capabilities:
        return ()
    floor = acting_floor(team, state, among)
    stages = stages_of(floor, state)
    if not floor.acting(stages) >> region & 1:
        return ()
    after = floor.acted(stages, at, i)
    pairs = zip(floor.gates, stages, after, strict=True)
    return tuple((k, new) for k, old, new in pairs if old != new)


def acting_group(
    team: Team,
    state: State,
    at: Sequence[int | None],
    i: int,
    changes: Collection[tuple[int, now.Stage]],
) -> frozenset[int]:
    """Return the robots that take part in an action of robot ``i``, or in the needs that the action
    fulfils next. ``changes``: the obstacles that the action changes, with their new stages."""
    found = {i}
    for k, stage in changes:
        for later in (None, *range(state.obstacles[k].stage.need + 1, stage.need)):
            found |= {*participants(team, state, at, i, k, later)}
    return frozenset(found)


def participants(
    team: Team, state: State, at: Sequence[int | None], i: int, k: int, later: int | None = None
) -> tuple[int, ...]:
    """Return the robots that act when robot ``i`` acts on an obstacle: all robots that must act
    together, or only robot ``i``. ``later``: the index of a need after the present one."""
    stage, needs = state.obstacles[k].stage, team.obstacles[k].needs
    later = stage.need if later is None else later
    if not needs[later].together:
        return (i,)
    every = enumerate(state.obstacles)  # the action may also put down another load
    carried = [h for h, each in every if h != k and i in (each.stage.group or ())]
    floor = acting_floor(team, state, (k, *carried))
    g, after = floor.gates.index(k), floor.acted(stages_of(floor, state), at, i)
    stages = put(after, g, stage)
    for number in range(stage.need, later):
        who = floor.there(g, stages, at) if needs[number].together else (i,)
        stages = floor.advanced(g, stages, who)
    return floor.there(g, stages, at)


def consequences(
    team: Team, before: State, event: now.Elsewhere | now.Failed | now.Lost
) -> Iterator[now.Event]:
    """Yield the events that follow from a step that did not end as commanded. The robot is out of
    service if another robot may be in its region. ``before``: the state before the step's end."""
    i, robot = event.robot, team.members[event.robot].robot
    here, target = (pose % team.size for pose in (before.robots[i].pose, before.robots[i].next))
    policy, tried = team.scenario.failures, (*before.robots[i].failed, target)
    often, gives_up = False, True
    if isinstance(event, now.Lost):
        for region, others in sorted(_closed(team, before, event).items()):
            obstacle = lost(robot, others, region)
            yield from met(team, before, i, obstacle, region)
            if obstacle.name not in team.numbers:
                team = introduced(team, obstacle)
    else:
        place = event.pose % team.size
        gives_up = place != here and is_reserved(team, before, i, place)
        if isinstance(event, now.Failed) and not gives_up:
            often = tried.count(target) > policy.retries
            stops = often and policy.then is FailedMoves.OUT_OF_SERVICE
            gives_up = event.fatal or stops or len(tried) >= policy.most
    if gives_up and before.robots[i].active:
        yield now.Served(i, False, FAILURE)
    elif often and not gives_up:
        yield from met(team, before, i, unknown(robot, target), before.robots[i].next)


def _closed(team: Team, before: State, event: now.Lost) -> dict[Region, frozenset[str]]:
    """Return the regions in which a lost robot may be, each with the robots to which it is closed.
    The robot itself blocks its last region. If it may have entered a zone, the whole zone is closed
    to the zone's other robots."""
    name, here = team.members[event.robot].name, before.robots[event.robot].pose % team.size
    rivals = frozenset(team.members[j].name for j in team.members[event.robot].rivals)
    closed = dict.fromkeys(event.regions - {here}, rivals)
    for zone in team.scenario.never_together:
        if name in zone.robots and here not in zone.regions and zone.regions & event.regions:
            for region in zone.regions:
                closed[region] = closed.get(region, frozenset()) | zone.robots - {name}
    return closed


def met(team: Team, state: State, i: int, obstacle: Obstacle, pose: int) -> Iterator[now.Event]:
    """Yield the events of robot ``i`` encountering an obstacle that the team may not know yet."""
    yield from noticed(team, state, obstacle)
    yield now.Met(i, number(team, state, obstacle), pose, stopped=True)


def vain(
    team: Team, before: State, after: State, i: int, failed: Collection[int]
) -> Iterator[now.Event]:
    """Yield the events that follow from failed actions: the team sees or encounters obstacles, and
    a robot that cannot turn back is out of service. ``before``, ``after``: the states around the
    action."""
    pose, late = after.robots[i].pose, barred(team, after) - barred(team, before)
    behind, steps = after.robots[i].behind, team.members[i].graph.steps(pose)
    for k in failed:
        inside = team.obstacles[k].region == pose % team.size and i in team.obstacles[k].blocks
        left, there = inside and (i, k) in late, before.obstacles[k]
        yield now.Seen(k)
        if inside and (there.state is Is.SEEN or not there.known):
            yield now.Met(i, k, pose, stopped=True)
        if left and behind is not None and all(to % team.size != behind for to in steps):
            yield now.Served(i, False, FAILURE)  # the robot cannot turn back


def noticed(team: Team, state: State, obstacle: Obstacle) -> Iterator[now.Event]:
    """Yield the events of the team seeing an obstacle. A resolved order is placed again."""
    yield from joined(team, state, obstacle)
    k = number(team, state, obstacle)
    over = k < len(state.obstacles) and state.obstacles[k].state in (Is.AWAY, Is.OVER)
    again = over and team.obstacles[k].ordered
    yield now.Appeared(k, cause="world") if again else now.Seen(k)


def joined(team: Team, state: State, obstacle: Obstacle) -> Iterator[now.Event]:
    """Yield the events that add an obstacle to a team that lacks it. An earlier obstacle of its
    name must then have disappeared, even if no event has reported that."""
    there = {k: state.obstacles[k].state for k in team.numbers.get(obstacle.name, ())}
    if not there:
        yield now.Introduced(obstacle)
    elif there[number(team, state, obstacle)] is Is.AWAY:
        yield from (now.Gone(k, "world") for k in there if there[k] not in (Is.AWAY, Is.OVER))


def number(team: Team, state: State, obstacle: Obstacle) -> int:
    """Return the index of an obstacle: its own if the team has it; else that of the first one of
    its name that is not ``OVER``, or of the last one; for a new name, the next free index."""
    numbers = team.numbers.get(obstacle.name)
    if numbers is None:
        return len(team.obstacles)
    for k in numbers:
        if team.obstacles[k].source == obstacle:
            return k
    there = (k for k in numbers if state.obstacles[k].state is not Is.OVER)
    return next(there, numbers[-1])


BY_OPERATOR = (Need(OPERATOR_ACTION),)


def unknown(robot: Robot, region: Region) -> Obstacle:
    """Return an obstacle that blocks the robot's layer in a region until an operator resolves
    it."""
    layer = robot.model.layer
    kind = ObstacleType(f"unknown_{layer}", BY_OPERATOR, frozenset({layer}))
    return Obstacle(kind, region)


def lost(robot: Robot, others: frozenset[str], region: Region) -> Obstacle:
    """Return an obstacle where a lost robot may be. It blocks the lost robot and ``others``."""
    blocks = frozenset({robot.name, *others})
    return Obstacle(ObstacleType(f"lost_{robot.name}", BY_OPERATOR, blocks), region)


def stands_for(obstacle: Obstacle, robot: str) -> bool:
    """Return whether an obstacle represents a lost robot."""
    return obstacle.type.name == f"lost_{robot}"
