"""Failure of a strategy, for people and for machines.

Paths show values (``region=47 heading=east``), so that no node has to be looked up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from safenav.spec.specification import Constraint, Owner
from safenav.synthesis.export import in_words
from safenav.synthesis.strategy import Strategy
from safenav.verify.failures import Failure, Verification

_SHOWN_STEPS = 24


def failure_lines(failure: Failure, strategy: Strategy) -> Iterator[str]:
    """Yield the fault, the constraint that it breaks with its origin, and a shortest path to it."""
    where = "" if failure.node is None else f" at node {failure.node} ({failure.state})"
    yield f"{failure.fault.value}{where}"
    if failure.detail:
        yield failure.detail
    if failure.constraint is not None:
        yield f"constraint: [{failure.constraint.section}] {failure.constraint.formula}"
        yield f"from: {failure.constraint.origin}"
    if failure.path:
        yield f"shortest path, {len(failure.path) - 1} steps:"
        yield from _steps(failure.path, strategy)
    if failure.cycle:
        yield f"then forever, every {len(failure.cycle)} steps:"
        yield from _steps(failure.cycle, strategy)


def verification_data(found: Verification, strategy: Strategy) -> dict[str, object]:
    """Return all that a check found, for machines; values are those of the specification."""
    return {
        "ok": found.ok,
        "vacuous": found.vacuous,
        "nodes": found.nodes,
        "transitions": found.edges,
        "failures": [_failure_data(failure, strategy) for failure in found.failures],
    }


def _steps(nodes: Sequence[int], strategy: Strategy) -> Iterator[str]:
    numbered = (f"{node}: {node_words(node, strategy)}" for node in nodes)
    yield from (f"  {line}" for line in without_the_middle([*numbered], _SHOWN_STEPS))


def without_the_middle(lines: Sequence[str], most: int) -> Iterator[str]:
    """Yield the lines; of more than ``most`` the first and the last, and how many are between."""
    half, count = most // 2, len(lines)
    if count <= most:
        yield from lines
        return
    yield from lines[:half]
    yield f"... {count - 2 * half} more"
    yield from lines[count - half :]


def node_words(node: int, strategy: Strategy) -> str:
    """Return the values at a node."""
    values = strategy.values(node)
    words = (in_words(strategy, values, owner) for owner in (Owner.OUTPUT, Owner.INPUT))
    return " ".join(filter(None, words)) or "(no variables)"


def _failure_data(failure: Failure, strategy: Strategy) -> dict[str, object]:
    return {
        "fault": failure.fault.name.lower(),
        "says": failure.fault.value,
        "node": failure.node,
        "values": None if failure.node is None else strategy.values(failure.node),
        "successor": failure.successor,
        "detail": failure.detail,
        "constraint": _constraint_data(failure.constraint),
        "path": list(failure.path),
        "cycle": list(failure.cycle),
    }


def _constraint_data(constraint: Constraint | None) -> dict[str, object] | None:
    if constraint is None:
        return None
    origin = constraint.origin
    return {
        "section": constraint.section.value,
        "formula": constraint.formula,
        "item": origin.item,
        "rule": origin.rule,
        "source": origin.source,
    }
