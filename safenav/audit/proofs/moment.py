"""The moment that a proof concerns: each robot's pose, and the obstacles in its way."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TypeVar

from safenav.audit.proofs.formulas import Formulas
from safenav.audit.proofs.formulas import Pose as Pose

_WAYS: Mapping[str, tuple[int, int]] = {
    "north": (-1, 0),
    "east": (0, 1),
    "south": (1, 0),
    "west": (0, -1),
}
S = TypeVar("S")
_BACK = {"north": "south", "south": "north", "east": "west", "west": "east"}


@dataclass(frozen=True)
class Need:
    """``robots`` distinct robots perform ``action`` from ``regions``, ``together`` or not;
    ``same``: they are among those that met the need before it."""

    action: str
    robots: int
    regions: frozenset[int]
    together: bool
    same: bool = False


@dataclass(frozen=True)
class OpenObstacle:
    """An obstacle that is known and unresolved: the needs before ``stage`` are met, and ``done``
    have had their part in the one at it; ``group`` met the need before it. ``blocks``: robots that
    it physically stops."""

    name: str
    region: int
    needs: tuple[Need, ...]
    blocks: frozenset[str]
    stage: int = 0
    done: frozenset[str] = frozenset()
    group: frozenset[str] = frozenset()

    def able(self, robot: Robot, stage: int) -> bool:
        """Return whether the robot has the action of that stage's need, and what the same robots
        must do after it; whether it met the need before the present one, if it takes the same."""
        actions, later = {self.needs[stage].action}, stage + 1
        while later < len(self.needs) and self.needs[later].same:
            actions.add(self.needs[later].action)
            later += 1
        chosen = stage != self.stage or not self.needs[stage].same or robot.name in self.group
        return chosen and actions <= robot.capabilities

    def commits(self) -> bool:
        """Return whether meeting the present need chooses the robots for another one."""
        need, later = self.needs[self.stage], self.needs[self.stage + 1 :]
        chosen = need.same and len(self.group) <= need.robots
        return bool(later) and later[0].same and not chosen

    def closes(self, robot: Robot, stage: int | None = None) -> bool:
        """Return whether the robot may not enter: it is blocked, and does not resolve the obstacle
        by entering, given the needs unmet at that stage (default: the present one)."""
        last = self.needs[-1]
        only = (self.stage if stage is None else stage) == len(self.needs) - 1 and last.robots == 1
        only = only and not last.same
        enters = only and self.region in last.regions and last.action in robot.capabilities
        return robot.name in self.blocks and not enters

    def missing(self, stage: int) -> int:
        """Return how many robots must still have a part in the need of that stage."""
        need = self.needs[stage]
        if stage != self.stage or need.together:
            return need.robots
        return need.robots - len(self.done)


@dataclass(frozen=True)
class Robot:
    """``pose``: where it is, or will arrive. ``targets`` of its objective, met ``in_order`` or not.
    ``formulas``: what it demands where it is written in formulas; None and not ``judged`` if they
    cannot be read. ``rules``: what each of its steps keeps beside that. ``conflicts``: robots with
    which it must not share a region.

    ``ends``: its targets are to be met once, and it stays at the last one.
    ``out``: it is out of service, so it stands still and wants nothing else.

    What it has still to do, as far as its goal lines show: ``rounds_left``, of which ``met``
    targets (those of ``covered``) are met already, and one of ``awaited`` is next."""

    name: str
    has_heading: bool
    capabilities: frozenset[str]
    pose: Pose
    targets: tuple[frozenset[int], ...]
    in_order: bool
    conflicts: frozenset[str]
    awaited: tuple[int, ...]
    covered: frozenset[int]
    met: int
    rounds_left: int
    formulas: Formulas | None = None
    rules: Formulas | None = None
    judged: bool = True
    ends: bool = False
    out: bool = False


@dataclass(frozen=True)
class Moment:
    """``sealed``: regions that are permanently closed, by robot; among them those of ``shut``,
    obstacles that can never be resolved. ``rounds``: how often an objective is to be met after a
    resolution. ``zones``: robots of which at most one is in some regions."""

    rows: int
    cols: int
    free: frozenset[int]
    robots: Mapping[str, Robot]
    obstacles: Mapping[str, OpenObstacle]
    sealed: Mapping[str, frozenset[int]]
    rounds: int
    shut: frozenset[str] = frozenset()
    zones: tuple[tuple[frozenset[str], frozenset[int]], ...] = ()

    def steps(self, robot: Robot, pose: Pose) -> list[Pose]:
        """Return the poses one step away on the free map, never backwards with a heading."""
        region, faced = pose
        found: list[Pose] = []
        if robot.out:
            return found
        for way, (south, east) in _WAYS.items():
            col = region % self.cols + east
            to = region + south * self.cols + east
            if not 0 <= col < self.cols or to not in self.free:
                continue
            if not robot.has_heading:
                found.append((to, None))
            elif faced is None or way != _BACK[faced]:
                found.append((to, way))
        rules = robot.formulas or robot.rules
        return found if rules is None else [to for to in found if rules.allows(pose, to)]

    def walls(self, robot: Robot, obstacles: Iterable[OpenObstacle]) -> frozenset[int]:
        """Return the regions that the open obstacles close to a robot, and the sealed ones."""
        closed = {obstacle.region for obstacle in obstacles if obstacle.closes(robot)}
        return self.sealed[robot.name] | closed

    def closure(
        self, robot: Robot, start: Iterable[Pose], walls: frozenset[int]
    ) -> frozenset[Pose]:
        """Return all poses that the robot alone reaches from ``start`` without entering walls."""
        found = set(start)
        pending = list(found)
        while pending:
            for pose in self.steps(robot, pending.pop()):
                if pose[0] not in walls and pose not in found:
                    found.add(pose)
                    pending.append(pose)
        return frozenset(found)

    def live(self, robot: Robot, inside: frozenset[Pose], walls: frozenset[int]) -> frozenset[Pose]:
        """Return the greatest subset of a set of poses from which the robot reaches every target
        infinitely often without leaving that subset."""
        kept = {pose for pose in inside if pose[0] not in walls}
        if robot.out:
            return frozenset(kept)
        if robot.formulas is not None:
            return frozenset(pose for pose, _ in self._states(robot, robot.formulas, kept))
        before: dict[Pose, list[Pose]] = {pose: [] for pose in kept}
        for pose in kept:
            for to in self.steps(robot, pose):
                if to in kept:
                    before[to].append(pose)
        while True:
            size = len(kept)
            for target in robot.targets[-1 if robot.ends else 0 :]:
                kept = _reaching({pose for pose in kept if pose[0] in target}, before, kept)
            if len(kept) == size:
                return frozenset(kept)

    def goes_on(
        self, robot: Robot, walls: frozenset[int], memory: Mapping[str, int] | None
    ) -> bool:
        """Return whether a robot alone can continue forever from where it is, with the ``memory``
        of its formulas if that is known."""
        if robot.ends:
            return self._ends(robot, walls)
        inside = self.closure(robot, [robot.pose], walls)
        if robot.formulas is None or memory not in robot.formulas.valuations:
            return bool(self.live(robot, inside, walls))
        kept = {pose for pose in inside if pose[0] not in walls}
        number = robot.formulas.valuations.index(memory)
        return (robot.pose, number) in self._states(robot, robot.formulas, kept)

    def _ends(self, robot: Robot, walls: frozenset[int]) -> bool:
        """Return whether a robot alone can meet its remaining targets, one after the other."""
        at = {robot.pose}
        for target in robot.targets[robot.awaited[0] :]:
            reach = self.closure(robot, at, walls)
            at = {pose for pose in reach if pose[0] in target and pose[0] not in walls}
        return bool(at)

    def _states(self, robot: Robot, formulas: Formulas, inside: set[Pose]) -> set[tuple[Pose, int]]:
        """Variant of ``live`` where goals are met by steps, and staying is also a step: poses with
        the memory of the objective, by number."""
        steps = [
            ((pose, i), (to, j), goals)
            for pose in inside
            for to in [pose, *self.steps(robot, pose)]
            if to in inside
            for i, j, goals in formulas.steps(pose, to)
        ]
        kept = {state for step in steps for state in step[:2]}
        while True:
            size = len(kept)
            for goal in range(max(len(formulas.liveness), 1)):
                within = [step for step in steps if step[0] in kept and step[1] in kept]
                before: dict[tuple[Pose, int], list[tuple[Pose, int]]] = {s: [] for s in kept}
                for one, other, _ in within:
                    before[other].append(one)
                met = {one for one, _, goals in within if goal in goals or not formulas.liveness}
                kept = _reaching(met, before, kept)
            if len(kept) == size:
                return kept

    def without(self, obstacles: Iterable[str]) -> Moment:
        """Return the same moment without these obstacles."""
        gone = set(obstacles)
        rest = {name: obstacle for name, obstacle in self.obstacles.items() if name not in gone}
        return replace(self, obstacles=rest)

    def enough(self, need: Need, missing: int, places: Mapping[str, frozenset[int]]) -> bool:
        """Return whether this many of these robots can perform the need simultaneously
        (``together``) or one after the other, each from one of its places."""
        useful = {name: at & need.regions for name, at in places.items() if at & need.regions}
        if len(useful) < missing:
            return False
        if not need.together:
            return True
        return any(self.fits(group, useful) for group in combinations(sorted(useful), missing))

    def fits(self, group: tuple[str, ...], places: Mapping[str, frozenset[int]]) -> bool:
        """Return whether the robots of a group can stand at one of their places each, those in
        conflict at different ones."""
        return self._fits(list(group), places, {})

    def _fits(
        self, group: list[str], places: Mapping[str, frozenset[int]], stood: dict[str, int]
    ) -> bool:
        if not group:
            return True
        name, rest = group[0], group[1:]
        taken = {at for other, at in stood.items() if other in self.robots[name].conflicts}
        return any(
            self._fits(rest, places, stood | {name: at}) for at in sorted(places[name] - taken)
        )


def _reaching(wanted: set[S], before: Mapping[S, list[S]], kept: set[S]) -> set[S]:
    """Return the members of ``kept`` from which steps lead to ``wanted``."""
    found = set(wanted)
    pending = list(found)
    while pending:
        for state in before[pending.pop()]:
            if state in kept and state not in found:
                found.add(state)
                pending.append(state)
    return found
