"""An independent check that a strategy satisfies its specification (docs/trust.md).

It shares only the automaton and the specification's text with the synthesizer. It parses the text
and evaluates it on the explicit graph. A strategy is correct if

- every initial input that ENV_INIT allows has a node to start from, which satisfies SYS_INIT;
- every node has exactly one successor for each next input that ENV_TRANS allows, and no other;
- every transition satisfies SYS_TRANS, and every value is within its range;
- no cycle meets all assumptions of ENV_LIVENESS and misses a goal of SYS_LIVENESS.

After the environment has violated an assumption, the specification guarantees nothing, so nothing
is checked.

A counterstrategy is a winning automaton of the environment. In each node the environment has chosen
one next input; the successors are all replies of the system. It proves that a specification is
unrealizable if

- the start nodes have one input that ENV_INIT allows, and all outputs that SYS_INIT allows;
- the next inputs satisfy ENV_TRANS, and each reply that SYS_TRANS allows is a successor (a node
  without successors: to some next input, the system has no reply);
- every cycle meets each assumption of ENV_LIVENESS, and no cycle meets all goals.
"""

from collections import Counter
from collections.abc import Iterator, Sequence, Set
from enum import StrEnum
from functools import reduce
from operator import or_
from typing import Any

from msgspec import Struct

from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.strategy import Strategy, in_words
from safenav.verify.automaton import Automaton, NoMeasureError, clauses, measure, openings, rounds
from safenav.verify.completions import Clause, Completions, Row, first_row


class Fault(StrEnum):
    """Faults of an automaton. Each value states its fault in words."""

    NO_START = "no node to start from"
    RANGE = "a value outside its range"
    FORBIDDEN_INPUT = "a next input that the assumptions exclude"
    SEVERAL_INPUTS = "the environment does not choose exactly one next input"
    MISSING_SUCCESSOR = "no successor for an allowed move of the other player"
    SEVERAL_SUCCESSORS = "two successors for the same move of the other player"
    BROKEN_GUARANTEE = "a transition that breaks a guarantee"
    STARVED_GOAL = "a cycle that meets all assumptions, but not this goal"
    STARVED_ASSUMPTION = "a cycle on which the environment does not meet this assumption"
    GOALS_MET = "a cycle on which the system meets all its goals"


class Failure(Struct, frozen=True):
    """A fault, with a path to it.

    ``node``: its node, None if there is none; ``state``: this node in words. ``successor``: the
    other end of a faulty transition. ``constraint``: the violated constraint with its origin.
    ``path``: a shortest path from an initial node to ``node``. ``cycle``: the nodes of a closed
    walk from ``node``, for faults of liveness. ``detail``: the faulty move.
    """

    fault: Fault
    node: int | None = None
    successor: int | None = None
    constraint: Constraint | None = None
    path: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()
    state: str = ""
    detail: str = ""

    @property
    def lines(self) -> list[str]:
        """The failure in words: the fault, the violated constraint, and its origin."""
        where = "" if self.node is None else f" at node {self.node} ({self.state})"
        found = [f"{self.fault.value}{where}", *([self.detail] if self.detail else [])]
        if self.constraint is not None:
            found.append(f"constraint: [{self.constraint.section}] {self.constraint.formula}")
            found.append(f"from: {self.constraint.origin}")
        return found


class Verification(Struct, frozen=True):
    """The result of a check. ``failures``: the first one of each kind and constraint; ``nodes``,
    ``edges``: the numbers of checked nodes and edges. ``vacuous``: whether no initial state
    satisfies the assumptions, so that the strategy guarantees nothing."""

    failures: tuple[Failure, ...]
    nodes: int
    edges: int
    vacuous: bool = False

    @property
    def ok(self) -> bool:
        return not self.failures


def verify(spec: Specification, automaton: Strategy, counter: bool = False) -> Verification:
    """Return the verdict on a strategy of the system or, if ``counter``, on a counterstrategy (a
    proof that no strategy exists).

    Raises InputError if the specification cannot be read, ResourceLimitError if its assumptions
    connect too many inputs for a count.
    """
    vacuous = not counter and not openings(spec)[0].count([()])[0]
    found = Automaton(spec, automaton, automaton.initial(counter))
    failures = tuple(_failures(found, counter))
    return Verification(failures, len(found.nodes), len(found.edges), vacuous)


def first_failure(spec: Specification, automaton: Strategy, counter: bool = False) -> str | None:
    """Return the first fault of an automaton, in words; None if it satisfies the specification.

    A synthesizer takes this function as its ``verifier``. Raises as ``verify`` does.
    """
    failures = verify(spec, automaton, counter).failures
    return next(("\n    ".join(failure.lines) for failure in failures), None)


def lost_opening(spec: Specification) -> Row | None:
    """Return initial inputs that ENV_INIT allows but that leave no output, or None. A
    counterstrategy that wins with these inputs has no node."""
    inputs, outputs = openings(spec)
    return inputs.unanswered(outputs)


_OF_EDGES = (Fault.FORBIDDEN_INPUT, Fault.BROKEN_GUARANTEE)


def _failures(automaton: Automaton, counter: bool) -> Iterator[Failure]:
    yield from _start_failures(automaton, counter)
    for k, variable in enumerate(automaton.spec.variables):
        pairs = ((node, row[k]) for node, row in automaton.values.items())
        if wrong := next((pair for pair in pairs if pair[1] not in variable.range), None):
            detail = f"{variable.declaration}, found {wrong[1]}"
            yield _failure(automaton, Fault.RANGE, wrong[0], detail=detail)
    for fault, against in zip(_OF_EDGES, automaton.against, strict=False):
        for clause, edges in against:
            if edges:
                source, target = (end[first_row(edges)] for end in automaton.edges.ends)
                detail = f"to {_node_in_words(automaton, target)}"
                yield _failure(automaton, fault, source, clause, target, detail=detail)
    yield from (_reply_failures if counter else _input_failures)(automaton)
    size, ends = len(automaton.strategy.states), automaton.edges.ends
    for starved, about, met, excuses in obligations(automaton, counter):
        try:
            measure(size, ends, met, excuses)
        except NoMeasureError as error:
            yield _failure(automaton, starved, error.cycle[0], about, cycle=error.cycle)


def _failure(
    automaton: Automaton,
    fault: Fault,
    node: int,
    clause: Clause | None = None,
    successor: int | None = None,
    cycle: tuple[int, ...] = (),
    detail: str = "",
) -> Failure:
    constraint, path = clause.constraint if clause else None, automaton.path(node)
    state = _node_in_words(automaton, node)
    return Failure(fault, node, successor, constraint, path, cycle, state, detail)


def _node_in_words(automaton: Automaton, node: int) -> str:
    return in_words(automaton.strategy, automaton.strategy.values(node))


def _move_in_words(automaton: Automaton, owner: Owner, row: Row) -> str:
    """Return the values of all inputs or of all outputs in words."""
    names = [variable.name for variable in automaton.spec.owned(owner)]
    values = dict(zip(names, row, strict=True))
    return in_words(automaton.strategy, values, owner) or "nothing to choose"


def _start_failures(automaton: Automaton, counter: bool) -> Iterator[Failure]:
    """Yield a failure if a start node is missing. A strategy needs one, which satisfies both INITs,
    for each initial input; a counterstrategy, for each remaining output."""
    spec, strategy, starts = automaton.spec, automaton.strategy, automaton.starts
    inputs, outputs = openings(spec)
    if counter and not starts:
        if lost_opening(spec) is None:
            yield Failure(Fault.NO_START, detail=f"of the counterstrategy for {spec.robot}")
        return
    owner, row, possible = Owner.INPUT, Row(), inputs
    if counter:
        owner, row, possible = Owner.OUTPUT, automaton.parts(owner)[starts[0]], outputs
    parts = automaton.parts(owner)
    (count,) = possible.count([row])
    missing = _missing(possible, row, count, {parts[node] for node in starts})
    if missing is not None:
        words = f"for the initial {owner.lower()} {_move_in_words(automaton, owner, missing)}"
        first = strategy.values(0) if strategy.states and not starts else {}
        both = (*clauses(spec, Section.ENV_INIT), *clauses(spec, Section.SYS_INIT))
        why = (each.constraint for each in both if first and not each.holds(first, {}))
        yield Failure(Fault.NO_START, constraint=next(why, None), detail=words if missing else "")


def _missing(possible: Completions, row: Row, count: int, there: Set[Row]) -> Row | None:
    """Return a completion of a row that is not in ``there``, or None. ``count``: the number of all
    completions; if ``there`` has as many members, none is missing."""
    if count == len(there):
        return None
    return next((each for each in possible.each(row) if each not in there), None)


def _input_failures(automaton: Automaton) -> Iterator[Failure]:
    """Yield the failures of a strategy without exactly one successor for each next input."""
    allowed = automaton.edges.without(reduce(or_, (edges for _, edges in automaton.against[0]), 0))
    moves = [(node, automaton.values[node], targets) for node, targets in allowed.items()]
    yield from _move_failures(automaton, Owner.INPUT, rounds(automaton.spec)[0], moves)


def _reply_failures(automaton: Automaton) -> Iterator[Failure]:
    """Yield the failures of the successors of a counterstrategy. Those of a node must have a common
    next input and be all possible replies of the system, each once. A node without successors needs
    a next input to which the system has no reply."""
    choices, replies = rounds(automaton.spec)
    inputs, after = automaton.parts(Owner.INPUT), automaton.edges.after
    chosen = {node: [*{inputs[target] for target in after[node]}] for node in after}
    for node in [node for node, rows in chosen.items() if len(rows) > 1][:1]:
        yield _failure(automaton, Fault.SEVERAL_INPUTS, node)
    every = ((node, rows[0]) for node, rows in chosen.items() if len(rows) == 1)
    moves = [(node, (*automaton.values[node], *row), after[node]) for node, row in every]
    yield from _move_failures(automaton, Owner.OUTPUT, replies, moves)
    for node in automaton.nodes:
        if not chosen[node] and choices.unanswered(replies, automaton.values[node]) is None:
            detail = "expected a successor for each next input, found none"
            yield _failure(automaton, Fault.MISSING_SUCCESSOR, node, detail=detail)
            return


def _move_failures(
    automaton: Automaton,
    owner: Owner,
    possible: Completions,
    moves: Sequence[tuple[int, Row, Sequence[int]]],
) -> Iterator[Failure]:
    """Yield the first node with two successors for one move of the other player, and the first with
    none for an allowed move. ``moves``: nodes, their known values and successors."""
    parts = automaton.parts(owner)
    rows = [[parts[target] for target in targets] for _, _, targets in moves]
    counts = possible.count([row for _, row, _ in moves])
    twice = (next((r for r, n in Counter(each).items() if n > 1), None) for each in rows)
    missing = (
        _missing(possible, row, count, {*there})
        for (_, row, _), there, count in zip(moves, rows, counts, strict=True)
    )
    for fault, wrong in ((Fault.SEVERAL_SUCCESSORS, twice), (Fault.MISSING_SUCCESSOR, missing)):
        for (node, _, _), move in zip(moves, wrong, strict=True):
            if move is not None:
                detail = f"for {_move_in_words(automaton, owner, move)}"
                yield _failure(automaton, fault, node, detail=detail)
                break


Obligation = tuple[Fault, Clause | None, bytes, list[bytes]]
"""A goal that each infinite path meets infinitely often, unless from some point on it never meets
one of the excuses. Fields: the fault otherwise, the clause, and for each edge whether it meets the
goal and each excuse."""


def obligations(automaton: Automaton, counter: bool) -> list[Obligation]:
    """Return the obligations of a strategy (its goals, excused by the assumptions) or of a
    counterstrategy (the assumptions, and an unmeetable goal, excused by the goals)."""
    every = (1 << len(automaton.edges)) - 1
    fair, goals = (
        [(clause, automaton.edges.flags(every ^ unmet)) for clause, unmet in part]
        for part in automaton.against[2:]
    )
    if counter:
        never = bytes(len(automaton.edges))
        last: Obligation = (Fault.GOALS_MET, None, never, [met for _, met in goals])
        return [*((Fault.STARVED_ASSUMPTION, *each, []) for each in fair), last]
    return [(Fault.STARVED_GOAL, *each, [met for _, met in fair]) for each in goals]


def measures(spec: Specification, automaton: Strategy, counter: bool) -> dict[str, Any]:
    """Return the measures of a strategy (one for each goal) or of a ``counter``strategy (one for
    each assumption, and one whose excuses are the goals). Each path of a counterstrategy meets all
    assumptions infinitely often, but not all goals. ``start``: its initial inputs; ``chosen``: its
    next inputs in each node.

    Raises NoMeasureError if the automaton does not satisfy (or refute) its specification."""
    size = len(automaton.states)
    starts = automaton.initial(True) if counter else range(size)
    found = Automaton(spec, automaton, starts)
    wanted = obligations(found, counter)
    each = [measure(size, found.edges.ends, met, excuses) for *_, met, excuses in wanted]
    if not counter:
        return {"of": "strategy", "measures": each}
    inputs = found.parts(Owner.INPUT)
    start = inputs[starts[0]] if starts else lost_opening(spec)
    chosen = [_choice(found, node) if node in inputs else () for node in range(size)]
    assert start is not None and None not in chosen, "the system has no reply to some input"
    return {"of": "counterstrategy", "start": start, "chosen": chosen, "measures": each}


def _choice(automaton: Automaton, node: int) -> Row | None:
    """Return the next inputs that the environment chooses in a node: those of its successors, or
    inputs without a reply of the system if there are none."""
    targets = automaton.strategy.transitions[node]
    if targets:
        return automaton.parts(Owner.INPUT)[targets[0]]
    choices, replies = rounds(automaton.spec)
    return choices.unanswered(replies, automaton.values[node])
