"""Scenarios from YAML: everything that can be known to be wrong before a run is reported here.

All diagnostics are collected and raised as one InputError. The readers beside this module
each know one item of the format; docs/scenario.md is its reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.scenario.model import (
    DEFAULT_CLOCK,
    Catalogue,
    Clock,
    Controllers,
    Coordination,
    FailedMoves,
    Failures,
    LatePolicy,
    Limits,
    ObstacleType,
    RequestOrder,
    Robot,
    RobotChange,
    Scenario,
    Until,
)
from safenav.scenario.objective import Ltl
from safenav.scenario.reading.areas import read_areas
from safenav.scenario.reading.catalogue import RESOLVE_WITHIN, built_in, extended, read_catalogue
from safenav.scenario.reading.changes import ChangeReader
from safenav.scenario.reading.expectation import ExpectationReader
from safenav.scenario.reading.inputs import read_inputs
from safenav.scenario.reading.maps.map import read_map
from safenav.scenario.reading.never_together import read_never_together
from safenav.scenario.reading.obstacles import read_obstacles, read_orders, read_suspects
from safenav.scenario.reading.partition import read_partition
from safenav.scenario.reading.promises import check_promises
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.reading.requirements import read_requirements
from safenav.scenario.reading.robots import read_robots
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, ReadableFolder, suggestion
from safenav.scenario.yaml.source import parsed, read_source
from safenav.world.map import Region, RegionMap

VERSION = 1

Change = Callable[[Node, Findings], Node]
"""Alters a document before it is read: a variation is checked as if it stood in the file."""

KEYS = (
    "safenav",
    "name",
    "map",
    "areas",
    "robots",
    "never_together",
    "inputs",
    "obstacles",
    "orders",
    "changes",
    "until",
    "limits",
    "clock",
    "failures",
    "resolve_within",
    "suspects",
    "late",
    "chargers",
    "flat",
    "seed",
    "coordination",
    "order",
    "controllers",
    "deadlock",
    "partition",
    "requirements",
    "expect",
    "catalogue",
)
FAILURE_KEYS = ("retries", "then", "most", "actions", "patience", "timeout")
UNTIL_KEYS = ("rounds", "by")
LIMIT_KEYS = ("ticks", "seconds", "synthesis_seconds", "synthesis_memory", "states")
REQUIRED = {
    "safenav": "begin the file with 'safenav: 1', the version of its format",
    "map": "draw it: 'map:', below it 'grid: |', below that rows of '#' and '.'",
    "robots": "name each robot with its model, start and objective",
}


def load_scenario(path: str | Path, *, reachable: bool = True) -> Scenario:
    """The scenario in a file. ``reachable``: insist that robots can reach their targets.

    Raises InputError with every diagnostic, in file order, if the file cannot be read or is not a
    valid scenario.
    """
    findings = Findings(str(path))
    text = read_source(Path(path), findings)
    findings.raise_if_any()
    assert text is not None
    return load_scenario_text(text, str(path), reachable=reachable)


def load_scenario_text(
    text: str,
    file: str = "<text>",
    change: Change | None = None,
    *,
    reachable: bool = True,
    reach: ReadableFolder | None = None,
) -> Scenario:
    """The scenario in a text. ``file`` is named in messages and as the scenario's source; a
    catalogue file is searched beside it. ``reach``: which files it may name.

    Raises InputError.
    """
    findings = Findings(file, reach)
    document = parsed(text, findings)
    if document is None:
        findings.raise_if_any()
        raise AssertionError("a document that cannot be read is reported")
    root = document.root if change is None else change(document.root, findings)
    scenario = _Loader(text, file, findings, reachable).read(root)
    findings.raise_if_any()
    assert scenario is not None
    return scenario


class Draft(Struct, frozen=True):
    """The readable parts of a text: the scenario if it has no error, the catalogue that
    its names refer to, its map as far as that is usable, and all diagnostics."""

    scenario: Scenario | None
    catalogue: Catalogue
    world: RegionMap | None
    diagnostics: tuple[Diagnostic, ...]


def load_draft(
    text: str, file: str, reach: ReadableFolder | None = None, *, reachable: bool = True
) -> Draft:
    """The scenario in a text that somebody is still working on. Raises nothing."""
    findings = Findings(file, reach)
    document = parsed(text, findings)
    loader = _Loader(text, file, findings, reachable)
    scenario = None if document is None else loader.read(document.root)
    try:
        findings.raise_if_any()
    except InputError as error:
        return Draft(None, loader.catalogue, loader.world, error.diagnostics)
    return Draft(scenario, loader.catalogue, loader.world, ())


class _Loader:
    def __init__(self, text: str, file: str, findings: Findings, reachable: bool) -> None:
        self._lines = text.split("\n")
        self._file = file
        self._reachable = reachable
        self._findings = findings
        self.catalogue = built_in()
        self.world: RegionMap | None = None

    def read(self, root: Node) -> Scenario | None:
        """The scenario; only to be used if nothing was reported."""
        item = read.mapping(root, "the scenario", self._findings, KEYS, REQUIRED)
        if item is None:
            return None
        self._version(item.get("safenav"))
        regions = read_map(item.get("map"), self._lines, Path(self._file).parent, self._findings)
        regions = read_areas(item.get("areas"), regions, self._findings)
        self.world = regions.world
        before = len(self._findings)
        named = _names(item.get("robots"))
        catalogue = self.catalogue = self._catalogue(item.get("catalogue"), regions, named)
        types_known = len(self._findings) == before
        inputs = read_inputs(item.get("inputs"), frozenset(named), self._findings)
        known = [each.name for each in inputs]
        robots = read_robots(
            item.get("robots"), regions, catalogue, self._findings, self._reachable, known
        )
        apart = read_never_together(
            item.get("never_together"), regions, robots, frozenset(named), self._findings
        )
        before = len(self._findings)
        obstacles = read_obstacles(
            item.get("obstacles"), regions, catalogue, robots, self._findings
        )
        orders = read_orders(item.get("orders"), regions, catalogue, self._findings)
        obstacles = (*obstacles, *orders)
        obstacles_known = types_known and len(self._findings) == before
        all_known = obstacles_known and regions.world is not None
        changes = ChangeReader(
            regions, robots, frozenset(named), self._findings, self._reachable
        ).read(item.get("changes"))
        flat = self._flat(item.get("flat"))
        expectations = ExpectationReader(
            regions,
            obstacles if all_known else None,
            named,
            self._findings,
            "" if flat is None else flat.name,
        )
        expect = expectations.read(item.get("expect"))
        requirements = read_requirements(
            item.get("requirements"),
            regions,
            named,
            obstacles if all_known else None,
            self._findings,
            "" if flat is None else flat.name,
        )
        name = read.text(item.get("name"), "'name'", self._findings)
        until, limits = self._until(item.get("until")), self._limits(item.get("limits"))
        seed = read.integer(item.get("seed"), "'seed'", self._findings, most=2**63 - 1)
        coordination = read.choice(
            item.get("coordination"), "'coordination'", Coordination, self._findings
        )
        if coordination is Coordination.ASSIGNABLE:
            self._assigned(item.get("coordination"), robots, changes)
        order = read.choice(item.get("order"), "'order'", RequestOrder, self._findings)
        controllers = read.choice(
            item.get("controllers"), "'controllers'", Controllers, self._findings
        )
        deadlock = read.switch(item.get("deadlock"), "'deadlock'", self._findings)
        partition = read_partition(item.get("partition"), regions, self._findings)
        clock = read.choice(item.get("clock"), "'clock'", Clock, self._findings)
        failures = self._failures(item.get("failures"))
        limit = read.integer(item.get(RESOLVE_WITHIN), f"'{RESOLVE_WITHIN}'", self._findings)
        suspects = read_suspects(item.get("suspects"), regions, catalogue, self._findings)
        late = read.choice(item.get("late"), "'late'", LatePolicy, self._findings)
        chargers = self._chargers(item.get("chargers"), regions)
        if regions.world is None:
            return None
        scenario = Scenario(
            name or Path(self._file).stem,
            regions.world,
            robots,
            obstacles,
            until,
            limits,
            seed or 0,
            coordination or Coordination.RESYNTHESIS,
            expect,
            self._file,
            deadlock is not False,
            partition,
            controllers or Controllers.AUTO,
            changes,
            requirements,
            catalogue=catalogue,
            clock=clock or DEFAULT_CLOCK,
            failures=failures,
            never_together=apart,
            order=order or RequestOrder.NEWEST,
            resolve_within=limit,
            suspects=suspects,
            late=late or LatePolicy.GO_ON,
            chargers=chargers,
            flat=flat,
            inputs=inputs,
        )
        if len(self._findings) == 0:
            check_promises(scenario, item, self._findings)
        return scenario

    def _chargers(self, node: Node | None, regions: RegionReader) -> frozenset[Region]:
        items = read.sequence(node, "chargers", self._findings) or ()
        found = [regions.regions(item, "an item of chargers") or frozenset() for item in items]
        return frozenset[Region]().union(*found)

    def _flat(self, node: Node | None) -> ObstacleType | None:
        word = read.text(node, "'flat'", self._findings)
        kind = self.catalogue.obstacles.get(word or "")
        if word is not None and kind is None and not self.catalogue.may_hold(word):
            hint = suggestion(word, self.catalogue.obstacles)
            self._findings.add(node, f"'flat': unknown obstacle type '{clipped(word)}'", hint)
        if kind is not None and kind.blocks != frozenset():
            found = f"'flat': a {kind.name} appears where a robot stands, and it stops some"
            self._findings.add(node, found, f"give {kind.name} 'blocks: []'")
        return kind

    def _version(self, node: Node | None) -> None:
        if node is None:
            return
        version = read.integer(node, "'safenav' (the version of the format)", self._findings)
        if version is not None and version != VERSION:
            found = f"version {version} of the scenario format is unknown"
            self._findings.add(node, found, f"this safenav reads 'safenav: {VERSION}'")

    def _catalogue(
        self, node: Node | None, regions: RegionReader, team: tuple[str, ...]
    ) -> Catalogue:
        base = built_in()
        if node is None:
            return base
        if not isinstance(node, Scalar) or not isinstance(node.value, str):
            return read_catalogue(node, base, regions, self._findings, self._file, team)
        path = Path(self._file).parent / node.value
        text = read_source(path, self._findings, node)
        if text is None:
            return base.without_rest()
        beside = self._findings.beside(str(path))
        return extended(base, text, regions, beside, str(path), team)

    def _assigned(
        self, node: Node | None, robots: Sequence[Robot], changes: Sequence[RobotChange]
    ) -> None:
        """A goal that is assigned at runtime may lie beyond a target, or be one."""
        for robot in robots:
            if robot.while_waiting is not None:
                found = f"'coordination: assignable' cannot keep 'while_waiting' of {robot.name}"
                hint = "leave out the key, or use 'coordination: resynthesis'"
                self._findings.add(node, found, hint)
            if isinstance(robot.objective, Ltl) and robot.objective.inputs:
                found = f"'coordination: assignable' cannot use inputs in 'ltl' of {robot.name}"
                self._findings.add(node, found, "use 'coordination: resynthesis'")
        given = [(robot.name, robot.objective) for robot in robots]
        given += [(change.robot, change.objective) for change in changes if change.objective]
        for name in dict.fromkeys(n for n, o in given if o.literal):
            found = f"'coordination: assignable' cannot keep 'form: literal' of {name}"
            hint = "leave out the form, or use 'coordination: resynthesis'"
            self._findings.add(node, found, hint)

    def _until(self, node: Node | None) -> Until:
        item = read.mapping(node, "until", self._findings, UNTIL_KEYS)
        if item is None:
            return Until()
        label = "'rounds' of until"
        rounds = read.integer(item.get("rounds"), label, self._findings, least=1)
        by = read.integer(item.get("by"), "'by' of until", self._findings, least=1)
        return Until(Until().rounds if rounds is None else rounds, by)

    def _failures(self, node: Node | None) -> Failures:
        item = read.mapping(node, "failures", self._findings, FAILURE_KEYS)
        if item is None:
            return Failures()
        counts = {
            key: read.integer(
                item.get(key), f"'{key}' of failures", self._findings, least=int(key != "retries")
            )
            for key in ("retries", "most", "actions")
        }
        times = {
            key: read.positive(item.get(key), f"'{key}' of failures", self._findings)
            for key in ("patience", "timeout")
        }
        then = read.choice(item.get("then"), "'then' of failures", FailedMoves, self._findings)
        given = {**counts, **times, "then": then}
        return replace(Failures(), **{k: v for k, v in given.items() if v is not None})

    def _limits(self, node: Node | None) -> Limits:
        item = read.mapping(node, "limits", self._findings, LIMIT_KEYS)
        if item is None:
            return Limits()
        ticks = read.integer(item.get("ticks"), "'ticks' of limits", self._findings, least=1)
        whole, seconds = (
            read.positive(item.get(word), f"'{word}' of limits", self._findings)
            for word in ("seconds", "synthesis_seconds")
        )
        memory = read.integer(
            item.get("synthesis_memory"), "'synthesis_memory' of limits", self._findings, least=1
        )
        states = read.integer(item.get("states"), "'states' of limits", self._findings, least=1)
        default = Limits()
        return Limits(
            ticks or default.ticks,
            seconds or default.synthesis_seconds,
            memory or default.synthesis_memory,
            whole,
            states or default.states,
        )


def _names(node: Node | None) -> tuple[str, ...]:
    """All robots that the scenario names, usable or not."""
    return tuple(key.text for key, _ in node.entries) if isinstance(node, Mapping) else ()
