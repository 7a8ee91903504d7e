"""Shorter plans, in which each robot in turn gets the earliest path past the others' paths.

Searches count steps; among their plans, the fastest is chosen.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import reduce
from itertools import chain, combinations, pairwise, product
from math import inf
from operator import and_
from typing import NamedTuple

from safenav.components import reached
from safenav.plan.course import Course, cost, course_of, timed
from safenav.plan.order import plan_of, preview
from safenav.plan.search import FEWEST, completes
from safenav.team.floor import Floor, Joint
from safenav.team.state import Plan
from safenav.world.poses import Mask, bits, region_mask

REPEATS = 4
FEW, LITTLE = 12, 0.02
"""More than ``FEW`` robots: stop after a round that saves at most ``LITTLE`` of the ticks."""
MOST_CELLS = 40_000
MUCH = 1.5


Via = tuple[Mask, int, bool]
"""Poses through which a robot must go; the first tick for it; whether it stays there for a tick."""


class Draft(NamedTuple):
    """A plan and the joint state after each tick if all steps take one tick (empty: the plan may
    not complete the mission). ``cost``: its time, and its numbers of steps and of turns that take
    time."""

    plan: Plan
    ticks: list[Joint]
    cost: tuple[float, int, int] = (inf, 0, 0)


def shortened(
    floor: Floor,
    states: Sequence[Joint],
    served: frozenset[int],
    kinds: Iterable[Sequence[Joint]] = (),
) -> Plan:
    """Return the cheapest plan with these states or those of a sequence of ``kinds``. It has fewer
    ticks and steps than its states if shortening succeeds soon."""
    best = _shortened(floor, states, served)
    known = {_paths(states)}
    for each in kinds:
        draft = _shown(floor, each[0], [one.poses for one in each], served)
        if draft.cost[0] < MUCH * best.cost[0] and (paths := _paths(draft.ticks)) not in known:
            known.add(paths)
            best = min(best, _shortened(floor, draft.ticks, served), key=lambda one: one.cost)
    return best.plan


def _paths(ticks: Sequence[Joint]) -> tuple[tuple[int, ...], ...]:
    return tuple(joint.poses for joint in ticks)


def _ways(ticks: Sequence[Joint]) -> list[list[int]]:
    """Return, for each robot, its pose at each tick."""
    return [[*way] for way in zip(*(joint.poses for joint in ticks), strict=True)]


def _shortened(floor: Floor, states: Sequence[Joint], served: frozenset[int]) -> Draft:
    """Return the plan with these states after its robots have received faster paths."""
    best = _shown(floor, states[0], [joint.poses for joint in states], served)
    for _ in range(REPEATS if best.ticks else 0):
        ends = [_moves(floor, i, way)[-1] for i, way in enumerate(_ways(best.ticks))]
        order = sorted(floor.robots, key=lambda i: -ends[i])
        before, tries = best, [(order, False)]
        if len(order) <= FEW:  # also one at a time: together they may disturb each other
            tries += [([i], False) for i in order]
            first = order if len(order) <= FEWEST else order[:1]
            tries += [([i, j], True) for i in first for j in order if i != j]
        for group, yields in tries:
            if (ways := _rerouted(floor, best.ticks, group, yields=yields)) is not None:
                best = _better(floor, best, ways, served) or best
            elif group is order:
                break  # no single robot finds a better route either
        best = _without_loops(floor, best, served) or best
        least = LITTLE * before.cost[0] if len(order) > FEW else 0
        if best is before or before.cost[0] - best.cost[0] < least:
            break
    return best


def coupled(floor: Floor) -> Iterator[tuple[int, ...]]:
    """Yield the groups of robots that may have to wait for each other."""
    left, members, these = {*floor.robots}, floor.team.members, frozenset(floor.robots)
    while left:
        group = reached([min(left)], lambda i: members[i].partners & these)
        yield tuple(sorted(group))
        left -= group.keys()


def _without_loops(floor: Floor, best: Draft, served: frozenset[int]) -> Draft | None:
    """Return the plan in which robots stay, all or a few at a time, instead of leaving their poses
    and returning; None if that is not better than ``best``."""
    found = None
    for group in coupled(floor):
        few = (combinations(group, size) for size in (2, 1) if len(group) <= FEW)
        for some in dict.fromkeys((group, *chain.from_iterable(few))):
            ways = _waiting(floor, best.ticks, some)
            better = ways and _better(floor, best, ways, served)
            if better:
                found = best = better
    return found


def _waiting(floor: Floor, best: list[Joint], group: Sequence[int]) -> list[list[int]] | None:
    """Return each robot's pose at each tick after stays replace a group's loops; None if nothing
    changes. A loop remains if another robot needs a region of the group meanwhile."""
    states = [
        (joint.stages, tuple((joint.poses[i], joint.counts[i]) for i in group)) for joint in best
    ]
    last = {state: t for t, state in enumerate(states)}
    ways = _ways(best)
    t, changed = 0, False
    while t < len(best):
        until = last[states[t]]
        if until > t and any(_disturbed(floor, ways, i, group, t, until) for i in group):
            t += 1
            continue
        for i in group:
            changed |= any(pose != ways[i][t] for pose in ways[i][t:until])
            ways[i][t:until] = [ways[i][t]] * (until - t)
        t = until + 1
    return ways if changed else None


def _disturbed(
    floor: Floor, ways: list[list[int]], i: int, group: Sequence[int], begin: int, end: int
) -> bool:
    """Return whether, in ticks ``begin`` to ``end``, a robot outside ``group`` needs the region in
    which robot ``i`` is at ``begin``."""
    member, size = floor.team.members[i], floor.team.size
    place, times = ways[i][begin] % size, range(begin, end + 1)
    if any(ways[k][t] % size == place for k in member.rivals.difference(group) for t in times):
        return True
    return bool(member.zones) and any(
        floor.shut(i, [way[begin if k in group else t] for k, way in enumerate(ways)]) >> place & 1
        for t in times
    )


def earlier(course: Course) -> Course:
    """Return a faster execution with the same end, or the given one if no other is faster. All
    robots in turn, or only one, take their earliest paths. In lockstep these omit the stops if the
    charges suffice."""
    for _ in range(REPEATS):
        before, order = course, sorted(course.floor.robots, key=lambda i: -course.arrives[i][-1])
        groups = (order, *([i] for i in order))
        for group, stops in product(groups, (True,) if course.floor.team.live else (False, True)):
            ways = _rerouted(course.floor, course.states, group, course, stops=stops)
            found = None if ways is None else _recharged(course, ways)
            if found is not None and found.cost < course.cost:
                course = found
        if course is before:
            break
    return course


def _recharged(course: Course, ways: list[list[int]]) -> Course | None:
    """Return the execution with these poses at each tick and the same end; None if there is none,
    an obstacle opens too late, or the charges do not suffice."""
    states, last, energies = [course.states[0]], course.states[-1], course.energies
    full = [energies[i].battery.capacity if i in energies else 0 for i in range(len(ways))]
    for poses in zip(*(way[1:] for way in ways), strict=True):
        joint = states[-1]
        for i, after in course.floor.sequence(joint, poses):
            if not course.floor.allowed(i, joint.stages) >> after.poses[i] & 1:
                return None
            joint = after
        states.append(joint._replace(charges=tuple(full)))
    states[-1] = states[-1]._replace(charges=last.charges)
    found = course_of(course.floor, states) if states[-1] == last else None
    return None if found is None or found.failed else found


def _rerouted(
    floor: Floor,
    best: Sequence[Joint],
    who: Sequence[int],
    course: Course | None = None,
    *,
    stops: bool = True,
    yields: bool = False,
) -> list[list[int]] | None:
    """Return each robot's pose at each tick after the robots ``who``, one after the other, take
    their earliest paths with the ``stops`` of a ``course``; None if nothing changes. ``yields``:
    whether each robot ignores later ones, which avoid it (None if they cannot)."""
    ways, changed, members = _ways(best), False, floor.team.members
    shared: dict[frozenset[int], list[Mask]] = {}  # regions of crowds by tick
    size = floor.team.size
    for k, i in enumerate(who):
        crowd = None if yields else floor.team.crowds[i]
        if crowd is None:
            rivals = members[i].rivals.difference(who[k + 1 :] if yields else ())
            taken = [region_mask(at[j] % size for j in rivals) for at in zip(*ways, strict=True)]
        else:  # its rivals' regions: the crowd's without its own
            if crowd not in shared:
                every = zip(*ways, strict=True)
                shared[crowd] = [region_mask(at[j] % size for j in crowd) for at in every]
            pairs = zip(shared[crowd], ways[i], strict=True)
            taken = [mask & ~(1 << pose % size) for mask, pose in pairs]
        # A robot leaves an obstacle only the way it came.
        held = any(behind is not None for *_, behind in floor.inside[i])
        way = None if held else _earliest(floor, best, ways, i, taken, course, stops=stops)
        if way is not None and ((yields and k) or _pays(floor, i, way, ways[i])):
            if crowd is not None:
                shared[crowd] = [
                    mask | 1 << pose % size for mask, pose in zip(taken, way, strict=True)
                ]
            ways[i], changed = way, True
        elif yields:
            return None
    return ways if changed else None


def _better(
    floor: Floor, best: Draft, ways: Sequence[Sequence[int]], served: frozenset[int]
) -> Draft | None:
    """Return the plan with these poses of each robot at each tick; None if it does not complete the
    mission, or costs no less than ``best``."""
    found = _shown(floor, best.ticks[0], list(zip(*ways, strict=True)), served)
    return found if found.cost < best.cost else None


def _shown(
    floor: Floor, first: Joint, ticks: Sequence[tuple[int, ...]], served: frozenset[int]
) -> Draft:
    """Return the plan with these joint poses. Its ``ticks`` are empty unless it completes the
    mission for any durations."""
    plan, last = plan_of(floor, first, ticks)
    shown = preview(floor, plan, first)
    if shown is None or not all(completes(floor, end, served) for end in (shown[-1], last)):
        return Draft(plan, [])
    moves = (_moves(floor, i, way) for i, way in enumerate(_ways(shown)))
    steps, turns, ends = zip(*moves, strict=True)
    if {*floor.team.step_times} != {1}:
        arrives = timed(floor, plan, shown, floor.team.step_times)
        ends = tuple(each[-1] for each in arrives)
    return Draft(plan, shown, (cost(floor, ends), sum(steps), sum(turns)))


def _pays(floor: Floor, i: int, way: Sequence[int], before: Sequence[int]) -> bool:
    """Return whether a path has fewer steps, equal steps and fewer turns, or an earlier end."""
    *fewer, end = _moves(floor, i, way)
    *most, late = _moves(floor, i, before)
    return fewer < most or end < late


def _moves(floor: Floor, i: int, way: Sequence[int]) -> tuple[int, int, int]:
    """Return the numbers of steps and of turns that take time, and the tick of the last step."""
    moves, turns = [t for t in range(1, len(way)) if way[t] != way[t - 1]], 0
    if i in floor.team.turning:
        steps = [way[t] % floor.team.size - way[t - 1] % floor.team.size for t in moves]
        turns = sum(a != b for a, b in pairwise(steps))
    return len(moves), turns, moves[-1] if moves else 0


def _earliest(
    floor: Floor,
    ticks: Sequence[Joint],
    ways: Sequence[Sequence[int]],
    i: int,
    shut: Sequence[Mask],
    course: Course | None = None,
    *,
    stops: bool = True,
) -> list[int] | None:
    """Return a robot's pose at each tick on its earliest path that counts and acts as in ``ticks``;
    None if there is none. With a ``course``, it has the same last pose and (if ``stops``) the same
    stops. ``shut``: the regions to avoid at each tick."""
    graph, last = floor.graphs[i], len(ticks) - 1
    places = course.stops(i) if course is not None and stops else {}
    vias, member = _vias(floor, ticks, i, places), floor.team.members[i]
    if last * (len(vias) + 1) > MOST_CELLS:
        return None
    taken = list[Mask]()
    for t, mask in enumerate(shut):
        zones = floor.shut(i, [way[t] for way in ways]) if member.zones else 0
        taken.append(graph.poses_on(mask | zones))
    later = [0] * (last + 2)
    for t in range(last, -1, -1):
        later[t] = later[t + 1] | taken[t]
    final = floor.final(i, ticks[-1].stages) if course is None else 1 << ticks[-1].poses[i]
    cells: list[list[Mask]] = [[0] * (len(vias) + 1) for _ in ticks]
    cells[0][0] = 1 << ticks[0].poses[i]
    for t in range(last + 1):
        if t:
            free = ~(taken[t - 1] | taken[t])
            allowed = floor.allowed(i, ticks[t - 1].stages) & free
            for k, poses in enumerate(cells[t - 1]):
                if poses:
                    cells[t][k] |= poses & free | graph.forward(poses) & allowed
                    if k < len(vias) and vias[k][2]:
                        cells[t][k + 1] |= poses & free & vias[k][0]
        for k, (via, least, stop) in enumerate(vias):
            if t >= least and not stop:
                cells[t][k + 1] |= cells[t][k] & via
        if end := cells[t][-1] & final & ~later[t]:
            return _back(floor, cells, vias, t, next(bits(end)), i, taken, ticks)
    return None


def _back(
    floor: Floor,
    cells: list[list[Mask]],
    vias: list[Via],
    t: int,
    pose: int,
    i: int,
    taken: list[Mask],
    ticks: Sequence[Joint],
) -> list[int]:
    """Return the path to ``cell`` with the most stays and, if turns take time, few turns."""
    graph, way, k, step = floor.graphs[i], [pose] * (len(ticks) - t), len(vias), 0
    while t:
        free = ~(taken[t - 1] | taken[t])
        for passed in range(k, -1, -1):
            row = cells[t - 1][passed]
            if row >> pose & 1 and free >> pose & 1:
                break
            entered = floor.allowed(i, ticks[t - 1].stages) & free
            came = graph.backward(1 << pose) & row if entered >> pose & 1 else 0
            if came:
                straight = pose - step
                before = straight if straight >= 0 and came >> straight & 1 else next(bits(came))
                pose, step = before, (pose - before) * (i in floor.team.turning)
                break
            assert passed, "the cell was reached from another"
            via, _, stop = vias[passed - 1]
            assert via >> pose & 1, "the cell was reached from another"
            if stop:
                passed -= 1  # the tick of the stop
                assert cells[t - 1][passed] >> pose & 1, "it stood there"
                break
        k, t = passed, t - 1
        way.append(pose)
    return way[::-1]


def _vias(floor: Floor, ticks: Sequence[Joint], i: int, stops: Mapping[int, int]) -> list[Via]:
    """Return the poses through which a robot must go, in order: where it acts, where it counts
    goals that no later resolution voids, and where it ``stops`` (ticks by waypoint)."""
    place, since, graph, size = 0, 0, floor.graphs[i], floor.team.size
    found: list[Via] = [(1 << ticks[0].poses[i], 0, True)] * stops.get(0, 0)
    member, memory = floor.team.members[i], ticks[0].counts[i][0]
    pairs = pairwise(joint.stages for joint in ticks)
    restarts = (t for t, (a, b) in enumerate(pairs, 1) if a != b and floor.restarts(a, b))
    counts = 0 if i in floor.keeping else max(restarts, default=0)
    for t in range(1, len(ticks)):
        before, joint = ticks[t - 1], ticks[t]
        if joint.stages != before.stages:
            for g in floor.open(before.stages):
                need = floor.need(g, before.stages)
                there = floor.there(g, before.stages, [pose % size for pose in joint.poses])
                if joint.stages[g] != before.stages[g] and i in there:
                    others, least = {*there} - {i} if need.together else (), t
                    while least > since and all(
                        need.regions >> ticks[least - 1].poses[j] % size & 1 for j in others
                    ):
                        least -= 1  # the robot has to be there with all others
                    found.append((graph.poses_on(need.regions), least, False))
            if len(floor.open(joint.stages)) != len(floor.open(before.stages)):
                since = t
        if (
            t >= counts
            and joint.counts[i] != before.counts[i]
            and (goal := floor.awaited(i, before.counts[i])) >> joint.poses[i] & 1
        ):
            if not member.pursuit.in_turn:  # each target that it meets there
                goal = reduce(and_, (m for m in member.targets if m >> joint.poses[i] & 1), goal)
            elif counts:  # with the next target at that time
                goal, memory = member.targets[memory], member.pursuit.step(memory, 1 << memory)[0]
            found.append((goal, 0 if i in floor.keeping else since, False))
        if joint.poses[i] != before.poses[i]:
            place += 1
            found += [(1 << joint.poses[i], since, True)] * stops.get(place, 0)
    return found
