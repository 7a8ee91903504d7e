"""Catalogues from YAML: robot models and obstacle types.

The package contains the built-in catalogue; a scenario adds or replaces entries, in place or from a
file. Code contains no model and no type.
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from safenav.scenario import language
from safenav.scenario.model import Catalogue, Need, ObstacleType, RobotModel
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Node, Scalar, below, clipped, entries_of, items_of
from safenav.scenario.yaml.findings import parsed, read_source, suggestion
from safenav.scenario.yaml.typed import read

T = TypeVar("T")

_BUILT_IN = Path(__file__).parents[1] / "built_in"
FILES = (_BUILT_IN / "robots.yaml", _BUILT_IN / "obstacles.yaml")
"""The built-in catalogue."""


@cache
def built_in() -> Catalogue:
    """Return the catalogue in the package."""
    catalogue = Catalogue()
    for file in FILES:
        reading = Reading(str(file))
        reading.catalogue = catalogue
        read_catalogue_file(file, reading)
        reading.raise_if_any()
        catalogue = reading.catalogue
    return catalogue


def read_catalogue_file(path: Path, reading: Reading, named_at: Node | None = None) -> None:
    """Add the catalogue in a file to that of ``reading``. ``named_at``: the place where the file
    that ``reading`` reads names this one (None: they are the same)."""
    inside = reading if named_at is None else reading.beside(str(path), named_at)
    text = read_source(path, reading, named_at)
    root = None if text is None else parsed(text, inside, "catalogue")
    item = None if root is None else read(language.CatalogueKeys, root, "catalogue", inside)
    resolve_catalogue(item, inside)
    reading.catalogue = inside.catalogue


def resolve_catalogue(item: language.CatalogueKeys | None, reading: Reading) -> None:
    """Add a catalogue's entries to that of ``reading``. ``item``: None after a reported error."""
    base = reading.catalogue
    if item is None:
        reading.broken.add("*")
        return
    own = {key.text: model for key, model in (item.robots or {}).items()}
    robots = _completed(base.robots, own, item.at("robots"), reading)
    types = {key.text: _type(key, e, robots, reading) for key, e in (item.obstacles or {}).items()}
    obstacles = _completed(base.obstacles, types, item.at("obstacles"), reading)
    reading.catalogue = Catalogue(robots, obstacles)


def _completed(
    base: Mapping[str, T], own: Mapping[str, T | None], listed: Node | None, reading: Reading
) -> dict[str, T]:
    """Return the entries of ``base``, replaced by those in ``own``. A name with a reported own
    entry has no entry, rather than that of ``base``."""
    every = {key.text: own.get(key.text) for key, _ in entries_of(listed)}
    reading.broken |= {name for name, each in every.items() if each is None}
    return {name: each for name, each in {**base, **every}.items() if each is not None}


def _type(
    key: Scalar, item: language.TypeKeys, models: Mapping[str, RobotModel], reading: Reading
) -> ObstacleType | None:
    before = len(reading)
    blocks = _blocks(item, models, reading)
    if item.flawed:
        return None
    needs = _needs(item, reading)
    if len(reading) > before:
        return None
    return ObstacleType(key.text, needs, blocks, item.has_truth, item.resolve_within)


def _needs(item: language.TypeKeys, reading: Reading) -> tuple[Need, ...]:
    """Return the needs in order. A ``same`` need has the number of robots of the previous one."""
    if item.action is not None:
        return (Need(item.action, at=item.resolve_at),)
    found: list[Need] = []
    for need, node in zip(item.needs or (), items_of(item.at("needs")), strict=True):
        label, given = f"need {len(found) + 1} {item.of}", below(node, "robots")
        if need.same and not found:
            reading.add(below(node, "same"), f"{label} has no previous need for 'same'")
        elif need.same and need.robots != (before := found[-1].robots):
            if given is not None:
                message = f"{label} needs {need.robots} robots, and the need before it {before}"
                reading.add(given, message, "the same robots fulfil both; leave 'robots' out")
            need = replace(need, robots=before)
        found.append(need)
    return tuple(found)


def _blocks(
    item: language.TypeKeys, models: Mapping[str, RobotModel], reading: Reading
) -> frozenset[str] | None:
    words = {*(model.layer for model in models.values()), *models, *reading.named}
    # A separate catalogue may name any robot, and an unreadable model may have any layer.
    checked = reading.named and not reading.broken
    for word in item.blocks or ():
        if checked and word.text not in words:
            found = (
                f"{item.named('blocks')}: '{clipped(word.text)}' is not a layer, a robot model or"
            )
            hint = "to stop all robots, leave 'blocks' out" if word.text in ("all", "any") else ""
            reading.add(word, f"{found} a robot", hint or suggestion(word.text, words))
    return None if item.blocks is None else frozenset(word.text for word in item.blocks)
