"""A vacuous win as a warning, with the path to it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from safenav.explain.vacuity import Vacuity, Way
from safenav.report.terminal.strategy_failure import node_words
from safenav.synthesis.strategy import Strategy
from safenav.trace.words import counted

_SHOWN = 12


def vacuity_lines(robot: str, vacuity: Vacuity, strategy: Strategy) -> Iterator[str]:
    """Yield the text; the first line is the warning itself."""
    verb = "could win" if vacuity.way is Way.FORCED else "may win"
    yield f"{robot} {verb} by breaking its own assumptions: {vacuity.way.value}"
    if vacuity.way in (Way.UNFAIR, Way.NO_BEGINNING):
        for origin in vacuity.origins[:_SHOWN]:
            yield f"  assumption: {origin.item}: {origin.rule}"
    if vacuity.path:
        count = counted(len(vacuity.path) - 1, "step")
        yield f"  it happens after {count}, if the other robots do this:"
        skipped = max(0, len(vacuity.path) - _SHOWN)
        if skipped:
            yield f"    ... {counted(skipped, 'step')} before"
        for node in vacuity.path[skipped:]:
            yield f"    {node_words(node, strategy)}"


def vacuity_data(vacuity: Vacuity, strategy: Strategy) -> dict[str, Any]:
    """Return the same for machines."""
    return {
        "way": vacuity.way.name.lower(),
        "says": vacuity.way.value,
        "nodes": vacuity.nodes,
        "assumptions": [{"item": o.item, "rule": o.rule} for o in vacuity.origins],
        "path": [strategy.values(node) for node in vacuity.path],
    }
