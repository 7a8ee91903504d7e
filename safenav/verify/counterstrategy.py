"""The check of a counterstrategy: an automaton of the environment that the system cannot beat.

In each node the environment has chosen one next input; the successors are all that the system
may answer. It is a proof that a specification is unrealizable if

- the start nodes have one input that ENV_INIT allows, and all outputs that SYS_INIT allows;
- the next inputs satisfy ENV_TRANS, and every answer that SYS_TRANS allows is there (a node
  without successors: some next input leaves the system no answer);
- every cycle meets each assumption of ENV_LIVENESS, and no cycle meets all goals.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice

from safenav.spec.specification import Owner, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton, Failure, Fault, clauses
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
    yield from _start_failures(automaton)
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


def _start_failures(automaton: Automaton) -> Iterator[Failure]:
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
