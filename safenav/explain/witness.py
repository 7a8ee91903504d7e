"""Witness: a losing play of a robot that does its best.

Where graph search suffices, the regions within reach are the witness. Otherwise the environment's
winning strategy (the counterstrategy) is played against a robot that always takes the reply that
brings it nearest to the target that it awaits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, product

from safenav.components import explored
from safenav.explain.explanation import (
    Diagnosis,
    Dilemma,
    NoStrategyCause,
    PlayMoment,
    Witness,
    WitnessEnd,
)
from safenav.explain.play import MOST_INPUTS, MOST_MOMENTS, Play
from safenav.scenario.guarantees import values_of
from safenav.scenario.objective import Ltl, Target
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import clauses
from safenav.verify.completions import Clause
from safenav.verify.counterstrategy import counterstrategy_starts
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Pose, moves


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
    play.approach_from(walk[-1])
    passed = len(walk) - 1  # the last moment in which a goal was met
    while play.answers(walk[-1]) and len(walk) < MOST_MOMENTS:
        node = min(play.answers(walk[-1]), key=play.distance)
        if node in walk[passed:]:
            cycle = tuple(walk[walk.index(node, passed) :])
            moments = tuple(map(play.moment, walk))
            goal = play.unreachable(explored(cycle, play.answers)) or play.starved(cycle)
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


class _Play(Play):
    """A play on a map."""

    def __init__(
        self, spec: Specification, counterstrategy: Strategy, task: Task, world: RegionMap
    ) -> None:
        super().__init__(spec, counterstrategy)
        self._task = task
        self._world = world
        self._fields: dict[Target, Mapping[Region, int]] = {}
        self._lost: Target = frozenset()  # regions of a goal of formulas that it can no longer meet

    def approach_from(self, node: int) -> None:
        """Let a robot with formulas approach the regions of a goal that it cannot meet from
        there."""
        if isinstance(self._task.objective, Ltl):
            goal = self.unreachable(explored([node], self.answers))
            met = (c for c in clauses(self._spec, Section.SYS_LIVENESS) if c.constraint is goal)
            self._lost = frozenset(r for clause in met for r in self._regions_of(clause))

    def _regions_of(self, goal: Clause) -> Iterator[Region]:
        """Yield the regions in which a goal can hold, whatever else is so there."""
        others = [v for v in self._spec.variables if v.name != "region"]
        ranges = [range((v.bounds or (0, 1))[0], (v.bounds or (0, 1))[1] + 1) for v in others]
        names = [v.name for v in others]
        for region in self._world.free:
            for choice in islice(product(*ranges), MOST_INPUTS):
                values = dict(zip(names, choice, strict=True)) | {"region": region}
                if goal.holds(values, values):
                    yield region
                    break

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
        if self._lost:
            return self._lost
        left = (target for target in self._task.targets if here not in target)
        return frozenset().union(*left) or frozenset().union(*self._task.targets)

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
        for choice in islice(product(*ranges), MOST_INPUTS):
            after = {**later, **{v.name: c for v, c in zip(free, choice, strict=True)}}
            broken = [c.constraint for c in promised if not c.holds(now, after)]
            if best is None or len(broken) < len(best):
                best = broken
        return best[0] if best else None
