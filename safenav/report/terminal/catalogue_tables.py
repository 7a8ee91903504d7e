"""A catalogue as tables for people and as data for machines: robot models, capabilities, obstacle
types, and the source of each entry."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from msgspec import to_builtins

from safenav.report.terminal.layout import table
from safenav.scenario.model import Catalogue, Need, ResolveAt, RobotModel
from safenav.scenario.reading.catalogue import UNLIMITED


def catalogue_data(catalogue: Catalogue) -> dict[str, Any]:
    """Return the catalogue as JSON data. ``capabilities`` lists the models that have each and the
    obstacle types that need it."""
    robots, obstacles = catalogue.robots, catalogue.obstacles
    written = partial(to_builtins, order="deterministic")
    return {
        "robots": {
            name: {**written(model), "source": catalogue.sources[f"robots.{name}"]}
            for name, model in robots.items()
        },
        "capabilities": {
            word: {
                "robots": [m.name for m in robots.values() if word in m.capabilities],
                "resolves": [
                    kind.name
                    for kind in obstacles.values()
                    if any(need.action == word for need in kind.needs)
                ],
            }
            for word in _capabilities(catalogue)
        },
        "obstacles": {
            name: written(kind)
            | {"needs": written(kind.needs), "source": catalogue.sources[f"obstacles.{name}"]}
            for name, kind in obstacles.items()
        },
    }


def catalogue_lines(catalogue: Catalogue) -> list[str]:
    """Return a catalogue as three tables, line by line."""
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
            str(model.timing),
            _metres(model),
            model.motion,
            catalogue.sources[f"robots.{name}"],
        )
        for name, model in catalogue.robots.items()
    ]
    headings = ("model", "mobility", "layer", "capabilities", "vision", "ticks per step", "size")
    return table((*headings, "motion", "source"), rows)


def _obstacles(catalogue: Catalogue) -> list[str]:
    rows = [
        (
            name,
            ", then ".join(map(_need, kind.needs)),
            "every robot" if kind.blocks is None else _listed(sorted(kind.blocks)),
            "traversable or not" if kind.has_truth else None,
            catalogue.sources[f"obstacles.{name}"],
        )
        for name, kind in catalogue.obstacles.items()
    ]
    return table(("type", "needs", "blocks", "reveals", "source"), rows)


def _capabilities(catalogue: Catalogue) -> list[str]:
    known = {word for model in catalogue.robots.values() for word in model.capabilities}
    needs = (need for kind in catalogue.obstacles.values() for need in kind.needs)
    return sorted(known | {need.action for need in needs})


def _listed(words: Iterable[str]) -> str | None:
    return ", ".join(words) or None


def _metres(model: RobotModel) -> str | None:
    parts = [] if model.size is None else [f"{model.size:g} m"]
    return _listed(parts if model.speed is None else [*parts, f"{model.speed:g} m/s"])


def _need(need: Need) -> str:
    """Return a need in words: ``lift beside it by 2 robots together``."""
    if isinstance(need.at, ResolveAt):
        where = "at it" if need.at is ResolveAt.SELF else "beside it"
    else:
        where = "at regions " + ", ".join(map(str, sorted(need.at)))
    robots = "" if need.robots == 1 else f" by {need.robots} robots"
    same = " by the same" if need.same else ""
    return f"{need.action} {where}{robots}{' together' * need.together}{same}"
