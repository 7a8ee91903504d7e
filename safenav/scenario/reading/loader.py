"""Scenarios from YAML: everything that can be known to be wrong before a run is reported here.

All diagnostics are collected and raised as one InputError. The readers beside this module
each know one item of the format; docs/scenario.md is its reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from msgspec import Struct

from safenav.errors import Diagnostic, InputError
from safenav.scenario.model import Catalogue, ObstacleType, Robot, Scenario
from safenav.scenario.objective import Ltl
from safenav.scenario.reading.areas import AREAS, read_areas
from safenav.scenario.reading.catalogue import CatalogueKeys, built_in, extended, read_catalogue
from safenav.scenario.reading.changes import CHANGES, ChangeReader
from safenav.scenario.reading.expectation import ExpectationReader, ExpectKeys
from safenav.scenario.reading.inputs import INPUTS, read_inputs
from safenav.scenario.reading.maps.keys import MapKeys
from safenav.scenario.reading.maps.map import read_map
from safenav.scenario.reading.never_together import NEVER_TOGETHER, read_never_together
from safenav.scenario.reading.obstacles import (
    OBSTACLES,
    ORDERS,
    SUSPECTS,
    read_obstacles,
    read_orders,
    read_suspects,
)
from safenav.scenario.reading.partition import PARTITION, read_partition
from safenav.scenario.reading.promises import check_promises
from safenav.scenario.reading.regions import REGION, RegionReader
from safenav.scenario.reading.requirements import REQUIREMENTS, read_requirements
from safenav.scenario.reading.robots import ROBOTS, read_robots
from safenav.scenario.settings import (
    Clock,
    Controllers,
    Coordination,
    FailedMoves,
    Failures,
    LatePolicy,
    Limits,
    RequestOrder,
    RobotChange,
    Until,
)
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, ReadableFolder, suggestion
from safenav.scenario.yaml.shapes import (
    POSITIVE,
    SWITCH,
    TEXT,
    Key,
    Table,
    choice,
    either,
    form,
    many,
    whole,
)
from safenav.scenario.yaml.source import parsed, read_source
from safenav.world.map import Region, RegionMap

VERSION = 1

Change = Callable[[Node, Findings], Node]
"""Alters a document before it is read: a variation is checked as if it stood in the file."""


class UntilKeys(Table):
    about = "When a run is completed."
    made = Until
    rounds = Key(whole(1), "Rounds of each robot after the last resolution.")
    by = Key(whole(1), "The tick at which the mission is completed at the latest.")


class LimitKeys(Table):
    about = "When to give up."
    made = Limits
    ticks = Key(whole(1), "Ticks of a run.")
    seconds = Key(POSITIVE, "Seconds of a run (live: on its clock). Default: none.")
    synthesis_seconds = Key(POSITIVE, "Seconds of a single synthesis.")
    synthesis_memory = Key(whole(1), "Memory of a single synthesis, in MiB.")
    states = Key(whole(1), "The most states of a strategy that 'auto' lists.")


class FailureKeys(Table):
    about = "What follows when robots fail in a live run."
    made = Failures
    retries = Key(whole(), "How often a failed move into a region is repeated.")
    then = Key(
        choice(FailedMoves), "What follows: the region is an obstacle, or the robot out of service."
    )
    most = Key(whole(1), "Failed moves in a row after which a robot is out of service.")
    actions = Key(whole(1), "Failed actions after which another robot helps.")
    patience = Key(POSITIVE, "Median durations after which a command is cancelled.")
    timeout = Key(POSITIVE, "Seconds after which a command is cancelled. Default: none.")


class ScenarioKeys(Table):
    about = (
        "A map, robots with objectives, and hidden obstacles (format version 1). "
        "See docs/scenario.md."
    )
    made = Scenario
    safenav = Key(
        form({"const": VERSION}),
        "Version of the format.",
        required="begin the file with 'safenav: 1', the version of its format",
    )
    name = Key(TEXT, "Its name in reports. Default: that of the file.")
    map = Key(
        form(MapKeys),
        required="draw it: 'map:', below it 'grid: |', below that rows of '#' and '.'",
    )
    areas = Key(AREAS, "Named sets of regions, usable as targets.")
    robots = Key(
        ROBOTS,
        "The team by name, in the order of moves within a tick.",
        required="name each robot with its model, start and objective",
    )
    never_together = Key(NEVER_TOGETHER, "Robots and regions for at most one of them.")
    inputs = Key(INPUTS, "Booleans that the environment sets.")
    obstacles = Key(OBSTACLES, "Obstacles that robots find by encountering them.")
    orders = Key(ORDERS, "Work that the team receives at some tick.")
    changes = Key(CHANGES, "Objectives and service of robots during the run.")
    until = Key(form(UntilKeys))
    limits = Key(form(LimitKeys))
    clock = Key(choice(Clock), "Time passes in ticks, or in seconds (live).")
    failures = Key(form(FailureKeys))
    resolve_within = Key(
        whole(),
        "The most ticks from a request to a resolution, unless the obstacle says otherwise.",
    )
    suspects = Key(SUSPECTS, "Obstacles that the team knows may be there.")
    late = Key(choice(LatePolicy), "After a broken promise: go_on, or stop.")
    chargers = Key(form(many(REGION)), "Regions where batteries are charged.")
    flat = Key(TEXT, "The obstacle type (with 'blocks: []') of a robot without charge.")
    seed = Key(whole(most=2**63 - 1), "Seed of everything random in a run.")
    coordination = Key(choice(Coordination), "How robots are reassigned.")
    order = Key(choice(RequestOrder), "Which open request is served first.")
    controllers = Key(
        choice(Controllers),
        "Whether strategies are listed or give moves on demand; auto: by limits.states.",
    )
    deadlock = Key(SWITCH, "Whether joint plans move robots that wait for each other.")
    partition = Key(PARTITION)
    requirements = Key(
        REQUIREMENTS,
        "Formulas over the motion, such as always(distance(a, b) >= 1); they may have names.",
    )
    expect = Key(form(ExpectKeys))
    catalogue = Key(
        form(either(CatalogueKeys, TEXT)),
        "Models and types of its own, in place or as the path of a file.",
    )


AS_WRITTEN = (
    *(ScenarioKeys.name, ScenarioKeys.seed, ScenarioKeys.coordination, ScenarioKeys.order),
    *(ScenarioKeys.controllers, ScenarioKeys.deadlock, ScenarioKeys.clock),
    *(ScenarioKeys.resolve_within, ScenarioKeys.late),
)
"""Keys whose values are fields of the scenario."""


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
        item = ScenarioKeys.read(root, "the scenario", self._findings, of="")
        if item is None:
            return None
        self._version(item.safenav)
        regions = read_map(item.map, self._lines, Path(self._file).parent, self._findings)
        regions = read_areas(item.areas, regions, self._findings)
        self.world = regions.world
        before = len(self._findings)
        named = _names(item.robots)
        catalogue = self.catalogue = self._catalogue(item.catalogue, regions, named)
        types_known = len(self._findings) == before
        inputs = read_inputs(item.inputs, frozenset(named), self._findings)
        known = [each.name for each in inputs]
        robots = read_robots(
            item.robots, regions, catalogue, self._findings, self._reachable, known
        )
        apart = read_never_together(
            item.never_together, regions, robots, frozenset(named), self._findings
        )
        before = len(self._findings)
        obstacles = read_obstacles(item.obstacles, regions, catalogue, robots, self._findings)
        orders = read_orders(item.orders, regions, catalogue, self._findings)
        obstacles = (*obstacles, *orders)
        obstacles_known = types_known and len(self._findings) == before
        all_known = obstacles_known and regions.world is not None
        changes = ChangeReader(
            regions, robots, frozenset(named), self._findings, self._reachable
        ).read(item.changes)
        flat = self._flat(item)
        expectations = ExpectationReader(
            regions,
            obstacles if all_known else None,
            named,
            self._findings,
            "" if flat is None else flat.name,
        )
        expect = expectations.read(item.expect)
        requirements = read_requirements(
            item.requirements,
            regions,
            named,
            obstacles if all_known else None,
            self._findings,
            "" if flat is None else flat.name,
        )
        if item.coordination is Coordination.ASSIGNABLE:
            self._assigned(item.where(ScenarioKeys.coordination), robots, changes)
        partition = read_partition(item.partition, regions, self._findings)
        suspects = read_suspects(item.suspects, regions, catalogue, self._findings)
        chargers = self._chargers(item.chargers, regions)
        until = UntilKeys.fill(item.until, "until", self._findings, Until())
        limits = LimitKeys.fill(item.limits, "limits", self._findings, Limits())
        failures = FailureKeys.fill(item.failures, "failures", self._findings, Failures())
        given = {"name": Path(self._file).stem, **item.given(*AS_WRITTEN)}
        if regions.world is None:
            return None
        scenario = Scenario(
            map=regions.world,
            robots=robots,
            obstacles=obstacles,
            until=until,
            limits=limits,
            expect=expect,
            source=self._file,
            partition=partition,
            changes=changes,
            requirements=requirements,
            catalogue=catalogue,
            failures=failures,
            never_together=apart,
            suspects=suspects,
            chargers=chargers,
            flat=flat,
            inputs=inputs,
            **given,
        )
        if len(self._findings) == 0:
            check_promises(scenario, item.node, self._findings)
        return scenario

    def _chargers(self, node: Node | None, regions: RegionReader) -> frozenset[Region]:
        items = read.sequence(node, "chargers", self._findings) or ()
        found = [regions.regions(item, "an item of chargers") or frozenset() for item in items]
        return frozenset[Region]().union(*found)

    def _flat(self, item: ScenarioKeys) -> ObstacleType | None:
        word, node = item.flat, item.where(ScenarioKeys.flat)
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


def _names(node: Node | None) -> tuple[str, ...]:
    """All robots that the scenario names, usable or not."""
    return tuple(key.text for key, _ in node.entries) if isinstance(node, Mapping) else ()
