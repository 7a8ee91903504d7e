"""Conversion of objectives between scenario and trace."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from msgspec.structs import replace

from safenav.scenario.objective import KINDS, Ltl, Objective, to_data
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
    """The formulas that a header spells, which its reader has checked; a single one may be a
    string."""
    parts: Mapping[str, Any] = json.loads(spelled) or {}

    def listed(key: str) -> tuple[str, ...]:
        found = parts.get(key) or ()
        return (found,) if isinstance(found, str) else tuple(found)

    memory = (parts.get("memory") or {}).items()
    ranges = {name: None if kind == "bool" else (kind[0], kind[1]) for name, kind in memory}
    return Ltl(listed("init"), listed("safety"), listed("liveness"), ranges, listed("inputs"))
