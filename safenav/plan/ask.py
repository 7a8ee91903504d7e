"""Search for a plan that completes the mission from a state, or for a proof of infeasibility.

``ask`` returns a plan, a proof, or None if its budget is exhausted. The result depends only on the
floor, the joint state, the served requests and the seed, by which it is cached.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import reduce
from itertools import combinations, islice, pairwise
from operator import add, or_

from msgspec import Struct
from msgspec.structs import replace

from safenav.plan.charged import ChargedSearch, Charges, least_of, raced
from safenav.plan.course import Course
from safenav.plan.order import UNKNOWN, plan_of, preview
from safenav.plan.search import FARTHEST, FIRST_BUDGET, Answer, Exhausted, Guide, Search, jammed
from safenav.plan.shorten import earlier, shortened
from safenav.solve.room import room_words, without_room
from safenav.solve.solve import Solver, settle
from safenav.team.bound import least_within
from safenav.team.floor import Floor, Joint, Stages, put
from safenav.team.state import Plan, Stage
from safenav.world.poses import FAR, Mask

WORK, WORK_OF_A_ROBOT, CHARGED_WORK, CHARGED_LEAST = 3_000_000, 60_000, 80_000, 20_000
"""Work of a search: minimum; for each robot; with charges; with charges while obstacles are open,
since the request will soon change."""
FEW_WORK, FEW_GROUPS, FEW_STATES, LEAST_WORK = 200_000, 300, 20_000, 100_000
AHEAD, MOST_AHEAD, AHEAD_CHARGED = 2, 6, 4
"""A mission of more than ``MOST_AHEAD`` rounds is planned ``AHEAD`` rounds at a time; with
batteries ``AHEAD_CHARGED``, which saves stops."""
DETOUR = 4
"""Maximum detour, in steps, to a free charger; a robot waits for the nearest one otherwise."""
READY, TRIES, LITTLE, CROWD = 3, 3, 10_000, 20
"""Limits of searches for a plan after which the team can continue: rounds, number of searches, work
for each robot, and robots."""


class Found(Struct, frozen=True):
    """A plan. ``first``: pairs of a robot and the index of the target with which it begins, for the
    robots that do not begin with their next target."""

    plan: Plan
    first: tuple[tuple[int, int], ...] = ()


class Deadlock(Struct, frozen=True):
    """A proof that no order of moves of ``robots`` completes the mission. ``memory``: the memory of
    the formulas of some robots; ``why``: the reason in words, empty if a search has proved it."""

    robots: tuple[int, ...]
    memory: Mapping[str, Mapping[str, int]] | None = None
    why: str = ""


class Unserved(Struct, frozen=True):
    """The result that the team can complete its rounds, but not also serve these open obstacles."""

    gates: tuple[int, ...]


def ask(
    floor: Floor,
    joint: Joint,
    served: tuple[int, ...],
    seed: int,
    check: Callable[[], None] = lambda: None,
    fruitless: int = 0,
) -> Found | Deadlock | Unserved | None:
    """Return a plan that completes the mission and resolves all ``served`` obstacles, a proof that
    there is none, or None if the budget is exhausted. A long mission gets a plan of its next
    rounds. Robots with deadlines continue, if possible, until all rounds are completed. ``check``
    raises if the search must end; ``fruitless``: the number of similar searches without a
    result."""
    work = max(LEAST_WORK, _work(floor) >> 4 * fruitless)
    if (none := _crowded(floor)) is not None:
        return none
    sharing = [i for i in floor.robots if i in floor.team.sharing] or floor.robots
    done = 0 if served else min(floor.rounds_done(i, joint.counts[i]) for i in sharing)
    if max(floor.wanted) - done > MOST_AHEAD:
        every = len(floor.team.members)
        part, more = (replace(floor, rounds=(done + AHEAD + k,) * every) for k in (0, 1))
        found = _continued(part, joint, served, seed, check, work)
        if not isinstance(found, Found):
            return found  # what is impossible for some rounds is impossible for all
        if _goes_on(more, joint, found, seed, check):
            return replace(found, plan=replace(found.plan, part=True))
    return _continued(floor, joint, served, seed, check, work)


def _continued(
    floor: Floor,
    joint: Joint,
    served: tuple[int, ...],
    seed: int,
    check: Callable[[], None],
    work: int,
) -> Found | Deadlock | Unserved | None:
    """Return the result of a search. In a plan, robots with deadlines continue after their last
    round until all robots have completed theirs, but delay no other robot. Resolutions restart
    rounds. Robots that wait long for them complete rounds before, and delay the end by at most a
    round."""
    found = _ask(floor, joint, served, seed, check, work)
    timed = [i for i in floor.robots if floor.team.members[i].robot.within is not None]
    if not timed or not isinstance(found, Found) or found.first:
        return found
    ticks = preview(floor, found.plan, joint)
    if ticks is None:
        return found
    pairs = enumerate(pairwise(each.stages for each in ticks), 1)
    restart = max((t for t, (a, b) in pairs if floor.restarts(a, b)), default=0)
    extra, last, later, keeping = [0] * len(floor.wanted), len(ticks) - 1, 0, set[int]()
    longest = last * max(floor.team.members[i].ticks for i in floor.robots)
    for i in timed:
        member = floor.team.members[i]
        least = least_within(member, joint.poses[i], strict=member.objective.literal)
        extra[i] = 1 + longest // least if least else 0
        if least and restart > (member.robot.within or 0) // 2:
            keeping, later = keeping | {i}, max(later, least)
    while any(extra):
        longer = replace(floor, rounds=tuple(map(add, floor.wanted, extra)))
        keeps = replace(longer, keeping=frozenset(keeping))
        further = _ask(keeps, joint, served, seed, check, work, brief=True)
        extra = [rounds // 2 for rounds in extra]
        if not isinstance(further, Found) or further.first:
            continue
        shown = (preview(longer, further.plan, joint) or [])[: last + later + 1]
        ends = (t for t, each in enumerate(shown) if floor.completed(each, frozenset(served)))
        if (done := next(ends, None)) is not None:
            plan, final = plan_of(longer, joint, [one.poses for one in shown[: done + 1]])
            if floor.completed(final, frozenset(served)):
                return Found(plan)
    return found


def _goes_on(
    more: Floor, joint: Joint, found: Found, seed: int, check: Callable[[], None], work: int = 0
) -> bool:
    """Return whether the team can complete the rounds of ``more`` after a plan. A robot that cannot
    turn back may end the plan where it has no room to turn around."""
    if not more.one_way:
        return True
    ticks = None if found.first else preview(more, found.plan, joint)
    if ticks is None:
        return False
    search = _search(more, ticks[-1], frozenset(), seed, check, work)
    return not isinstance(search.run(), Exhausted | None)


def _ask(
    floor: Floor,
    joint: Joint,
    served: tuple[int, ...],
    seed: int,
    check: Callable[[], None],
    work: int,
    *,
    brief: bool = False,
) -> Found | Deadlock | Unserved | None:
    search = _search(floor, joint, frozenset(served), seed, check, work)
    reached = answer = _answer(search, check)
    restarts = any(floor.gate(g).restarts for g in floor.open(joint.stages))
    either = (i for i in floor.robots if floor.team.members[i].either)
    may_turn = any(restarts or joint.counts[i][1] == 0 for i in either)
    if isinstance(answer, Exhausted) and may_turn:
        free = replace(floor, either=True)
        here = free.settled(joint.poses, joint.counts, joint.stages)
        answer = _answer(_search(free, here, frozenset(served), seed, check, work), check)
        if isinstance(answer, list) and not isinstance(answer, Exhausted):
            first = tuple(_first(floor, [joint, *answer]))
            counts = list(joint.counts)
            for i, memory in first:
                counts[i] = memory, 0
            begun = floor.settled(joint.poses, tuple(counts), joint.stages)
            plan = shortened(floor, [begun, *answer[1:]], frozenset(served))
            if not first:  # robots begin with other targets after a resolution, which ends the plan
                plan = replace(plan, foreseen=frozenset())
            return Found(plan, first)
    if answer is None or isinstance(answer, Deadlock):
        return answer
    if not isinstance(answer, Exhausted):
        return _found(search, answer, check, brief=brief)
    assert isinstance(reached, Exhausted)
    stages = {each.stages for each in reached if floor.completed(each, frozenset())}
    ends, possible = [{*served}.difference(floor.open(each)) for each in stages], set[int]()
    for g in served:  # in order, keep each that can be served with the kept ones
        possible |= {g} if any({*possible, g} <= end for end in ends) else set()
    if ends:
        return Unserved(tuple(g for g in served if g not in possible))
    return _deadlock(floor, joint)


def _found(search: Search, states: Answer, check: Callable[[], None], *, brief: bool) -> Found:
    """Return the plan that visits these states. Where robots cannot turn around, prefer a plan
    after which the team can continue, since a resolution may restart their rounds."""
    floor, served, members = search.floor, search.served, search.floor.team.members
    careful = floor.one_way and len(floor.robots) <= CROWD
    ready, found = replace(floor, ready=True), list[Found]()
    rounds, work = [*floor.wanted], LITTLE * len(floor.robots)
    for i in floor.robots if careful else ():  # without those that cannot reach their targets now
        able = floor.graphs[i].live(members[i].aims, floor.floors[i]) >> search.start.poses[i] & 1
        rounds[i] += able and not members[i].pursuit.settles
    more = replace(floor, rounds=tuple(rounds))
    while states is not None and not isinstance(states, Exhausted):
        moves = careful and not jammed(ready, states[-1])
        kinds = () if brief else search.alternatives(len(states))
        found.append(Found(shortened(ready if moves else floor, states, served, kinds)))
        if not careful or (moves and _goes_on(more, search.start, found[-1], 0, check, work)):
            return found[-1]
        if len(found) == TRIES:
            break
        search = _search(ready, search.start, served, len(found), check, work)
        states = search.run(READY)
    return found[0]


def _answer(search: Search, check: Callable[[], None]) -> Answer | Deadlock:
    """Return the first that exists: the result of the first search, a proof for one or two robots,
    the result of a short search, a proof for three, or the result of a long search. If robots are
    out of service, the proof for one robot comes first."""
    floor, start = search.floor, search.start
    if floor.away and (none := _few(floor, start, check, (1,))) is not None:
        return none
    if len(floor.robots) <= CROWD:
        found = search.first()
        if found is not None and not isinstance(found, Exhausted):
            return found
        if (none := _few(floor, start, check, (1, 2))) is not None:
            return none
    answer = search.run(1)
    if answer is not None:
        return answer
    return _few(floor, start, check, (1, 2, 3)) or search.run()


def ask_charged(
    floor: Floor,
    joint: Joint,
    served: tuple[int, ...],
    seed: int,
    charges: Charges,
    time: float,
    further: bool,
    check: Callable[[], None] = lambda: None,
) -> Found | None:
    """Return a plan for which the charges suffice, forever or at least until its end; None if none
    is found. A long mission gets a plan of its next rounds. ``further``: whether the mission
    continues with orders."""
    if _crowded(floor) is not None:
        return None
    sharing = [i for i in floor.robots if i in floor.team.sharing]
    # Other robots complete their rounds by their strategies.
    helpers = frozenset[int]().union(*(_helpers(floor, joint, g) for g in floor.open(joint.stages)))
    robots = tuple(i for i in floor.robots if i in sharing or i in helpers)
    done = min((floor.rounds_done(i, joint.counts[i]) for i in sharing), default=0)
    whole = max(floor.wanted) <= done + MOST_AHEAD
    most = FAR if whole else done + AHEAD_CHARGED
    rounds = tuple(min(n, most) if i in sharing else 0 for i, n in enumerate(floor.wanted))
    floor = _hopeful(replace(floor, rounds=rounds, robots=robots), joint, charges)
    extent = whole, further or not whole
    course = _charged(floor, joint, frozenset(served), seed, charges, check, extent)
    if course is None:
        return None
    ends = course.floor.completed(course.states[-1], frozenset(served))
    return Found(replace(course.planned(time), part=not (whole and ends)))


def _hopeful(floor: Floor, joint: Joint, charges: Charges) -> Floor:
    """Return the floor without the batteries of robots whose charge cannot suffice, so that plans
    spare the other batteries. Return the same floor if all or none of the charges suffice."""
    members = [*floor.team.members]
    having = [i for i in floor.robots if members[i].energy is not None]
    least = {i: least_of(floor, i, joint.poses[i], joint.counts[i]) for i in having}
    hopeless = [i for i in having if least[i] > charges[i]]
    if len(hopeless) == len(having):
        return floor
    for i in hopeless:
        members[i] = replace(members[i], energy=None)
    return replace(floor, team=replace(floor.team, members=tuple(members))) if hopeless else floor


def _charged(
    floor: Floor,
    joint: Joint,
    wanted: frozenset[int],
    seed: int,
    charges: Charges,
    check: Callable[[], None],
    extent: tuple[bool, bool],
) -> Course | None:
    """Return an execution for ``ask_charged``, preferably with charge for a further stay, or None.
    ``extent``: whether the rounds of ``floor`` are all those of the mission, and whether the robots
    will have more work."""
    whole, further = extent
    late = tuple(
        c if m.energy is None or m.energy.charging(p) else c - m.energy.battery.stay
        for c, m, p in zip(charges, floor.team.members, joint.poses, strict=True)
    )
    guide = _guide(floor, wanted)
    work = CHARGED_LEAST if floor.open(joint.stages) else CHARGED_WORK

    def goes_on(last: Joint) -> bool:  # robots that cannot turn around may be in each other's way
        if not floor.one_way or (whole and floor.completed(last, wanted)):
            return True
        done = (floor.rounds_done(i, count) for i, count in enumerate(last.counts))
        more = replace(floor, rounds=tuple(1 + each for each in done))
        search = _search(more, last, wanted, seed, check, LITTLE * len(floor.robots))
        return not isinstance(search.run(), Exhausted | None)

    # If charges suffice only until a plan's end, a mission that continues loses robots.
    weaker = () if further and not floor.team.scenario.flat else ((False, charges),)
    for lasting, begins in ((True, late), (True, charges), *weaker):
        start = joint._replace(charges=begins)
        # Short stops cost least if a charger is near; few stops cost least if it is far.
        ways = (False, True) if begins is late else (False,)
        searches = [
            ChargedSearch(floor, wanted, guide, start, seed, work, (lasting, full), further, check)
            for full in ways
        ]
        if (found := raced(searches, work, goes_on)) is not None:
            return earlier(found)
        work //= 4  # a weaker request is likely to fail as well
    return None


def homeward(floor: Floor, joint: Joint, low: Sequence[int]) -> Plan | None:
    """Return a plan that brings robots with ``low`` charge, the most urgent first, to chargers;
    None if it is not found soon. All other robots of the floor let them pass."""
    members, goals, taken = floor.team.members, [0] * len(joint.poses), dict[int, Mask]()
    for i in low:
        energy, graph, allowed = members[i].energy, floor.graphs[i], floor.allowed(i, joint.stages)
        assert energy is not None
        shut = reduce(or_, (taken[j] for j in members[i].rivals & taken.keys()), 0)
        pose, free = joint.poses[i], energy.chargers & ~graph.poses_on(shut)
        alone = energy.graph.distances(energy.chargers, members[i].floor)[pose]
        if graph.distances(free, allowed)[pose] <= alone + DETOUR:
            goals[i] = graph.nearest(pose, free, allowed)
            taken[i] = graph.regions_of(goals[i])
    if not any(goals):
        return None
    floor = replace(floor, ends=tuple(goal or ~0 for goal in goals))
    search = Search(floor, frozenset(), lambda *_: goals, joint, 0, LITTLE * len(floor.robots))
    found = search.deep(joint, search.goal, FIRST_BUDGET, FARTHEST, [*floor.robots])
    if found is None or isinstance(found, Exhausted):
        return None
    plan = shortened(floor, found, frozenset(), search.alternatives(len(found)))
    return replace(plan, charges=(UNKNOWN,) * len(members))


def lost(floor: Floor, joint: Joint, robots: Collection[int]) -> Deadlock | None:
    """Return a proof that these robots cannot complete the mission, even with the help of all their
    possible helpers; None if it is not found soon."""
    helpers = (_helpers(floor, joint, g) for g in floor.open(joint.stages))
    return _proof(floor, joint, tuple(sorted({*robots}.union(*helpers))))


def _helpers(floor: Floor, joint: Joint, g: int) -> frozenset[int]:
    """Return the robots that may take part in the open needs of an obstacle."""
    needs = range(joint.stages[g].need, len(floor.gate(g).needs))
    each = (floor.skilled(g, put(joint.stages, g, Stage(stage))) for stage in needs)
    return frozenset[int]().union(*each)


def _proof(floor: Floor, joint: Joint, group: tuple[int, ...]) -> Deadlock | None:
    """Return a proof that a group cannot complete the mission, even without the other robots and
    the open obstacles that those may resolve; None if it is not found soon."""
    alone = [g for g in floor.open(joint.stages) if _helpers(floor, joint, g) <= {*group}]
    gates, stages = tuple(floor.gates[g] for g in alone), tuple(joint.stages[g] for g in alone)
    few = replace(floor, gates=gates, robots=group, either=True)
    begun = few.settled(joint.poses, joint.counts, stages)
    search = Search(few, frozenset(), _guide(few, frozenset()), begun, 0, FEW_WORK)
    found = search.deep(begun, search.goal, 200, "farthest first", list(group))
    if found is None or isinstance(found, Exhausted):
        found = search.singles(FEW_STATES)
    if not isinstance(found, Exhausted):
        return None
    return _deadlock(few, begun)


def _crowded(floor: Floor) -> Deadlock | None:
    """Return a deadlock if robots outnumber the regions of their last targets, else None."""
    team, every = floor.team, (i for i in floor.robots if floor.wanted[i])
    group = next(without_room([team.members[i].robot for i in every]), None)
    if group is None:
        return None
    who = tuple(i for i in floor.robots if team.members[i].robot in group)
    return Deadlock(who, why=f"deadlock: {room_words(group, team.world)}")


def _search(
    floor: Floor,
    joint: Joint,
    served: frozenset[int],
    seed: int,
    check: Callable[[], None],
    work: int = 0,
) -> Search:
    return Search(floor, served, _guide(floor, served), joint, seed, work or _work(floor), check)


def _work(floor: Floor) -> int:
    return max(WORK, WORK_OF_A_ROBOT * len(floor.robots))


def _guide(floor: Floor, served: frozenset[int]) -> Guide:
    """Return a function that maps stages and poses to each robot's duty goal (None: no duty)."""
    solver = Solver(floor)

    def guide(stages: Stages, poses: tuple[int, ...]) -> Sequence[Mask | None]:
        goals: list[Mask | None] = [None] * len(poses)
        wanted = served & {*floor.open(stages)}
        if wanted:
            aside = frozenset(floor.open(stages)) - wanted
            duties = settle(solver, poses, stages, aside, frozenset()).duties
            for i, duty in duties.items():
                goals[i] = duty.goal
            taken: dict[tuple[int, ...], Mask] = {}
            for i, duty in duties.items():  # robots that act together need different regions
                graph, left = floor.graphs[i], taken.get(duty.group, 0)
                free = duty.goal & ~graph.poses_on(left) if len(duty.group) > 1 else 0
                if free:
                    near = graph.nearest(poses[i], free, floor.allowed(i, stages))
                    goals[i] = near
                    taken[duty.group] = left | graph.regions_of(near)
        return goals

    return guide


def _first(floor: Floor, states: Sequence[Joint]) -> Iterator[tuple[int, int]]:
    """Yield pairs of a robot and the target with which it begins in a plan, if not its next one."""
    for i in floor.robots:
        member, (memory, met) = floor.team.members[i], states[0].counts[i]
        if member.either and met == 0:
            reached = (member.reached(joint.poses[i]) for joint in states)
            here = next((each for each in reached if each), 1 << memory)
            if not here >> memory & 1:
                yield i, here.bit_length() - 1


def _few(
    floor: Floor, joint: Joint, check: Callable[[], None], sizes: Sequence[int]
) -> Deadlock | None:
    """Return a proof, or None, that a group of one of these sizes cannot complete the mission even
    without all other robots, which would only restrict it."""
    sharing = [i for i in floor.robots if floor.team.members[i].partners]
    for size in (each for each in sizes if each < len(floor.robots)):
        groups = [
            g
            for g in combinations(sharing, size)
            if size == 1 or all(floor.team.members[i].partners & {*g} for i in g)
        ]
        for group in islice(sorted(groups, key=lambda g: _spread(floor, joint, g)), FEW_GROUPS):
            check()
            if (found := _proof(floor, joint, group)) is not None:
                return found
    return None


def _spread(floor: Floor, joint: Joint, group: tuple[int, ...]) -> int:
    at = [divmod(joint.poses[i] % floor.team.size, floor.team.world.cols) for i in group]
    return sum(max(side) - min(side) for side in zip(*at, strict=True))


def _deadlock(floor: Floor, joint: Joint) -> Deadlock:
    names = {i: floor.team.members[i].name for i in floor.robots}
    own = {name: floor.team.members[i].graph.memory(joint.poses[i]) for i, name in names.items()}
    memory = {name: dict(values) for name, values in own.items() if values}
    return Deadlock(floor.robots, memory or None)
