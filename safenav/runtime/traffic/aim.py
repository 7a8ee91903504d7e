"""Where a robot is going whose goals do not follow from places alone.

Formulas may remember: "be at the dock again after having seen the shelf". Joint plans know poses
only, so they would take the robot to the dock. Its strategy knows better: the shortest of its own
ways on which a goal is met, up to the first step on it that changes what the robot remembers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from itertools import pairwise

from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.runtime.navigation import Planner
from safenav.scenario.objective import Ltl
from safenav.synthesis.strategy import Strategy
from safenav.world.map import Heading
from safenav.world.moves import Pose

MOST_NODES = 20_000


def aim_of(planner: Planner, met: Collection[int]) -> Pose | None:
    """The pose that a robot is to come to first; None if that is where it stands, or unknown (as
    it is where nobody lists the strategy). ``met``: the goals of its formulas that it has met in
    this round."""
    objective = planner.task.objective
    if planner.node is None or not isinstance(objective, Ltl):
        return None
    strategy = planner.strategy
    if not isinstance(strategy, Strategy):
        return None
    goals = [parse(line) for i, line in enumerate(objective.liveness) if i not in met]
    before: dict[int, int | None] = {planner.node: None}
    queue = deque([planner.node])
    while queue and len(before) < MOST_NODES:
        node = queue.popleft()
        values = strategy.values(node)
        for after in strategy.transitions[node]:
            later = strategy.values(after)
            if any(evaluate(goal, values, later) for goal in goals):
                return _milestone(planner, [*_way(before, node), after], objective)
            if after not in before:
                before[after] = node
                queue.append(after)
    return None


def _milestone(planner: Planner, way: list[int], objective: Ltl) -> Pose | None:
    """The first pose of a way that is not the present one and where something is remembered, or
    the goal is met."""
    values = [planner.strategy.values(node) for node in way]
    here = _pose(values[0])
    for step, (before, after) in enumerate(pairwise(values)):
        last = step == len(values) - 2
        if last or any(before[name] != after[name] for name in objective.memory):
            for pose in (_pose(before), _pose(after)):
                if pose != here:
                    return pose
    return None


def _way(before: dict[int, int | None], last: int) -> list[int]:
    way = []
    node: int | None = last
    while node is not None:
        way.append(node)
        node = before[node]
    return way[::-1]


def _pose(values: dict[str, int]) -> Pose:
    heading = values.get("heading")
    return Pose(values["region"], None if heading is None else Heading(heading))
