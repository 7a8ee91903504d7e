"""Input data of the coordination solver: robots that move, obstacles that need actions.

Frozen and without any reference to a running mission, so that every decision of this package is
a function of it. Robots are numbered in the scenario's order, obstacles in the order of encounter.
Permanent obstacles (the paper's set O) are no longer among them: they are missing from the
``floor`` of the robots that they block.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cached_property

from msgspec import Struct
from msgspec.structs import replace

from safenav.cached_method import cached_method
from safenav.scenario import needs
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.pursuit import Pursuit
from safenav.world.map import RegionMap
from safenav.world.poses import Mask, PoseGraph, bits, region_mask


class BudgetExhaustedError(Exception):
    """A search has used up its budget: nothing is proven."""


class OpenNeed(Struct, frozen=True):
    """A need of an obstacle: ``robots`` different robots perform ``action``, each in one of
    ``regions`` (a mask), all in the same tick if ``together``; ``same``: they are among those that
    fulfilled the need before it."""

    action: str
    robots: int
    regions: Mask
    together: bool = False
    same: bool = False


class Stage(Struct, frozen=True):
    """Progress of an obstacle: the next need, and the robots that fulfilled their part of it.
    ``group``: those that met the need before it, if the same must meet this one (None: any)."""

    need: int = 0
    done: frozenset[int] = frozenset()
    group: frozenset[int] | None = None


Stages = tuple[Stage, ...]
"""The stage of each obstacle."""


class OpenObstacle(Struct, frozen=True, dict=True):
    """An obstacle that is known and not resolved. ``closed_to``: for each need, the robots that
    must not enter while it is the next. ``barred``: robots that do nothing for it although they
    have the action. ``refused``: robots for whose duty no strategy was found; one that gets there
    still acts. ``order``: robots take loads in this order where they can take several.
    ``restarts``: rounds restart when it is resolved. ``cut_off``: for each need, the robots that do
    not take a load by it, since no path leads them to where it is put down."""

    name: str
    region: int
    closed_to: tuple[frozenset[int], ...]
    needs: tuple[OpenNeed, ...]
    barred: frozenset[int] = frozenset()
    order: tuple[str, int, int] = ("", 0, 0)
    refused: frozenset[int] = frozenset()
    restarts: bool = True
    cut_off: tuple[frozenset[int], ...] = ()

    @classmethod
    def of(
        cls,
        obstacle: Obstacle,
        robots: Sequence[Robot],
        world: RegionMap,
        barred: frozenset[int] = frozenset(),
        refused: frozenset[int] = frozenset(),
    ) -> OpenObstacle:
        """An obstacle of the scenario."""
        parts, closed = [], []
        for number, need in enumerate(obstacle.needs):
            regions = region_mask(obstacle.resolution_regions(world, number))
            parts.append(OpenNeed(need.action, need.robots, regions, need.together, need.same))
            blocked = (i for i, robot in enumerate(robots) if obstacle.closed_to(robot, number))
            closed.append(frozenset(blocked))
        about = obstacle.name, obstacle.region
        return cls(*about, tuple(closed), tuple(parts), barred, obstacle.order, refused)

    @cached_property
    def skills(self) -> tuple[frozenset[str], ...]:
        """Return for each need the actions that a robot must have: its own, and those of the needs
        that the same robots must meet after it."""
        return tuple(needs.actions(self.needs, number) for number in range(len(self.needs)))

    def cut_off_at(self, need: int) -> frozenset[int]:
        """Return the robots that do not take a load by a need."""
        return self.cut_off[need] if self.cut_off else frozenset()

    def chain(self, need: int) -> tuple[OpenNeed, ...]:
        """A need, and those after it that the same robots must meet."""
        return tuple(needs.chain(self.needs, need))

    def resolved(self, stage: Stage) -> bool:
        return stage.need >= len(self.needs)

    def takes(self, stage: Stage) -> bool:
        """Whether the robots that meet the next need carry a load from then on."""
        return needs.takes(self.needs, stage.need)

    def carriers(self, stage: Stage) -> frozenset[int]:
        """The robots that carry it, if it is a load: those that took it or their part of it."""
        if not self.resolved(stage) and self.needs[stage.need].same:
            return stage.group or frozenset()
        return stage.done if stage.done and self.takes(stage) else frozenset()

    def advanced(self, stage: Stage, group: Collection[int] | None) -> Stage:
        """The stage after the next need is met, by ``group`` (None: unknown) and those that
        had their part in it before."""
        met = stage.group if group is None else stage.done.union(group)
        same = len(self.chain(stage.need)) > 1
        return Stage(stage.need + 1, group=met if same else None)

    def acted(self, stage: Stage, group: Collection[int]) -> Stage:
        """The stage after a group has acted on the next need."""
        done, met = needs.group_of(self.needs[stage.need], stage.done, group)
        return self.advanced(stage, group) if met else replace(stage, done=done)


class Member(Struct, frozen=True, eq=False):
    """A robot as coordination sees it. ``floor``: the poses that walls, permanent obstacles and its
    own safety lines allow. ``targets``: pose masks, in order; ``in_turn``: they count in this order
    only; ``settles``: it stays at the last one. ``ticks``: those of a step. ``laden``: it carries a
    load that no robot can ever put down. ``any_first``: until it has met one of its targets, any of
    them may come first."""

    name: str
    graph: PoseGraph
    floor: Mask
    targets: tuple[Mask, ...]
    in_turn: bool
    settles: bool
    capabilities: frozenset[str]
    ticks: int = 1
    laden: bool = False
    any_first: bool = False

    def live(self, allowed: Mask) -> Mask:
        """Return the ``allowed`` poses from which it can continue forever inside them. Only the
        last target counts if it settles there: its strategy finds the path."""
        return self.graph.live(self.targets[-1:] if self.settles else self.targets, allowed)

    @property
    def pursuit(self) -> Pursuit:
        """The order in which its targets count."""
        return Pursuit(len(self.targets), self.in_turn, self.settles)

    def awaited(self, memory: int) -> Mask:
        """Return the poses of the targets that it may meet next, with this memory of its
        pursuit."""
        found = 0
        for target in bits(self.pursuit.awaited(memory)):
            found |= self.targets[target]
        return found

    @property
    def turns(self) -> bool:
        """Return whether some moves cannot be undone by going back."""
        return self.graph.one_way


Zones = tuple[tuple[frozenset[int], Mask], ...]
"""Groups of robots with the regions in which at most one of them may be."""


class Separation(Struct, frozen=True):
    """Rules that separate robots. ``sizes``: number of regions of each robot's map, which gives a
    pose's region."""

    sizes: Sequence[int]
    conflicts: Sequence[frozenset[int]]
    zones: Zones = ()

    def closed(self, robot: int, *moments: Sequence[int]) -> Mask:
        """Return the regions that other robots close to one robot at some joint poses."""
        found = 0
        for other in self.conflicts[robot]:
            for poses in moments:
                found |= 1 << poses[other] % self.sizes[other]
        for robots, zone in self.zones:
            others = robots - {robot} if robot in robots else ()
            if any(zone >> p[o] % self.sizes[o] & 1 for o in others for p in moments):
                found |= zone
        return found


class Problem(Struct, frozen=True, eq=False, dict=True):
    """A team and the obstacles that it knows. ``conflicts``: for each robot those with which it
    must never share a region. ``zones``: robots of which at most one is in some regions.
    The obstacles are listed in the order in which they are served.
    """

    members: tuple[Member, ...]
    gates: tuple[OpenObstacle, ...]
    conflicts: tuple[frozenset[int], ...]
    zones: Zones = ()

    @cached_property
    def separation(self) -> Separation:
        """The rules that separate robots."""
        sizes = tuple(member.graph.size for member in self.members)
        return Separation(sizes, self.conflicts, self.zones)

    def interferes(self, robot: int) -> bool:
        """Whether it may have to wait for another robot."""
        return bool(self.conflicts[robot]) or any(robot in group for group, _ in self.zones)

    def resolved(self, gate: int, stages: Stages) -> bool:
        return self.gates[gate].resolved(stages[gate])

    def open(self, stages: Stages) -> list[int]:
        """The obstacles that are not resolved."""
        both = enumerate(zip(self.gates, stages, strict=True))
        return [number for number, (gate, stage) in both if stage.need < len(gate.needs)]

    def next_need(self, gate: int, stages: Stages) -> OpenNeed:
        return self.gates[gate].needs[stages[gate].need]

    def allowed(self, robot: int, stages: Stages) -> Mask:
        """The poses of a robot's floor outside the open obstacles that it must not enter."""
        both = enumerate(zip(self.gates, stages, strict=True))
        closed = tuple(
            number
            for number, (gate, stage) in both
            if stage.need < len(gate.needs) and robot in gate.closed_to[stage.need]
        )
        return self._floor_without(robot, closed)

    @cached_method
    def live(self, stages: Stages) -> tuple[Mask, ...]:
        """Return for each robot the poses from which it can continue forever now."""
        return tuple(m.live(self.allowed(i, stages)) for i, m in enumerate(self.members))

    @cached_method
    def acting_in(self, stages: Stages) -> tuple[Mask, ...]:
        """Return for each robot the poses in which it may take part in the next need of an
        obstacle. So most joint states are searched without a look at the obstacles."""
        masks = [0] * len(self.members)
        for gate in self.open(stages):
            regions = self.next_need(gate, stages).regions
            for i in self.acting(gate, stages):
                masks[i] |= self.members[i].graph.poses_on(regions)
        return tuple(masks)

    def able(self, gate: int, stages: Stages) -> list[int]:
        """The robots that can be sent for the obstacle's next need, in the team's order."""
        return [i for i in self.acting(gate, stages) if i not in self.gates[gate].refused]

    def acting(self, gate: int, stages: Stages) -> list[int]:
        """The robots that act on the obstacle's next need where they can, in the team's order."""
        out = stages[gate].done | self.gates[gate].barred
        if self.takes(gate, stages):
            out |= self.full(stages) | self.gates[gate].cut_off_at(stages[gate].need)
        return [i for i in self.skilled(gate, stages) if i not in out]

    def takes(self, gate: int, stages: Stages) -> bool:
        """Return whether robots that fulfil an obstacle's next need carry a load from then on."""
        return self.gates[gate].takes(stages[gate])

    def full(self, stages: Stages) -> frozenset[int]:
        """The robots that carry a load, and so can take no other."""
        gates = zip(self.gates, stages, strict=True)
        laden = frozenset(i for i, member in enumerate(self.members) if member.laden)
        return laden.union(*(gate.carriers(stage) for gate, stage in gates))

    def skilled(self, gate: int, stages: Stages) -> list[int]:
        """Return the robots with the actions of the obstacle's next need and of the 'same' needs
        after it; if the next need is a 'same' one, only robots that fulfilled the need before
        it."""
        stage = stages[gate]
        actions = self.gates[gate].skills[stage.need]
        return [
            i
            for i, member in enumerate(self.members)
            if actions <= member.capabilities and (stage.group is None or i in stage.group)
        ]

    def commits(self, gate: int, stages: Stages) -> bool:
        """Whether fulfilling the next need also chooses the robots of a later one."""
        stage, gate_ = stages[gate], self.gates[gate]
        chosen = stage.group is not None and len(stage.group) <= gate_.needs[stage.need].robots
        return len(gate_.chain(stage.need)) > 1 and not chosen

    def missing(self, gate: int, stages: Stages) -> int:
        """Return the number of further robots that the next need takes."""
        return self.next_need(gate, stages).robots - len(stages[gate].done)

    def advanced(self, gate: int, stages: Stages, group: Collection[int] | None = None) -> Stages:
        """The stages after the next need of an obstacle is met, see ``OpenObstacle.advanced``."""
        return put(stages, gate, self.gates[gate].advanced(stages[gate], group))

    def acted(self, gate: int, stages: Stages, group: Collection[int]) -> Stages:
        """The stages after a group has acted on the next need of an obstacle."""
        return put(stages, gate, self.gates[gate].acted(stages[gate], group))

    @property
    def nothing_done(self) -> Stages:
        return (Stage(),) * len(self.gates)

    @cached_method
    def _floor_without(self, robot: int, closed: tuple[int, ...]) -> Mask:
        member, walls = self.members[robot], region_mask(self.gates[gate].region for gate in closed)
        return member.floor & ~member.graph.poses_on(walls)


def put(stages: Stages, gate: int, stage: Stage) -> Stages:
    return (*stages[:gate], stage, *stages[gate + 1 :])


class Floor(Struct, frozen=True):
    """A snapshot of a mission for coordination. Names: ``names``, of the robots; ``gates``, of the
    open obstacles, in the order of service; ``given_up``, of those that no robot can ever
    resolve."""

    problem: Problem
    stages: Stages
    poses: tuple[int, ...]
    names: tuple[str, ...]
    gates: tuple[str, ...]
    given_up: tuple[str, ...] = ()

    def index(self, robot: str) -> int:
        return self.names.index(robot)

    def reach(self, robot: int) -> Mask:
        """The poses that a robot can reach from its present one if open obstacles are walls."""
        allowed = self.problem.allowed(robot, self.stages)
        return self.problem.members[robot].graph.closure(1 << self.poses[robot], allowed)
