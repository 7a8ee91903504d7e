"""Joint proofs: robots that share a floor cannot complete, whatever each of them does.

The joint states are enumerated again: each robot's pose, the goals that it has still to meet, the
stage of each obstacle. One robot moves at a time into a region that no robot in conflict with it
occupies. Accepted if no reachable state completes the mission, and if the reachable poses are those
that the proof counts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import product

from safenav.audit.proofs.moment import Moment, OpenObstacle, Pose, Robot
from safenav.audit.proofs.reading import mapping, names, pose, whole

MOST_STATES = 200_000

Left = tuple[int, int]
"""Remaining work of a robot: in order, the goals left and which is next; otherwise the rounds left
and the targets covered in this one, bit by bit."""

Stage = tuple[str, int, frozenset[str], frozenset[str]]
"""An obstacle, its next need, who has had a part in that, and who met the need before it if it
takes the same robots."""


@dataclass(frozen=True)
class _State:
    poses: tuple[Pose, ...]
    left: tuple[Left, ...]
    stages: tuple[Stage, ...]

    @property
    def rank(self) -> int:
        """Rank of a state: those with less to do are examined first, so that a false proof is
        refuted early."""
        return sum(goals for goals, _ in self.left)


def joint_problems(proof: Mapping[str, object], moment: Moment) -> Iterator[str]:
    """Yield why a joint proof does not hold."""
    listed = names(proof.get("robots"), "robots")
    start = {
        name: pose(one, f"the start of {name}")
        for name, one in mapping(proof.get("start"), "start").items()
    }
    stages = {
        name: whole(one, f"the stage of {name}")
        for name, one in mapping(proof.get("stages"), "stages").items()
        if name not in moment.shut
    }
    told, digest = whole(proof.get("states"), "states"), proof.get("sha256")
    strangers = sorted({*listed, *start} - moment.robots.keys())
    if strangers or not listed:
        yield f"the proof names {', '.join(strangers) or 'no robots'}"
        return
    for name in listed:
        if start.get(name) != moment.robots[name].pose:
            yield f"{name} is at {moment.robots[name].pose}, not where the proof begins"
            return
    problem = _stages_problem(stages, set(listed), moment)
    if problem:
        yield problem
        return
    if told > MOST_STATES:
        yield f"{told} states exceed the {MOST_STATES} that the audit enumerates"
        return
    robots = [moment.robots[name] for name in moment.robots if name in listed]
    if not all(robot.judged for robot in robots):
        return  # what their formulas demand is more than is read here
    yield from _Enumeration(
        moment.without(moment.obstacles.keys() - stages.keys()), robots
    ).problems(told, digest)


def _stages_problem(stages: Mapping[str, int], listed: set[str], moment: Moment) -> str:
    outside = [robot for name, robot in moment.robots.items() if name not in listed]
    for name, stage in stages.items():
        obstacle = moment.obstacles.get(name)
        if obstacle is None:
            return f"{name} is unknown or already resolved, so it blocks no robot"
        if stage != obstacle.stage:
            return f"{name} has {obstacle.stage} of its needs fulfilled, not {stage}"
        rest = {need.action for need in obstacle.needs[stage:]}
        helper = next((robot for robot in outside if rest & robot.capabilities), None)
        if helper is not None:
            return f"{helper.name}, which the proof omits, may help to resolve {name}"
    return ""


class _Enumeration:
    def __init__(self, moment: Moment, robots: list[Robot]) -> None:
        self._moment = moment
        self._robots = robots
        self._obstacles = dict(moment.obstacles)
        self._rivals = [
            [k for k, other in enumerate(robots) if other.name in robot.conflicts]
            for robot in robots
        ]
        self._walls: dict[tuple[Stage, ...], list[frozenset[int]]] = {}
        self._live: dict[tuple[str, frozenset[int]], frozenset[Pose]] = {}
        self._steps: list[dict[Pose, list[Pose]]] = [{} for _ in robots]

    def problems(self, told: int, digest: object) -> Iterator[str]:
        queue: list[tuple[int, int, _State]] = []
        seen: set[_State] = set()
        poses: set[tuple[Pose, ...]] = set()
        for state in self._starts():
            self._find(state, seen, poses, queue)
        while queue:
            _, _, state = heappop(queue)
            if self._is_complete(state):
                places = ", ".join(
                    f"{robot.name} at {at[0]}"
                    for robot, at in zip(self._robots, state.poses, strict=True)
                )
                yield f"the mission can be completed: every objective is met with {places}"
                return
            for after in self._successors(state):
                self._find(after, seen, poses, queue)
            if len(seen) > MOST_STATES:
                yield f"more than {MOST_STATES} states: too many for the audit"
                return
            if len(poses) > told:
                yield f"more states are reachable than the {told} of the proof"
                return
        if len(poses) != told:
            yield f"{len(poses)} states are reachable, not {told}"
        elif digest != _digest(poses):
            yield "the reachable states are not those of the proof (sha256)"

    def _find(
        self,
        state: _State,
        seen: set[_State],
        poses: set[tuple[Pose, ...]],
        queue: list[tuple[int, int, _State]],
    ) -> None:
        if state not in seen:
            seen.add(state)
            poses.add(state.poses)
            heappush(queue, (state.rank, len(seen), state))

    def _starts(self) -> list[_State]:
        choices: list[list[Left]] = []
        for robot in self._robots:
            if robot.ends:
                (first,) = robot.awaited
                choices.append([((len(robot.targets) - first) * (robot.rounds_left > 0), first)])
            elif robot.in_order:
                count = len(robot.targets)
                goals = max(robot.rounds_left * count - robot.met, 0)
                choices.append([(goals, k) for k in robot.awaited])
            else:
                choices.append([(robot.rounds_left, sum(1 << k for k in robot.covered))])
        poses = tuple(robot.pose for robot in self._robots)
        stages = tuple(
            (g.name, g.stage, g.done, g.group if g.needs[g.stage].same else frozenset())
            for _, g in sorted(self._obstacles.items())
        )
        return [self._settled(_State(poses, left, stages)) for left in product(*choices)]

    def _successors(self, state: _State) -> Iterator[_State]:
        closed = self._closed(state.stages)
        for k, robot in enumerate(self._robots):
            taken = {state.poses[other][0] for other in self._rivals[k]}
            known = self._steps[k]
            for group, zone in self._moment.zones:
                mates = [o for i, o in enumerate(self._robots) if i != k and o.name in group]
                if robot.name in group and any(
                    state.poses[self._robots.index(o)][0] in zone for o in mates
                ):
                    taken |= zone
            here = state.poses[k]
            if here not in known:
                known[here] = self._moment.steps(robot, here)
            for to in known[here]:
                if to[0] not in taken and to[0] not in closed[k]:
                    poses = (*state.poses[:k], to, *state.poses[k + 1 :])
                    yield self._settled(replace(state, poses=poses))

    def _closed(self, stages: tuple[Stage, ...]) -> list[frozenset[int]]:
        known = self._walls.get(stages)
        if known is None:
            obstacles = [self._obstacle(stage) for stage in stages]
            known = [self._moment.walls(robot, obstacles) for robot in self._robots]
            self._walls[stages] = known
        return known

    def _obstacle(self, stage: Stage) -> OpenObstacle:
        name, index, done, group = stage
        return replace(self._obstacles[name], stage=index, done=done, group=group)

    def _is_complete(self, state: _State) -> bool:
        if any(goals for goals, _ in state.left):
            return False
        closed = self._closed(state.stages)
        return all(
            at in self._lively(robot, walls)
            for robot, at, walls in zip(self._robots, state.poses, closed, strict=True)
        )

    def _lively(self, robot: Robot, walls: frozenset[int]) -> frozenset[Pose]:
        key = (robot.name, walls)
        if key not in self._live:
            moment = self._moment
            headings = ("north", "east", "south", "west") if robot.has_heading else (None,)
            everywhere = frozenset(
                (region, heading) for region in moment.free for heading in headings
            )
            self._live[key] = moment.live(robot, everywhere, walls)
        return self._live[key]

    def _settled(self, state: _State) -> _State:
        """Return the state after all that is done where the robots stand: actions, then goals."""
        stages: list[Stage] = []
        resolved = False
        for stage in state.stages:
            now: Stage | None = stage
            while now is not None and (after := self._performed(now, state.poses)) != now:
                now = after
            if now is None:
                resolved = True
            else:
                stages.append(now)
        left = state.left
        if resolved:
            left = tuple(map(self._anew, self._robots, left))
        left = tuple(
            self._met(robot, at[0], one)
            for robot, at, one in zip(self._robots, state.poses, left, strict=True)
        )
        return _State(state.poses, left, tuple(stages))

    def _anew(self, robot: Robot, left: Left) -> Left:
        """Rounds count from the last resolution; the order of the targets is kept."""
        rounds, count = self._moment.rounds, len(robot.targets)
        if robot.ends:
            return count - left[1], left[1]
        return (rounds * count, left[1]) if robot.in_order else (rounds, 0)

    def _performed(self, stage: Stage, poses: tuple[Pose, ...]) -> Stage | None:
        """Return the stage after the actions that the robots can perform where they stand; None:
        resolved."""
        name, index, done, group = stage
        obstacle = self._obstacle(stage)
        need = obstacle.needs[index]
        here = {
            robot.name
            for robot, at in zip(self._robots, poses, strict=True)
            if at[0] in need.regions and obstacle.able(robot, index)
        }
        if need.together:
            if len(here) < need.robots:
                return stage
        elif len(done | here) < need.robots:
            return name, index, done | here, group
        if index + 1 == len(obstacle.needs):
            return None
        met = done | here if obstacle.needs[index + 1].same else frozenset()
        return name, index + 1, frozenset(), met

    def _met(self, robot: Robot, region: int, left: Left) -> Left:
        goals, covered = left  # in order: which is next
        count = len(robot.targets)
        if robot.in_order:
            while goals and region in robot.targets[covered]:
                last = robot.ends and covered == count - 1
                goals, covered = goals - 1, covered if last else (covered + 1) % count
            return goals, covered
        here = sum(1 << k for k, target in enumerate(robot.targets) if region in target)
        while goals:
            covered |= here
            if covered != (1 << count) - 1:
                return goals, covered
            goals, covered = goals - 1, 0
        return 0, 0


def _digest(poses: set[tuple[Pose, ...]]) -> str:
    lines = sorted(
        json.dumps([[region, heading] for region, heading in one], separators=(",", ":")) + "\n"
        for one in poses
    )
    return hashlib.sha256("".join(lines).encode()).hexdigest()
