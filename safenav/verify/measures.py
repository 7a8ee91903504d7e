"""Progress measures: checkable evidence that a strategy starves no goal.

For a goal each node gets a number ``n`` and perhaps an assumption ``a`` (an index, or None). On
each edge that misses the goal the number falls, or number and assumption stay and the edge misses
that assumption. This form is complete for explicit strategies: a run that starves a goal exists if
and only if some strongly connected component of the edges that miss the goal meets every
assumption. Otherwise ``n`` is the depth of the component in the condensation and ``a`` an
assumption that the component misses. One pass of Tarjan's algorithm (SIAM J. Comput. 1972) per
goal. The verified checker accepts automata by their measures (docs/proof.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from safenav.components import components
from safenav.spec.specification import Owner, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton
from safenav.verify.completions import Completions, Row
from safenav.verify.verification import counterstrategy_starts, lost_opening


class NoMeasureError(ValueError):
    """No measure exists: a run starves the goal although it meets every assumption."""


Measure = dict[str, list[Any]]
"""Number (``n``) and assumption (``a``) of each node."""


def strategy_measures(spec: Specification, strategy: Strategy) -> dict[str, Any]:
    """Return the measures of a strategy that satisfies the specification: one for each goal.

    Raises NoMeasureError if it starves a goal."""
    automaton = Automaton(spec, strategy, range(len(strategy.states)))
    *_, fair, goals = _met(automaton)
    return {"of": "strategy", "measures": [_measure(automaton, goal, fair) for goal in goals]}


def counterstrategy_measures(spec: Specification, strategy: Strategy) -> dict[str, Any]:
    """Return the measures of a counterstrategy that defeats the specification: one for each
    assumption, which each path meets infinitely often, and one whose excuses are the goals, not all
    of which a path meets infinitely often. ``start``: the initial inputs; ``chosen``: the next
    inputs of each node.

    Raises NoMeasureError if it does not defeat the specification."""
    automaton = Automaton(spec, strategy, counterstrategy_starts(spec, strategy))
    *_, fair, goals = _met(automaton)
    measures = [_measure(automaton, met, []) for met in fair]
    measures.append(_measure(automaton, bytes(len(automaton.edges)), goals))
    chosen = list(_choices(automaton))
    return {
        "of": "counterstrategy",
        "start": _opening(automaton),
        "chosen": chosen,
        "measures": measures,
    }


def _met(automaton: Automaton) -> list[list[bytes]]:
    """Return for each clause of ENV_TRANS, SYS_TRANS, ENV_LIVENESS and SYS_LIVENESS the edges on
    which it is met."""
    every = (1 << len(automaton.edges)) - 1
    return [
        [automaton.edges.flags(every ^ unmet) for _, unmet in part] for part in automaton.against()
    ]


def _measure(automaton: Automaton, met: bytes, excuses: Sequence[bytes]) -> Measure:
    ends = automaton.edges.sources, automaton.edges.targets
    return measure(len(automaton.strategy.states), ends, met, excuses)


def _choices(automaton: Automaton) -> Iterator[Row]:
    """Yield the next inputs that the environment chooses in each node: those of the successors, or
    inputs to which the system has no answer. None are needed in a node that is not reachable."""
    choices = Completions(
        automaton.current, automaton.next_inputs, automaton.clauses(Section.ENV_TRANS)
    )
    known = (*automaton.current, *automaton.next_inputs)
    answers = Completions(known, automaton.next_outputs, automaton.clauses(Section.SYS_TRANS))
    inputs = automaton.parts(Owner.INPUT)
    for node, targets in enumerate(automaton.strategy.transitions):
        if node not in inputs:
            yield ()
        elif targets:
            yield inputs[targets[0]]
        else:
            state = automaton.values[node]
            yield _unanswered(choices.each(state), answers, state)


def _opening(automaton: Automaton) -> Row:
    """Return the initial inputs of the environment."""
    if automaton.starts:
        return automaton.parts(Owner.INPUT)[automaton.starts[0]]
    found = lost_opening(automaton.spec)
    if found is None:
        raise NoMeasureError("the system has an output for each initial input")
    return found


def _unanswered(rows: Iterator[Row], answers: Completions, known: Row) -> Row:
    for row in rows:
        if not answers.count([(*known, *row)])[0]:
            return row
    raise NoMeasureError("the system has an answer to each input")


def measure(
    size: int,
    edges: tuple[Sequence[int], Sequence[int]],
    met: Sequence[int],
    excuses: Sequence[Sequence[int]],
) -> Measure:
    """Return the measure of a goal.

    ``size``: number of nodes. ``edges``: the node before each edge, and the node after it. ``met``,
    and each of ``excuses`` (assumptions; for a counterstrategy, goals): for each edge, whether it
    is met there. Raises NoMeasureError if no measure exists.
    """
    missing: list[list[tuple[int, int]]] = [[] for _ in range(size)]
    for edge, (source, target) in enumerate(zip(*edges, strict=True)):
        if not met[edge]:
            missing[source].append((target, edge))
    numbers = [0] * size
    assumptions: list[int | None] = [None] * size
    component = [-1] * size
    for label, members in enumerate(components([[t for t, _ in out] for out in missing])):
        for node in members:
            component[node] = label
        inside, depth = [], 0
        for node in members:
            for target, edge in missing[node]:
                if component[target] == label:
                    inside.append(edge)
                else:
                    depth = max(depth, numbers[target] + 1)
        excuse = None
        if inside:
            excuse = next(
                (k for k, e in enumerate(excuses) if not any(e[edge] for edge in inside)), None
            )
            if excuse is None:
                raise NoMeasureError(f"node {members[0]} lies on a cycle that starves the goal")
        for node in members:
            numbers[node] = depth
            assumptions[node] = excuse
    return {"n": numbers, "a": assumptions}
