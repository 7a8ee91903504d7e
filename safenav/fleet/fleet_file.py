"""The fleet file: connection, sensors and actions of each robot of a scenario.

docs/drive.md describes it. One file serves all scenarios with these robots.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TypeVar

from msgspec.structs import replace

from safenav.fleet.stations import (
    FleetFile,
    FollowUse,
    Network,
    ScanUse,
    SimulationUse,
    Station,
    TransportKind,
    on_regions,
    side_of,
)
from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.reading.regions import REGION, Reading
from safenav.scenario.settings import FailedMoves, Failures
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping as MappingNode
from safenav.scenario.yaml.document import Node, Place, Scalar, clipped
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.shapes import (
    POSITIVE,
    TEXT,
    TEXTS,
    TRUTH,
    Key,
    Shape,
    Table,
    choice,
    form,
    many,
    matching,
    named,
    whole,
)
from safenav.scenario.yaml.source import parsed, read_source

T = TypeVar("T")

VERSION = 1
EXAMPLE = "{type: door, region: 47}"
MOST_RETRIES = 20
NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
"""Pattern of ROS names."""
NAMESPACE = re.compile(rf"/?|{NAME.pattern}/?")


def _in_ros(
    pattern: re.Pattern[str], node: Node | None, what: str, findings: Findings
) -> str | None:
    """Return the text of a node if it has this pattern; otherwise report it."""
    found = read.text(node, what, findings)
    if node is None or found is None or pattern.fullmatch(found):
        return found
    hint = "use letters, digits and '_', for example /lab/digit"
    findings.add(node, f"{what}: '{clipped(found)}' is not a name in ROS", hint)
    return None


NAMED = Shape(matching(NAME), partial(_in_ros, NAME))


class NetworkKeys(Table):
    about = "Where the robots are. Default: this machine alone."
    made = Network
    domain = Key(whole(0, 232), "ROS_DOMAIN_ID.")
    interface = Key(TEXT, "The network interface; lo: loopback.")
    peers = Key(TEXTS, "Where to find robots; []: multicast. Default: 127.0.0.1.")


class HiddenKeys(Table):
    type = Key(TEXT, "An obstacle type of the scenario.", required=EXAMPLE)
    region = Key(REGION, "Where it is, as in a scenario.", required=EXAMPLE)
    traversable = Key(TRUTH, "What resolving it reveals.")


class SimulationKeys(Table):
    about = "Settings of the transport 'simulation'."
    made = SimulationUse
    pace = Key(POSITIVE, "Upper limit of the speed-up over real time.")
    obstacles = Key(form(many(HiddenKeys)), "The true obstacles. Default: those of the scenario.")


class ScanKeys(Table):
    about = "A lidar that finds obstacles in the regions beside the robot."
    made = ScanUse
    topic = Key(NAMED, "Default: scan.")
    obstacle = Key(TEXT, "The obstacle type at the end of a ray.", required="a type of obstacle")
    beyond = Key(POSITIVE, "Metres behind a region's centre that count. Default: 0.35 of its side.")


class FollowKeys(Table):
    about = "The robot tracks references itself, instead of goals."
    made = FollowUse
    topic = Key(NAMED, "The topic of its references.")
    tolerance = Key(
        POSITIVE,
        "Allowed deviation from its reference, in metres. "
        "Default: 0.25 of a region's side, at most 0.25 m.",
    )


class StationKeys(Table):
    definition = "robot"
    made = Station
    namespace = Key(
        Shape(matching(NAMESPACE), partial(_in_ros, NAMESPACE)),
        "Prefix of its topics. Default: / and its name.",
    )
    tolerance = Key(
        POSITIVE,
        "Distance from a region's centre that counts as arrival, in metres. "
        "Default: 0.3 of its side, at most 0.3 m.",
    )
    speed = Key(POSITIVE, "Metres per second, for time limits.")
    timeout = Key(POSITIVE, "Time limit of a goal, as a multiple of the expected time.")
    retries = Key(whole(0, MOST_RETRIES), "Number of times that a failed goal is sent again.")
    scan = Key(form(ScanKeys))
    report = Key(NAMED, "A text topic: 'door@47' is present, '-door@47' is gone.")
    follow = Key(form(FollowKeys))
    act = Key(form(named(NAMED)), "The service that performs each action.")


class FailureKeys(Table):
    about = "What follows when a robot fails to carry out a command."
    example = "{retries: 3}"
    made = Failures
    retries = Key(whole(), "How often a failed move into a region is repeated.")
    then = Key(
        choice(FailedMoves),
        "Then the region is an obstacle, or the robot is out of service.",
    )
    most = Key(whole(1), "Failed moves in a row after which a robot is out of service.")
    actions = Key(whole(1), "Failed actions after which another robot helps.")
    patience = Key(POSITIVE, "Median durations after which a command is cancelled.")
    timeout = Key(POSITIVE, "Seconds after which a command is cancelled. Default: none.")


class FleetKeys(Table):
    about = "How each robot of a scenario is reached, what it senses, and how it acts."
    version = Key(
        Shape({"const": VERSION}, partial(read.integer, least=1)),
        "The version of the format: 1.",
        required="begin the file with 'safenav-fleet: 1', the version of its format",
        name="safenav-fleet",
    )
    transport = Key(
        choice(TransportKind),
        "The middleware between safenav and the robots.",
        required="'transport: ros2' or 'simulation'",
    )
    network = Key(form(NetworkKeys))
    simulation = Key(form(SimulationKeys))
    failures = Key(FailureKeys.filling(Failures()))
    inputs = Key(form(named(NAMED)), "ROS: the topic (std_msgs/Bool) of each input.")
    defaults = Key(form(StationKeys), "Values for robots that set no others.")
    robots = Key(form(named(StationKeys)), "By name; others have the defaults.")


def load_fleet(path: Path, scenario: Scenario) -> FleetFile:
    """Read the fleet file for the robots of a scenario. Robots that it does not list get the
    defaults. Raises InputError with all errors."""
    reading = Reading(str(path), world=scenario.map)
    reading.catalogue = scenario.catalogue
    text = read_source(path, reading)
    root = None if text is None else parsed(text, reading, "fleet file")
    fleet = None if root is None else _fleet(root, scenario, reading)
    reading.raise_if_any()
    assert fleet is not None
    return fleet


def _fleet(root: Node, scenario: Scenario, findings: Reading) -> FleetFile | None:
    item = FleetKeys.read(root, "a fleet file", findings, of="")
    if item is None:
        return None
    if item.version not in (None, VERSION):
        found = f"found version {item.version}, expected {VERSION}"
        findings.add(item.where(FleetKeys.version), found)
    transport = item.transport
    network = NetworkKeys.fill(item.network, "'network'", findings, Network(), "of network")
    listed = read.mapping(item.robots, "'robots'", findings)
    names = [robot.name for robot in scenario.robots]
    stations = {
        name: _station(name, item.defaults, listed.get(name) if listed else None, findings)
        for name in names
    }
    for key, _ in listed.entries if listed else ():
        if key.text not in names:
            its = f"its robots are {', '.join(names)}"
            findings.unknown(key, "the scenario has no robot", key.text, names, its)
    simulation = _simulation(item.simulation, findings)
    kind = transport or TransportKind.ROS2
    if kind is TransportKind.ROS2:
        _check_apart(stations, item.robots or root, findings)
    inputs = _inputs(item.inputs, kind, scenario, findings)
    failures = item.failures or Failures()
    return FleetFile(kind, network, simulation, stations, inputs, failures)


def _check_apart(stations: Mapping[str, Station], node: Node, findings: Findings) -> None:
    """Report robots with the same namespace: they would receive each other's messages and goals."""
    first: dict[str, str] = {}
    for name, station in stations.items():
        if (other := first.setdefault(station.namespace, name)) != name:
            found = f"{other} and {name} have the same namespace, '{station.namespace or '/'}'"
            findings.add(node, found, "each robot needs one of its own")


def _inputs(
    node: Node | None, transport: TransportKind, scenario: Scenario, findings: Findings
) -> dict[str, str]:
    item = read.mapping(node, "'inputs'", findings)
    if item is None:
        return {}
    if transport is not TransportKind.ROS2:
        hint = "leave out 'inputs'; an operator sets them: 'input NAME on'"
        findings.add(item, f"the transport {transport} has no topics", hint)
    names, found = [each.name for each in scenario.inputs], {}
    for key, value in item.entries:
        topic = NAMED.read(value, f"the topic of '{key.text}'", findings)
        if key.text not in names:
            listed = f"its inputs are {', '.join(names)}" if names else "it has none"
            findings.unknown(key, "the scenario has no input", key.text, names, listed)
        elif topic is not None:
            found[key.text] = topic
    return found


def _simulation(node: Node | None, findings: Reading) -> SimulationUse:
    item = SimulationKeys.read(node, "'simulation'", findings, "of simulation")
    if item is None:
        return SimulationUse()
    pace = item.pace
    listed = read.sequence(item.obstacles, "'obstacles' of simulation", findings)
    found = []
    for entry in listed or ():
        obstacle = HiddenKeys.read(entry, "an obstacle of simulation", findings)
        if obstacle is None:
            continue
        kind = _kind(obstacle, HiddenKeys.type, findings)
        truth, region = obstacle.traversable, obstacle.region
        if kind is not None and region is not None:
            found.append(Obstacle(findings.catalogue.obstacles[kind], region, truth))
    return SimulationUse(pace or 1.0, None if listed is None else tuple(found))


def _kind(item: Table, key: Key[str], findings: Reading) -> str | None:
    """Return an obstacle type of the scenario; report an unknown one."""
    kind: str | None = item.given(key).get(key.name)
    types = findings.catalogue.obstacles
    if kind is None or kind in types:
        return kind
    its = f"the scenario's types are {', '.join(sorted(types))}"
    findings.unknown(item.where(key), "the scenario has no type of obstacle", kind, types, its)
    return None


def _station(name: str, defaults: Node | None, own: Node | None, findings: Reading) -> Station:
    """Return a robot's station: its own keys, else those of the defaults."""
    entries: list[tuple[Scalar, Node]] = []
    for node, what in ((own, f"robot '{name}'"), (defaults, "'defaults'")):
        if (found := StationKeys.read(node, what, findings)) is not None:
            entries += found.node.entries
    label, base = f"of robot '{name}'", Station(f"/{name}")
    side = side_of(findings.world)
    base = replace(base, tolerance=on_regions(base.tolerance, side))
    item = StationKeys(MappingNode(Place(), tuple(entries)), label, findings)
    act = _by_name(item.act, f"'act' {label}", label, NAMED, findings)
    _check_inside(item, StationKeys.tolerance, side, findings)
    numbers = (StationKeys.tolerance, StationKeys.speed, StationKeys.timeout, StationKeys.retries)
    return replace(
        base,
        **item.given(*numbers, StationKeys.report),
        namespace=_absolute(item.namespace or base.namespace),
        scan=_scan(item.scan, label, side, findings),
        follow=_follow(item.follow, label, side, findings),
        act=act,
    )


def _by_name(
    node: Node | None, what: str, of: str, values: Shape[T], findings: Findings
) -> dict[str, T]:
    """Return the values of a mapping from names. ``of``: follows a name in messages."""
    item = read.mapping(node, what, findings)
    found = ((key.text, value) for key, value in (item.entries if item else ()))
    named = ((name, values.read(value, f"'{name}' {of}", findings)) for name, value in found)
    return {name: value for name, value in named if value is not None}


def _absolute(namespace: str) -> str:
    """Return a namespace as ROS 2 uses it on the wire: absolute, or empty for the root."""
    return f"/{stripped}" if (stripped := namespace.strip("/")) else ""


def _check_inside(item: Table, key: Key[float], side: float, findings: Findings) -> None:
    """Report a distance from the centre of a region that reaches its border."""
    metres = item.given(key).get(key.name)
    if metres is not None and metres >= side / 2:
        found = f"'{key.name}' {item.of}: {metres:g} m reach into the next region"
        findings.add(item.where(key), found, f"less than {side / 2:g} m: half a region's side")


def _scan(node: Node | None, label: str, side: float, findings: Reading) -> ScanUse | None:
    item = ScanKeys.read(node, f"'scan' {label}", findings, f"of scan {label}")
    if item is None or (kind := _kind(item, ScanKeys.obstacle, findings)) is None:
        return None
    _check_inside(item, ScanKeys.beyond, side, findings)
    use = ScanUse("scan", kind)
    return item.over(replace(use, beyond=side * use.beyond))


def _follow(node: Node | None, label: str, side: float, findings: Findings) -> FollowUse | None:
    item = FollowKeys.read(node, f"'follow' {label}", findings, f"of follow {label}")
    if item is None:
        return None
    _check_inside(item, FollowKeys.tolerance, side, findings)
    use = FollowUse()
    return item.over(replace(use, tolerance=on_regions(use.tolerance, side)))


def schema_text() -> str:
    """Return the JSON Schema (draft 2020-12) of fleet files."""
    from safenav.scenario.yaml import json_schema

    return json_schema.schema_text(FleetKeys, "safenav fleet file")
