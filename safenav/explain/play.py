"""Losing plays in the environment's winning strategy (the counterstrategy): of a system that meets
goals while it can, or of a robot that then approaches an unreachable goal on its map. If graph
search suffices, the regions within reach are the witness."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from graphlib import TopologicalSorter
from itertools import islice, product

from msgspec import Struct

from safenav.cached_method import cached_method
from safenav.components import explored, path_to, shortest_paths
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
from safenav.spec.specification import Constraint, Owner, Section, Specification, Variable
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, clauses
from safenav.verify.completions import Clause, Completions
from safenav.verify.counterstrategy import counterstrategy_starts
from safenav.verify.cycles import Edges, cyclic_parts
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Pose, moves

MOST_MOMENTS = 200
MOST_INPUTS = 4096
MOST_VENTURED = 12
"""Moments that a system tries for a goal before it cycles."""


class Play:
    """One counterstrategy, and queries on its nodes: each move of the system is a successor."""

    def __init__(self, spec: Specification, counterstrategy: Strategy) -> None:
        self._spec = spec
        self._strategy = counterstrategy
        self._inputs = [v.name for v in spec.owned(Owner.INPUT)]

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

    def _nearest(self, start: int, goals: Sequence[Clause]) -> tuple[Sequence[int], Clause | None]:
        """Return the nodes of a shortest walk after ``start`` whose last step meets a goal."""
        values = self._strategy.values

        def steps(node: int) -> list[tuple[int, int]]:
            return [(node, after) for after in self.answers(node)]

        before = shortest_paths(steps(start), lambda step: steps(step[1]))
        for a, b in before:
            met = next((goal for goal in goals if goal.holds(values(a), values(b))), None)
            if met is not None:
                return [after for _, after in path_to((a, b), before)], met
        return [], None

    def answers(self, node: int) -> Sequence[int]:
        return self._strategy.transitions[node]

    def out_of_reach(self, nodes: Sequence[int]) -> Constraint | None:
        """Return a goal that no transition meets from these nodes on."""
        game = explored(nodes, self.answers)
        return self._unmet((a, b) for a in game for b in game[a])

    def never_met(self, cycle: Sequence[int]) -> Constraint | None:
        """Return a goal that a cycle does not meet, preferably one that is out of reach."""
        rounds = zip(cycle, (*cycle[1:], cycle[0]), strict=True)
        return self.out_of_reach(cycle) or self._unmet(rounds)

    def _unmet(self, steps: Iterable[tuple[int, int]]) -> Constraint | None:
        met = [(self._strategy.values(a), self._strategy.values(b)) for a, b in steps]
        goals = clauses(self._spec, Section.SYS_LIVENESS)
        return next((g.constraint for g in goals if not any(g.holds(*step) for step in met)), None)

    def pressure(self, node: int) -> dict[str, int]:
        """Return next inputs that the assumptions allow and that leave the system no reply."""
        automaton = Automaton(self._spec, self._strategy, (node,))
        assumed = automaton.clauses(Section.ENV_TRANS)
        promised = automaton.clauses(Section.SYS_TRANS)
        row = automaton.values[node]
        choices = Completions(automaton.current, automaton.next_inputs, assumed)
        known = (*automaton.current, *automaton.next_inputs)
        answers = Completions(known, automaton.next_outputs, promised)
        for inputs in islice(choices.each(row), MOST_INPUTS):
            if next(iter(answers.each((*row, *inputs))), None) is None:
                return dict(zip(self._inputs, inputs, strict=True))
        return {}


class LosingPlay(Struct, frozen=True):
    """Nodes of a counterstrategy, ``walk`` from the start on; then ``cycle`` repeats forever
    (STARVED) and ``goal`` is never met, or the next inputs ``pressure`` leave no reply (STUCK)."""

    ending: WitnessEnd
    walk: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()
    goal: Constraint | None = None
    pressure: tuple[tuple[str, int], ...] = ()


def losing_play(spec: Specification, counterstrategy: Strategy) -> LosingPlay:
    """Play the environment's strategy against a system that meets goals while it can, unless that
    leads into an avoidable dead end; it delays an unavoidable one."""
    starts = counterstrategy_starts(spec, counterstrategy)
    if not starts:
        return LosingPlay(WitnessEnd.NO_BEGINNING)
    play = Play(spec, counterstrategy)
    nodes = explored(starts, play.answers)
    parts = cyclic_parts(Edges(list(nodes), counterstrategy.transitions))
    greedy = play.goals_first(starts[0])
    ahead = shortest_paths(greedy[-1:], play.answers)
    if parts and not parts.keys() & ahead.keys():
        ahead = shortest_paths(starts, play.answers)
        greedy = [*path_to(next(node for node in ahead if node in parts), ahead)]
        ahead = shortest_paths(greedy[-1:], play.answers)
    if not parts:
        longest = _longest(starts if len(greedy) == 1 else greedy[-1:], nodes)
        walk = longest if len(greedy) == 1 else (*greedy[:-1], *longest)
        pressure = tuple(play.pressure(walk[-1]).items())
        return LosingPlay(WitnessEnd.STUCK, walk, pressure=pressure)
    away = dict[int, int]()  # moments until each node
    for node, last in ahead.items():
        away[node] = away.get(last, -1) + 1
    far = [node for node in away if node in parts and away[node] <= MOST_VENTURED]
    end = max(far or [node for node in away if node in parts][:1], key=lambda node: away[node])
    walk = (*greedy[:-1], *path_to(end, ahead))
    inside = {node for node, part in parts.items() if part == parts[end]}

    def within(node: int) -> list[int]:
        return [after for after in play.answers(node) if after in inside]

    back = path_to(end, shortest_paths(within(end), within))
    cycle = (walk[-1], *back[:-1])
    return LosingPlay(WitnessEnd.STARVED, walk[:-1], cycle, play.never_met(cycle))


def _longest(starts: Sequence[int], nodes: dict[int, Sequence[int]]) -> tuple[int, ...]:
    """Return the longest walk in a graph without cycles."""
    left: dict[int, int] = {}
    for node in TopologicalSorter(nodes).static_order():  # its successors come before it
        left[node] = max((left[after] + 1 for after in nodes[node]), default=0)
    walk = [max(starts, key=lambda node: left[node])]
    while nodes[walk[-1]]:
        walk.append(max(nodes[walk[-1]], key=lambda node: left[node]))
    return tuple(walk)


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
            goal = play.never_met(cycle)
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
        self._lost: Target = frozenset()  # regions of an unreachable goal of formulas

    def approach_from(self, node: int) -> None:
        """Let a robot with formulas approach the regions of a goal that it cannot meet from
        there."""
        if isinstance(self._task.objective, Ltl):
            goal = self.out_of_reach([node])
            met = (c for c in clauses(self._spec, Section.SYS_LIVENESS) if c.constraint is goal)
            self._lost = frozenset(r for clause in met for r in self._regions_of(clause))

    def _regions_of(self, goal: Clause) -> Iterator[Region]:
        """Yield the regions in which a goal can hold for some values of the other variables."""
        others = [v for v in self._spec.variables if v.name != "region"]
        for region in self._world.free:
            known = ({**values, "region": region} for values in _valuations(others))
            if any(goal.holds(values, values) for values in known):
                yield region

    def moment(self, node: int) -> PlayMoment:
        values = self._strategy.values(node)
        others = tuple((name, values[name]) for name in self._inputs)
        known = ("region", "heading", *self._inputs)
        memory = tuple((name, value) for name, value in values.items() if name not in known)
        return PlayMoment(values.get("region"), _heading(values), others, memory)

    def distance(self, node: int) -> int:
        """Return the steps to the target that the robot awaits there, without regard to
        headings."""
        values = self._strategy.values(node)
        region = values.get("region")
        awaited = self._awaited(values)
        if region is None or not awaited:
            return 0
        return self._field(awaited).get(region, self._world.size)

    @cached_method
    def _field(self, awaited: Target) -> Mapping[Region, int]:
        return self._world.distances(awaited)

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
        pose = Pose(values["region"], _heading(values))
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
        choices = ({**later, **values} for values in _valuations(free))
        broken = ([c.constraint for c in promised if not c.holds(now, after)] for after in choices)
        fewest = min(broken, key=len)
        return fewest[0] if fewest else None


def _heading(values: Mapping[str, int]) -> Heading | None:
    return Heading(values["heading"]) if "heading" in values else None


def _valuations(variables: Sequence[Variable]) -> Iterator[dict[str, int]]:
    """Yield values of all these variables, up to a limit."""
    names = [variable.name for variable in variables]
    for choice in islice(product(*(variable.range for variable in variables)), MOST_INPUTS):
        yield dict(zip(names, choice, strict=True))
