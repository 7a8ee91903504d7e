"""A catalogue as tables for people and as data for machines: robot models, capabilities, obstacle
types, and the source of each entry."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from safenav.report.terminal.table import table
from safenav.scenario.model import Catalogue, ObstacleType, ResolveAt, RobotModel, Timing
from safenav.scenario.reading.catalogue import UNLIMITED


def _motion_data(model: RobotModel) -> dict[str, object] | None:
    """Return the kind of motion and the parameters that the model sets itself."""
    return (
        None if model.motion is None else {"kind": model.motion.kind, **dict(model.motion.values)}
    )


def catalogue_data(catalogue: Catalogue) -> dict[str, Any]:
    """Return everything, fit for JSON. ``capabilities`` lists for each the models that have it and
    the obstacles that need it."""
    return {
        "robots": {
            name: {
                "mobility": model.mobility.value,
                "layer": model.layer,
                "capabilities": sorted(model.capabilities),
                "vision": model.vision,
                "size": model.size,
                "speed": model.speed,
                "motion": _motion_data(model),
                "timing": {"least": model.timing.least, "most": model.timing.most},
                "source": catalogue.sources[f"robots.{name}"],
            }
            for name, model in catalogue.robots.items()
        },
        "capabilities": {
            word: {
                "robots": [m.name for m in catalogue.robots.values() if word in m.capabilities],
                "resolves": [t.name for t in catalogue.obstacles.values() if t.action == word],
            }
            for word in _capabilities(catalogue)
        },
        "obstacles": {
            name: {
                "action": kind.action,
                "resolve_at": kind.resolve_at.value
                if isinstance(kind.resolve_at, ResolveAt)
                else sorted(kind.resolve_at),
                "blocks": None if kind.blocks is None else sorted(kind.blocks),
                "has_truth": kind.has_truth,
                "source": catalogue.sources[f"obstacles.{name}"],
            }
            for name, kind in catalogue.obstacles.items()
        },
    }


def catalogue_lines(catalogue: Catalogue) -> list[str]:
    """Return the same as three tables."""
    data = catalogue_data(catalogue)
    lines = ["Robot models", *_robots(catalogue), "", "Capabilities"]
    rows = [
        (word, _listed(entry["robots"]), _listed(entry["resolves"]))
        for word, entry in data["capabilities"].items()
    ]
    lines += table(("capability", "robots that have it", "resolves"), rows)
    return [*lines, "", "Obstacle types", *_obstacles(catalogue)]


def _robots(catalogue: Catalogue) -> list[str]:
    rows = [
        (
            name,
            model.mobility.value,
            model.layer,
            _listed(sorted(model.capabilities)),
            UNLIMITED if model.vision is None else f"{model.vision:g}",
            _ticks(model.timing),
            _metres(model),
            catalogue.sources[f"robots.{name}"],
        )
        for name, model in catalogue.robots.items()
    ]
    headings = ("model", "mobility", "layer", "capabilities", "vision", "ticks per step", "size")
    return table((*headings, "source"), rows)


def _obstacles(catalogue: Catalogue) -> list[str]:
    rows = [
        (
            name,
            kind.action,
            _where(kind),
            "every robot" if kind.blocks is None else _listed(sorted(kind.blocks)),
            "traversable or not" if kind.has_truth else None,
            catalogue.sources[f"obstacles.{name}"],
        )
        for name, kind in catalogue.obstacles.items()
    ]
    return table(("type", "action", "where", "blocks", "reveals", "source"), rows)


def _capabilities(catalogue: Catalogue) -> list[str]:
    known = {word for model in catalogue.robots.values() for word in model.capabilities}
    return sorted(known | {kind.action for kind in catalogue.obstacles.values()})


def _listed(words: Iterable[str]) -> str | None:
    return ", ".join(words) or None


def _ticks(timing: Timing) -> str:
    return str(timing.least) if timing.least == timing.most else f"{timing.least} to {timing.most}"


def _metres(model: RobotModel) -> str | None:
    parts = [] if model.size is None else [f"{model.size:g} m"]
    return _listed(parts if model.speed is None else [*parts, f"{model.speed:g} m/s"])


def _where(kind: ObstacleType) -> str:
    if isinstance(kind.resolve_at, ResolveAt):
        return "at it" if kind.resolve_at is ResolveAt.SELF else "beside it"
    return "regions " + ", ".join(map(str, sorted(kind.resolve_at)))
