"""Exact decision whether a mission can be completed if its robots never hinder each other.

Without collisions, a robot's pose matters only through the obstacles in its way and the moves that
it can undo. So the search runs over the stages of the obstacles and, for each robot, the set of
poses that it may still choose. It tries every obstacle and every group of robots at each point.
Resolutions only open paths, so accidental ones never make a mission worse.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations

from campaigns.judge.mission import Mission
from campaigns.judge.poses import Poses
from campaigns.judge.situation import FIRST, Answer, Situation, Stage, walls

Sets = tuple[int, ...]


def can_complete(mission: Mission, begin: Situation, budget: int = 20_000) -> Answer:
    """Return whether all robots can reach poses from which they continue forever. ``budget``:
    maximum number of situations examined."""
    return _Search(mission, begin, budget).answer()


class _OverBudgetError(Exception):
    pass


class _Search:
    def __init__(self, mission: Mission, begin: Situation, budget: int) -> None:
        assert not mission.crowded
        self.mission = mission
        self.begin = begin
        self.budget = budget
        self.graphs = [Poses(mission, robot) for robot in mission.robots]
        self.seen: set[tuple[frozenset[tuple[str, Stage]], Sets]] = set()

    def answer(self) -> Answer:
        sets = tuple(
            1 << graph.index[self.begin.poses[graph.robot.name]]
            if self.begin.poses[graph.robot.name] in graph.index
            else 0
            for graph in self.graphs
        )
        try:
            return Answer.YES if self._possible(dict(self.begin.stages), sets) else Answer.NO
        except _OverBudgetError:
            return Answer.OVER_BUDGET

    def _possible(self, stages: Mapping[str, Stage], sets: Sets) -> bool:
        pending = [(dict(stages), sets)]
        while pending:
            stages, sets = pending.pop()
            closed = [
                walls(self.mission, g.robot.name, stages, self.begin.sealed) for g in self.graphs
            ]
            sets = tuple(g.closure(s, w) for g, s, w in zip(self.graphs, sets, closed, strict=True))
            key = (frozenset(stages.items()), sets)
            if key in self.seen:
                continue
            if len(self.seen) >= self.budget:
                raise _OverBudgetError
            self.seen.add(key)
            if all(s & g.live(w) for g, s, w in zip(self.graphs, sets, closed, strict=True)):
                return True
            pending.extend(self._options(stages, sets))
        return False

    def _options(
        self, stages: Mapping[str, Stage], sets: Sets
    ) -> Iterator[tuple[dict[str, Stage], Sets]]:
        for name, (index, done) in stages.items():
            need = self.mission.obstacles[name].needs[index]
            there = {
                k: s & g.at(need.at)
                for k, (g, s) in enumerate(zip(self.graphs, sets, strict=True))
                if need.action in g.robot.capabilities and g.robot.name not in done
            }
            size = need.robots if need.together else 1
            for group in combinations([k for k in there if there[k]], size):
                after = done | {self.graphs[k].robot.name for k in group}
                chosen = tuple(there[k] if k in group else s for k, s in enumerate(sets))
                yield self._performed(stages, name, index, after), chosen

    def _performed(
        self, stages: Mapping[str, Stage], name: str, index: int, done: frozenset[str]
    ) -> dict[str, Stage]:
        obstacle, after = self.mission.obstacles[name], dict(stages)
        if len(done) < obstacle.needs[index].robots:
            after[name] = (index, done)
        elif index + 1 < len(obstacle.needs):
            after[name] = (index + 1, FIRST[1])
        else:
            del after[name]
        return after
