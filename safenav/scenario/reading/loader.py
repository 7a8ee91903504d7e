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
from safenav.scenario import settings
from safenav.scenario.model import Catalogue, ObstacleType, Scenario
from safenav.scenario.reading.areas import AREAS, NEVER_TOGETHER, PARTITION, read_areas
from safenav.scenario.reading.catalogue import (
    TYPE,
    CatalogueKeys,
    built_in,
    read_catalogue,
    read_catalogue_file,
)
from safenav.scenario.reading.changes import CHANGES, INPUTS, read_changes, read_inputs
from safenav.scenario.reading.compatibility import check_assignable, check_deadlines
from safenav.scenario.reading.expectation import EXPECT, REQUIREMENTS
from safenav.scenario.reading.maps.keys import MapKeys
from safenav.scenario.reading.maps.map import read_map
from safenav.scenario.reading.obstacles import (
    OBSTACLES,
    ORDERS,
    read_obstacles,
    read_orders,
)
from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.reading.robots import ROBOTS, read_robots
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Mapping, Node, Scalar, entries_of
from safenav.scenario.yaml.findings import Findings, ReadableFolder
from safenav.scenario.yaml.shapes import Key, Shape, Table
from safenav.scenario.yaml.source import parsed, read_source
from safenav.world.map import Region, RegionMap

VERSION = 1

Change = Callable[[Node, Findings], Node]
"""A change of a document before it is read: a variation is checked like the text of a file."""


class UntilKeys(Table):
    about = "When a run is completed."
    example = "{rounds: 2}"
    made = settings.Until
    rounds = Key(shapes.whole(1), "Rounds of each robot after the last resolution.")
    by = Key(shapes.whole(1), "The tick at which the mission is completed at the latest.")


class LimitKeys(Table):
    about = "Limits of the run and of each synthesis."
    definition = "limits"
    example = "{ticks: 500}"
    made = settings.Limits
    ticks = Key(shapes.whole(1), "Ticks of a run.")
    seconds = Key(shapes.POSITIVE, "Seconds of a run (live: on its clock). Default: none.")
    synthesis_seconds = Key(shapes.POSITIVE, "Seconds of a single synthesis.")
    synthesis_memory = Key(shapes.whole(1), "Memory of a single synthesis, in MiB.")


def _chargers(node: Node | None, _what: str, reading: Reading) -> frozenset[Region]:
    found = read.values(
        node, "chargers", reading, lambda item, what, _: reading.regions(item, what)
    )
    return frozenset[Region]().union(*(found or ()))


class ScenarioKeys(Table):
    about = (
        "A map, robots with objectives, and hidden obstacles (format version 1). "
        "See docs/scenario.md."
    )
    definition = "scenario"
    made = Scenario
    safenav = Key(
        shapes.form({"const": VERSION}),
        "Version of the format.",
        required="begin the file with 'safenav: 1', the version of its format",
    )
    name = Key(shapes.TEXT, "Its name in reports. Default: that of the file.")
    map = Key(
        shapes.form(MapKeys),
        required="draw it: 'map:', below it 'grid: |', below that rows of '#' and '.'",
    )
    areas = Key(AREAS, "Named sets of regions, usable as targets.")
    robots = Key(
        ROBOTS,
        "The team by name, in the order of moves within a tick.",
        required="name each robot with its model, start and objective",
    )
    never_together = Key(NEVER_TOGETHER, "Regions with at most one of several robots at a time.")
    inputs = Key(INPUTS, "Booleans that the environment sets.")
    obstacles = Key(OBSTACLES, "Hidden obstacles, which robots discover by encountering them.")
    orders = Key(ORDERS, "Tasks that the team receives during the run.")
    changes = Key(CHANGES, "Objectives and service of robots during the run.")
    until = Key(UntilKeys.filling(settings.Until()))
    limits = Key(LimitKeys.filling(settings.Limits()))
    clock = Key(shapes.choice(settings.Clock), "Time passes in ticks, or in seconds (live).")
    resolve_within = Key(
        shapes.whole(),
        "Maximum ticks from a request to its resolution, unless the obstacle has its own.",
    )
    late = Key(shapes.choice(settings.LatePolicy), "After a missed deadline: go_on, or stop.")
    chargers = Key(Shape(shapes.many(REGION), _chargers), "Regions where batteries are charged.")
    flat = Key(
        TYPE, "The obstacle type (with 'blocks: []') that represents a robot without charge."
    )
    seed = Key(shapes.whole(most=2**63 - 1), "Seed of all random draws.")
    coordination = Key(shapes.choice(settings.Coordination), "How robots are reassigned.")
    partition = Key(PARTITION)
    requirements = Key(
        REQUIREMENTS,
        "Formulas over the motion, such as always(distance(a, b) >= 1); they may have names.",
    )
    expect = Key(EXPECT)
    catalogue = Key(
        shapes.form(shapes.either(CatalogueKeys, shapes.TEXT)),
        "Models and types of its own, in place or as the path of a file.",
    )


AS_WRITTEN = (
    *(ScenarioKeys.name, ScenarioKeys.seed, ScenarioKeys.coordination, ScenarioKeys.clock),
    *(ScenarioKeys.resolve_within, ScenarioKeys.late, ScenarioKeys.never_together),
    *(ScenarioKeys.expect, ScenarioKeys.requirements, ScenarioKeys.partition),
    *(ScenarioKeys.chargers, ScenarioKeys.until, ScenarioKeys.limits),
)
"""Keys whose values are fields of the scenario, in the order in which they are read."""


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
    keys = {key.text for key, _ in root.entries} if isinstance(root, Mapping) else set()
    if not keys or not keys.issubset(CatalogueKeys.known):
        return load_scenario_text(text, str(path)).catalogue
    reading.catalogue = built_in()
    read_catalogue(root, reading, str(path))
    reading.raise_if_any()
    return reading.catalogue


def schema_text() -> str:
    """Return the JSON Schema (draft 2020-12) of scenario files, for editors and other tools. It
    describes their shape only, so it accepts a region in a wall or an unknown robot model."""
    from safenav.scenario.yaml import json_schema

    return json_schema.schema_text(ScenarioKeys, "safenav scenario")


def _scenario(root: Node, reading: Reading) -> Scenario | None:
    """Return the scenario, which is valid only if nothing was reported."""
    reading.catalogue = built_in()
    item = ScenarioKeys.read(root, "the scenario", reading, of="")
    if item is None:
        return None
    _check_version(item.safenav, reading)
    read_map(item.map, reading)
    read_areas(item.areas, reading)
    reading.alone = False
    reading.named = tuple(key.text for key, _ in entries_of(item.robots))
    reading.robots_known = isinstance(item.robots, Mapping)
    before = len(reading)
    _read_catalogue(item.catalogue, reading)
    types_known = len(reading) == before
    inputs = read_inputs(item.inputs, reading)
    reading.inputs = tuple(each.name for each in inputs)
    reading.team = read_robots(item.robots, reading)
    before = len(reading)
    obstacles = (*read_obstacles(item.obstacles, reading), *read_orders(item.orders, reading))
    known = types_known and reading.robots_known and reading.world is not None
    if known and len(reading) == before:
        reading.obstacles = obstacles
    changes = read_changes(item.changes, reading)
    reading.flat = _flat(item, reading)
    if item.coordination is settings.Coordination.ASSIGNABLE:
        at = item.where(ScenarioKeys.coordination)
        check_assignable(reading.team, changes, at, reading)
    given = {"name": printable(Path(reading.file).stem), **item.given(*AS_WRITTEN)}
    if reading.world is None:
        return None
    scenario = Scenario(
        map=reading.world,
        robots=reading.team,
        obstacles=obstacles,
        source=reading.file,
        changes=changes,
        catalogue=reading.catalogue,
        flat=reading.flat,
        inputs=inputs,
        **given,
    )
    if len(reading) == 0:
        check_deadlines(scenario, item.node, reading)
    return scenario


def _check_version(node: Node | None, findings: Findings) -> None:
    what = "'safenav' (the version of the format)"
    version = read.integer(node, what, findings, least=-read.MOST)
    if version is not None and version != VERSION:
        found = f"version {version} of the scenario format is unknown"
        findings.add(node, found, f"this safenav reads 'safenav: {VERSION}'")


def _read_catalogue(node: Node | None, reading: Reading) -> None:
    if isinstance(node, Scalar) and isinstance(node.value, str):
        path = reading.folder / node.value
        read_catalogue_file(path, reading, str(path), node)
    elif node is not None:
        read_catalogue(node, reading, reading.file)


def _flat(item: ScenarioKeys, reading: Reading) -> ObstacleType | None:
    kind = item.flat
    if kind is not None and kind.blocks != frozenset():
        found = f"'flat': a {kind.name} appears where a robot stands, and it stops some"
        reading.add(item.where(ScenarioKeys.flat), found, f"give {kind.name} 'blocks: []'")
    return kind
