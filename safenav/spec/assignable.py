"""Goals assigned at runtime: coordination without resynthesis (paper, Section V-D).

One input, ``assigned``, steers a robot whose strategy never changes. Its greatest value lets the
robot pursue its own objective. Another region sends the robot there and excuses its own goals
meanwhile; the region where it stands lets it wait. Permanent obstacles still require a new
strategy.

Only regions from which a robot can resume its own objective are assigned. Steps may be irreversible
(headings in a corridor, formulas about steps or with a memory), and a joint plan or a duty may lead
a robot through them. So the assignable regions depend on the robot's pose and memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from itertools import starmap
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from safenav.components import components, reached
from safenav.formula.syntax import one_of
from safenav.scenario.objective import Ltl, Objective, formulas_in
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable, among
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap
from safenav.world.poses import Mobility, Pose, moves

if TYPE_CHECKING:
    from safenav.spec.guarantees import Guarantees

Remembered = tuple[tuple[str, int], ...]
"""The memory of formulas, by name; empty if there is none."""

State = tuple[Pose, Remembered]


class Part(Struct, frozen=True):
    """Regions and the states (pose and memory) in which they are assignable."""

    regions: frozenset[Region]
    states: frozenset[State]


class AssignableRegions(Struct, frozen=True):
    """The assignable regions. ``places``: regions that are assignable in some state. ``parts``: the
    states for those that are assignable only in some states."""

    places: frozenset[Region] = frozenset()
    parts: tuple[Part, ...] = ()

    def allows(self, state: State, place: Region) -> bool:
        """Return whether the region ``place`` is assignable in a state."""
        parts = (part for part in self.parts if place in part.regions)
        return place in self.places and all(state in part.states for part in parts)


def assignable_regions(task: Task, world: RegionMap) -> AssignableRegions:
    """Return the assignable regions of a task's robot."""
    blocked = frozenset(known.region for known in task.blocked)
    memory = tuple(sorted(task.memory.values.items()))
    mobility, own = task.robot.model.mobility, task.objective
    first = task.memory.index if own.settles else 0
    return _assignable_regions(_Ground(mobility, task.pose, memory, own, first, blocked, world))


class _Ground(Struct, frozen=True):
    """The states of a robot (pose and memory), which determine its paths. ``first``: the index of
    the first target that it still has to meet."""

    mobility: Mobility
    start: Pose
    memory: Remembered
    objective: Objective
    first: int
    blocked: frozenset[Region]
    world: RegionMap

    @property
    def guarantees(self) -> Guarantees:
        from safenav.spec.guarantees import guarantees_of  # imported here: few use formulas

        return guarantees_of(formulas_in(self.objective) or Ltl())

    def begins(self) -> list[State]:
        """Return the possible initial states of the robot."""
        if self.memory:
            return [(self.start, self.memory)]
        begins, memories = self.guarantees.begins, self.guarantees.memories
        return [(self.start, _remembered(m)) for m in memories if begins(m, self.start)]

    def after(self, state: State) -> list[State]:
        """Return the possible states of the robot after a step or a stay."""
        pose, old, guarantees = state[0], dict(state[1]), self.guarantees
        return [
            (to, _remembered(new))
            for to in moves(self.mobility, pose, self.world, self.blocked)
            for new in guarantees.memories
            if guarantees.allows_with(pose, old, to, new)
        ]

    def meets(self, members: Sequence[State], successors: Mapping[State, Sequence[State]]) -> bool:
        """Return whether a robot can meet its objective forever while it circulates among these
        states."""
        if not isinstance(self.objective, Ltl):
            regions = {pose.region for pose, _ in members}
            return all(target & regions for target in self.objective.targets[self.first :])
        meets, inside = self.guarantees.meets_with, set(members)
        steps = [(one, to) for one in members for to in successors[one] if to in inside]
        return all(
            any(meets(goal, p, dict(old), q, dict(new)) for (p, old), (q, new) in steps)
            for goal in range(self.guarantees.goals)
        )

    def live(self) -> list[tuple[list[State], set[int]]]:
        """Return the strongly connected sets of states in which the robot can meet its objective
        forever, even if it must wait in any of them. Successors come first. Each set has the
        indices of the sets that one step reaches."""
        after = cache(self.after)
        successors = {state: after(state) for state in reached(self.begins(), after)}
        while True:
            states = list(successors)
            number = {state: k for k, state in enumerate(states)}
            graph = [[number[to] for to in successors[one] if to in number] for one in states]
            found: list[tuple[list[State], set[int]]] = []
            of: dict[State, int] = {}
            for members in components(graph):
                part = [states[k] for k in members]
                beyond = {of[to] for one in part for to in successors[one] if to in of}
                if beyond or self.meets(part, successors):
                    of |= dict.fromkeys(part, len(found))
                    found.append((part, beyond))
            left = {one: [to for to in successors[one] if to in of] for one in of}
            successors = {one: to for one, to in left.items() if any(p == one[0] for p, _ in to)}
            if len(successors) == len(states):
                return found


def _remembered(memory: Mapping[str, int]) -> Remembered:
    return tuple(sorted(memory.items()))


@lru_cache(maxsize=64)
def _assignable_regions(ground: _Ground) -> AssignableRegions:
    live = ground.live()
    states = {state for members, _ in live for state in members}
    if states.isdisjoint(ground.begins()):  # the objective is infeasible, or memories are too many
        return AssignableRegions()
    reach: list[frozenset[Region]] = []  # the regions that each set can reach
    for members, beyond in live:
        here = frozenset(pose.region for pose, _ in members)
        reach.append(here.union(*(reach[to] for to in sorted(beyond))))
    places = frozenset[Region]().union(*reach)
    sources: dict[tuple[int, ...], set[Region]] = {}
    for place in sorted(places):
        of = tuple(k for k, regions in enumerate(reach) if place in regions)
        sources.setdefault(of, set()).add(place)
    parts = (
        Part(frozenset(regions), frozenset(state for k in of for state in live[k][0]))
        for of, regions in sources.items()
        if len(of) < len(live)
    )
    return AssignableRegions(places, tuple(parts))


SOURCE = "paper, Section V-D, the runtime-assignable goal"


def inputs(world: RegionMap) -> tuple[Variable, ...]:
    """Return the input by which the coordination layer commands the robot."""
    note = f"the region assigned to it, where it waits; {own(world)}: none"
    return (Variable("assigned", Owner.INPUT, (0, own(world)), note),)


def own(world: RegionMap) -> int:
    """Return the value of ``assigned`` for the robot's own objective."""
    return world.size


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions: the robot can resume its objective from each assigned region, and an
    assignment lasts until the robot has reached the region or must wait."""
    possible = assignable_regions(task, world)
    begin = _origin("nothing is assigned before the first move")
    yield Constraint(Section.ENV_INIT, f"assigned = {own(world)}", begin)
    where = _origin("only regions from which it can resume its objective are assigned")
    given = one_of("assigned", {*possible.places, own(world)}, "'")
    yield Constraint(Section.ENV_TRANS, f"assigned' = region | {given}", where)
    for part in possible.parts:
        formula = f"{one_of('assigned', part.regions, NEXT)} -> {_in(part, task)}"
        yield Constraint(Section.ENV_TRANS, formula, where, tuple(sorted(part.regions)))
    still = _origin("an assignment stays until the robot is there or must wait")
    now = f"assigned != {own(world)} & assigned != region & {_elsewhere(world)}"
    yield Constraint(Section.ENV_TRANS, f"{now} -> assigned' = assigned", still)
    fair = _origin("infinitely often, it need not wait")
    yield Constraint(Section.ENV_LIVENESS, "assigned' != region", fair)


NEXT = "'"


def _elsewhere(world: RegionMap) -> str:
    """Return the condition that a region other than the robot's own is assigned."""
    return f"assigned' != {own(world)} & assigned' != region"


def _origin(rule: str) -> Origin:
    return Origin("coordination", rule, SOURCE)


def guarantees(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the guarantees: the robot waits on command and goes to the assigned region."""
    stay = _origin("it stays where it is assigned")
    yield Constraint(Section.SYS_TRANS, "assigned' = region -> region' = region", stay)
    able = _origin("it stays where it can reach the region that it is assigned")
    for part in assignable_regions(task, world).parts:
        formula = f"{one_of('assigned', part.regions, NEXT)} -> {_in(part, task, NEXT)}"
        yield Constraint(Section.SYS_TRANS, formula, able, tuple(sorted(part.regions)))
    go = _origin("it reaches the assigned region")
    formula = f"assigned' = {own(world)} | region' = assigned'"
    yield Constraint(Section.SYS_LIVENESS, formula, go)


def _in(part: Part, task: Task, mark: str = "") -> str:
    """Return the condition that the state is one of ``part``. ``mark``: the suffix of variables."""
    ranges = task.objective.memory if isinstance(task.objective, Ltl) else {}
    poses: dict[Remembered, set[Pose]] = {}
    for pose, memory in part.states:
        poses.setdefault(memory, set()).add(pose)

    def has(name: str, value: int) -> str:
        truth = "" if value else "!"
        return f"{name}{mark} = {value}" if ranges[name] else f"{truth}{name}{mark}"

    atoms = [" & ".join([*starmap(has, m), among(poses[m], mark)]) for m in sorted(poses)]
    return f"({' | '.join(atoms)})"


def excused(constraint: Constraint, world: RegionMap) -> Constraint:
    """Return a constraint of the own objective that is excused while another region is assigned."""
    rule = f"{constraint.origin.rule}, unless it is assigned another region"
    formula = f"{_elsewhere(world)} | ({constraint.formula})"
    return replace(constraint, formula=formula, origin=replace(constraint.origin, rule=rule))
