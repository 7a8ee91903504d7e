"""Joint proofs: robots that share a floor cannot complete the mission, whatever each does.

The joint states are enumerated: each robot's pose and remaining goals, and the stage of each
obstacle. One robot moves at a time, into a region without a robot in conflict with it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import cache
from heapq import heappop, heappush
from itertools import product
from typing import Any, NamedTuple

from safenav.judge.lines import Line
from safenav.judge.proofs.case import Case, Open, TooLargeError
from safenav.judge.world import Poses

MOST_STATES = 200_000
EITHER = ELSEWHERE = -1
Left = tuple[int, int]
"""In order: the goals left, and the next one (``EITHER``: the one met first). In any order: the
rounds left, and a bit mask of the targets met in this one."""


class Goals(NamedTuple):
    """The goals of a robot. ``settles``: the mission ends only while it is at the last,
    ``ends``: it also meets each once; ``either``: after a resolution, either may be
    first."""

    targets: list[Poses]
    in_order: bool
    settles: bool
    ends: bool
    starts: list[Left]
    either: bool


class _State(NamedTuple):
    poses: tuple[Any, ...]
    left: tuple[Left, ...]
    opened: tuple[Open, ...]


def joint_problems(proof: Line, case: Case) -> Iterator[str]:
    """Yield the errors of a joint proof. Raises TooLargeError."""
    opened = {one.name: one for one in case.obstacles}
    stages = {name: stage for name, stage in proof.stages.items() if name not in case.shut}
    robots = [name for name in case.names if name in proof.robots]
    if not robots or len(robots) != len(proof.robots):
        yield f"the proof is about {', '.join(proof.robots) or 'no robots'}"
        return
    for name in robots:
        if proof.start.get(name) != case.at[name][:2]:
            yield f"{name} is at {case.at[name][0]}, not where the proof begins"
            return
    for name, stage in stages.items():
        if name not in opened or opened[name].stage != stage:
            yield f"{name} is not open with {stage} of its needs met"
            return
        able = frozenset[str]().union(*(need.able for need in opened[name].left))
        if helpers := sorted(able - {*robots}):
            yield f"{helpers[0]}, which the proof omits, may help to resolve {name}"
            return
    if proof.states > MOST_STATES:
        raise TooLargeError(f"{proof.states} joint states; at most {MOST_STATES} are enumerated")
    known = tuple(one for one in case.obstacles if one.name in stages)
    every, poses = Enumeration(case, robots, known), set[tuple[Any, ...]]()
    for state, seen in every.reached():
        poses.add(tuple(pose[:2] for pose in state.poses))
        if every.is_complete(state):
            at = zip(robots, state.poses, strict=True)
            yield f"the mission can be completed with {', '.join(f'{n} at {p[0]}' for n, p in at)}"
            return
        if seen > MOST_STATES:
            raise TooLargeError(f"more than {MOST_STATES} joint states")
        if len(poses) > proof.states:
            yield f"more states are reachable than the {proof.states} of the proof"
            return
    lines = sorted(json.dumps(one, separators=(",", ":")) + "\n" for one in poses)
    if len(poses) != proof.states:
        yield f"{len(poses)} states are reachable, not {proof.states}"
    elif hashlib.sha256("".join(lines).encode()).hexdigest() != proof.sha256:
        yield "the reachable states are not those of the proof (sha256)"


def can_complete(case: Case, most: int) -> str:
    """Return where the robots may go to complete what those in service have to do; empty if they
    cannot, or have done it. Raises TooLargeError."""
    every = Enumeration(case, case.names, case.obstacles)
    for state, seen in every.reached():
        if every.is_complete(state) and case.state.orders.isdisjoint(o.name for o in state.opened):
            if all(
                pose == case.at[name] for name, pose in zip(case.names, state.poses, strict=True)
            ):
                return ""
            at = zip(case.names, state.poses, strict=True)
            return ", ".join(f"{name} at {pose[0]}" for name, pose in at)
        if seen > most:
            raise TooLargeError(f"more than {most} joint states")
    return ""


def room_problems(proof: Line, case: Case) -> Iterator[str]:
    """Yield the errors of a proof that robots have no room at their last targets."""
    robots, s = {*proof.robots}, case.state
    if not robots or robots - {*case.names}:
        yield "the proof names no robots of the team"
        return
    regions = set[int]()
    for name in robots:
        if not s.robots[name].own.settles or robots - {name, *s.rivals[name]}:
            yield f"{name} need not stay at a target, or may share its region"
            return
        regions |= s.robots[name].own.last
    if len(regions) >= len(robots):
        yield f"there is room at {len(regions)} regions for {len(robots)} robots"


def goals_of(name: str, case: Case) -> Goals:
    """Return the goals that a robot has still to meet."""
    robot, s = case.state.robots[name], case.state
    if name in case.out:
        return Goals([frozenset([case.at[name]])], True, False, False, [(0, 0)], False)
    own, progress, wanted = robot.own, robot.progress, case.state.scenario.until.rounds or 1
    steps, count = case.state.world.graph(robot.faces), robot.own.count
    targets = [frozenset(pose for pose in steps if pose[0] in target) for target in own.targets]
    if own.kind == "ltl":
        targets = case.members[name].aims
    ends, rounds = own.ends, progress.rounds(own, s.tick)
    either = own.strict and not own.literal and count == 2
    if ends:
        first = min(progress.ahead, count - 1)
        starts = [((count - first) * (not progress.ended(own)), first)]
    elif own.settles:
        starts = [(int(rounds < 1), 0)]
    elif own.in_turn:
        left, turn = max(wanted * count - progress.goals, 0), progress.turn or 0
        free = own.strict and not own.literal and not progress.goals
        firsts = [turn]
        if own.literal and progress.turn is None:  # with the target on which it starts
            firsts += [k for k in range(1, count) if case.at[name] in targets[k]]
        starts = [(left, k) for k in (range(count) if free else firsts)]
        starts = [(left, EITHER)] if free and either else starts
    else:
        met = progress.seen if own.covers else _partly(progress.counts)
        starts = [(max(wanted - rounds, 0), sum(1 << k for k in met))]
    ordered = own.in_turn or own.settles
    return Goals(targets, ordered, own.settles, ends, starts, either)


def _partly(counts: tuple[int, ...]) -> list[int]:
    return [k for k, n in enumerate(counts) if n > min(counts)]


class Enumeration:
    """The joint states of some robots with some open obstacles."""

    def __init__(self, case: Case, robots: list[str], opened: tuple[Open, ...]) -> None:
        self.case, self.robots, self.opened = case, robots, opened
        self.goals = [goals_of(name, case) for name in robots]
        self._acted, self._walls = cache(self._act), cache(case.walls)
        self._live = cache(case.is_live)

    def reached(self) -> Iterator[tuple[_State, int]]:
        """Yield the reachable states, those with the fewest goals left first, each with the number
        of states found before it."""
        queue, seen, after = list[tuple[int, int, _State]](), set[_State](), self._starts()
        while True:
            for found in after:
                if found not in seen:
                    seen.add(found)
                    left = sum(goals for goals, _ in found.left)
                    heappush(queue, (left, len(seen), found))
            if not queue:
                return
            _, _, state = heappop(queue)
            yield state, len(seen)
            after = self._successors(state)

    def _starts(self) -> Iterator[_State]:
        poses = tuple(self.case.at[name] for name in self.robots)
        for left in product(*(own.starts for own in self.goals)):
            yield self._settled(_State(poses, left, self.opened))

    def _successors(self, state: _State) -> Iterator[_State]:
        s, at = self.case.state, dict(zip(self.robots, state.poses, strict=True))
        for k, name in enumerate(self.robots):
            taken = {at[other][0] for other in s.rivals[name] if other in at}
            for robots, regions in s.zones:
                mates = (at[other][0] for other in robots - {name} if other in at)
                if name in robots and not regions.isdisjoint(mates):
                    taken |= regions
            taken |= self._walls(name, state.opened)
            for to in self.case.members[name].steps.get(at[name], ()):
                if to[0] not in taken:
                    poses = (*state.poses[:k], to, *state.poses[k + 1 :])
                    yield self._settled(_State(poses, state.left, state.opened), k)

    def is_complete(self, state: _State) -> bool:
        """Return whether each robot has met all goals, is at its last target if it settles there,
        and can continue forever."""
        if any(goals for goals, _ in state.left):
            return False
        each = zip(self.robots, self.goals, state.poses, strict=True)
        return all(
            (not own.settles or pose in own.targets[-1]) and self._live(name, pose, state.opened)
            for name, own, pose in each
        )

    def _settled(self, state: _State, moved: int | None = None) -> _State:
        """Return the state after all actions, then all goals, of the robots where they stand."""
        regions = frozenset(
            region for one in state.opened for need in one.left for region in need.regions
        )
        places = tuple(p[0] if p[0] in regions else ELSEWHERE for p in state.poses)
        after, left = self._acted(state.opened, places), state.left
        flat = self.case.state.scenario.flat
        restarts = any(not one.left and one.order[0] != flat for one in after)
        opened = tuple(one for one in after if one.left)
        if moved is not None and not restarts:
            met = _met(self.goals[moved], state.poses[moved], left[moved])
            return _State(state.poses, (*left[:moved], met, *left[moved + 1 :]), opened)
        if restarts:
            left = tuple(map(self._anew, self.goals, left))
        return _State(state.poses, tuple(map(_met, self.goals, state.poses, left)), opened)

    def _act(self, opened: tuple[Open, ...], places: tuple[int, ...]) -> tuple[Open, ...]:
        """Return the obstacles after all actions. Loads are taken last, in their order, by robots
        that can carry one more."""
        at = dict(zip(self.robots, places, strict=True))
        after = [_performed(one, at, None) for one in opened]
        loads = [k for k, one in enumerate(after) if one.left and one.takes()]
        for k in sorted(loads, key=lambda k: after[k].order):
            after[k] = _performed(after[k], at, self.case.full(one for one in after if one.left))
        return tuple(after)

    def _anew(self, own: Goals, left: Left) -> Left:
        """Return the remaining goals after a resolution: rounds restart, the order is kept."""
        rounds, count = self.case.state.scenario.until.rounds or 1, len(own.targets)
        if own.ends:
            return count - left[1], left[1]
        if own.settles:
            return 1, 0
        if not own.in_order:
            return rounds, 0
        return rounds * count, EITHER if own.either else left[1]


def _performed(one: Open, at: dict[str, int], full: frozenset[str] | None) -> Open:
    """Return an obstacle after the actions of the robots where they stand. ``full``: robots that
    can take no other load; None: no robot takes one now."""
    while one.left:
        need, takes = one.left[0], one.takes()
        if takes and full is None:
            return one
        able = (need.able - one.barred - need.cut) & at.keys()
        able -= full or frozenset() if takes else frozenset()
        group = frozenset(name for name in able if at[name] in need.regions)
        if takes and not need.together:  # one after the other, in the order of their turns
            missing = need.robots - len(one.done)
            group = frozenset([name for name in at if name in group - one.done][:missing])
        group |= frozenset() if need.together else one.done
        if len(group) < need.robots:
            return one if need.together else one._replace(done=group)
        one = one.advanced(group)
    return one


def _met(own: Goals, pose: Any, left: Left) -> Left:
    goals, covered = left  # in order: the next goal
    count = len(own.targets)
    if goals and all(pose in target for target in own.targets):  # it meets all rounds here
        after = max(covered, 0) + goals
        then = min(after, count - 1) if own.ends else after % count
        return 0, then if own.in_order else 0
    if own.in_order:
        if covered == EITHER:
            covered = next((k for k, t in enumerate(own.targets) if pose in t), EITHER)
        while goals and covered != EITHER and pose in own.targets[covered]:
            last = own.ends and covered == count - 1
            goals, covered = goals - 1, covered if last else (covered + 1) % count
        return goals, covered
    here = sum(1 << k for k, target in enumerate(own.targets) if pose in target)
    while goals:
        covered |= here
        if covered != (1 << count) - 1:
            return goals, covered
        goals, covered = goals - 1, 0
    return 0, 0
