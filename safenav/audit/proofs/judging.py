"""Check of the proofs with which a run claims that its mission cannot be completed.

Nothing here is taken from the code that writes proofs: sets of poses, regions closed by obstacles
and joint states are all recomputed from the trace. A proof that is not accepted gets a sentence
stating why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from safenav.audit.proofs.closure import closure_problems
from safenav.audit.proofs.joint import joint_problems
from safenav.audit.proofs.moment import Moment
from safenav.audit.proofs.reading import MalformedError
from safenav.audit.proofs.tree import tree_problems


def problems_of(proof: Mapping[str, object], moment: Moment) -> Iterator[str]:
    """Yield why this proof does not show that nothing can be completed from that moment on."""
    try:
        match proof.get("kind"):
            case "closure":
                yield from closure_problems(proof, moment, lame=True)
            case "tree":
                yield from tree_problems(proof, moment)
            case "joint":
                yield from joint_problems(proof, moment)
            case kind:
                yield f"unknown kind of proof: {kind!r}"
    except MalformedError as error:
        yield f"the proof cannot be read: {error}"


def never_resolved_problems(
    proof: Mapping[str, object], moment: Moment, obstacle: str
) -> Iterator[str]:
    """Yield why this proof does not show that an obstacle can never be resolved."""
    try:
        if proof.get("kind") != "closure":
            yield f"only a closure proves that {obstacle} can never be resolved"
            return
        never = proof.get("never")
        if not isinstance(never, list) or obstacle not in never:
            yield f"{obstacle} is not among the obstacles that are never resolved"
        yield from closure_problems(proof, moment, lame=False)
    except MalformedError as error:
        yield f"the proof cannot be read: {error}"
