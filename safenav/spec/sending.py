"""Where a robot can be sent from where, without giving up its own objective.

Ways may be one-way (headings in a corridor, formulas about steps), and a joint plan or an errand
leads a robot through them. So what it can be sent to depends on where it is.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache

from safenav.components import components
from safenav.dataclass import dataclass
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl, Objective, targets_of
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose, moves


@dataclass(frozen=True)
class Part:
    """Regions, and poses from which they matter."""

    regions: frozenset[Region]
    poses: frozenset[Pose]


@dataclass(frozen=True)
class Sending:
    """``places``: where the robot can be sent from somewhere. ``parts``: regions to which it can be
    sent from some poses only, and those. ``homes``: where it can go round and meet its objective
    for ever, if there are several such regions: for each of them the poses that are there or on the
    way to it. A robot stays among them unless it is sent elsewhere."""

    places: frozenset[Region]
    parts: tuple[Part, ...] = ()
    homes: tuple[Part, ...] = ()

    def allows(self, pose: Pose, place: Region) -> bool:
        """Whether the robot can be sent from a pose to a place."""
        parts = (part for part in self.parts if place in part.regions)
        return place in self.places and all(pose in part.poses for part in parts)


def sending(task: Task, world: RegionMap) -> Sending:
    """Where the robot of a task can be sent."""
    blocked = frozenset(known.region for known in task.blocked)
    return _sending(task.robot.model.mobility, task.pose, task.objective, blocked, world)


def whereabouts(task: Task, world: RegionMap) -> frozenset[Region]:
    """The regions that the robot of a task can ever come to."""
    blocked = frozenset(known.region for known in task.blocked)
    ways = _ways(task.robot.model.mobility, task.pose, task.objective, blocked, world)
    return frozenset(pose.region for pose in ways)


@lru_cache(maxsize=64)
def _sending(
    mobility: Mobility,
    start: Pose,
    objective: Objective,
    blocked: frozenset[Region],
    world: RegionMap,
) -> Sending:
    ways = _ways(mobility, start, objective, blocked, world)
    poses = list(ways)
    number = {pose: index for index, pose in enumerate(poses)}
    graph = [[number[after] for after in ways[pose]] for pose in poses]
    rounds = [[poses[index] for index in members] for members in components(graph)]
    of_pose = {pose: k for k, members in enumerate(rounds) for pose in members}
    home: list[int | None] = []  # of each round the one where the robot goes on for ever
    reach: list[frozenset[Region]] = []  # the regions that it can reach and still go on
    for k, members in enumerate(rounds):  # what one leads to comes before it
        after = sorted({of_pose[to] for pose in members for to in ways[pose]} - {k})
        after = [to for to in after if home[to] is not None]
        best = max(after, key=lambda to: len(rounds[home[to] or 0]), default=None)
        own = k if _meets(members, ways, objective) else None
        home.append(own if own is not None or best is None else home[best])
        here = () if home[k] is None else (pose.region for pose in members)
        reach.append(frozenset(here).union(*(reach[to] for to in after)))
    if home[of_pose[start]] is None:  # it cannot meet its objective from where it starts
        return Sending(frozenset({start.region}))
    if isinstance(objective, Ltl) and guarantees_of(objective).remember_something:
        # With some memory it could; with what it remembers it may not, once it has left.
        there = rounds[home[of_pose[start]] or 0]
        return Sending(frozenset(pose.region for pose in there))
    parts = _parts(rounds, reach)
    places = frozenset[Region]().union(*(part.regions for part in parts))
    alive = sum(len(members) for members, found in zip(rounds, reach, strict=True) if found)
    return Sending(
        places or frozenset({start.region}),
        tuple(part for part in parts if len(part.poses) < alive),
        _homes(rounds, home),
    )


def _parts(rounds: list[list[Pose]], reach: list[frozenset[Region]]) -> list[Part]:
    """Regions that can be reached from the same poses, with those; none that can be reached only
    by standing there."""
    sources: dict[Region, list[int]] = {}
    for k, regions in enumerate(reach):
        for region in sorted(regions):
            sources.setdefault(region, []).append(k)
    found: dict[tuple[int, ...], set[Region]] = {}
    for region, of in sources.items():
        if any(pose.region != region for k in of for pose in rounds[k]):
            found.setdefault(tuple(of), set()).add(region)
    return [
        Part(frozenset(regions), frozenset(pose for k in of for pose in rounds[k]))
        for of, regions in found.items()
    ]


def _homes(rounds: list[list[Pose]], home: list[int | None]) -> tuple[Part, ...]:
    """The homes with the poses on the way to them; nothing if all are the same regions."""
    found: dict[frozenset[Region], set[Pose]] = {}
    for k, at in enumerate(home):
        if at is not None:
            regions = frozenset(pose.region for pose in rounds[at])
            found.setdefault(regions, set()).update(rounds[k])
    if len(found) == 1:
        return ()
    return tuple(Part(regions, frozenset(poses)) for regions, poses in found.items())


def _meets(members: list[Pose], ways: dict[Pose, tuple[Pose, ...]], objective: Objective) -> bool:
    """Whether a robot that goes round among these poses can meet its objective for ever."""
    if not isinstance(objective, Ltl):
        regions = {pose.region for pose in members}
        return all(target & regions for target in targets_of(objective))
    formulas, inside = guarantees_of(objective), set(members)
    return all(
        any(
            formulas.meets(goal, pose, after)
            for pose in members
            for after in ways[pose]
            if after in inside
        )
        for goal in range(formulas.goals)
    )


def _ways(
    mobility: Mobility,
    start: Pose,
    objective: Objective,
    blocked: Collection[Region],
    world: RegionMap,
) -> dict[Pose, tuple[Pose, ...]]:
    """The poses that the robot can come to, each with those that are a step away."""
    formulas = guarantees_of(objective) if isinstance(objective, Ltl) else None
    after: dict[Pose, tuple[Pose, ...]] = {}
    queue = [start]
    while queue:
        pose = queue.pop()
        if pose in after:
            continue
        steps = moves(mobility, pose, world, blocked)
        if formulas is not None:
            steps = tuple(to for to in steps if to == pose or formulas.allows(pose, to))
        after[pose] = steps
        queue += steps
    return after
