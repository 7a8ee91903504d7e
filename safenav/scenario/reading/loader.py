"""Scenarios from YAML, with all errors that can be found before a run.

All diagnostics are collected and raised as one InputError. The readers beside this module read the
items of the format; docs/scenario.md is its reference.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec import Struct

from safenav.errors import Diagnostic, InputError
from safenav.lines import printable
from safenav.scenario import language
from safenav.scenario.model import Catalogue, ObstacleType, Scenario
from safenav.scenario.reading.catalogue import (
    built_in,
    read_catalogue_file,
    resolve_catalogue,
    type_named,
)
from safenav.scenario.reading.compatibility import check_assignable, check_deadlines
from safenav.scenario.reading.events import (
    resolve_changes,
    resolve_expect,
    resolve_inputs,
    resolve_obstacles,
    resolve_orders,
    resolve_requirements,
)
from safenav.scenario.reading.map import resolve_map
from safenav.scenario.reading.regions import Reading, resolve_areas, resolve_exclusions
from safenav.scenario.reading.robots import resolve_robots
from safenav.scenario.settings import Coordination
from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, entries_of, items_of
from safenav.scenario.yaml.findings import Findings, ReadableFolder
from safenav.scenario.yaml.source import parsed, read_source
from safenav.scenario.yaml.typed import entries, read
from safenav.world.map import Region, RegionMap

Change = Callable[[Node, Findings], Node]
"""A change of a document before it is read: a variation is checked like the text of a file."""


def load_scenario(path: str | Path, *, reachable: bool = True) -> Scenario:
    """Return the scenario in a file. ``reachable``: report targets that a robot cannot reach.

    Raises InputError with every diagnostic, in file order, if the file cannot be read or is not a
    valid scenario.
    """
    return load_scenario_text(scenario_text(Path(path)), str(path), reachable=reachable)


def scenario_text(path: Path) -> str:
    """Return the text of a scenario's file, or of standard input. Raises InputError."""
    findings = Findings(str(path))
    text = read_source(path, findings)
    findings.raise_if_any()
    assert text is not None
    return text


def load_scenario_text(
    text: str,
    file: str = "<text>",
    change: Change | None = None,
    *,
    reachable: bool = True,
    reach: ReadableFolder | None = None,
) -> Scenario:
    """Return the scenario in a text. ``file`` is named in messages and as the scenario's source; a
    catalogue file is searched beside it. ``change`` is applied to the document first. ``reach``:
    the folder whose files it may name; None: any.

    Raises InputError.
    """
    reading = Reading(file, reach, reachable=reachable)
    root = parsed(text, reading)
    if root is not None:
        root = root if change is None else change(root, reading)
        scenario = _scenario(root, reading)
    reading.raise_if_any()
    assert scenario is not None, "what cannot be read is reported"
    return scenario


class Draft(Struct, frozen=True):
    """The readable parts of a text: the scenario if it has no error, its catalogue, its map if that
    is usable, and all diagnostics."""

    scenario: Scenario | None
    catalogue: Catalogue
    world: RegionMap | None
    diagnostics: tuple[Diagnostic, ...]


def load_draft(
    text: str, file: str, reach: ReadableFolder | None = None, *, reachable: bool = True
) -> Draft:
    """Return the scenario in a text that is still being edited. Raises nothing."""
    reading = Reading(file, reach, reachable=reachable)
    reading.catalogue = built_in()
    root = parsed(text, reading)
    scenario = None if root is None else _scenario(root, reading)
    try:
        reading.raise_if_any()
    except InputError as error:
        return Draft(None, reading.catalogue, reading.world, error.diagnostics)
    return Draft(scenario, reading.catalogue, reading.world, ())


def load_catalogue(path: Path) -> Catalogue:
    """Return the built-in catalogue with the additions of a scenario or a catalogue file.

    Raises InputError with every diagnostic if the file is neither.
    """
    reading = Reading(str(path))
    text = read_source(path, reading)
    root = None if text is None else parsed(text, reading)
    reading.raise_if_any()
    assert text is not None and root is not None
    keys = {key.text for key, _ in entries_of(root)}
    if not keys or not keys.issubset(entries(language.CatalogueKeys)):
        return load_scenario_text(text, str(path)).catalogue
    reading.catalogue = built_in()
    resolve_catalogue(read(language.CatalogueKeys, root, "catalogue", reading), reading, str(path))
    reading.raise_if_any()
    return reading.catalogue


def schema_text() -> str:
    """Return the JSON Schema (draft 2020-12) of scenario files, for editors and other tools. It
    describes their shape only, so it accepts a region in a wall or an unknown robot model."""
    from safenav.scenario.yaml.json_schema import schema_text as schema_of  # for editors alone

    return schema_of(language.ScenarioKeys, "safenav scenario")


def _scenario(root: Node, reading: Reading) -> Scenario | None:
    """Return the scenario, which is valid only if nothing was reported."""
    reading.catalogue = built_in()
    item: language.ScenarioKeys | None = read(language.ScenarioKeys, root, "the scenario", reading)
    if item is None:
        return None
    reading.names_known = item.map is not None
    resolve_map(item.map, reading)
    resolve_areas(item.areas or {}, reading)
    reading.alone = False
    reading.named = tuple(key.text for key, _ in entries_of(item.at("robots")))
    reading.robots_known = isinstance(item.at("robots"), document.Mapping)
    before = len(reading)
    _resolve_catalogue(item, reading)
    types_known = len(reading) == before and not _flawed(item.catalogue)
    reading.inputs = tuple(key.text for key, _ in entries_of(item.at("inputs")))
    inputs = resolve_inputs(item.inputs or {}, reading)
    if item.robots == {} and not reading.named:
        reading.add(item.at("robots"), "there are no robots", "a scenario has at least one")
    reading.team = resolve_robots(item.robots or {}, reading)
    before = len(reading)
    obstacles = (
        *resolve_obstacles(item.obstacles, reading),
        *resolve_orders(item.orders, reading),
    )
    known = types_known and reading.robots_known and reading.world is not None
    if known and len(reading) == before and _all_given(item):
        reading.obstacles = obstacles
    changes = resolve_changes(item.changes, reading)
    reading.flat = _flat(item, reading)
    if item.coordination is Coordination.ASSIGNABLE:
        check_assignable(reading.team, changes, item.at("coordination"), reading)
    never_together = resolve_exclusions(item.never_together, reading)
    expect = resolve_expect(item.expect, reading)
    requirements = resolve_requirements(item.requirements, reading)
    chargers = [reading.regions(place) or frozenset() for place in item.chargers or ()]
    if reading.world is None:
        return None
    scenario = Scenario(
        name=item.name or printable(Path(reading.file).stem),
        map=reading.world,
        robots=reading.team,
        obstacles=obstacles,
        until=item.until,
        limits=item.limits,
        seed=item.seed,
        coordination=item.coordination,
        expect=expect,
        source=reading.file,
        tiles=item.partition.tiles if isinstance(item.partition, language.TileKeys) else None,
        changes=changes,
        requirements=requirements,
        catalogue=reading.catalogue,
        clock=item.clock,
        never_together=never_together,
        resolve_within=item.resolve_within,
        late=item.late,
        chargers=frozenset[Region]().union(*chargers),
        flat=reading.flat,
        inputs=inputs,
    )
    if len(reading) == 0:
        check_deadlines(scenario, item.node, reading)
    return scenario


def _all_given(item: language.ScenarioKeys) -> bool:
    """Return whether all obstacles and orders could be read."""
    for key, read_items in (("obstacles", item.obstacles), ("orders", item.orders)):
        node = item.at(key)
        listed = node is None or isinstance(node, document.Sequence)
        if not listed or len(read_items) < len(items_of(node)):
            return False
    return not any(each.flawed for each in (*item.obstacles, *item.orders))


def _flawed(part: language.CatalogueKeys | str | None) -> bool:
    return isinstance(part, language.CatalogueKeys) and part.flawed


def _resolve_catalogue(item: language.ScenarioKeys, reading: Reading) -> None:
    if isinstance(item.catalogue, str):
        path = reading.folder / item.catalogue
        read_catalogue_file(path, reading, str(path), item.at("catalogue"))
    elif item.at("catalogue") is not None:
        resolve_catalogue(item.catalogue, reading, reading.file)


def _flat(item: language.ScenarioKeys, reading: Reading) -> ObstacleType | None:
    kind = type_named(item.flat, item.named("flat"), reading)
    if kind is not None and kind.blocks != frozenset():
        found = f"'flat': a {kind.name} appears where a robot stands, and it stops some"
        reading.add(item.at("flat"), found, f"give {kind.name} 'blocks: []'")
    return kind
