"""An independent check that a strategy satisfies its specification (docs/trust.md).

It shares nothing with the synthesizer but the automaton and the specification's text: that is
parsed and evaluated here, on the explicit graph. A strategy is right if

- every initial input that ENV_INIT allows has a node to start from, which satisfies SYS_INIT;
- every node has exactly one successor for each next input that ENV_TRANS allows, and no other;
- every transition satisfies SYS_TRANS, and every value is within its range;
- no cycle meets all assumptions of ENV_LIVENESS and misses a goal of SYS_LIVENESS.

Once the environment has broken an assumption, the specification guarantees nothing, so nothing is
checked.

A counterstrategy is an automaton of the environment that the system cannot beat. In each node the
environment has chosen one next input; the successors are all that the system may answer. It is a
proof that a specification is unrealizable if

- the start nodes have one input that ENV_INIT allows, and all outputs that SYS_INIT allows;
- the next inputs satisfy ENV_TRANS, and every answer that SYS_TRANS allows is there (a node
  without successors: some next input leaves the system no answer);
- every cycle meets each assumption of ENV_LIVENESS, and no cycle meets all goals.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence, Set
from itertools import islice
from typing import Any

from safenav.components import components
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Alive, Automaton, Failure, Fault, Verification, clauses, quiet
from safenav.verify.completions import Clause, Completions, Row, Slot

_SOME = 256


def counterstrategy_starts(spec: Specification, counterstrategy: Strategy) -> tuple[int, ...]:
    """Return the longest prefix of the nodes that share the first node's inputs, are all different,
    and satisfy ENV_INIT and SYS_INIT."""
    initial = [*clauses(spec, Section.ENV_INIT), *clauses(spec, Section.SYS_INIT)]
    inputs = [variable.name for variable in spec.owned(Owner.INPUT)]
    first = counterstrategy.values(0) if counterstrategy.states else {}

    def begins(_node: int, values: Mapping[str, int]) -> bool:
        same = all(values[name] == first[name] for name in inputs)
        return same and all(clause.holds(values, None) for clause in initial)

    return counterstrategy.leading(begins)


def counterstrategy_failures(automaton: Automaton) -> Iterator[Failure]:
    """Yield all faults of a counterstrategy with known initial states."""
    yield from _opening_failures(automaton)
    yield from automaton.range_failures()
    assumed, promised, fair, goals = automaton.against()
    yield from automaton.edge_failures(assumed, promised)
    yield from _answer_failures(automaton, [c for c, _ in assumed], [c for c, _ in promised])
    for clause, unmet in fair:
        yield from automaton.cycle_failures(Fault.STARVED_ASSUMPTION, unmet, (), clause)
    every = (1 << len(automaton.edges)) - 1
    yield from automaton.cycle_failures(Fault.GOALS_MET, every, [unmet for _, unmet in goals])


def lost_opening(spec: Specification) -> Row | None:
    """Return initial inputs that ENV_INIT allows and that leave no output, if there are any: a
    counterstrategy that wins with them has no node."""
    inputs, outputs = (
        [Slot(variable, False) for variable in spec.owned(owner)]
        for owner in (Owner.INPUT, Owner.OUTPUT)
    )
    answers = Completions(inputs, outputs, clauses(spec, Section.SYS_INIT))
    openings = Completions((), inputs, clauses(spec, Section.ENV_INIT))
    return _unanswered(openings, answers, ())


def _unanswered(moves: Completions, answers: Completions, known: Row) -> Row | None:
    """Return the first move from known values that has no answer, if there is one."""
    found = moves.each(known)
    while some := list(islice(found, _SOME)):
        counts = answers.count([(*known, *row) for row in some])
        if 0 in counts:
            return some[counts.index(0)]
    return None


def _opening_failures(automaton: Automaton) -> Iterator[Failure]:
    inputs, outputs = automaton.places(Owner.INPUT), automaton.places(Owner.OUTPUT)
    if not automaton.starts:  # then the system must be unable to answer some initial input
        if lost_opening(automaton.spec) is None:
            detail = f"of the counterstrategy for {automaton.spec.robot}"
            yield Failure(Fault.NO_START, detail=detail)
        return
    answers = Completions(inputs, outputs, automaton.clauses(Section.SYS_INIT))
    chosen = automaton.parts(Owner.INPUT)[automaton.starts[0]]
    missing = _missing(answers, chosen, automaton.begun(Owner.OUTPUT))
    if missing is not None:
        detail = f"for the initial output {automaton.move_in_words(outputs, missing)}"
        yield Failure(Fault.NO_START, detail=detail)


def _missing(completions: Completions, row: Row, there: Set[Row]) -> Row | None:
    """Return a completion of a row that is not ``there``, if one of them is missing. Counting
    usually suffices: all that is there is a completion, or another fault."""
    if completions.count([row])[0] == len(there):
        return None
    return next((each for each in completions.each(row) if each not in there), None)


def _answer_failures(
    automaton: Automaton, assumed: Sequence[Clause], promised: Sequence[Clause]
) -> Iterator[Failure]:
    """Yield the faults of the successors of a counterstrategy: each node has one next input, and
    each possible reply of the system to it once; or some next input leaves it no reply."""
    choices = Completions(automaton.current, automaton.next_inputs, assumed)
    known = (*automaton.current, *automaton.next_inputs)
    answers = Completions(known, automaton.next_outputs, promised)
    inputs, moves, ends = automaton.parts(Owner.INPUT), [], []
    for node in automaton.nodes:
        targets = automaton.strategy.transitions[node]
        chosen = {inputs[target] for target in targets}
        if len(chosen) == 1:
            moves.append((node, (*automaton.values[node], *chosen.pop()), targets))
        else:
            ends.append((node, chosen))
    if several := [node for node, chosen in ends if chosen]:
        yield automaton.failure(Fault.SEVERAL_INPUTS, several[0])
    yield from _move_failures(automaton, Owner.OUTPUT, answers, moves)
    for node in (node for node, chosen in ends if not chosen):
        if _unanswered(choices, answers, automaton.values[node]) is None:
            detail = "expected a successor for each next input, found none"
            yield automaton.failure(Fault.MISSING_SUCCESSOR, node, detail=detail)
            return


def _move_failures(
    automaton: Automaton,
    owner: Owner,
    completions: Completions,
    moves: Sequence[tuple[int, Row, Sequence[int]]],
) -> Iterator[Failure]:
    """Yield the first node with two successors for one move of the other player, and the first
    without one for an allowed move. ``moves``: nodes, their known values, and their successors."""
    reported: set[Fault] = set()
    parts, places = automaton.parts(owner), [Slot(v, True) for v in automaton.spec.owned(owner)]
    counts = completions.count([row for _, row, _ in moves])
    for (node, row, targets), count in zip(moves, counts, strict=True):
        there = {parts[target] for target in targets}
        wrong = dict[Fault, Row | None]()
        if len(there) < len(targets):
            seen = [parts[target] for target in targets]
            twice = next(one for k, one in enumerate(seen) if one in seen[:k])
            wrong[Fault.SEVERAL_SUCCESSORS] = twice
        if len(there) != count and Fault.MISSING_SUCCESSOR not in reported:
            missing = (each for each in completions.each(row) if each not in there)
            wrong[Fault.MISSING_SUCCESSOR] = next(missing, None)
        for fault, move in wrong.items():
            if move is not None and fault not in reported:
                reported.add(fault)
                detail = f"for {automaton.move_in_words(places, move)}"
                yield automaton.failure(fault, node, detail=detail)


def verify_strategy(spec: Specification, strategy: Strategy, alive: Alive = quiet) -> Verification:
    """Check a strategy of the system. ``alive`` is called now and then; it may raise.

    Raises InputError if the specification cannot be read, ResourceLimitError if its
    assumptions tie so many inputs together that they cannot be counted.
    """
    automaton = Automaton(spec, strategy, strategy.initial(), alive)
    failures = tuple(_strategy_failures(automaton))
    vacuous = not _starts(automaton).count([()])[0]
    return Verification(failures, len(automaton.nodes), len(automaton.edges), vacuous)


def verify_counterstrategy(
    spec: Specification, counterstrategy: Strategy, alive: Alive = quiet
) -> Verification:
    """Check a strategy of the environment: the proof that no strategy of the system exists.
    Arguments and errors as in ``verify_strategy``."""
    starts = counterstrategy_starts(spec, counterstrategy)
    automaton = Automaton(spec, counterstrategy, starts, alive)
    failures = tuple(counterstrategy_failures(automaton))
    return Verification(failures, len(automaton.nodes), len(automaton.edges))


def first_failure(
    spec: Specification,
    automaton: Strategy,
    is_counterstrategy: bool = False,
    alive: Alive = quiet,
) -> str | None:
    """Return the first defect of an automaton, in words; None if it satisfies the specification.

    A synthesizer takes this as its ``verifier``. Raises as ``verify_strategy`` does.
    """
    check = verify_counterstrategy if is_counterstrategy else verify_strategy
    return next(("\n    ".join(f.lines) for f in check(spec, automaton, alive).failures), None)


def _strategy_failures(automaton: Automaton) -> Iterator[Failure]:
    yield from _start_failures(automaton)
    yield from automaton.range_failures()
    assumed, promised, fair, goals = automaton.against()
    yield from automaton.edge_failures(assumed, promised)
    forbidden = 0
    for _, wrong in assumed:
        forbidden |= wrong
    banned = automaton.edges.flags(forbidden)
    completions = Completions(
        automaton.current, automaton.next_inputs, [clause for clause, _ in assumed]
    )
    moves = [
        (node, automaton.values[node], [t for k, t in enumerate(targets, first) if not banned[k]])
        for node, targets, first in automaton.edges.by_node()
    ]
    yield from _move_failures(automaton, Owner.INPUT, completions, moves)
    unfair = [unmet for _, unmet in fair]
    for clause, missing in goals:
        yield from automaton.cycle_failures(Fault.STARVED_GOAL, missing, unfair, clause)


def _start_failures(automaton: Automaton) -> Iterator[Failure]:
    """Yield a missing start: each initial input of the environment needs a node that satisfies both
    INITs."""
    missing = _missing(_starts(automaton), (), automaton.begun(Owner.INPUT))
    if missing is not None:
        places = automaton.places(Owner.INPUT)
        detail = f"for the initial input {automaton.move_in_words(places, missing)}"
        why = _why_no_start(automaton)
        yield Failure(Fault.NO_START, constraint=why, detail=detail if places else "")


def _starts(automaton: Automaton) -> Completions:
    """Return the completions of the empty row: the initial inputs that the assumptions allow."""
    return Completions((), automaton.places(Owner.INPUT), automaton.clauses(Section.ENV_INIT))


def _why_no_start(automaton: Automaton) -> Constraint | None:
    """Return the constraint that the automaton's first node violates, if the automaton has no
    start."""
    if automaton.starts or not len(automaton.strategy.states):
        return None
    values = automaton.strategy.values(0)
    initial = (*automaton.clauses(Section.ENV_INIT), *automaton.clauses(Section.SYS_INIT))
    return next((c.constraint for c in initial if not c.holds(values, None)), None)


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
            found = _unanswered(choices, answers, automaton.values[node])
            if found is None:
                raise NoMeasureError("the system has an answer to each input")
            yield found


def _opening(automaton: Automaton) -> Row:
    """Return the initial inputs of the environment."""
    if automaton.starts:
        return automaton.parts(Owner.INPUT)[automaton.starts[0]]
    found = lost_opening(automaton.spec)
    if found is None:
        raise NoMeasureError("the system has an output for each initial input")
    return found


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
