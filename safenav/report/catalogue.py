"""A catalogue as tables of text."""

from collections.abc import Iterable

from safenav.report.terminal.layout import table
from safenav.scenario.model import Catalogue, Need, ResolveAt, RobotModel
from safenav.scenario.values import UNLIMITED


def catalogue_lines(catalogue: Catalogue) -> list[str]:
    """Return a catalogue as three tables, line by line."""
    lines = ["Robot models", *_robots(catalogue), "", "Capabilities"]
    models, types = catalogue.robots.values(), catalogue.obstacles.values()
    needs = {kind.name: {need.action for need in kind.needs} for kind in types}
    words = {word for each in (*needs.values(), *(m.capabilities for m in models)) for word in each}
    rows = [
        (
            word,
            _listed(model.name for model in models if word in model.capabilities),
            _listed(kind for kind, actions in needs.items() if word in actions),
        )
        for word in sorted(words)
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
        )
        for name, model in catalogue.robots.items()
    ]
    headings = ("model", "mobility", "layer", "capabilities", "vision", "ticks per step", "size")
    return table((*headings, "motion"), rows)


def _obstacles(catalogue: Catalogue) -> list[str]:
    rows = [
        (
            name,
            ", then ".join(map(_need, kind.needs)),
            "every robot" if kind.blocks is None else _listed(sorted(kind.blocks)),
            "traversable or not" if kind.has_truth else None,
        )
        for name, kind in catalogue.obstacles.items()
    ]
    return table(("type", "needs", "blocks", "reveals"), rows)


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
