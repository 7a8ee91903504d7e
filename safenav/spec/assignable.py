"""Goals that are assigned at runtime: coordination without resynthesis (paper, Section V-D).

Three inputs let the coordination layer steer a robot whose strategy is never changed: ``wait``
keeps it where it is; ``request`` sends it to the region ``assigned``, and excuses its own goals
meanwhile. Obstacles that turn out to be permanent still require a new strategy. While a robot must
wait, the inputs do not state the region of an open request: otherwise each pair of a region and a
request would double the nodes.

Only regions from which a robot can resume its own objective are assigned. Steps may be irreversible
(headings in a corridor, formulas about steps or with a memory), and a joint plan or a duty may lead
a robot through them. So its assignable regions depend on its pose and on its memory.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import starmap
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from safenav.components import components, explored
from safenav.formula.syntax import one_of
from safenav.scenario.objective import Ltl, Objective, formulas_in
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable, among
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap
from safenav.world.poses import Mobility, Pose, moves

if TYPE_CHECKING:
    from safenav.scenario.guarantees import Guarantees

Remembered = tuple[tuple[str, int], ...]
"""The memory of formulas, by name; empty if there is none."""

State = tuple[Pose, Remembered]


class Part(Struct, frozen=True):
    """Regions with the states (pose and memory) at which they matter."""

    regions: frozenset[Region]
    states: frozenset[State]

    def poses(self) -> dict[Remembered, frozenset[Pose]]:
        """Return the poses for each memory."""
        found: dict[Remembered, set[Pose]] = {}
        for pose, memory in self.states:
            found.setdefault(memory, set()).add(pose)
        return {memory: frozenset(found[memory]) for memory in sorted(found)}


class AssignableRegions(Struct, frozen=True):
    """``places``: regions assignable from some pose. ``parts``: regions assignable from some poses
    only, with those poses. ``homes``: the sets of regions in which the robot can meet its objective
    forever, if there are several, each with the states in it or on the way to it. A robot does not
    leave these states unless it is assigned a region elsewhere."""

    places: frozenset[Region]
    parts: tuple[Part, ...] = ()
    homes: tuple[Part, ...] = ()

    def allows(self, pose: Pose, memory: Mapping[str, int], place: Region) -> bool:
        """Return whether ``place`` is assignable at a pose with this memory."""
        return place in self.places and all(
            any(at == pose and _agree(known, memory) for at, known in part.states)
            for part in self.parts
            if place in part.regions
        )


def _agree(known: Remembered, memory: Mapping[str, int]) -> bool:
    return all(memory.get(name) == value for name, value in known)


def assignable_regions(task: Task, world: RegionMap) -> AssignableRegions:
    """Return the assignable regions of a task's robot."""
    return _assignable_regions(_Ground.of(task, world))


class _Ground(Struct, frozen=True):
    """A robot's pose and memory, on which its paths depend."""

    mobility: Mobility
    start: Pose
    memory: Remembered
    objective: Objective
    blocked: frozenset[Region]
    world: RegionMap

    @classmethod
    def of(cls, task: Task, world: RegionMap) -> _Ground:
        blocked = frozenset(known.region for known in task.blocked)
        memory = tuple(sorted(task.memory.values.items()))
        return cls(task.robot.model.mobility, task.pose, memory, task.objective, blocked, world)

    @property
    def guarantees(self) -> Guarantees | None:
        from safenav.scenario.guarantees import guarantees_of  # few robots have formulas

        found = formulas_in(self.objective)
        return None if found is None else guarantees_of(found)

    def begins(self) -> list[State]:
        """Return the possible initial states of the robot."""
        guarantees = self.guarantees
        if guarantees is None:
            return [(self.start, ())]
        if self.memory:
            return [(self.start, self.memory)]
        memories = (tuple(sorted(memory.items())) for memory in guarantees.memories)
        return [(self.start, m) for m in memories if guarantees.begins(dict(m), self.start)]

    def after(self, state: State) -> list[State]:
        """Return the states after a step or a stay."""
        pose, memory = state
        guarantees = self.guarantees
        steps = moves(self.mobility, pose, self.world, self.blocked)
        if guarantees is None:
            return [(to, ()) for to in steps]
        old = dict(memory)
        return [
            (to, tuple(sorted(new.items())))
            for to in steps
            for new in guarantees.memories
            if guarantees.allows_with(pose, old, to, new)
        ]

    def ways(self) -> dict[State, Sequence[State]]:
        """Return the states that the robot can reach, each with its successors."""
        return explored(self.begins(), self.after)

    def meets(
        self, members: Collection[State], successors: Mapping[State, Collection[State]]
    ) -> bool:
        """Return whether a robot that circulates among these states can meet its objective
        forever."""
        guarantees = self.guarantees
        if guarantees is None or not isinstance(self.objective, Ltl):
            regions = {pose.region for pose, _ in members}
            return all(target & regions for target in self.objective.targets)
        steps = [(one, other) for one in members for other in successors[one] if other in members]
        return all(
            any(
                guarantees.meets_with(goal, one[0], dict(one[1]), other[0], dict(other[1]))
                for one, other in steps
            )
            for goal in range(guarantees.goals)
        )


@lru_cache(maxsize=64)
def _assignable_regions(ground: _Ground) -> AssignableRegions:
    here, guarantees = frozenset({ground.start.region}), ground.guarantees
    if guarantees is not None and not guarantees.memories:  # too many to follow
        return AssignableRegions(here)
    successors = ground.ways()
    rounds, home = _homes(ground, successors)
    of_state = {state: k for k, members in enumerate(rounds) for state in members}
    begins = [of_state[state] for state in ground.begins() if state in of_state]
    if all(home[k] is None for k in begins):  # it cannot meet its objective from where it starts
        return AssignableRegions(here)
    reach: list[frozenset[Region]] = []  # the regions that it can reach and still continue
    for k, members in enumerate(rounds):
        after = {
            of_state[to] for state in members for to in successors[state] if to in of_state
        } - {k}
        found = () if home[k] is None else (pose.region for pose, _ in members)
        reach.append(frozenset(found).union(*(reach[to] for to in sorted(after))))
    parts = _parts(rounds, reach)
    alive = sum(len(members) for members, found in zip(rounds, reach, strict=True) if found)
    return AssignableRegions(
        frozenset[Region]().union(*(part.regions for part in parts)) or here,
        tuple(part for part in parts if len(part.states) < alive),
        _told_apart(rounds, home),
    )


def _homes(
    ground: _Ground, successors: dict[State, Sequence[State]]
) -> tuple[list[list[State]], list[int | None]]:
    """Return the strongly connected sets of states (successors first), and for each the one in
    which the robot can continue forever from there; None where its objective is lost. States where
    it cannot stay, although it may have to wait, are left out."""
    while True:
        states = list(successors)
        number = {state: index for index, state in enumerate(states)}
        graph = [[number[to] for to in successors[state] if to in number] for state in states]
        rounds = [[states[index] for index in members] for members in components(graph)]
        of_state = {state: k for k, members in enumerate(rounds) for state in members}
        home: list[int | None] = []
        for k, members in enumerate(rounds):
            after = {of_state[to] for state in members for to in successors[state] if to in number}
            beyond = {at for to in after - {k} if (at := home[to]) is not None}
            best = max(sorted(beyond), key=lambda at: len(rounds[at]), default=None)
            home.append(k if ground.meets(frozenset(members), successors) else best)
        restless = {
            state
            for state, following in successors.items()
            if not any(to[0] == state[0] and to in number for to in following)
        }
        if not restless:
            return rounds, home
        lost = restless | {s for k, ms in enumerate(rounds) if home[k] is None for s in ms}
        successors = {state: successors[state] for state in states if state not in lost}


def _parts(rounds: list[list[State]], reach: list[frozenset[Region]]) -> list[Part]:
    """Group the regions by the states that reach them; omit those that can be reached only from
    themselves."""
    sources: dict[Region, list[int]] = {}
    for k, regions in enumerate(reach):
        for region in sorted(regions):
            sources.setdefault(region, []).append(k)
    found: dict[tuple[int, ...], set[Region]] = {}
    for region, of in sources.items():
        if any(pose.region != region for k in of for pose, _ in rounds[k]):
            found.setdefault(tuple(of), set()).add(region)
    return [
        Part(frozenset(regions), frozenset(state for k in of for state in rounds[k]))
        for of, regions in found.items()
    ]


def _told_apart(rounds: list[list[State]], home: list[int | None]) -> tuple[Part, ...]:
    """Return the homes with the states that lead to them; empty if there is only one."""
    found: dict[frozenset[Region], set[State]] = {}
    for k, at in enumerate(home):
        if at is not None:
            regions = frozenset(pose.region for pose, _ in rounds[at])
            found.setdefault(regions, set()).update(rounds[k])
    if len(found) == 1:
        return ()
    return tuple(Part(regions, frozenset(states)) for regions, states in found.items())


SOURCE = "paper, Section V-D, the runtime-assignable goal"
NEXT = "'"


def inputs(world: RegionMap) -> tuple[Variable, ...]:
    """Return the inputs by which the coordination layer commands the robot."""
    return (
        Variable("request", Owner.INPUT, None, "the robot is assigned a region"),
        Variable("wait", Owner.INPUT, None, "the robot must stay where it is"),
        Variable("assigned", Owner.INPUT, (0, world.size - 1), "the region assigned to it"),
    )


def neutral(assignable: AssignableRegions) -> Region:
    """Return the value of ``assigned`` while there is no request."""
    return min(assignable.places)


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions: requests assign regions from which the robot can resume its objective,
    and do not change while open."""
    possible = assignable_regions(task, world)
    idle = neutral(possible)
    begin = _origin("no request before the first move")
    for formula in ("!request", f"assigned = {idle}", "!wait"):
        yield Constraint(Section.ENV_INIT, formula, begin)
    where = _origin("only regions from which it can resume its objective are assigned")
    allowed_next = one_of("assigned", possible.places, "'")
    yield Constraint(Section.ENV_TRANS, f"request' & !wait' -> {allowed_next}", where)
    for part in possible.parts:
        formula = f"{_asked(part)} -> {_in(part, task)}"
        yield Constraint(Section.ENV_TRANS, formula, where, tuple(sorted(part.regions)))
    yield Constraint(Section.ENV_TRANS, f"!request' | wait' -> assigned' = {idle}", where)
    still = _origin("an open request keeps its region until the robot must wait")
    same = "request & !wait & request' & !wait' -> assigned' = assigned"
    yield Constraint(Section.ENV_TRANS, same, still)
    fair = _origin("infinitely often, it need not wait")
    yield Constraint(Section.ENV_LIVENESS, "!wait'", fair)


def _origin(rule: str) -> Origin:
    return Origin("coordination", rule, SOURCE)


def guarantees(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the guarantees: the robot waits when commanded, and goes to the assigned region."""
    stay = _origin("it stays while it must wait")
    yield Constraint(Section.SYS_TRANS, "wait' -> region' = region", stay)
    possible = assignable_regions(task, world)
    able = _origin("it never loses a region that it is assigned")
    for part in possible.parts:
        formula = f"{_asked(part)} -> {_in(part, task, NEXT)}"
        yield Constraint(Section.SYS_TRANS, formula, able, tuple(sorted(part.regions)))
    home = _origin("it does not leave permanently unless assigned elsewhere")
    for part in possible.homes:
        asked = "!request' | " + one_of("assigned", part.regions, "'")
        formula = f"{_in(part, task)} & ({asked}) -> {_in(part, task, NEXT)}"
        yield Constraint(Section.SYS_TRANS, formula, home)
    go = _origin("it reaches the assigned region")
    yield Constraint(Section.SYS_LIVENESS, "request' & !wait' -> region' = assigned'", go)


def _in(part: Part, task: Task, mark: str = "") -> str:
    """Return the condition for the states of ``part``; ``mark``: suffix of the variables."""
    ranges = task.objective.memory if isinstance(task.objective, Ltl) else {}

    def has(name: str, value: int) -> str:
        truth = "" if value else "!"
        return f"{name}{mark} = {value}" if ranges[name] else f"{truth}{name}{mark}"

    states = part.poses().items()
    atoms = [" & ".join([*starmap(has, memory), among(poses, mark)]) for memory, poses in states]
    return f"({' | '.join(atoms)})"


def _asked(part: Part) -> str:
    """Return the condition that one of the regions of a part is assigned to the robot."""
    assigned = one_of("assigned", part.regions, "'")
    return f"request' & !wait' & {assigned}"


def excused(constraint: Constraint) -> Constraint:
    """Return a constraint of the robot's objective, excused while a request is open."""
    rule = f"{constraint.origin.rule}, unless it is assigned a region"
    origin, formula = replace(constraint.origin, rule=rule), f"request' | ({constraint.formula})"
    return replace(constraint, formula=formula, origin=origin)
