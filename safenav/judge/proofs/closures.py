"""The closure of all that a team can do, and its consequences: obstacles that are never resolved
and robots that can never continue.

The closure contains the poses that each robot can reach if every need is fulfilled whose regions
enough robots can reach. A robot that cannot continue there never can. Otherwise each choice of a
group for the next need is examined; a choice after which all its robots can return represents all
choices.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from itertools import combinations, product
from typing import Any

from safenav.judge.formulas import Formulas
from safenav.judge.state import Need, Obstacle, Rest, Robot, State
from safenav.judge.world import Graph, Poses

Sets = Mapping[str, Poses]
PER_CHOICE = 100
"""Cost of a choice of robots, in states."""
PER_SYMBOL = 20
"""Number of formula symbols with the cost of a state."""


class Case:
    """The team in a state: each robot's ``steps`` outside permanent obstacles, and the poses that
    meet each of its ``targets``. ``out``: robots out of service; ``flat``: robots that another
    battery returns to service, each with its obstacle; ``memory``: the memory of each robot whose
    poses include one; ``never``: given-up obstacles that are never resolved; ``shut``: these and
    all permanent obstacles; ``laden``: robots with a load, or a part of one, that no robot can ever
    put down; ``leaving``: the state in which a robot in transit still acts in the region that it
    leaves."""

    def __init__(
        self,
        s: State,
        *,
        out: Iterable[str] = (),
        memory: Mapping[str, int] | None = None,
        never: Collection[str] = (),
    ) -> None:
        self.state, self.world, self.names = s, s.world, s.names
        self.out = frozenset(out)
        self.memory = {n: k for n, k in (memory or {}).items() if n not in self.out}
        every = s.obstacles.values()
        self.shut = [one for one in every if one.permanent or one.name in never]
        self.laden = frozenset[str]().union(*(x.rest.laden() for x in self.shut if x.open))
        self.at: dict[str, Any] = {name: s.destination(name) for name in s.names}
        self.steps: dict[str, Graph] = {}
        self.targets: dict[str, list[Poses]] = {}
        for name in s.names:
            self.steps[name], self.targets[name] = self._moves(name)
        for name, number in self.memory.items():
            self.at[name] = (*self.at[name], number, frozenset())
        moving = (n for n, r in s.robots.items() if r.bound is not None and not s.live)
        at = {n: (*s.robots[n].pose, "leaving", frozenset[int]()) for n in moving}
        self.leaving: dict[str, Any] = {n: one for n, one in at.items() if n not in self.out}
        self.steps |= {n: {**self.steps[n], x: (self.at[n],)} for n, x in self.leaving.items()}
        self.now = {**self.at, **self.leaving}
        self.start = {n: self._with_next(n, frozenset([self.now[n]])) for n in s.names}
        known = (one for one in every if one.open and one.known and one not in self.shut)
        self.obstacles = tuple(self._opened(one) for one in known if one.rest.left)
        here = (one.name for one in self.obstacles if one.name in s.flat)
        self.flat = {s.flat[one]: one for one in here if s.robots[s.flat[one]].out}
        self._reach, self._on = cache(self._reached), cache(self._standing)
        self._goes_on = cache(self._continues)

    def _moves(self, name: str) -> tuple[Graph, list[Poses]]:
        robot, here = self.state.robots[name], self.at[name]
        own, formulas = robot.own, robot.own.formulas
        if name in self.out:
            return {here: ()}, [frozenset([here])]
        steps: Graph = self.world.graph(robot.faces)
        self.world.spend(len(steps))
        targets = [frozenset(p for p in steps if p[0] in target) for target in own.targets]
        if formulas is not None:
            self.world.spend(len(steps) * formulas.work // PER_SYMBOL)
            steps = {a: tuple(b for b in to if formulas.allows(a, b)) for a, to in steps.items()}
            if own.kind == "ltl":
                targets = [_met(formulas, k, steps) for k in range(len(formulas.goals))]
        shut = {one.region: one.open for one in self.shut if name in one.blocks}
        if sealed := own.avoid.union(shut):
            came = self._came(robot) if shut.get(here[0]) else None
            ahead = {b for b in steps.get(here, ()) if came is not None and b[0] != came}
            steps = {
                a: tuple(b for b in to if b[0] not in sealed and not (a == here and b in ahead))
                for a, to in steps.items()
                if a[0] not in sealed or a == here
            }
        if name in self.memory:
            return _with_memory(formulas, steps)
        return steps, targets

    def _came(self, robot: Robot) -> int | None:
        """Return the region from which a robot has entered its present one or, in transit, enters
        its destination; None if an obstacle has appeared around it there."""
        if robot.bound is None:
            return robot.came
        there = self.state.at.get(robot.bound, ())
        closed = self.state.external and any(one.rest.closes(robot.name) for one in there)
        return None if closed else robot.pose[0]

    def _opened(self, one: Obstacle) -> Rest:
        """Return an open obstacle without the robots that never act on it."""
        s, rest, left = self.state, one.rest, list[Need]()
        for k in range(len(rest.left)):
            chain = rest._replace(left=rest.left[k:])
            cut = self._cut(chain) if chain.takes() else ()
            left.append(chain.left[0]._replace(able=chain.left[0].able.difference(cut)))
        failed = frozenset(robot for robot, name in s.barred if name == one.name)
        return rest._replace(
            left=tuple(left),
            enters=rest.enters - failed,
            done=frozenset[str]() if left[0].together else rest.done,
            barred=failed | self.out,
        )

    def _cut(self, load: Rest) -> Iterator[str]:
        """Yield the robots that never take a load since they cannot reach its destination."""
        graph = self.world.graph(False)
        for name in load.left[0].able:
            avoid = self.state.robots[name].own.avoid
            reached = self.world.reach(graph, [(self.at[name][0], None)], avoid)
            left = avoid - load.left[0].regions  # regions that the robot may only leave
            regions = {region for region, _ in reached} - left
            if any(regions.isdisjoint(need.regions) for need in load.chain()):
                yield name

    def _with_next(self, name: str, poses: Poses) -> Poses:
        return poses | {self.at[name]} if self.leaving.get(name) in poses else poses

    def way_back(self, name: str, pose: Any, obstacles: Iterable[Rest]) -> int | None:
        """Return the only region that a robot inside an obstacle may enter (None: any)."""
        robot = self.state.robots[name]
        entered = robot.came is not None and robot.bound is None and pose == self.at[name]
        return robot.came if entered and pose[0] in self.walls(name, obstacles) else None

    @staticmethod
    def walls(name: str, obstacles: Iterable[Rest]) -> frozenset[int]:
        return frozenset(one.region for one in obstacles if one.closes(name))

    def _reached(self, name: str, poses: Poses, walls: frozenset[int]) -> Poses:
        return frozenset(self.world.reach(self.steps[name], self._with_next(name, poses), walls))

    def reach(self, name: str, poses: Poses, obstacles: Iterable[Rest]) -> Poses:
        return self._reach(name, poses, self.walls(name, obstacles))

    def _continues(self, name: str, poses: Poses, walls: frozenset[int]) -> bool:
        aims = self.targets[name][-1 if self.state.robots[name].own.ends else 0 :]
        return self.world.can_continue(self.steps[name], self._with_next(name, poses), aims, walls)

    def can_continue(self, name: str, poses: Poses, obstacles: Iterable[Rest]) -> bool:
        """Return whether a robot can meet each target infinitely often from some of the poses."""
        return self._goes_on(name, poses, self.walls(name, obstacles))

    def all_continue(self, sets: Sets, obstacles: Iterable[Rest]) -> bool:
        return all(self.can_continue(name, sets[name], obstacles) for name in self.names)

    def full(self, obstacles: Iterable[Rest]) -> frozenset[str]:
        """Return the robots that can take no other load."""
        return self.laden.union(*(one.laden() for one in obstacles))

    def _standing(self, name: str, regions: frozenset[int]) -> Poses:
        return frozenset(pose for pose in self.steps[name] if pose[0] in regions)

    def actors(self, one: Rest, sets: Sets, full: frozenset[str]) -> dict[str, Poses]:
        """Return the robots that can do their part of an obstacle's next need, each with the poses
        for it. ``full``: robots that can take no other load."""
        able = able_now(one, full)
        at = {n: sets[n] & self._on(n, one.left[0].regions) for n in self.names if n in able}
        return {name: there for name, there in at.items() if there}

    def groups(self, one: Rest, at: Sets) -> Iterator[tuple[str, ...]]:
        """Yield the groups of robots that can fulfil an obstacle's next need."""
        missing = max(0, one.left[0].robots - len(one.done))
        for group in combinations(at, missing) if missing <= len(at) else ():
            self.world.spend()
            if not one.left[0].together or self._fits(group, at):
                yield group

    def _fits(self, group: tuple[str, ...], at: Sets) -> bool:
        """Return whether the robots of a group can stand in some of their poses simultaneously,
        rivals in different regions and at most one robot in each zone."""
        s, crowd = self.state, [name for name in group if {*self.state.mates[name]} & {*group}]
        for regions in product(*({pose[0] for pose in at[name]} for name in crowd)):
            self.world.spend()
            pairs = combinations(zip(crowd, regions, strict=True), 2)
            if not any(b in s.kept_out(m, n, frozenset([a])) for (n, a), (m, b) in pairs):
                return True
        return False


def case_of(s: State, *, out: Iterable[str] = (), memory: Mapping[str, int] | None = None) -> Case:
    """Return the case of a state: the given-up obstacles that the team can never resolve from there
    are permanent."""
    never = set[str]()
    while True:
        case = Case(s, out=out, memory=memory, never=never)
        given_up = {one.name for one in case.obstacles if s.obstacles[one.name].shut}
        left = team_closure(case, case.start, case.obstacles)[1] if given_up else ()
        if not (more := given_up.intersection(one.name for one in left)):
            return case
        never |= more


def case_now(s: State, memory: Mapping[str, int] | None = None) -> Case:
    """Return the case of the present state. A robot without charge counts as in service if it has
    or can get another battery: a proof with this robot also holds without it."""
    out = {name for name, robot in s.robots.items() if robot.out and not robot.filled}
    while True:
        case = case_of(s, out=out, memory=memory)
        never = team_closure(case, case.start, case.obstacles)[1] if case.flat else ()
        back = out & (case.flat.keys() - {s.flat.get(one.name) for one in never})
        if not back:
            return case
        out -= back


def able_now(one: Rest, full: frozenset[str]) -> frozenset[str]:
    """Return the robots that may do their part of an obstacle's next need."""
    able = one.left[0].able - one.done - one.barred
    return able - full if one.takes() else able


def _met(formulas: Formulas, goal: int, steps: Graph) -> Poses:
    """Return the poses where a stay meets a goal, and those into which a step meets it although a
    stay at neither end of the step does."""
    staying = {pose for pose in steps if formulas.meets(goal, pose, pose)}
    pairs = ((a, b) for a, to in steps.items() for b in to if not {a, b} & staying)
    return frozenset(staying | {b for a, b in pairs if formulas.meets(goal, a, b)})


def _with_memory(formulas: Formulas, steps: Graph) -> tuple[Graph, list[Poses]]:
    """Return the graph of a robot's steps, and the states that meet each goal. A state is a pose, a
    memory, and the goals that only the last step met. A robot that stays may change its memory."""
    edges: dict[Any, set[Any]] = {}
    for here, to in steps.items():
        for there in (here, *to):
            for i, j, goals in formulas.steps(here, there):
                by_staying = formulas.met_by_staying(here, i) | formulas.met_by_staying(there, j)
                edges.setdefault((*here, i), set()).add((*there, j, goals - by_staying))
    states = {(*state, frozenset[int]()) for state in edges}.union(*edges.values())
    graph = {one: tuple(to for to in edges.get(one[:3], ()) if to != one) for one in states}
    met = {one: one[3] | formulas.met_by_staying(one[:2], one[2]) for one in states}
    return graph, [frozenset(x for x in states if k in met[x]) for k in range(formulas.count)]


def team_closure(
    case: Case, start: Sets, opened: tuple[Rest, ...]
) -> tuple[Sets, tuple[Rest, ...]]:
    """Return the poses that each robot can ever reach from ``start``, and the obstacles that are
    never resolved, each with its open needs from the first that is never fulfilled."""
    left = opened
    while True:
        inside = {name: case.reach(name, start[name], left) for name in case.names}
        full = case.full(one for one in left if one in opened)  # they keep their loads forever
        each = (_furthest(case, one, inside, full, left) for one in opened)
        after = tuple(one for one in each if one.left)
        if after == left:
            return inside, left
        left = after


def _furthest(
    case: Case, one: Rest, inside: Sets, full: frozenset[str], walls: tuple[Rest, ...]
) -> Rest:
    """Return an obstacle after all needs that can be fulfilled: enough robots can reach each of
    them (from the previous need if the same robots are demanded)."""
    sets = inside
    while one.left:
        at = case.actors(one, sets, full)
        if next(case.groups(one, at), None) is None:
            return one
        one, full, sets = one.advanced(at), frozenset(), inside
        if one.left and one.left[0].same:
            moved = {name: case.reach(name, poses, walls) for name, poses in at.items()}
            sets = {**inside, **moved}
    return one


def is_hopeless(case: Case) -> bool:
    """Return whether some robot can never continue after any choices. Raises TooLargeError."""
    states: list[tuple[Sets, tuple[Rest, ...]]] = [(case.start, case.obstacles)]
    while states:
        sets, opened = states.pop()
        case.world.spend(PER_CHOICE)
        if not case.all_continue(*team_closure(case, sets, opened)):
            continue
        sets = {name: case.reach(name, sets[name], opened) for name in case.names}
        if case.all_continue(sets, opened):
            return False
        options = [*_options(case, sets, opened)]
        lossless = [after for after, free in options if free]
        states += lossless[:1] or [after for after, _ in options]
    return True


def _options(
    case: Case, sets: Sets, opened: tuple[Rest, ...]
) -> Iterator[tuple[tuple[Sets, tuple[Rest, ...]], bool]]:
    """Yield each option: a group fulfils the next need of an obstacle, or one robot does its part
    of it. An option is a pair: the robots' poses and the open obstacles afterwards, and whether
    nothing is lost, since these robots can return to all their poses."""
    full = case.full(opened)
    for k, one in enumerate(opened):
        at, alone = case.actors(one, sets, full), one.left[0].together or one.left[0].robots == 1
        chosen = one.left[0].same and len(one.left[0].able) <= one.left[0].robots
        free = chosen or not one.chain()
        parts = () if alone else ((name,) for name in at)
        for group in dict.fromkeys((*case.groups(one, at), *parts)):
            rest = one.acted(group)
            after = (*opened[:k], *([rest] if rest.left else []), *opened[k + 1 :])
            back = (sets[name] <= case.reach(name, at[name], after) for name in group)
            yield ({**sets, **{name: at[name] for name in group}}, after), free and all(back)
