"""Losing plays in the environment's winning strategy (the counterstrategy) against a core.

The system obeys all guarantees while it can. It meets the goals that the environment does not
prevent, then pursues one that it cannot meet, until it has no move left or the play repeats."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice

from safenav.components import path_to, shortest_paths
from safenav.explain.explanation import LosingPlay, PlayEnd, Values
from safenav.explain.realizability import Questions
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, clauses
from safenav.verify.completions import Clause, Completions, Row, Slot
from safenav.verify.verification import counterstrategy_starts

MOST_MOMENTS = 200
"""Moments in which a system meets goals."""
MOST_INPUTS = 4096
"""Inputs that are tried for one that leaves no output."""

Nearness = Callable[[Values], float]
Near = Callable[[Constraint], Nearness]
"""The distance to a goal, beyond which plans do not distinguish moves."""


def anywhere(_goal: Constraint) -> Nearness:
    """Return the distance to a goal without a map."""
    return lambda _: 0.0


def losing_play(
    whole: Specification,
    core: Specification,
    ask: Questions,
    near: Near = anywhere,
) -> LosingPlay | None:
    """Return a play that an unrealizable ``core`` of ``whole`` loses; None if the limits do not
    allow it."""
    strategy = ask.counterstrategy(core)
    if strategy is None:
        return None
    starts = counterstrategy_starts(core, strategy)
    if not starts:
        return LosingPlay(PlayEnd.NO_BEGINNING, strategy, pressure=_refused(core))
    arena = _Arena(whole, core, strategy, starts)
    begins = [node for node in starts if arena.begins_well(node)] or starts
    values = strategy.values
    walk = [begins[0]]
    goals = arena.meet_goals(walk)
    nearness: Nearness = near(goals[0]) if goals else (lambda _: 0.0)
    passed = len(walk) - 1  # the last moment in which a goal was met
    while arena.answers[walk[-1]]:
        node = arena.pursue(walk[-1], nearness)
        if node in walk[passed:]:
            cycle = walk[walk.index(node, passed) :]
            walk = walk[: walk.index(node, passed)]
            goal = arena.never_met(cycle)
            shown = tuple(map(values, walk)), tuple(map(values, cycle))
            return LosingPlay(PlayEnd.STARVED, strategy, *shown, goal)
        walk.append(node)
    inputs = arena.pressure(walk[-1])
    return LosingPlay(PlayEnd.STUCK, strategy, tuple(map(values, walk)), pressure=inputs)


class _Arena:
    """A counterstrategy against ``core``. ``answers``: the successors of each node that obey all
    guarantees of ``whole``, or all of them if none does."""

    def __init__(
        self, whole: Specification, core: Specification, strategy: Strategy, starts: Sequence[int]
    ) -> None:
        self._strategy = strategy
        self._automaton = automaton = Automaton(core, strategy, starts)
        self._goals = automaton.clauses(Section.SYS_LIVENESS)
        self._first = clauses(whole, Section.SYS_INIT)
        self._inputs = [variable.name for variable in core.owned(Owner.INPUT)]
        wrong = 0
        for plane in automaton.violated([c.formula for c in clauses(whole, Section.SYS_TRANS)]):
            wrong |= plane
        flags = automaton.edges.flags(wrong)
        self.answers: dict[int, Sequence[int]] = {}
        for node, after, first in automaton.edges.by_node():
            legal = [to for k, to in enumerate(after, first) if not flags[k]]
            self.answers[node] = legal or after
        self._lasting = _lasting(self.answers)

    def begins_well(self, node: int) -> bool:
        """Return whether a start satisfies all guarantees on it."""
        values = self._strategy.values(node)
        return all(clause.holds(values, None) for clause in self._first)

    def meet_goals(self, walk: list[int]) -> list[Constraint]:
        """Extend a walk as long as one goal of a round can be met; return those that remain."""
        left = list(self._goals)
        while left and len(walk) < MOST_MOMENTS:
            leg, met = self._nearest(walk[-1], left)
            if met is None:
                break
            walk += leg
            left = [goal for goal in left if goal is not met] or list(self._goals)
        return [goal.constraint for goal in left]

    def _nearest(self, start: int, goals: Sequence[Clause]) -> tuple[Sequence[int], Clause | None]:
        """Return the nodes of a shortest walk after ``start`` whose last step meets a goal."""
        values = self._strategy.values

        def steps(node: int) -> list[tuple[int, int]]:
            return [(node, after) for after in self.answers[node]]

        before = shortest_paths(steps(start), lambda step: steps(step[1]))
        for a, b in before:
            met = next((goal for goal in goals if goal.holds(values(a), values(b))), None)
            if met is not None:
                return [after for _, after in path_to((a, b), before)], met
        return [], None

    def pursue(self, node: int, near: Nearness) -> int:
        """Return the successor nearest to a goal, of equals the one from which a play can last
        longest."""
        values = self._strategy.values
        return min(self.answers[node], key=lambda n: (near(values(n)), -self._lasting[n]))

    def never_met(self, cycle: Sequence[int]) -> Constraint | None:
        """Return a goal that a cycle does not meet."""
        values = self._strategy.values
        steps = [(values(a), values(b)) for a, b in zip(cycle, (*cycle[1:], cycle[0]), strict=True)]
        unmet = (goal for goal in self._goals if not any(goal.holds(*step) for step in steps))
        return next((goal.constraint for goal in unmet), None)

    def pressure(self, node: int) -> tuple[tuple[str, int], ...]:
        """Return next inputs that the assumptions allow and that leave the system no output."""
        found = self._automaton
        assumed, promised = found.clauses(Section.ENV_TRANS), found.clauses(Section.SYS_TRANS)
        inputs = Completions(found.current, found.next_inputs, assumed)
        outputs = Completions((*found.current, *found.next_inputs), found.next_outputs, promised)
        now = found.values[node]
        row = _without_output(inputs.each(now), outputs, now)
        return tuple(zip(self._inputs, row or (), strict=False))


def _without_output(rows: Iterable[Row], outputs: Completions, now: Row = ()) -> Row | None:
    """Return the first of some inputs that no output completes."""
    few = islice(rows, MOST_INPUTS)
    return next((row for row in few if next(outputs.each((*now, *row)), None) is None), None)


def _refused(spec: Specification) -> tuple[tuple[str, int], ...]:
    """Return initial inputs that the assumptions allow and that leave the system no output, as far
    as the guarantees mention them."""
    inputs, outputs = ([Slot(v, False) for v in spec.owned(owner)] for owner in Owner)
    promised = clauses(spec, Section.SYS_INIT)
    rows = Completions((), inputs, clauses(spec, Section.ENV_INIT)).each(())
    row = _without_output(rows, Completions(inputs, outputs, promised))
    mentioned = {name for clause in promised for name, _ in clause.places}
    names = [slot.variable.name for slot in inputs]
    return tuple((n, v) for n, v in zip(names, row or (), strict=False) if n in mentioned)


def _lasting(answers: Mapping[int, Sequence[int]]) -> dict[int, float]:
    """Return for each node how many moments a play from it can last."""
    before: dict[int, list[int]] = {}
    for node, following in answers.items():
        for after in following:
            before.setdefault(after, []).append(node)
    left = {node: len(after) for node, after in answers.items()}
    lasting = dict.fromkeys(answers, 0.0)
    ended = [node for node, count in left.items() if not count]
    for node in ended:
        for other in before.get(node, ()):
            left[other] -= 1
            lasting[other] = max(lasting[other], lasting[node] + 1)
            if not left[other]:
                ended.append(other)
    return {node: lasting[node] if not left[node] else float("inf") for node in answers}
