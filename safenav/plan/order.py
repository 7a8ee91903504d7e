"""Plans as robots' paths with the conditions of each step.

A step into a region waits until the rivals that were there before have arrived elsewhere. A step
that counts a goal waits for the resolutions that would reset the count later. So every execution,
for any durations, is a prefix of an order of the plan. This is an action dependency graph (Hoenig
et al., RA-L 2019).
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence

from msgspec.structs import replace

from safenav.team.acts import acts_on, standing
from safenav.team.apply import will_count
from safenav.team.battery import AMPLE, NEVER, Energy
from safenav.team.floor import Floor, Joint, restarted
from safenav.team.known import floor_now, stages_of
from safenav.team.state import Count, Is, Plan, State, Waypoint
from safenav.team.team import Team
from safenav.world.poses import FAR

EARLY = 1e-5
AGAIN = 0.1
"""Seconds after which a robot with less charge than its new plan foresees needs a further plan."""
UNKNOWN = -1
"""The charge at the end of a plan that only brings robots to chargers."""


def plan_of(floor: Floor, first: Joint, ticks: Sequence[tuple[int, ...]]) -> tuple[Plan, Joint]:
    """Return the plan in which robots go to these joint poses, and the state after it. The robots
    go one at a time, in the plan's order."""
    robots, stays = floor.robots, _Stays(floor, first)
    ways = {i: [Waypoint(first.poses[i])] for i in robots}
    owed = defaultdict[int, set[tuple[int, int]]](set)  # needs to fulfil before leaving
    for i in robots:  # earlier resolutions may let its goal count
        member, counts = floor.team.members[i], first.counts[i]
        if member.pursuit.in_turn or counts != restarted(member, Count(*counts))[:2]:
            owed[i] |= _whole(floor, _over(floor, first))
    joint, over = first, _over(floor, first)
    for poses in ticks:
        for i, after in floor.sequence(joint, poses):
            counts = joint.counts[i]
            others = stays.moved(i, joint.poses[i], poses[i], len(ways[i]))
            waits = owed[i] | (_whole(floor, over) if after.counts[i] != counts else set())
            owed[i] = set()
            when = tuple(sorted(others.items())), frozenset(waits), counts, over
            ways[i].append(Waypoint(poses[i], *when))
            if after.stages != joint.stages:
                over = _over(floor, after)
                for j, what in _because(floor, joint, after):
                    owed[j].add(what)
            joint = after
    every = tuple(tuple(ways.get(i, ())) for i in range(len(first.poses)))
    return Plan(every, frozenset(floor.gates)), joint


class _Stays:
    """The stays in each region and zone: the robot, and the index of its waypoint afterwards."""

    def __init__(self, floor: Floor, first: Joint) -> None:
        self.team, self.stays = floor.team, defaultdict[object, list[list[int]]](list)
        for i in floor.robots:
            for space in self.team.spaces(i, first.poses[i] % self.team.size):
                self.stays[space].append([i, 0])

    def moved(self, i: int, before: int, pose: int, place: int) -> dict[int, int]:
        """Record the step of a robot to waypoint ``place``. Return the robots that stayed at its
        destination before, each with the index of its next waypoint after that stay. In a crowd
        (all are rivals) the last visitor suffices, since it arrived after all others had left."""
        team, region, found = self.team, pose % self.team.size, dict[int, int]()
        left, entered = team.spaces(i, before % team.size), team.spaces(i, region)
        crowd = team.crowds[i] or frozenset()
        for space in left:
            if space not in entered:
                next(stay for stay in reversed(self.stays[space]) if stay[0] == i)[1] = place
        for space, others in entered.items():
            if space not in left:
                for j, after in reversed(self.stays[space]):
                    if j in others:
                        found[j] = max(after, found.get(j, 0))
                    if j in crowd and space == region:
                        break
                self.stays[space].append([i, 0])
        return found


def _because(floor: Floor, before: Joint, joint: Joint) -> Iterator[tuple[int, tuple[int, int]]]:
    """Yield each robot that must not leave before a need is fulfilled, and the need: robots that
    act (for a part: until its need is next), and robots whose goals then count."""
    size, over = floor.team.size, _over(floor, joint) - _over(floor, before)
    for g in floor.open(before.stages):
        stages, met = before.stages, joint.stages[g].need
        while stages[g].need < met:  # one step may be enough for several needs
            regions = floor.need(g, stages).regions
            acting = [j for j in floor.able(g, stages) if regions >> joint.poses[j] % size & 1]
            yield from ((j, (floor.gates[g], met)) for j in acting)
            stages = floor.advanced(g, stages, acting)
        parts = joint.stages[g].done - stages[g].done
        yield from ((j, (floor.gates[g], met)) for j in parts)
    for j in floor.robots if over else ():
        if j in floor.keeping:
            continue
        member = floor.team.members[j]
        if joint.counts[j] != restarted(member, Count(*before.counts[j]))[:2]:
            yield from ((j, what) for what in _whole(floor, over))


def acting_first(floor: Floor, joint: Joint, state: State, plan: Plan) -> Plan:
    """Return a plan from ``joint`` (``joint_now``) in which no robot leaves before it has completed
    the actions that it can do where it is. The plan presumes these actions."""
    before, ways = joint._replace(stages=stages_of(floor, state)), [*plan.ways]
    for j, need in _because(floor, before, joint):
        for leaving in ways[j][1:2]:
            later = leaving._replace(needs=leaving.needs | {need})
            ways[j] = (ways[j][0], later, *ways[j][2:])
    return replace(plan, ways=tuple(ways))


def _whole(floor: Floor, over: Iterable[int]) -> set[tuple[int, int]]:
    return {(k, len(floor.team.obstacles[k].needs)) for k in over}


def _over(floor: Floor, joint: Joint) -> frozenset[int]:
    open_ = floor.open(joint.stages)
    return frozenset(k for g, k in enumerate(floor.gates) if g not in open_)


def _are_met(state: State, needs: Iterable[tuple[int, int]]) -> bool:
    found = ((state.obstacles[k], number) for k, number in needs)
    return all(each.state is Is.OVER or each.stage.need >= number for each, number in found)


def next_step(team: Team, state: State, i: int) -> int | None:
    """Return the pose to which the plan lets a robot step now; None if the robot waits or its path
    has ended."""
    plan, robot = state.plan, state.robots[i]
    if plan is None or robot.at + 1 >= len(plan.ways[i]):
        return None
    waypoint = plan.ways[i][robot.at + 1]
    over = frozenset(k for k in plan.foreseen if state.obstacles[k].state is Is.OVER)
    if any(state.robots[j].at < place for j, place in waypoint.after) or not _are_met(
        state, waypoint.needs
    ):
        return None
    if over == waypoint.over and not _has_counted(team, i, robot.own, waypoint.progress):
        return None  # the robot stays and counts
    if is_charging(team, state, i, waypoint):
        return None
    return waypoint.pose if waypoint.pose % team.size not in closed(team, state, i) else None


def is_charging(team: Team, state: State, i: int, waypoint: Waypoint) -> bool:
    """Return whether a robot waits for charge before its next step: on a charger, or off the
    chargers without charge."""
    energy, robot = team.members[i].energy, state.robots[i]
    if energy is None:
        return False
    if not energy.charging(robot.pose):
        return robot.charge < energy.battery.move
    return state.time < waypoint.tick or robot.charge < _leaving(team, state, energy, waypoint)


def _leaving(team: Team, state: State, energy: Energy, waypoint: Waypoint) -> float:
    """Return the charge with which a robot leaves a charger: the capacity if its plan ignores
    charges and no robot brings batteries."""
    battery = energy.battery
    alone = blind(state) and not team.scenario.flat
    return battery.capacity if alone else max(battery.move, waypoint.charge)


def starving(team: Team, state: State) -> list[int]:
    """Return the robots off the chargers that must go to one now, by increasing spare charge. Each
    is idle, and has less charge than its plan foresees, or its plan has ended or ignores
    charges."""
    plan, found = state.plan, list[tuple[float, int]]()
    for i in team.charged:
        spare, robot = _spare(team, state, i), state.robots[i]
        if spare is None or not robot.idle or not robot.active:
            continue
        if not blind(state) and next_step(team, state, i) is not None:
            continue
        late = (
            plan is None
            or robot.charge < _foreseen(state, i)
            or (UNKNOWN in plan.charges and at_end(state, team.sharing))
        )
        if late and -_slack(team, state, i) <= spare <= EARLY:  # a charger is still in reach
            found.append((spare, i))
    return [i for _, i in sorted(found)]


def blind(state: State) -> bool:
    """Return whether the plan in force ignores charges."""
    return state.plan is not None and not state.plan.charges


def _foreseen(state: State, i: int) -> float:
    """Return the charge that the plan predicts for a robot when it leaves its present waypoint, or
    at the end of the plan; ``NEVER`` if the plan ignores charges."""
    plan = state.plan
    assert plan is not None
    way = plan.ways[i][state.robots[i].at + 1 :][:1]
    return NEVER if blind(state) else way[0].charge if way else plan.charges[i]


def drains(team: Team, state: State, i: int) -> bool:
    """Return whether a robot uses charge where it is, even while it waits."""
    energy = team.members[i].energy
    return (
        energy is not None and energy.battery.stay > 0 and not energy.charging(state.robots[i].next)
    )


def _spare(team: Team, state: State, i: int) -> float | None:
    """Return the spare charge of a robot off the chargers: what remains after its path to a charger
    and a few further steps. None if its stay uses no charge, or it cannot reach a charger."""
    energy, robot = team.members[i].energy, state.robots[i]
    if energy is None or not drains(team, state, i):
        return None
    steps = energy.graph.distances(energy.chargers, floor_now(team, state).floors[i])[robot.pose]
    return (
        robot.charge - steps * energy.battery.move - _slack(team, state, i) if steps < FAR else None
    )


def _slack(team: Team, state: State, i: int) -> float:
    """Return the charge of a few steps, or waits for other robots' steps, and an ample reserve if
    robots take turns at the chargers. A robot alone takes one step; two if its plan ignores
    charges, since it may step away from the chargers."""
    energy = team.members[i].energy
    assert energy is not None
    unit = max(energy.battery.stay * team.step_ticks[i], energy.battery.move)
    turns = len(team.charged) > len(team.scenario.chargers)
    steps = 4 if team.members[i].rivals else 1 + blind(state)
    return steps * unit + turns * AMPLE * energy.battery.capacity


def charging_ends(team: Team, state: State) -> float | None:
    """Return the next time in a live run at which a robot on a charger is charged enough, or one
    off the chargers must go there or runs out of charge; None: never."""
    times, low = [], [state.robots[i].charge for i in starving(team, state)]
    for i, (member, robot) in enumerate(zip(team.members, state.robots, strict=True)):
        energy = member.energy
        if energy is None or robot.to is not None or not robot.active:
            continue
        charge, move = robot.charge, energy.battery.move
        if energy.charging(robot.pose):
            way = state.plan.ways[i][robot.at + 1 : robot.at + 2] if state.plan else ()
            full = energy.battery.capacity  # then, or with ample charge, it makes room
            least = max((_leaving(team, state, energy, waypoint) for waypoint in way), default=full)
            waits = [waypoint.tick - state.time for waypoint in way]
            left = max([(least - charge) / energy.battery.charge, *waits])
            if low and (more := energy.yields(min(low)) - charge) > 0:
                left = min(left, more / (energy.battery.charge + energy.battery.stay))
        elif energy.battery.stay:
            spare = _spare(team, state, i)
            marks = [charge - move, *(() if spare is None else (spare, spare + EARLY))]
            if state.plan is not None and state.plan.charges:
                late = charge - _foreseen(state, i) + 2 * EARLY
                marks += [max(late, AGAIN * energy.battery.stay)] if late > EARLY else []
            left = min((m for m in marks if m > EARLY), default=0) / energy.battery.stay
        else:
            continue
        if left > 0:
            times.append(state.time + left + EARLY)
    return min(times, default=None)


def charges_now(team: Team, state: State) -> tuple[float, ...]:
    """Return the charge of each robot after its present step; empty if no robot has a battery."""
    pairs = zip(team.members, state.robots, strict=True) if team.charged else ()
    return tuple(
        r.charge if m.energy is None or r.to is None else m.energy.battery.stepped(r.charge)
        for m, r in pairs
    )


def _has_counted(team: Team, i: int, own: Count, due: tuple[int, int]) -> bool:
    pursuit = team.members[i].pursuit
    if pursuit.settles:  # the robot returns to its last target and counts there
        return own.memory >= due[0]
    if pursuit.in_turn:
        return own.met >= due[1]
    return (own.met, own.memory & due[0]) >= (due[1], due[0])


def closed(team: Team, state: State, i: int) -> frozenset[int]:
    """Return the regions that a robot must not enter now because of known obstacles."""
    pairs = zip(team.obstacles, state.obstacles, strict=True)
    known = ((one, each) for one, each in pairs if each.stands)
    return frozenset(one.region for one, each in known if one.closes(i, each))


def at_end(state: State, among: Iterable[int]) -> bool:
    """Return whether the robots of the plan have completed their paths."""
    plan = state.plan
    return plan is not None and all(state.robots[i].at + 1 >= len(plan.ways[i]) for i in among)


def stuck(team: Team, state: State, helped: frozenset[int]) -> bool:
    """Return whether a plan cannot continue by itself: none of its robots moves, acts, can act or
    step, counts by staying, waits for charge, or waits for a robot with a strategy to resolve an
    obstacle of ``helped``."""
    plan = state.plan
    assert plan is not None
    at = standing(team, state, moving=False)
    for i in team.sharing:
        robot = state.robots[i]
        if not robot.active:
            continue
        if not robot.idle or next_step(team, state, i) is not None or will_count(team, state, i):
            return False
        if acts_on(team, state, at, i):
            return False
        way = plan.ways[i][robot.at + 1 :]
        energy = team.members[i].energy
        on = energy is not None and energy.charging(robot.pose)
        if on and way and is_charging(team, state, i, way[0]):
            return False
        shut = [k for k in helped if state.obstacles[k].state is Is.OPEN]
        regions = {team.obstacles[k].region for k in shut}
        for waypoint in way:
            if any(k in helped for k, _ in waypoint.needs) or waypoint.pose % team.size in regions:
                return False
    return True


def awaited(team: Team, state: State) -> frozenset[int]:
    """Return the obstacles for which the next steps of a plan wait."""
    plan = state.plan
    assert plan is not None
    found = set[int]()
    for i in team.sharing:
        for waypoint in plan.ways[i][state.robots[i].at + 1 : state.robots[i].at + 2]:
            found |= {k for k, n in waypoint.needs if state.obstacles[k].stage.need < n}
            there = waypoint.pose % team.size
            here = (k for k in plan.foreseen if team.obstacles[k].region == there)
            found |= {k for k in here if team.obstacles[k].closes(i, state.obstacles[k])}
    return frozenset(found)


def preview(floor: Floor, plan: Plan, first: Joint) -> list[Joint] | None:
    """Return the joint state after each tick of an undisturbed execution; None if this does not
    complete the plan. Robots take turns and step as soon as they may."""
    at, ticks, joint = [0] * len(plan.ways), [first], first
    number = {k: g for g, k in enumerate(floor.gates)}
    while going := [i for i in floor.robots if at[i] + 1 < len(plan.ways[i])]:
        before = ticks[-1]
        for i in going:
            waypoint = plan.ways[i][at[i] + 1]
            if any(at[j] < place for j, place in waypoint.after):
                continue
            if any(joint.stages[number[k]].need < n for k, n in waypoint.needs):
                continue
            if floor.allowed(i, joint.stages) >> waypoint.pose & 1:
                joint, at[i] = floor.after(joint, i, waypoint.pose), at[i] + 1
        if joint is before:
            return None
        ticks.append(joint)
    return ticks


def joint_now(state: State, floor: Floor) -> Joint:
    """Return the present joint state, in which a robot in transit is at its destination."""
    counts = tuple((r.own.memory, r.own.met) for r in state.robots)
    arriving = [i for i, robot in enumerate(state.robots) if robot.to is not None]
    poses = tuple(robot.next for robot in state.robots)
    return floor.settled(poses, counts, stages_of(floor, state), arriving)
