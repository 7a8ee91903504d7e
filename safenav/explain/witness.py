"""Witness: a losing play of a robot that does its best.

Where graph search suffices, the regions within reach are the witness. Otherwise the environment's
winning strategy (the counterstrategy) is played against a robot that always takes the reply that
brings it nearest to the target that it awaits."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product

from safenav.explain.explanation import (
    Diagnosis,
    Dilemma,
    NoStrategyCause,
    PlayMoment,
    Witness,
    WitnessEnd,
)
from safenav.scenario.guarantees import values_of
from safenav.scenario.objective import Ltl, Target
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, clauses
from safenav.verify.completions import Clause, Completions
from safenav.verify.counterstrategy import counterstrategy_starts
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Pose, moves

MOST_MOMENTS = 200
_MOST_INPUTS = 4096


def confinement(found: Diagnosis) -> Witness | None:
    """Return the witness that needs no game: the regions that it can reach, without the target."""
    if found.cause is None or not (found.lost or found.cause is NoStrategyCause.CROSSING):
        return None
    return Witness(WitnessEnd.CONFINED, confined=found.confined)


def play_out(
    spec: Specification, counterstrategy: Strategy, task: Task, world: RegionMap
) -> Witness:
    """Play the environment's strategy against a robot that does its best: it meets the goals that
    it still can, then comes as near as possible to one that it can no longer meet."""
    starts = counterstrategy_starts(spec, counterstrategy)
    if not starts:
        return Witness(WitnessEnd.NO_BEGINNING)
    play = _Play(spec, counterstrategy, task, world)
    walk = play.goals_first(min(starts, key=play.distance))
    passed = len(walk) - 1  # the last moment in which a goal was met
    while play.answers(walk[-1]) and len(walk) < MOST_MOMENTS:
        node = min(play.answers(walk[-1]), key=play.distance)
        if node in walk[passed:]:
            cycle = tuple(walk[walk.index(node, passed) :])
            moments = tuple(map(play.moment, walk))
            goal = play.starved(cycle)
            return Witness(WitnessEnd.STARVED, moments, tuple(map(play.moment, cycle)), goal=goal)
        walk.append(node)
    moments = tuple(map(play.moment, walk))
    if play.answers(walk[-1]):
        return Witness(WitnessEnd.STARVED, moments)
    pressure = play.pressure(walk[-1])
    return Witness(
        WitnessEnd.STUCK,
        moments,
        pressure=tuple(pressure.items()),
        dilemmas=tuple(play.dilemmas(walk[-1], pressure)),
    )


class _Play:
    """One counterstrategy, and queries on its nodes."""

    def __init__(
        self, spec: Specification, counterstrategy: Strategy, task: Task, world: RegionMap
    ) -> None:
        self._spec = spec
        self._strategy = counterstrategy
        self._task = task
        self._world = world
        self._inputs = [v.name for v in spec.owned(Owner.INPUT)]
        self._fields: dict[Target, Mapping[Region, int]] = {}

    def goals_first(self, start: int) -> list[int]:
        """Return a walk from ``start`` that meets goals as long as one of a round can be met."""
        walk = [start]
        goals = clauses(self._spec, Section.SYS_LIVENESS)
        open_goals = list(goals)
        while open_goals and len(walk) < MOST_MOMENTS:
            leg, met = self._nearest(walk[-1], open_goals)
            if met is None:
                break
            walk += leg
            open_goals = [g for g in open_goals if g is not met] or list(goals)
        return walk

    def _nearest(self, start: int, goals: Sequence[Clause]) -> tuple[list[int], Clause | None]:
        """Return the nodes of a shortest walk after ``start`` whose last step meets a goal."""
        before = {start: start}
        queue = deque([start])
        while queue:
            node = queue.popleft()
            now = self._strategy.values(node)
            for after in self.answers(node):
                later = self._strategy.values(after)
                met = next((g for g in goals if g.holds(now, later)), None)
                if met is not None:
                    leg = [after]
                    while node != start:
                        leg.append(node)
                        node = before[node]
                    return leg[::-1], met
                if after not in before:
                    before[after] = node
                    queue.append(after)
        return [], None

    def answers(self, node: int) -> Sequence[int]:
        return self._strategy.transitions[node]

    def moment(self, node: int) -> PlayMoment:
        values = self._strategy.values(node)
        others = tuple((name, values[name]) for name in self._inputs)
        pose = ("region", "heading")
        memory = [n for n in values if n not in self._inputs and n not in pose]
        heading = values.get("heading")
        return PlayMoment(
            values.get("region"),
            None if heading is None else Heading(heading),
            others,
            tuple((name, values[name]) for name in memory),
        )

    def distance(self, node: int) -> int:
        """Return the steps to the target that the robot awaits there, without regard to
        headings."""
        values = self._strategy.values(node)
        region = values.get("region")
        awaited = self._awaited(values)
        if region is None or not awaited:
            return 0
        if awaited not in self._fields:
            self._fields[awaited] = self._world.distances(awaited)
        far = self._world.size
        return self._fields[awaited].get(region, far)

    def _awaited(self, values: Mapping[str, int]) -> Target:
        objective, here = self._task.objective, values.get("region")
        if not isinstance(objective, Ltl) and objective.in_turn:
            return objective.awaited(values.get(objective.turn, 0))
        left = (target for target in self._task.targets if here not in target)
        return frozenset().union(*left) or frozenset().union(*self._task.targets)

    def starved(self, cycle: Sequence[int]) -> Constraint | None:
        """Return a goal that is met on no transition of the cycle."""
        rounds = list(zip(cycle, (*cycle[1:], cycle[0]), strict=True))
        for clause in clauses(self._spec, Section.SYS_LIVENESS):
            if not any(
                clause.holds(self._strategy.values(a), self._strategy.values(b)) for a, b in rounds
            ):
                return clause.constraint
        return None

    def pressure(self, node: int) -> dict[str, int]:
        """Return next inputs that the assumptions allow and that leave the robot no reply."""
        automaton = Automaton(self._spec, self._strategy, (node,))
        assumed = automaton.clauses(Section.ENV_TRANS)
        promised = automaton.clauses(Section.SYS_TRANS)
        row = automaton.values[node]
        choices = Completions(automaton.current, automaton.next_inputs, assumed)
        known = (*automaton.current, *automaton.next_inputs)
        answers = Completions(known, automaton.next_outputs, promised)
        for inputs in islice(choices.each(row), _MOST_INPUTS):
            if next(iter(answers.each((*row, *inputs))), None) is None:
                return dict(zip(self._inputs, inputs, strict=True))
        return {}

    def dilemmas(self, node: int, pressure: Mapping[str, int]) -> Iterator[Dilemma]:
        """Yield for each move of its mobility the guarantee that it would break."""
        values = self._strategy.values(node)
        if "region" not in values:
            return
        heading = values.get("heading")
        pose = Pose(values["region"], None if heading is None else Heading(heading))
        promised = clauses(self._spec, Section.SYS_TRANS)
        for after in moves(self._task.robot.model.mobility, pose, self._world):
            broken = self._broken(values, {**pressure, **values_of(after)}, promised)
            if broken is not None:
                yield Dilemma(after.region, after.heading, broken)

    def _broken(
        self, now: Mapping[str, int], later: Mapping[str, int], promised: Sequence[Clause]
    ) -> Constraint | None:
        """Return the first constraint that a move breaks with the memory that breaks fewest."""
        free = [v for v in self._spec.owned(Owner.OUTPUT) if v.name not in later]
        ranges = [range((v.bounds or (0, 1))[0], (v.bounds or (0, 1))[1] + 1) for v in free]
        best: list[Constraint] | None = None
        for choice in islice(product(*ranges), _MOST_INPUTS):
            after = {**later, **{v.name: c for v, c in zip(free, choice, strict=True)}}
            broken = [c.constraint for c in promised if not c.holds(now, after)]
            if best is None or len(broken) < len(best):
                best = broken
        return best[0] if best else None
