"""Minimal unrealizable core: guarantees that cannot be kept together, in scenario terms.

Graph search first drops walls (a robot never observes walls that it cannot reach), then QuickXplain
queries the synthesizer. Assumptions are never dropped: without them a strategy is even less
possible."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence

from msgspec.structs import replace

from safenav.explain.explanation import (
    Core,
    CoreMember,
    Diagnosis,
    NoStrategyCause,
    is_guarantee,
    with_guarantees,
)
from safenav.explain.quickxplain import minimal_subset
from safenav.explain.realizability import Questions, cooperative
from safenav.outcome import Verdict
from safenav.scenario.objective import Target
from safenav.spec.movement import stepping
from safenav.spec.specification import Constraint, Section, Specification
from safenav.spec.task import Task
from safenav.world.map import Heading, Region, RegionMap

MOST_AT_ONCE = 64
"""Members that are tried one by one, several at a time, before any search."""


def find_core(
    spec: Specification, task: Task, world: RegionMap, found: Diagnosis, ask: Questions
) -> Core:
    """Return a minimal core of an unrealizable specification.

    Where a query gets no verdict within the limits, its members stay in the core, which is then not
    known to be minimal."""
    search = _Search(spec, ask)
    members = search.first_failing(_choices(_members(spec, task, world), task, world, found))
    walls = [m for m in members if _is_wall(m)]
    rest = search.minimal([m for m in members if not _is_wall(m)], walls)
    walls = search.minimal(walls, rest)
    walls = search.minimal([part for m in walls for part in _split(m)], rest)
    return search.core([*rest, *walls])


def find_line_core(spec: Specification, ask: Questions) -> Core:
    """Return a minimal core of an unrealizable specification, each line of which counts alone."""
    search = _Search(spec, ask)
    lines = [CoreMember(c.origin, (c,)) for c in spec.constraints if is_guarantee(c)]
    return search.core(search.minimal(lines, []))


class _Search:
    """Queries on subsets of one specification's guarantees."""

    def __init__(self, spec: Specification, ask: Questions) -> None:
        self._spec = spec
        self._ask = ask
        self._before = ask.asked
        self._unknown = False

    def core(self, members: Sequence[CoreMember]) -> Core:
        """Return the core of these members."""
        cooperating = self._ask.verdict(cooperative(self.with_only(members)))
        fairness = dict.fromkeys(c.origin for c in self._spec.section(Section.ENV_LIVENESS))
        alone, asked = cooperating is Verdict.UNREALIZABLE, self._ask.asked - self._before
        return Core(tuple(members), alone, tuple(fairness), not self._unknown, asked)

    def with_only(self, members: Iterable[CoreMember]) -> Specification:
        return with_guarantees(self._spec, (c for m in members for c in m.constraints))

    def fails(self, members: Iterable[CoreMember]) -> bool:
        """Return whether these guarantees are proven to be unrealizable."""
        verdict = self._ask.verdict(self.with_only(members))
        self._unknown = self._unknown or verdict not in (Verdict.REALIZABLE, Verdict.UNREALIZABLE)
        return verdict is Verdict.UNREALIZABLE

    def first_failing(self, choices: Sequence[list[CoreMember]]) -> list[CoreMember]:
        """Return the first choice that fails; the last one is everything."""
        return next((few for few in choices[:-1] if self.fails(few)), choices[-1])

    def minimal(self, members: list[CoreMember], background: list[CoreMember]) -> list[CoreMember]:
        """Return the members that are needed to fail together with ``background``."""
        without = [[*background, *members[:k], *members[k + 1 :]] for k in range(len(members))]
        if len(members) <= MOST_AT_ONCE:
            self._ask.prepare([self.with_only(some) for some in without])
            if not any(map(self.fails, without)):
                return members
        return minimal_subset(members, lambda some: self.fails([*background, *some]))


def _choices(
    every: list[CoreMember], task: Task, world: RegionMap, found: Diagnosis
) -> list[list[CoreMember]]:
    """Return guarantees that probably fail already, fewest first; the last choice is all of
    them."""
    choices = []
    if found.cause is NoStrategyCause.NO_WAY:
        dividing = _dividing(task, world, found.lost)
        choices.append([part for m in every for part in _split(m) if _within(part, dividing)])
    beside = {world.step(region, heading) for region in found.confined for heading in Heading}
    choices.append([m for m in every if not _is_wall(m) or beside.intersection(m.regions)])
    return [*choices, every]


def _members(spec: Specification, task: Task, world: RegionMap) -> list[CoreMember]:
    """Return the guarantees, grouped as a person would name them, in the order of preference for a
    core: the objective first, the map last."""
    together: dict[object, list[Constraint]] = {}
    for constraint in _with_all_edges(spec, task, world):
        if is_guarantee(constraint):
            alone = constraint.origin.item == "map" or constraint.section is Section.SYS_LIVENESS
            key = (constraint,) if alone else (constraint.origin, constraint.section)
            together.setdefault(key, []).append(constraint)
    members = [_member(constraints) for constraints in together.values()]
    return sorted(members, key=lambda m: (_is_wall(m), ".objective" not in m.origin.item))


def _with_all_edges(spec: Specification, task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the constraints, with the map's edge as a part of the mobility.

    A specification omits the edge where walls are along it. Without those walls a robot could step
    from the end of a row to the beginning of the next one."""
    item = f"{task.item}.mobility"
    open_map = replace(world, walls=frozenset())
    rules = list(stepping("region", Section.SYS_TRANS, open_map, item))
    for constraint in spec.constraints:
        if constraint == rules[0]:
            yield from (replace(rule, origin=constraint.origin) for rule in rules)
        elif constraint.origin.item != item or not constraint.origin.rule.startswith("no step"):
            yield constraint


def _member(constraints: Sequence[Constraint]) -> CoreMember:
    regions = sorted({region for c in constraints for region in c.regions})
    return CoreMember(constraints[0].origin, tuple(constraints), tuple(regions))


def _is_wall(member: CoreMember) -> bool:
    return member.origin.item == "map"


def _split(member: CoreMember) -> list[CoreMember]:
    """Return a run of walls wall by wall; any other member unchanged."""
    if not _is_wall(member) or len(member.regions) == 1:
        return [member]
    section, origin = member.constraints[0].section, member.origin
    return [
        CoreMember(origin, (Constraint(section, f"region' != {r}", origin, (r,)),), (r,))
        for r in member.regions
    ]


def _within(member: CoreMember, walls: Collection[Region]) -> bool:
    return not _is_wall(member) or not member.regions or member.regions[0] in walls


def _dividing(task: Task, world: RegionMap, lost: Sequence[Target]) -> set[Region]:
    """Return a minimal set of walls that is enough to keep the robot from the first lost target.

    Walls are removed one after the other, those at the edge of the map first, unless that would
    connect the two; connections are kept by union and find."""
    parent = list(range(world.size))

    def root(region: Region) -> Region:
        while parent[region] != region:
            parent[region] = parent[parent[region]]
            region = parent[region]
        return region

    standing = set(world.walls)
    for region in world.free:
        for beside in world.neighbours(region):
            parent[root(region)] = root(beside)
    apart = [t for t in lost if root(task.pose.region) not in {root(r) for r in t}]
    if not apart:
        return standing
    target = sorted(apart[0])
    for region in target[1:]:
        parent[root(region)] = root(target[0])
    for wall in sorted(world.walls, key=lambda r: (not _at_edge(r, world), r)):
        steps = (world.step(wall, heading) for heading in Heading)
        around = [r for r in steps if r is not None and r not in standing]
        joined = {root(r) for r in around}
        if {root(task.pose.region), root(target[0])} <= joined:
            continue
        standing.discard(wall)
        for region in around:
            parent[root(region)] = root(wall)
    return standing


def _at_edge(region: Region, world: RegionMap) -> bool:
    row, col = world.position(region)
    return row in (0, world.rows - 1) or col in (0, world.cols - 1)
