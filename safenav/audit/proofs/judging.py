"""Check of the proofs with which a run claims that its mission cannot be completed.

Nothing here is taken from the code that writes proofs: sets of poses, regions closed by obstacles
and joint states are all recomputed from the trace. A proof that is not accepted gets a sentence
stating why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from safenav.audit.proofs.case import Case
from safenav.audit.proofs.closure import closure_problems
from safenav.audit.proofs.joint import joint_problems
from safenav.audit.proofs.tree import tree_problems


def problems_of(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Yield why this proof does not show that nothing can be completed in that case."""
    problems = {"closure": _all_lame, "tree": tree_problems, "joint": joint_problems}
    if proof.get("kind") not in problems:
        yield f"unknown kind of proof: {proof.get('kind')!r}"
    else:
        yield from _read(problems[proof["kind"]](proof, case))


def never_resolved_problems(proof: Mapping[str, Any], case: Case, obstacle: str) -> Iterator[str]:
    """Yield why this proof does not show that an obstacle can never be resolved."""
    if proof.get("kind") != "closure":
        yield f"only a closure proves that {obstacle} can never be resolved"
        return
    if obstacle not in proof.get("never", ()):
        yield f"{obstacle} is not among the obstacles that are never resolved"
    yield from _read(closure_problems(proof, case, lame=False))


def _all_lame(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    return closure_problems(proof, case, lame=True)


def _read(problems: Iterator[str]) -> Iterator[str]:
    try:
        yield from problems
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        yield f"the proof cannot be read: {error!r}"
