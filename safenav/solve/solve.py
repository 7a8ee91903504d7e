"""SOLVE: an order of resolutions after which every robot can continue if robots never collide
(docs/coordination.md).

Each robot is modelled as the set of poses in which it may choose to be. In a step, a group fulfils
a need, or one robot does its part. Resolutions only open paths, so a step whose robots can return
to all their poses loses nothing and is taken immediately. Only irreversible steps branch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import combinations, takewhile
from math import inf

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.solve.room import too_many
from safenav.team.floor import Floor, Stages
from safenav.team.team import Team
from safenav.world.map import Region
from safenav.world.poses import Mask, bits

MOST_NODES = 20_000
MOST_GROUPS, MOST_TIMED = 100, 3
"""Maximum number of groups to compare for a need, and of robots in a group to time."""
Rank = tuple[object, ...]


class BudgetError(Exception):
    """An exhausted search budget: there is no verdict."""


class Step(Struct, frozen=True):
    """A ``group`` fulfils the next need of obstacle ``g``, each robot in a pose of ``at``."""

    g: int
    group: tuple[int, ...]
    at: tuple[Mask, ...]
    lossless: bool = False


class Sets(Struct, frozen=True):
    """The set of poses in which each robot may choose to be, and the stages of the obstacles."""

    floor: Floor
    sets: tuple[Mask, ...]
    stages: Stages

    def reach(self, i: int, poses: Mask) -> Mask:
        return self.floor.graphs[i].closure(poses, self.floor.allowed(i, self.stages))

    def spots(self, i: int, regions: Mask) -> Mask:
        return self.reach(i, self.sets[i]) & self.floor.graphs[i].poses_on(regions)

    def alive(self, i: int) -> bool:
        allowed = self.floor.allowed(i, self.stages)
        return bool(self.reach(i, self.sets[i]) & self.floor.live(i, allowed))

    def done(self, wanted: frozenset[int]) -> bool:
        return not wanted & {*self.floor.open(self.stages)} and all(
            map(self.alive, self.floor.robots)
        )

    def placed(self, i: int, at: Mask) -> Sets:
        return replace(self, sets=(*self.sets[:i], at, *self.sets[i + 1 :]))

    def after(self, step: Step) -> Sets:
        sets = list(self.sets)
        for i, at in zip(step.group, step.at, strict=True):
            sets[i] = at
        return Sets(self.floor, tuple(sets), self.floor.took_part(step.g, self.stages, step.group))


def around(floor: Floor, poses: tuple[int, ...], stages: Stages) -> Sets:
    """Return the poses that each robot can reach and from which it can return to ``poses``."""
    found = (floor.graphs[i].around(1 << p, floor.allowed(i, stages)) for i, p in enumerate(poses))
    return Sets(floor, tuple(found), stages)


class Solver:
    """Solver of one floor. It caches its results."""

    def __init__(self, floor: Floor) -> None:
        self.floor = floor
        self._known: dict[tuple[Sets, frozenset[int]], bool] = {}
        self._nodes = 0

    def feasible(self, now: Sets, wanted: frozenset[int] = frozenset()) -> bool:
        self._nodes = 0
        return self._steps(now, None, wanted) is not None

    def plan(
        self, now: Sets, poses: tuple[int, ...], wanted: frozenset[int]
    ) -> tuple[Step, ...] | None:
        """Return the steps that resolve ``wanted`` by the nearest robots or those that already
        help; None if there are none. They resolve other obstacles only if that is necessary for
        ``wanted``."""
        self._nodes = 0
        origins = replace(now, sets=tuple(1 << pose for pose in poses))
        return self._steps(now, origins, wanted)

    def _steps(
        self, now: Sets, origins: Sets | None, wanted: frozenset[int], before: tuple[Step, ...] = ()
    ) -> tuple[Step, ...] | None:
        key = now, wanted
        if self._known.get(key) is False or (origins is None and key in self._known):
            return () if self._known[key] else None
        self._nodes += 1
        if self._nodes > MOST_NODES:
            raise BudgetError
        found: tuple[Step, ...] | None = () if now.done(wanted) else None
        for step in options(now, origins, before, wanted) if found is None else ():
            then = origins and origins.after(step)
            rest = self._steps(now.after(step), then, wanted, (*before, step))
            found = None if rest is None else (step, *rest)
            if found is not None or step.lossless:
                break  # what fails after a lossless step fails after every step
        self._known[key] = found is not None
        return found


def options(
    now: Sets,
    origins: Sets | None,
    before: tuple[Step, ...] = (),
    wanted: frozenset[int] = frozenset(),
) -> list[Step]:
    """Return the possible next steps, those for ``wanted`` obstacles first, then by rank
    (docs/coordination.md, Helpers). Without ``origins``, return only one lossless step, if there is
    one. ``before``: the earlier steps."""
    found: list[tuple[Rank, Step]] = []
    for g in now.floor.open(now.stages):
        ranked = list(_options(g, now, origins, before))
        found += ranked
        if origins is None and (sure := [step for _, step in ranked if step.lossless]):
            return sure[:1]
    found.sort(key=lambda each: (each[1].g not in wanted, each[0]))
    return [step for _, step in found]


def _options(
    g: int, now: Sets, origins: Sets | None, before: tuple[Step, ...]
) -> Iterator[tuple[Rank, Step]]:
    """Yield the steps for one obstacle, each with its rank (the best step has the least)."""
    floor, stages = now.floor, now.stages
    need, then = floor.need(g, stages), replace(now, stages=floor.advanced(g, stages))
    places: dict[int, Mask] = {}
    times: dict[int, float] = {}

    @cache
    def when(i: int, there: Mask) -> float:
        return 0 if origins is None else time_of(g, i, there, now, origins)

    for i in floor.able(g, stages):
        if there := now.spots(i, need.regions):
            places[i] = there
            times[i] = when(i, there)
    helps = dict(floor.helping)
    helping = helps.get(g, ())
    others = (o for o in floor.open(stages) if o != g and _attainable(o, helps.get(o, ()), now))
    elsewhere = {i for o in others for i in helps[o]}
    elsewhere |= {i for step in before if step.g != g for i in step.group}
    back = {i: not now.sets[i] & ~then.reach(i, places[i]) for i in places}
    able = sorted(
        places, key=lambda i: (not back[i], i in elsewhere, i not in helping, times[i], i)
    )
    commits, missing = floor.commits(g, stages), max(1, floor.missing(g, stages))
    for number, group in enumerate(combinations(able, missing)):
        each = [times[i] for i in group]
        met = gathered(floor, group, places, when) if need.together else 0
        if met is None:
            continue
        lossless = all(back[i] for i in group) and not commits
        strangers, busy = sum(i not in helping for i in group), sum(i in elsewhere for i in group)
        last = max(met, *each)
        late = bool(floor.left) and last > floor.left[g]
        yield (
            (False, not lossless, g, late, busy, strangers, last, sum(each), group),
            Step(g, group, tuple(places[i] for i in group), lossless),
        )
        if lossless and not late and (last == max(each) or number >= MOST_GROUPS):
            return  # no other group is better, or there are too many
    for i in able if missing > 1 and not need.together else ():
        lossless = not now.sets[i] & ~now.reach(i, places[i]) and not commits
        yield ((True, not lossless, times[i], g, i), Step(g, (i,), (places[i],), lossless))


def _attainable(g: int, helpers: tuple[int, ...], now: Sets) -> bool:
    """Return whether all helpers of an obstacle can reach the regions of its next need."""
    need = now.floor.need(g, now.stages) if helpers else None
    return need is not None and all(now.spots(i, need.regions) for i in helpers)


def time_of(g: int, i: int, there: Mask, now: Sets, origins: Sets) -> float:
    """Return a robot's bid: the time (ticks; live: seconds) of its shortest path to a region of the
    next need and through regions of the later needs that the same robots must fulfil."""
    floor, graph, allowed = now.floor, now.floor.graphs[i], now.floor.allowed(i, now.stages)
    later = floor.gate(g).needs[now.stages[g].need + 1 :]
    goals = (graph.poses_on(need.regions) for need in takewhile(lambda need: need.same, later))
    return graph.steps_through(origins.sets[i], [there, *goals], allowed) * floor.team.step_times[i]


def gathered(
    floor: Floor,
    group: tuple[int, ...],
    places: Mapping[int, Mask],
    when: Callable[[int, Mask], float] = lambda *_: 0,
) -> float | None:
    """Return the earliest time at which a group can stand in regions of a need together, with
    rivals in different regions and at most one robot in each zone; None if it cannot. ``when``: the
    time at which a robot can be in some poses (large groups: 0)."""
    members, free = floor.team.members, {i: floor.graphs[i].regions_of(places[i]) for i in group}
    for i in group:
        crowd = [i]
        for j in group:
            crowd += [j] if members[j].rivals.issuperset(crowd) else []
        if too_many([[*bits(free[j])] for j in crowd]):
            return None  # this is faster than the search below
    timed = when if len(group) <= MOST_TIMED else lambda *_: 0
    ranked = {
        i: sorted((timed(i, places[i] & floor.graphs[i].on({r})), r) for r in bits(free[i]))
        for i in group
    }
    return _apart(floor.team, group, ranked, (0,) * len(members), inf)


def _apart(
    team: Team,
    group: tuple[int, ...],
    free: Mapping[int, Sequence[tuple[float, Region]]],
    at: tuple[Mask, ...],
    most: float,
) -> float | None:
    """Return the least time below ``most`` at which a group can stand in its ``free`` regions (with
    their times, in order) while other robots are in ``at``; None if it cannot."""
    if not group:
        return 0
    i, *rest = group
    shut, found = team.members[i].closed(at), None
    for time, region in free[i]:
        if time >= most:
            break
        if not shut >> region & 1:
            now = (*at[:i], 1 << region, *at[i + 1 :])
            then = _apart(team, (*rest,), free, now, most)
            if then is not None:
                most = found = max(time, then)
    return found


# Dead ends even if robots never collide: the closure and irreversible choices.


class Closure(Struct, frozen=True):
    """All that the team can resolve and reach. ``never``: open obstacles that are never resolved;
    ``stuck``: those whose next need can never be fulfilled; ``reach``, ``live``: each robot's
    reachable poses and whether it can continue, once the other obstacles are resolved."""

    never: tuple[int, ...]
    stuck: tuple[int, ...]
    reach: tuple[Mask, ...]
    live: tuple[bool, ...]
    left: Stages


def closure_of(now: Sets) -> Closure:
    """Return the closure of ``now``, a least fixpoint: a need can be fulfilled if enough able
    robots can reach its regions after all other possible resolutions."""
    floor, given, grown = now.floor, now.stages, True
    while grown:
        grown = False
        for g in floor.open(now.stages):
            if _enough(g, now, given):
                now, grown = replace(now, stages=floor.advanced(g, now.stages)), True
    never = floor.open(now.stages)
    return Closure(
        never,
        tuple(g for g in never if now.stages[g].need == given[g].need),
        tuple(now.reach(i, poses) for i, poses in enumerate(now.sets)),
        tuple(i not in floor.robots or now.alive(i) for i in range(len(now.sets))),
        now.stages,
    )


def _enough(g: int, now: Sets, given: Stages) -> bool:
    """Return whether enough robots can reach the regions of the next need and of the earlier needs
    that the same robots must fulfil."""
    floor, stages = now.floor, now.stages
    needs, number = floor.gate(g).needs, stages[g].need
    begin = number
    while begin > given[g].need and needs[begin].same:
        begin -= 1
    able = []
    for i in floor.able(g, stages):
        there = [bool(now.spots(i, need.regions)) for need in needs[begin : number + 1]]
        if begin == given[g].need < number and i in given[g].done:
            there[0] = True
        elif i in needs[begin].strays:
            continue
        able += [i] if all(there) else []
    return len(able) >= floor.missing(g, stages)


def dead_end(now: Sets) -> tuple[Closure | None, tuple[Step, ...]]:
    """Return the dead end of a state in which SOLVE fails: a closure in which some robot can never
    continue (None: no step is possible), and the steps to it, lossless ones if possible."""
    taken: tuple[Step, ...] = ()
    while all((closure := closure_of(now)).live):
        steps = options(now, None)
        if not steps:
            return None, taken
        step = next((step for step in steps if step.lossless), steps[0])
        now, taken = now.after(step), (*taken, step)
    return closure, taken


# Current duties: the served requests, the plan for all of them, and its first steps.


class Duty(Struct, frozen=True):
    """A robot's duty. ``goal``: the poses in which it can fulfil the next need of obstacle ``g``
    such that all robots can continue."""

    g: int
    group: tuple[int, ...]
    goal: Mask
    stays: bool


class Settlement(Struct, frozen=True):
    """The present duties, and the ``served`` gates in order (other gates count as walls). ``safe``:
    the poses to which each robot may go (None: not computed). ``plan``: all steps, of which duties
    are the first. ``hopeless``: some robot can never continue, and the other fields are void."""

    served: tuple[int, ...] = ()
    duties: dict[int, Duty] = field(default_factory=dict)
    safe: tuple[Mask | None, ...] = ()
    plan: tuple[Step, ...] = ()
    hopeless: bool = False


def settle(
    solver: Solver,
    poses: tuple[int, ...],
    stages: Stages,
    aside: frozenset[int],
    careful: frozenset[int],
) -> Settlement:
    """Return the duties of robots in these poses. ``aside``: gates that no joint plan serves;
    ``careful``: robots whose strategies need the safe poses."""
    floor, now = solver.floor, around(solver.floor, poses, stages)
    if not solver.feasible(now):
        return Settlement(hopeless=True)
    served: list[int] = []
    for g in floor.open(stages):
        if g not in aside and solver.feasible(now, frozenset({*served, g})):
            served.append(g)
    wanted = frozenset(served)
    plan = solver.plan(now, poses, wanted)
    assert plan is not None, "a feasible mission has a plan"
    duties = _present_duties(solver, plan, now, wanted)
    safe = tuple(
        _safe(solver, i, now, wanted) | (duties[i].goal if i in duties else 0)
        if i in careful
        else None
        for i in range(len(poses))
    )
    return Settlement(tuple(served), duties, safe, plan)


def _present_duties(
    solver: Solver, plan: tuple[Step, ...], now: Sets, wanted: frozenset[int]
) -> dict[int, Duty]:
    """Return the steps of a plan that are duties now: no earlier step is for their obstacle or
    robots, and all their robots can get there."""
    duties: dict[int, Duty] = {}
    begun: set[int] = set()
    busy: set[int] = set()
    for step in plan:
        need = now.floor.need(step.g, now.stages)
        pairs = zip(step.group, step.at, strict=True)
        at = tuple(now.spots(i, need.regions) & there for i, there in pairs)
        ready = step.g not in begun and not busy & {*step.group} and all(at)
        begun.add(step.g)
        busy.update(step.group)
        after = now.after(replace(step, at=at))
        for i, there in zip(step.group, at, strict=True) if ready else ():
            goal = _lasting(solver, i, there, after, wanted) or there
            stays = need.together or len(step.group) > 1
            duties[i] = Duty(step.g, step.group, goal, stays)
    return duties


def _safe(solver: Solver, i: int, now: Sets, wanted: frozenset[int]) -> Mask:
    """Return the poses to which a robot may go: the robot can return, or the team can continue."""
    here = now.sets[i]
    return here | _lasting(solver, i, now.reach(i, here) & ~here, now, wanted)


def _lasting(solver: Solver, i: int, candidates: Mask, now: Sets, wanted: frozenset[int]) -> Mask:
    """Return the candidates from which ``wanted`` can be served and all robots can continue. One
    check decides for many poses: poses that reach a good one are good, and poses that a bad one
    reaches are bad."""
    graph, allowed = now.floor.graphs[i], now.floor.allowed(i, now.stages)
    good, left = 0, candidates
    while left:
        pose = 1 << next(bits(left))
        if solver.feasible(now.placed(i, graph.around(pose, allowed)), wanted):
            found = graph.back(pose, allowed | pose) & left | pose
            good |= found
            left &= ~found
        else:
            left &= ~(graph.closure(pose, allowed) | pose)
    return good & candidates
