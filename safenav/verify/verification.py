"""An independent check that a strategy satisfies its specification (docs/trust.md).

It shares nothing with the synthesizer but the automaton and the specification's text: that is
parsed and evaluated here, on the explicit graph. A strategy is right if

- every initial input that ENV_INIT allows has a node to start from, which satisfies SYS_INIT;
- every node has exactly one successor for each next input that ENV_TRANS allows, and no other;
- every transition satisfies SYS_TRANS, and every value is within its range;
- no cycle meets all assumptions of ENV_LIVENESS and misses a goal of SYS_LIVENESS.

Once the environment has broken an assumption, the specification guarantees nothing, so nothing is
checked. For counterstrategies see ``verify_counterstrategy``: the players' roles are exchanged.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Alive, Automaton, Failure, Fault, Verification, quiet
from safenav.verify.completions import Clause, Completions, Slot
from safenav.verify.counterstrategy import counterstrategy_failures, counterstrategy_starts


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
    return next(map(str, check(spec, automaton, alive).failures), None)


def _strategy_failures(automaton: Automaton) -> Iterator[Failure]:
    yield from _start_failures(automaton)
    yield from automaton.range_failures()
    assumed, promised, fair, goals = automaton.against()
    yield from automaton.edge_failures(assumed, promised)
    forbidden = 0
    for _, wrong in assumed:
        forbidden |= wrong
    yield from _successor_failures(automaton, [clause for clause, _ in assumed], forbidden)
    unfair = [unmet for _, unmet in fair]
    for clause, missing in goals:
        yield from automaton.cycle_failures(Fault.STARVED_GOAL, missing, unfair, clause)


def _start_failures(automaton: Automaton) -> Iterator[Failure]:
    """Yield a missing start: each initial input of the environment needs a node that satisfies both
    INITs."""
    completions = _starts(automaton)
    unknown = _inputs(automaton)
    covered = {automaton.part(node, Owner.INPUT) for node in automaton.starts}
    if completions.count([()])[0] == len(covered):
        return
    missing = next((row for row in completions.each(()) if row not in covered), None)
    if missing is None:
        return
    detail = f"for the initial input {automaton.move_in_words(unknown, missing)}"
    yield Failure(
        Fault.NO_START, constraint=_why_no_start(automaton), detail=detail if unknown else ""
    )


def _inputs(automaton: Automaton) -> list[Slot]:
    return [place for place in automaton.current if place.variable.owner is Owner.INPUT]


def _starts(automaton: Automaton) -> Completions:
    """Return the completions of the empty row: the initial inputs that the assumptions allow."""
    return Completions((), _inputs(automaton), automaton.clauses(Section.ENV_INIT))


def _why_no_start(automaton: Automaton) -> Constraint | None:
    """Return the constraint that the automaton's first node violates, if the automaton has no
    start."""
    if automaton.starts or not len(automaton.strategy.states):
        return None
    values = automaton.strategy.values(0)
    initial = (*automaton.clauses(Section.ENV_INIT), *automaton.clauses(Section.SYS_INIT))
    return next((c.constraint for c in initial if not c.holds(values, None)), None)


def _successor_failures(
    automaton: Automaton, assumed: Sequence[Clause], forbidden: int
) -> Iterator[Failure]:
    """Yield nodes without exactly one successor for each allowed next input. Counting suffices:
    there must be as many different inputs as are allowed."""
    completions = Completions(automaton.current, automaton.next_inputs, assumed)
    rows = [automaton.values[node] for node in automaton.nodes]
    allowed = completions.count(rows)
    banned = automaton.edges.flags(forbidden) if forbidden else b""
    reported: set[Fault] = set()
    told = automaton.numbered(Owner.INPUT).__getitem__
    by_node = automaton.edges.by_node()
    for (node, targets, first), row, count in zip(by_node, rows, allowed, strict=True):
        different = set(map(told, targets))
        if len(different) < len(targets) and Fault.SEVERAL_SUCCESSORS not in reported:
            reported.add(Fault.SEVERAL_SUCCESSORS)
            inputs = [automaton.part(target, Owner.INPUT) for target in targets]
            twice = next(i for k, i in enumerate(inputs) if i in inputs[:k])
            detail = f"for {automaton.move_in_words(automaton.next_inputs, twice)}"
            yield automaton.failure(Fault.SEVERAL_SUCCESSORS, node, detail=detail)
        legal = targets
        if forbidden:
            legal = [t for k, t in enumerate(targets, first) if not banned[k]]
            different = set(map(told, legal))
        if len(different) != count and Fault.MISSING_SUCCESSOR not in reported:
            there = {automaton.part(target, Owner.INPUT) for target in legal}
            missing = next((i for i in completions.each(row) if i not in there), None)
            if missing is not None:
                reported.add(Fault.MISSING_SUCCESSOR)
                detail = f"for {automaton.move_in_words(automaton.next_inputs, missing)}"
                yield automaton.failure(Fault.MISSING_SUCCESSOR, node, detail=detail)
