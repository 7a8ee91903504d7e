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

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

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
    openings = Completions((), inputs, clauses(spec, Section.ENV_INIT)).each(())
    while rows := list(islice(openings, _SOME)):
        counts = answers.count(rows)
        if 0 in counts:
            return rows[counts.index(0)]
    return None


def _opening_failures(automaton: Automaton) -> Iterator[Failure]:
    spec = automaton.spec
    inputs = [p for p in automaton.current if p.variable.owner is Owner.INPUT]
    outputs = [p for p in automaton.current if p.variable.owner is Owner.OUTPUT]
    answers = Completions(inputs, outputs, automaton.clauses(Section.SYS_INIT))
    if automaton.starts:
        chosen = automaton.part(automaton.starts[0], Owner.INPUT)
        covered = {automaton.part(node, Owner.OUTPUT) for node in automaton.starts}
        if answers.count([chosen])[0] != len(covered):
            missing = next((row for row in answers.each(chosen) if row not in covered), None)
            if missing is not None:
                detail = f"for the initial output {automaton.move_in_words(outputs, missing)}"
                yield Failure(Fault.NO_START, detail=detail)
        return
    # Without a start, the system must be unable to answer some initial input.
    if lost_opening(spec) is None:
        yield Failure(Fault.NO_START, detail=f"of the counterstrategy for {spec.robot}")


def _answer_failures(
    automaton: Automaton, assumed: Sequence[Clause], promised: Sequence[Clause]
) -> Iterator[Failure]:
    """Yield the faults of the successors: each node has one next input, and each possible reply of
    the system to it once."""
    choices = Completions(automaton.current, automaton.next_inputs, assumed)
    known = (*automaton.current, *automaton.next_inputs)
    answers = Completions(known, automaton.next_outputs, promised)
    moving = [node for node in automaton.nodes if automaton.strategy.transitions[node]]
    rows = []
    for node in moving:
        target = automaton.strategy.transitions[node][0]
        rows.append((*automaton.values[node], *automaton.part(target, Owner.INPUT)))
    reported: set[Fault] = set()
    for node, row, count in zip(moving, rows, answers.count(rows), strict=True):
        targets = automaton.strategy.transitions[node]
        inputs = {automaton.part(target, Owner.INPUT) for target in targets}
        outputs = [automaton.part(target, Owner.OUTPUT) for target in targets]
        if len(inputs) > 1:
            if Fault.SEVERAL_INPUTS not in reported:
                reported.add(Fault.SEVERAL_INPUTS)
                yield automaton.failure(Fault.SEVERAL_INPUTS, node)
            continue
        if len(set(outputs)) < len(outputs) and Fault.SEVERAL_SUCCESSORS not in reported:
            reported.add(Fault.SEVERAL_SUCCESSORS)
            twice = next(o for k, o in enumerate(outputs) if o in outputs[:k])
            detail = f"for {automaton.move_in_words(automaton.next_outputs, twice)}"
            yield automaton.failure(Fault.SEVERAL_SUCCESSORS, node, detail=detail)
        if Fault.MISSING_SUCCESSOR in reported or count <= 0 or len(set(outputs)) == count:
            continue
        missing = next((o for o in answers.each(row) if o not in outputs), None)
        if missing is not None:
            reported.add(Fault.MISSING_SUCCESSOR)
            detail = f"for {automaton.move_in_words(automaton.next_outputs, missing)}"
            yield automaton.failure(Fault.MISSING_SUCCESSOR, node, detail=detail)
    for node in automaton.nodes:
        if automaton.strategy.transitions[node]:
            continue
        state = automaton.values[node]
        found = choices.each(state)
        while some := list(islice(found, _SOME)):
            if 0 in answers.count([(*state, *row) for row in some]):
                break
        else:
            detail = "expected a successor for each next input, found none"
            yield automaton.failure(Fault.MISSING_SUCCESSOR, node, detail=detail)
            return


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
