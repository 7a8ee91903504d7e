"""Next acts for requests with a deadline: the first steps of coordination's plan, from the
search of ``schedule`` (docs/deadlines.md). After each act the team must be able to continue.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.deadlines.bound import NEVER, BoundMoment, BoundObstacle, BoundRobot
from safenav.runtime.deadlines.schedule import Acts, Scheduler, leads_through, possible
from safenav.runtime.resolution.problem import BudgetExhaustedError, Floor, Stages
from safenav.runtime.resolution.solve import Plan, PoseSets, Solver, Step
from safenav.world.map import Region
from safenav.world.poses import Mask


class Dues(Struct, frozen=True):
    """The deadlines. ``by``: the last tick for each obstacle (by number); ``mission``: whether the
    mission has a deadline; ``now``: the last completed turn; ``ready``: the tick at whose end each
    robot is in its pose, or arrives there; ``leaves``: departure poses of robots in transit by
    steps of fixed duration. ``suspected``: for each robot the regions that may hold an obstacle
    that it must not enter (empty: no suspects)."""

    by: Mapping[int, int]
    mission: bool
    now: int
    ready: Sequence[int]
    leaves: Sequence[int | None]
    suspected: Sequence[Mask] = ()


class InTime(Struct, frozen=True):
    """``acts`` in the order of their turns; ``steps``: the same as steps of a coordination plan;
    ``beyond``: obstacles that no order of acts resolves by their deadline, to be resolved as soon
    as possible. ``spent``: the search for all obstacles has exhausted its budget; the acts are for
    the most urgent ones. ``ends``: the tick of the last act on each obstacle. ``around``: whether
    the robots avoid suspected obstacles, because the deadlines could not be met if they encountered
    one."""

    acts: Acts = ()
    steps: Plan = ()
    beyond: frozenset[int] = frozenset()
    spent: bool = False
    ends: Mapping[int, int] = field(default_factory=dict)
    around: bool = False

    def takers(self, floor: Floor) -> dict[str, frozenset[str]]:
        """Return the robots that may take each load whose taking is due next: those of its act; for
        a load without an act, the robots without an act."""
        if not self.acts:
            return {}
        found, idle = dict[str, frozenset[str]](), frozenset(floor.names)
        idle -= {floor.names[robot] for act in self.acts for robot in act.group}
        for gate, name in enumerate(floor.gates):
            if floor.problem.resolved(gate, floor.stages) or not floor.problem.takes(
                gate, floor.stages
            ):
                continue
            need = floor.stages[gate].need
            groups = [a.group for a in self.acts if (a.gate, a.need) == (gate, need)]
            members = frozenset(floor.names[robot] for group in groups for robot in group)
            found[name] = members or idle
        return found

    def keeps(self, gate: int, need: int, tick: int, dues: Dues) -> bool:
        """Return whether all deadlines are met if a need is met in a given tick, and later acts are
        delayed by the same amount."""
        acts = [act for act in self.acts if (act.gate, act.need) == (gate, need)]
        due = (self.ends.keys() & dues.by.keys()) - self.beyond
        if not acts or not due:
            return False
        late = max(0, tick - acts[-1].turn // len(dues.ready))
        return all(self.ends[each] + late <= dues.by[each] for each in due)

    def has_act(self, floor: Floor, robot: str) -> bool:
        return any(floor.index(robot) in act.group for act in self.acts)

    def next_at(self, floor: Floor, robot: str, region: Region) -> list[str] | None:
        """Return the obstacles on which a robot acts in its region before it acts elsewhere; None
        if it has no act."""
        mine = [act for act in self.acts if floor.index(robot) in act.group]
        found: list[str] = []
        for act in mine:
            if not floor.problem.gates[act.gate].needs[act.need].regions >> region & 1:
                break
            found.append(floor.gates[act.gate])
        return found if mine else None


def choose(solver: Solver, floor: Floor, served: frozenset[int], dues: Dues) -> InTime:
    """Choose acts that resolve the ``served`` obstacles with deadlines, in time where possible.
    Suspected obstacles count as present if a fastest path leads to one and acts around all of them
    are also in time: then no discovery makes the acts late. Otherwise they count as absent."""
    moment = moment_on(floor, dues)
    hopeful = _choose(solver, floor, served, dues, moment)
    if not any(dues.suspected) or not hopeful.acts or hopeful.beyond:
        return hopeful
    walkers = []
    for walker, regions in zip(moment.walkers, dues.suspected, strict=True):
        walls = walker.graph.poses_on(regions) & ~(1 << walker.pose)
        walkers.append(replace(walker, walls=walker.walls | walls))
    standing = replace(moment, walkers=tuple(walkers))
    if not leads_through(moment, hopeful.acts, dues.suspected):
        return hopeful
    known = possible(standing, hopeful.acts)  # by other paths as fast as these
    careful = hopeful if known else _choose(solver, floor, served, dues, standing)
    crowded = any(floor.problem.interferes(i) for act in careful.acts for i in act.group)
    if careful.spent or careful.beyond or crowded:
        return hopeful  # joint plans avoid known obstacles only
    return replace(careful, around=True)


def _choose(
    solver: Solver, floor: Floor, served: frozenset[int], dues: Dues, moment: BoundMoment
) -> InTime:
    barred = [
        gate.barred if number in served else frozenset(range(moment.count))
        for number, gate in enumerate(floor.problem.gates)
    ]

    def allowed(acts: Acts) -> bool:
        return solver.feasible(PoseSets.around(floor.problem, *after(floor, acts)), served)

    search = Scheduler(moment, floor.problem.conflicts, barred, allowed, stays=True)
    count = moment.count
    last = {gate: dues.by[gate] * count + count - 1 for gate in sorted(served & dues.by.keys())}
    urgent, spent = dict(sorted(last.items(), key=lambda one: one[1])), False
    try:
        acts, beyond = _kept(search, urgent)
    except BudgetExhaustedError:
        acts, beyond = _most_urgent(search, urgent)
        if not acts:
            return InTime(spent=True)
        spent = True
    if dues.mission and not spent:
        acts = _all_soon(search, acts, {g: t for g, t in last.items() if g not in beyond}, served)
    ends = {act.gate: act.turn // count for act in acts}
    return InTime(acts, steps_of(floor, acts), beyond, spent, ends)


def _kept(search: Scheduler, last: Mapping[int, int]) -> tuple[Acts, frozenset[int]]:
    """Return acts that resolve all obstacles by their turns; failing that, the most urgent ones by
    theirs, and the others as early as these allow. Raises BudgetExhaustedError."""
    found = search.in_time(last)
    if found is not None:
        return found, frozenset()
    in_time: dict[int, int] = {}
    acts: Acts = ()
    for gate, turn in last.items():
        found = search.in_time({**in_time, gate: turn})
        if found is not None:
            in_time[gate], acts = turn, found
    beyond = frozenset(last.keys() - in_time.keys())
    for gate in [gate for gate in last if gate in beyond]:
        turn, found = search.soonest(gate, in_time)
        if turn < NEVER:
            in_time[gate], acts = turn, found
    return acts, beyond


def _most_urgent(search: Scheduler, last: Mapping[int, int]) -> tuple[Acts, frozenset[int]]:
    """Return acts that resolve obstacles by their turns, added one by one in order of urgency, each
    with a separate budget; and the remaining obstacles."""
    in_time: dict[int, int] = {}
    acts: Acts = ()
    for gate, turn in last.items():
        search.begin_again()
        with suppress(BudgetExhaustedError):
            found = search.in_time({**in_time, gate: turn})
            if found is not None:
                in_time[gate], acts = turn, found
    return acts, frozenset(last.keys() - in_time.keys())


def _all_soon(
    search: Scheduler, acts: Acts, last: Mapping[int, int], served: frozenset[int]
) -> Acts:
    """Return acts with the last resolution as early as the search finds: rounds restart with each
    resolution."""
    turn = NEVER
    try:
        while True:
            due = {gate: min(last.get(gate, NEVER), turn - 1) for gate in served}
            better = search.in_time(due)
            if not better:
                return acts
            acts, turn = better, better[-1].turn
    except BudgetExhaustedError:
        return acts


def moment_on(floor: Floor, dues: Dues) -> BoundMoment:
    """Return the state for the search; steps of random duration take their maximum."""
    problem = floor.problem
    walkers = []
    robots = zip(problem.members, floor.poses, dues.ready, dues.leaves, strict=True)
    for member, pose, ready, leaves in robots:
        can, walls = (member.ticks, member.capabilities), member.graph.everywhere & ~member.floor
        walker = BoundRobot(member.graph, pose, ready, *can, walls, leaves, ready, member.room)
        walkers.append(walker)
    opens = map(BoundObstacle, problem.gates, floor.stages)
    return BoundMoment(tuple(walkers), tuple(opens), dues.now)


def after(floor: Floor, acts: Acts) -> tuple[tuple[int, ...], Stages]:
    """Return the robots' poses, and the stage of each obstacle, after some acts."""
    poses, stages = list(floor.poses), floor.stages
    for act in acts:
        for robot, pose, came in zip(act.group, act.poses, act.came, strict=True):
            poses[robot] = poses[robot] if came is None else pose
        stages = floor.problem.acted(act.gate, stages, act.group)
    return tuple(poses), stages


def spot_of(floor: Floor, robot: int, pose: int) -> Mask:
    """Return the poses in which a robot must act so that it is in time for its next act; if it may
    have to let others pass, all poses of that region."""
    if floor.problem.interferes(robot):
        graph = floor.problem.members[robot].graph
        return graph.poses_on(1 << pose % graph.size)
    return 1 << pose


def steps_of(floor: Floor, acts: Acts) -> Plan:
    """Return one step per need, with all robots that take part in it. A robot that acts again later
    acts first in the pose that the search chose, since the time of its next act depends on it."""
    found: dict[tuple[int, int], Step] = {}
    for number, act in enumerate(acts):
        regions = floor.problem.gates[act.gate].needs[act.need].regions
        again = {robot for later in acts[number + 1 :] for robot in later.group}
        at = []
        for robot, pose in zip(act.group, act.poses, strict=True):
            graph = floor.problem.members[robot].graph
            at.append(spot_of(floor, robot, pose) if robot in again else graph.poses_on(regions))
        before = found.get((act.gate, act.need))
        group, places = act.group, tuple(at)
        if before is not None:
            group, places = (*before.group, *group), (*before.at, *places)
        found[act.gate, act.need] = Step(act.gate, act.need, group, places)
    return tuple(found.values())
