"""Rules on infeasibility: an operator is needed only where a proof shows it."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, replace
from itertools import product
from typing import Any

from safenav.audit.progress import ENDS
from safenav.audit.proofs.formulas import UnreadError, read_formulas, rules_of
from safenav.audit.proofs.judging import never_resolved_problems, problems_of
from safenav.audit.proofs.moment import Moment, Need, OpenObstacle, Pose, Robot
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation, Status
from safenav.trace.objective import Objective
from safenav.trace.proofs import Closure, Proof
from safenav.trace.records import (
    Appeared,
    Blocked,
    Goal,
    Gone,
    NewObjective,
    Outcome,
    Record,
    Reopened,
    Resolved,
    Synthesis,
    Waiting,
)
from safenav.trace.vocabulary import BlockReason, Ending, OperatorCause

_FINAL = (BlockReason.UNTRAVERSABLE, BlockReason.OPERATOR)


class ProofRule(Rule):
    """A run that claims that an operator is needed proves it: from where the robots are, with what
    they know, no sequence of their moves completes the mission (D 5.6, T). An obstacle that joins
    the known ones because no robot can ever resolve it also has its proof."""

    name = "proof"

    def __init__(self) -> None:
        self._goals: dict[str, list[Goal]] = {}
        self._never: set[str] = set()
        self._memory: dict[tuple[str, str], Mapping[str, int] | None] = {}
        """Memory of each robot that had no strategy, by its name and specification."""

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Goal):
            if now.objectives[record.robot] == now.header.robots[record.robot].objective:
                self._goals.setdefault(record.robot, []).append(record)
        elif isinstance(record, Resolved):
            self._goals.clear()
        elif isinstance(record, NewObjective):
            self._goals.pop(record.robot, None)
        elif isinstance(record, Synthesis):
            self._memory[record.robot, record.spec] = record.memory
        elif isinstance(record, Appeared | Gone | Reopened):
            self._never.discard(record.obstacle)
        elif isinstance(record, Blocked) and record.reason not in _FINAL:
            yield from self._given_up(record, now)
        elif isinstance(record, Outcome | Waiting) and record.outcome is Ending.OPERATOR_NEEDED:
            if record.cause is OperatorCause.OUT_OF_SERVICE:
                if not now.out:
                    yield self.broken_by(record, None, "no robot is out of service")
                return
            if record.proof is None:
                if not self._unrealizable(record, now):
                    yield self.broken_by(
                        record, None, "an operator is needed, but that is not proven"
                    )
                return
            for name in _could_be_given_up(record.proof, now):
                problem = f"no need of {name} can ever be met, but it does not join the obstacles"
                yield self.broken_by(record, None, problem)
            for problem in problems_of(
                _as_json(record.proof), moment_of(now, self._goals, self._never)
            ):
                yield self.broken_by(record, None, problem)

    def _unrealizable(self, record: Outcome | Waiting, now: Situation) -> bool:
        """Return whether some robot has permanently lost its objective, as a synthesis states:
        alone, and without any obstacle that may yet be resolved, it cannot continue forever."""
        moment = moment_of(now, self._goals, self._never)
        told = record.unrealizable if isinstance(record, Outcome) else None
        for name, spec in (told or {}).items():
            robot = moment.robots.get(name)
            memory = self._memory.get((name, spec))
            if robot is None:
                continue
            if not robot.judged or not moment.goes_on(robot, moment.sealed[name], memory):
                return True
        return False

    def _given_up(self, record: Blocked, now: Situation) -> Iterator[Finding]:
        """An obstacle that can never be resolved, even if every robot is back in service, is
        permanently closed to the robots that it blocks."""
        moment = moment_of(now, self._goals, self._never, hopeful=True)
        if record.proof is not None:
            for problem in never_resolved_problems(_as_json(record.proof), moment, record.obstacle):
                yield self.broken_by(record, None, problem)
        else:
            yield self.broken_by(record, None, f"{record.obstacle} is given up without proof")
        self._never.add(record.obstacle)


def _could_be_given_up(proof: Proof, now: Situation) -> Iterator[str]:
    """Yield the open obstacles whose next need, as a closure shows, can never be met."""
    if not isinstance(proof, Closure) or now.out:
        return
    regions = {name: {r for r, _ in reach.poses} for name, reach in proof.robots.items()}
    for name in proof.never:
        if name in now.obstacles and now.status[name] is Status.UNRESOLVED:
            need = now.need(name)
            there = [
                robot
                for robot in now.capable(name) - (set() if need.together else now.done[name])
                if regions.get(robot, set()) & set(need.regions)
            ]
            if len(there) < need.robots - (0 if need.together else len(now.done[name])):
                yield name


def moment_of(
    now: Situation,
    goals: dict[str, list[Goal]],
    never: Collection[str],
    *,
    hopeful: bool = False,
) -> Moment:
    """Return the moment at a line of the trace. ``goals``: those since the last resolution.
    ``never``: obstacles that were shown to be never resolvable by any robot. ``hopeful``: as if
    every robot were in service."""
    out = frozenset() if hopeful else frozenset(now.out)
    world = now.grid
    obstacles = {
        name: OpenObstacle(
            name,
            obstacle.region,
            tuple(
                Need(
                    need.action,
                    need.robots,
                    frozenset(need.regions),
                    need.together,
                    bool(need.same),
                )
                for need in obstacle.all_needs
            ),
            frozenset(obstacle.blocks),
            now.stage[name],
            frozenset(now.done[name]),
            now.group.get(name, frozenset()),
        )
        for name, obstacle in now.obstacles.items()
        if now.status[name] in (Status.UNRESOLVED, Status.GIVEN_UP) and name in now.discovered
        if name not in never
    }
    return Moment(
        world.rows,
        world.cols,
        _free(now),
        {
            name: replace(_robot(name, now, goals.get(name, [])), out=name in out)
            for name in now.header.robots
        },
        obstacles,
        {
            name: now.header.robots[name].objective.avoid
            | frozenset(
                obstacle.region
                for obstacle in now.obstacles.values()
                if now.status[obstacle.name] is Status.UNTRAVERSABLE or obstacle.name in never
                if name in now.stopped_by(obstacle.name)
            )
            for name in now.header.robots
        },
        now.header.until.rounds or 1,
        frozenset(never),
        tuple((frozenset(z.robots), frozenset(z.regions)) for z in now.header.never_together or ()),
    )


def _free(now: Situation) -> frozenset[int]:
    return frozenset(r for r in range(now.grid.rows * now.grid.cols) if now.grid.is_free(r))


def _robot(name: str, now: Situation, goals: list[Goal]) -> Robot:
    told = now.header.robots[name]
    objective = told.objective
    rounds = now.header.until.rounds or 1
    done = goals[-1].round if goals else 0
    this_round = [goal.goal for goal in goals if goal.round == done]
    # The goal that completes a round is the last goal of that round, not the first of the next.
    covered = this_round[1:] if done else this_round
    robot = Robot(
        name=name,
        has_heading=now.has_heading(name),
        capabilities=frozenset(told.capabilities),
        pose=_pose(name, now),
        targets=objective.targets,
        in_order=objective.kind not in ("cover", "ltl"),
        conflicts=frozenset(
            other for other in now.header.robots if other != name and now.conflict(name, other)
        ),
        awaited=(min(now.ahead[name], len(objective.targets) - 1),)
        if objective.kind in ENDS
        else _awaited(objective, goals, resumed=bool(told.when)),
        covered=frozenset(goal for goal in covered if goal < len(objective.targets)),
        met=len(covered),
        rounds_left=max(rounds - done, 0),
        ends=objective.kind in ENDS,
    )
    try:
        if objective.kind != "ltl":
            return replace(robot, rules=rules_of(objective)) if objective.always else robot
        formulas = read_formulas(json.loads(objective.body))
    except UnreadError:
        return replace(robot, judged=False)
    headings = ("north", "east", "south", "west") if robot.has_heading else (None,)
    targets = formulas.goal_regions(product(_free(now), headings))
    return replace(robot, formulas=formulas, targets=targets)


def _awaited(objective: Objective, goals: list[Goal], *, resumed: bool) -> tuple[int, ...]:
    """Return the targets that may be next: a patrol that has met no target may begin with
    either."""
    count = len(objective.targets)
    if goals and goals[-1].goal < count:
        return ((goals[-1].goal + 1) % count,)
    return tuple(range(count)) if objective.kind == "patrol" or resumed else (0,)


def _pose(name: str, now: Situation) -> Pose:
    """Return the robot's pose; for a robot in transit, the pose where it will arrive."""
    toward = now.toward[name]
    if toward is None:
        return now.region[name], now.heading[name] if now.has_heading(name) else None
    way = now.grid.direction(now.region[name], toward)
    return toward, way if now.has_heading(name) else None


def _as_json(proof: Proof) -> dict[str, Any]:
    """Return a proof as the file has it."""
    found: dict[str, Any] = json.loads(json.dumps(asdict(proof)))
    return found
