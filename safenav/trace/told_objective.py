"""Conversion of objectives between scenario and trace."""

from __future__ import annotations

import json

from msgspec.structs import replace

from safenav.scenario.objective import KINDS, Ltl, Objective
from safenav.scenario.objective_text import to_data
from safenav.trace.objective import Objective as TracedObjective


def objective_in_trace(objective: Objective) -> TracedObjective:
    """Return an objective in the form of a trace."""
    traced = TracedObjective.of(to_data(objective))
    assert traced is not None, "every objective of a scenario can be told"
    return traced


def objective_of(traced: TracedObjective) -> Objective | None:
    """The objective that a trace names; None for a kind that is not known here."""
    if traced.kind == "ltl":
        return _ltl(traced.body)
    kind = KINDS.get(traced.kind)
    if kind is None or kind.wrong(traced.targets) or kind.one > (len(traced.targets) == 1):
        return None
    rules = {"avoid": traced.avoid, "always": traced.always}
    return replace(kind(tuple(traced.targets)), literal=traced.literal and kind.strict, **rules)


def _ltl(spelled: str) -> Ltl:
    """The formulas that a header spells; none if it omits them."""
    try:
        parts = json.loads(spelled)
        init, safety, live = (
            tuple(map(str, parts.get(key, ()))) for key in ("init", "safety", "liveness")
        )
        memory = parts.get("memory", {}).items()
        ranges = {str(k): None if v == "bool" else (int(v[0]), int(v[1])) for k, v in memory}
        return Ltl(init, safety, live, ranges, tuple(map(str, parts.get("inputs", ()))))
    except (ValueError, TypeError, AttributeError, IndexError, KeyError):
        return Ltl()
