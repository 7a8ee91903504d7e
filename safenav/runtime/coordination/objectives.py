"""Temporary objectives of robots in place of their own: wait, or help."""

from __future__ import annotations

from dataclasses import replace

from safenav.scenario.objective import Hold, Ltl, Objective, Target, Visit, ruled
from safenav.spec.movement import one_of
from safenav.world.map import Region


def holding(objective: Objective, region: Region) -> Objective:
    """Return the objective of a waiting requester: stay in ``region``.

    The robot keeps its safety guarantees: they hold always, also while it waits.
    """
    if isinstance(objective, Ltl):
        stay = f"region = {region} -> region' = {region}"
        return replace(
            objective, safety=(*objective.safety, stay), liveness=(f"region = {region}",)
        )
    return ruled(Hold(frozenset({region})), objective)


def helping(objective: Objective, places: Target, own: Target | None, *, stays: bool) -> Objective:
    """Return the objective of a helper: go to ``places`` first, then alternate with its ``own``
    target, or wait there for others that are also needed.

    Plain alternation, not the literal Patrol formula, which would forbid a robot that leaves a
    doorway on the far side to come back through it.
    """
    if isinstance(objective, Ltl):
        return replace(objective, liveness=(one_of("region", places),))
    if stays:
        return ruled(Hold(places), objective)
    return ruled(Visit((places,) if own is None else (places, own)), objective)
