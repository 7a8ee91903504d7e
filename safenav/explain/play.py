"""A losing play, chosen in the environment's winning strategy (the counterstrategy)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice

from msgspec import Struct

from safenav.components import explored, path_to, shortest_paths
from safenav.explain.explanation import WitnessEnd
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, clauses
from safenav.verify.completions import Clause, Completions
from safenav.verify.counterstrategy import counterstrategy_starts
from safenav.verify.cycles import Edges, cyclic_parts

MOST_MOMENTS = 200
MOST_INPUTS = 4096
MOST_VENTURED = 12
"""Moments that a system tries for a goal before it cycles."""


class Play:
    """One counterstrategy, and queries on its nodes: each answer of the system is a successor."""

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

    def starved(self, cycle: Sequence[int]) -> Constraint | None:
        """Return a goal that is met on no transition of the cycle."""
        rounds = list(zip(cycle, (*cycle[1:], cycle[0]), strict=True))
        for clause in clauses(self._spec, Section.SYS_LIVENESS):
            if not any(
                clause.holds(self._strategy.values(a), self._strategy.values(b)) for a, b in rounds
            ):
                return clause.constraint
        return None

    def unreachable(self, nodes: Mapping[int, Sequence[int]]) -> Constraint | None:
        """Return a goal that is met on no transition of a part of the game."""
        for clause in clauses(self._spec, Section.SYS_LIVENESS):
            values = self._strategy.values
            if not any(clause.holds(values(a), values(b)) for a in nodes for b in nodes[a]):
                return clause.constraint
        return None

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
    leads into a dead end which it can avoid; one that it cannot avoid it puts off."""
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
    goal = play.unreachable(explored(cycle, play.answers)) or play.starved(cycle)
    return LosingPlay(WitnessEnd.STARVED, walk[:-1], cycle, goal)


def _longest(starts: Sequence[int], nodes: dict[int, Sequence[int]]) -> tuple[int, ...]:
    """Return the longest walk in a graph without cycles."""
    left: dict[int, int] = {}
    stack = list(starts)
    while stack:
        node = stack[-1]
        open_nodes = [after for after in nodes[node] if after not in left]
        if open_nodes:
            stack += open_nodes
        else:
            left[node] = max((left[after] + 1 for after in nodes[node]), default=0)
            stack.pop()
    walk = [max(starts, key=lambda node: left[node])]
    while nodes[walk[-1]]:
        walk.append(max(nodes[walk[-1]], key=lambda node: left[node]))
    return tuple(walk)
