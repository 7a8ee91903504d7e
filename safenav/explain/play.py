"""A losing play, chosen in the environment's winning strategy (the counterstrategy)."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from itertools import islice

from msgspec import Struct

from safenav.components import explored
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
    ahead = explored(greedy[-1:], play.answers)
    if parts and not parts.keys() & ahead:
        greedy, ahead = [*_shortest(starts, parts, play)], nodes
    if not parts:
        longest = _longest(starts if len(greedy) == 1 else greedy[-1:], nodes)
        walk = longest if len(greedy) == 1 else (*greedy[:-1], *longest)
        pressure = tuple(play.pressure(walk[-1]).items())
        return LosingPlay(WitnessEnd.STUCK, walk, pressure=pressure)
    away = _away(greedy[-1:], play)
    far = [node for node in away if node in parts and away[node] <= MOST_VENTURED]
    ends = {max(far, key=lambda node: away[node])} if far else parts
    walk = (*greedy[:-1], *_shortest(greedy[-1:], ends, play))
    inside = {node for node, part in parts.items() if part == parts[walk[-1]]}
    after = [node for node in play.answers(walk[-1]) if node in inside]
    back = _shortest(after, {walk[-1]}, play, inside)
    cycle = (walk[-1], *back[:-1])
    goal = play.unreachable(explored(cycle, play.answers)) or play.starved(cycle)
    return LosingPlay(WitnessEnd.STARVED, walk[:-1], cycle, goal)


def _away(starts: Sequence[int], play: Play) -> dict[int, int]:
    """Return the moments until each node that can be reached, nearest first."""
    found = dict.fromkeys(starts, 0)
    queue = deque(starts)
    while queue:
        node = queue.popleft()
        for after in play.answers(node):
            if after not in found:
                found[after] = found[node] + 1
                queue.append(after)
    return found


def _shortest(
    starts: Sequence[int],
    ends: dict[int, int] | set[int],
    play: Play,
    inside: set[int] | None = None,
) -> tuple[int, ...]:
    """Return the nodes of a shortest walk from one of ``starts`` to one of ``ends``."""
    before = dict.fromkeys(starts, -1)
    queue = deque(starts)
    while queue:
        node = queue.popleft()
        if node in ends:
            walk = []
            while node >= 0:
                walk.append(node)
                node = before[node]
            return tuple(reversed(walk))
        for after in play.answers(node):
            if after not in before and (inside is None or after in inside):
                before[after] = node
                queue.append(after)
    raise AssertionError("no walk leads there")


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
