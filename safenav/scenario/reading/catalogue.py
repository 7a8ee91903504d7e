"""Catalogues from YAML: robot models and obstacle types.

The built-in catalogue is shipped with the package; a scenario adds to it, or replaces entries, in
place or from a file. Code contains no model and no type.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from safenav.pace.robot import BOUNDS, MEANINGS
from safenav.scenario import language
from safenav.scenario.model import Battery, Catalogue, Need, ObstacleType, ResolveAt, RobotModel
from safenav.scenario.reading.regions import Reading
from safenav.scenario.values import UNLIMITED
from safenav.scenario.yaml.document import Node, Scalar, clipped, entries_of
from safenav.scenario.yaml.findings import Findings, parsed, read_source, suggestion
from safenav.scenario.yaml.keys import Key
from safenav.scenario.yaml.typed import read
from safenav.world.poses import Mobility

T = TypeVar("T")

_BUILT_IN = Path(__file__).parents[1] / "built_in"
FILES = (_BUILT_IN / "robots.yaml", _BUILT_IN / "obstacles.yaml")
"""The built-in catalogue."""


@lru_cache(maxsize=1)
def built_in() -> Catalogue:
    """Return the catalogue that is shipped with the package."""
    catalogue = Catalogue()
    for file in FILES:
        reading = Reading(str(file))
        reading.catalogue = catalogue
        read_catalogue_file(file, reading)
        reading.raise_if_any()
        catalogue = reading.catalogue
    return catalogue


def read_catalogue_file(path: Path, reading: Reading, named_at: Node | None = None) -> None:
    """Add the catalogue in a file to that of ``reading``. ``named_at``: the place at which the file
    of ``reading`` names this one; None if they are the same."""
    inside = reading if named_at is None else reading.beside(str(path))
    text = read_source(path, reading, named_at)
    root = None if text is None else parsed(text, inside)
    if root is not None:
        resolve_catalogue(read(language.CatalogueKeys, root, "catalogue", inside), inside)
    if root is None:
        reading.broken.add("*")
    reading.catalogue = inside.catalogue


def resolve_catalogue(item: language.CatalogueKeys | None, reading: Reading) -> None:
    """Add the entries of a catalogue to that of ``reading``; None: it was reported."""
    base = reading.catalogue
    if item is None:
        reading.broken.add("*")
        return
    own = {key.text: _model(key, each, reading) for key, each in (item.robots or {}).items()}
    robots = _completed(base.robots, own, item.at("robots"), reading)
    types = {key.text: _type(key, e, robots, reading) for key, e in (item.obstacles or {}).items()}
    obstacles = _completed(base.obstacles, types, item.at("obstacles"), reading)
    reading.catalogue = Catalogue(robots, obstacles)


def _completed(
    base: Mapping[str, T], own: Mapping[str, T | None], listed: Node | None, reading: Reading
) -> dict[str, T]:
    """Return the entries of a catalogue with its ``own`` ones, without those that were reported:
    the built-in entry of that name is not meant."""
    every = {key.text: own.get(key.text) for key, _ in entries_of(listed)}
    reading.broken |= {name for name, each in every.items() if each is None}
    return {name: each for name, each in {**base, **every}.items() if each is not None}


def vision_of(value: float | str | None) -> float | None:
    """Return a radius of sight in regions; None if it is unlimited."""
    return None if value == UNLIMITED else value  # type: ignore[return-value]


def _model(key: Scalar, item: language.ModelKeys, reading: Reading) -> RobotModel | None:
    before = len(reading)
    battery, kind = _battery(item.battery, reading), _motion(item, reading)
    if item.flawed or item.mobility is None or item.layer is None or len(reading) > before:
        return None
    return RobotModel(
        name=key.text,
        mobility=item.mobility,
        layer=item.layer.text,
        capabilities=frozenset(word.text for word in item.capabilities),
        vision=vision_of(item.vision),
        size=item.size,
        speed=item.speed,
        timing=item.timing,
        motion=kind,
        battery=battery,
    )


def _battery(item: language.BatteryKeys | None, findings: Findings) -> Battery | None:
    if item is None or item.capacity is None or item.charge is None:
        return None
    start = item.capacity if item.start is None else item.start
    for key, given in (("start", start), ("move", item.move)):
        if given > item.capacity:
            found = f"{item.named(key)} is {given}, and it holds {item.capacity}"
            findings.add(item.at(key), found)
    return Battery(item.capacity, item.charge, start, item.move, item.stay)


def _motion(item: language.ModelKeys, findings: Findings) -> str | None:
    """Return the kind of motion of a robot model; None if it has none or that was reported."""
    if item.motion is None:
        return None
    if item.motion == "walker" and item.mobility is Mobility.FREE:
        hint = "it cannot turn around within a region: write 'mobility: heading'"
        found = f"{item.named('motion')}: a {item.motion} moves with a heading"
        findings.add(item.at("motion"), found, hint)
    for key in ("size", "speed"):
        least, most = BOUNDS[item.motion][key]
        limits = Key(least=least, most=most, why=MEANINGS[key])
        read(float, item.at(key), item.named(key), findings, limits)
    return item.motion


def _type(
    key: Scalar, item: language.TypeKeys, models: Mapping[str, RobotModel], reading: Reading
) -> ObstacleType | None:
    before = len(reading)
    blocks = _blocks(item, models, reading)
    needs = _needs(item.needs or (), reading)
    last = needs[-1] if needs else None
    if last and last.same and last.at is ResolveAt.SELF and blocks != frozenset():
        found = f"the 'same' robots fulfil the last need {item.of} inside it, but may not enter"
        reading.add(item.node, found, "write 'at: neighbours' or 'blocks: []'")
    where = item.resolve_at or ResolveAt.SELF
    action = needs[0].action if needs else item.action.text if item.action else None
    if item.flawed or len(reading) > before or action is None:
        return None
    return ObstacleType(
        name=key.text,
        action=action,
        resolve_at=needs[0].at if needs else where,
        blocks=blocks,
        has_truth=item.has_truth,
        listed=needs,
        resolve_within=item.resolve_within,
    )


def _needs(items: Sequence[language.NeedKeys], reading: Reading) -> tuple[Need, ...]:
    """Return ``needs: [{action: lift, robots: 2, at: neighbours, together: true}]``, in order."""
    found: list[Need] = []
    for number, item in enumerate(items):
        label, robots = item.of.removeprefix("of "), item.robots
        if item.same and not number:
            reading.add(item.at("same"), f"{label} has no previous need for 'same'")
        elif item.same and found and robots != (before := found[-1].robots):
            if item.at("robots") is not None:
                message = f"{label} needs {robots} robots, and the need before it {before}"
                hint = "the same robots fulfil both; leave 'robots' out"
                reading.add(item.at("robots"), message, hint)
            robots = before
        at = item.at_ or ResolveAt.SELF
        if item.action is not None:
            found.append(Need(item.action.text, robots, at, item.together, item.same))
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
            reading.add(word, f"{found} a robot", suggestion(word.text, words))
    return None if item.blocks is None else frozenset(word.text for word in item.blocks)
