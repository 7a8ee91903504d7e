"""The fleet file: how each robot of a scenario is reached, what it senses, and how it acts.

docs/drive.md describes it. One file serves all scenarios with these robots.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.scenario.model import Obstacle, Scenario
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping as MappingNode
from safenav.scenario.yaml.document import Node
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.source import parsed, read_source

VERSION = 1
KEYS = (
    "safenav-fleet",
    "transport",
    "network",
    "simulation",
    "pyrobosim",
    "inputs",
    "defaults",
    "robots",
)
REQUIRED = {
    "safenav-fleet": "begin the file with 'safenav-fleet: 1', the version of its format",
    "transport": "'transport: ros2', 'ros1', 'simulation' or 'pyrobosim'",
}
NETWORK_KEYS = ("domain", "interface", "peers", "master", "address")
STATION_KEYS = (
    "namespace",
    "tolerance",
    "speed",
    "timeout",
    "retries",
    "scan",
    "report",
    "follow",
    "act",
)
SIMULATION_KEYS = ("pace", "obstacles")
REQUIRED_OF_PYROBOSIM = {
    "world": "'world: lab.yaml', a world file of pyrobosim",
    "hallway": "'hallway: door', the type of obstacle that a closed hallway is",
}
PYROBOSIM_KEYS = (*REQUIRED_OF_PYROBOSIM, "pace", "closing")
REQUIRED_OF_OBSTACLE = ("type", "region")
OBSTACLE_KEYS = (*REQUIRED_OF_OBSTACLE, "traversable")
EXAMPLE = "{type: door, region: 47}"
SCAN_KEYS = ("topic", "obstacle", "beyond")
FOLLOW_KEYS = ("topic", "tolerance")
MOST_RETRIES = 20


class TransportKind(StrEnum):
    """The middleware."""

    ROS1 = "ros1"
    ROS2 = "ros2"
    SIMULATION = "simulation"
    PYROBOSIM = "pyrobosim"


class ScanUse(Struct, frozen=True):
    """The meaning of a lidar's rays: one that ends less than ``beyond`` metres behind the middle of
    the region beside the robot has found an obstacle of type ``obstacle`` there."""

    topic: str
    obstacle: str
    beyond: float = 0.35


class FollowUse(Struct, frozen=True):
    """A robot that tracks references for itself: the ``topic`` on which it gets them, and the most
    metres (``tolerance``) by which it may be off."""

    topic: str = "reference"
    tolerance: float = 0.25


class Station(Struct, frozen=True):
    """One robot. ``tolerance``: metres from the middle of a region at which it has arrived;
    ``speed``: metres per second, for the time limit of a goal, which is ``timeout`` times the
    expected time; ``retries``: how often a failed goal is sent again; ``scan`` and ``report``: what
    it senses by; ``follow``: None for a robot that finds its own way to goals; ``act``: the service
    that performs each action."""

    namespace: str
    tolerance: float = 0.3
    speed: float = 0.5
    timeout: float = 3.0
    retries: int = 2
    scan: ScanUse | None = None
    report: str | None = None
    follow: FollowUse | None = None
    act: Mapping[str, str] = field(default_factory=dict)


class Network(Struct, frozen=True):
    """Where robots are: loopback alone, unless the file says otherwise. ROS 2: ``domain``,
    ``interface``, ``peers``; ROS 1: the URI of the ``master``, and this machine's ``address``."""

    domain: int = 0
    interface: str = "lo"
    peers: tuple[str, ...] = ("127.0.0.1",)
    master: str = "http://127.0.0.1:11311"
    address: str = "127.0.0.1"


class SimulationUse(Struct, frozen=True):
    """The simulation runs at most ``pace`` times as fast as a clock. ``obstacles`` that are really
    there; None for those of the scenario."""

    pace: float = 1.0
    obstacles: tuple[Obstacle, ...] | None = None


class PyrobosimUse(Struct, frozen=True):
    """A ``world`` file of pyrobosim. A closed hallway is an obstacle of type ``hallway`` in the
    region of its middle; ``closing``: seconds of the simulation after which a hallway closes, as
    soon as no robot is in it or sent there."""

    world: Path
    hallway: str
    pace: float = 1.0
    closing: Mapping[str, float] = field(default_factory=dict)


class FleetFile(Struct, frozen=True):
    """``inputs``: the topic (std_msgs/Bool) of each input of the environment that has one."""

    transport: TransportKind
    network: Network
    simulation: SimulationUse
    pyrobosim: PyrobosimUse | None
    stations: Mapping[str, Station]
    inputs: Mapping[str, str] = field(default_factory=dict)


def load_fleet(path: Path, scenario: Scenario) -> FleetFile:
    """Read the fleet file for the robots of a scenario. Robots that it does not list get the
    defaults. Raises InputError with everything that is wrong."""
    findings = Findings(str(path))
    text = read_source(path, findings)
    document = None if text is None else parsed(text, findings)
    fleet = None if document is None else _fleet(document.root, scenario, path.parent, findings)
    findings.raise_if_any()
    assert fleet is not None
    return fleet


def _fleet(root: Node, scenario: Scenario, folder: Path, findings: Findings) -> FleetFile | None:
    item = read.mapping(root, "a fleet file", findings, KEYS, REQUIRED)
    if item is None:
        return None
    version = read.integer(item.get("safenav-fleet"), "'safenav-fleet'", findings, least=1)
    if version not in (None, VERSION):
        node = item.get("safenav-fleet")
        assert node is not None
        findings.add(node, f"found version {version}, expected {VERSION}")
    transport = read.choice(item.get("transport"), "'transport'", TransportKind, findings)
    network = _network(item.get("network"), findings)
    listed = read.mapping(item.get("robots"), "'robots'", findings)
    names = [robot.name for robot in scenario.robots]
    stations = {
        name: _station(
            name, item.get("defaults"), listed.get(name) if listed else None, findings, scenario
        )
        for name in names
    }
    for key, _ in listed.entries if listed else ():
        if key.text not in names:
            hint = suggestion(key.text, names) or f"its robots are {', '.join(names)}"
            findings.add(key, f"the scenario has no robot '{key.text}'", hint)
    simulation = _simulation(item.get("simulation"), scenario, findings)
    pyrobosim = _pyrobosim(item.get("pyrobosim"), scenario, folder, findings)
    if transport is TransportKind.PYROBOSIM and item.get("pyrobosim") is None:
        needed = " and ".join(REQUIRED_OF_PYROBOSIM.values())
        findings.add(root, "the key 'pyrobosim' is missing", f"it has {needed}")
    kind = transport or TransportKind.ROS2
    inputs = _inputs(item.get("inputs"), kind, scenario, findings)
    return FleetFile(kind, network, simulation, pyrobosim, stations, inputs)


def _inputs(
    node: Node | None, transport: TransportKind, scenario: Scenario, findings: Findings
) -> dict[str, str]:
    item = read.mapping(node, "'inputs'", findings)
    if item is None:
        return {}
    if transport not in (TransportKind.ROS1, TransportKind.ROS2):
        hint = "leave out 'inputs'; an operator sets them: 'input NAME on'"
        findings.add(item, f"the transport {transport} has no topics", hint)
    names, found = [each.name for each in scenario.inputs], {}
    for key, value in item.entries:
        topic = read.text(value, f"the topic of '{key.text}'", findings)
        if key.text not in names:
            listed = f"its inputs are {', '.join(names)}" if names else "it has none"
            said = f"the scenario has no input '{key.text}'"
            findings.add(key, said, suggestion(key.text, names) or listed)
        elif topic is not None:
            found[key.text] = topic
    return found


def _network(node: Node | None, findings: Findings) -> Network:
    item = read.mapping(node, "'network'", findings, NETWORK_KEYS)
    if item is None:
        return Network()
    domain = read.integer(item.get("domain"), "'domain' of network", findings, least=0, most=232)
    interface = read.text(item.get("interface"), "'interface' of network", findings)
    peers = read.sequence(item.get("peers"), "'peers' of network", findings)
    named = [read.text(peer, "a peer of network", findings) for peer in peers or ()]
    base = Network()
    return Network(
        base.domain if domain is None else domain,
        interface or base.interface,
        base.peers if peers is None else tuple(peer for peer in named if peer),
        read.text(item.get("master"), "'master' of network", findings) or base.master,
        read.text(item.get("address"), "'address' of network", findings) or base.address,
    )


def _simulation(node: Node | None, scenario: Scenario, findings: Findings) -> SimulationUse:
    item = read.mapping(node, "'simulation'", findings, SIMULATION_KEYS)
    if item is None:
        return SimulationUse()
    pace = read.positive(item.get("pace"), "'pace' of simulation", findings)
    listed = read.sequence(item.get("obstacles"), "'obstacles' of simulation", findings)
    world = scenario.map
    regions = RegionReader(world, world.names, findings, world.areas)
    found = []
    what, required = "an obstacle of simulation", dict.fromkeys(REQUIRED_OF_OBSTACLE, EXAMPLE)
    for entry in listed or ():
        obstacle = read.mapping(entry, what, findings, OBSTACLE_KEYS, required)
        if obstacle is None:
            continue
        kind = _kind(obstacle.get("type"), f"'type' of {what}", scenario, findings)
        truth = read.boolean(obstacle.get("traversable"), f"'traversable' of {what}", findings)
        place = obstacle.get("region")
        region = None if place is None else regions.region(place, f"'region' of {what}")
        if kind is not None and region is not None:
            found.append(Obstacle(scenario.catalogue.obstacles[kind], region, truth))
    return SimulationUse(pace or 1.0, None if listed is None else tuple(found))


def _pyrobosim(
    node: Node | None, scenario: Scenario, folder: Path, findings: Findings
) -> PyrobosimUse | None:
    what = "'pyrobosim'"
    item = read.mapping(node, what, findings, PYROBOSIM_KEYS, REQUIRED_OF_PYROBOSIM)
    if item is None:
        return None
    world = read.text(item.get("world"), "'world' of pyrobosim", findings)
    kind = _kind(item.get("hallway"), "'hallway' of pyrobosim", scenario, findings)
    pace = read.positive(item.get("pace"), "'pace' of pyrobosim", findings)
    listed = read.mapping(item.get("closing"), "'closing' of pyrobosim", findings)
    closing = {
        key.text: seconds
        for key, value in (listed.entries if listed else ())
        if (seconds := read.positive(value, f"'{key.text}' of closing", findings)) is not None
    }
    if world is None or kind is None:
        return None
    return PyrobosimUse(folder / world, kind, pace or 1.0, closing)


def _kind(node: Node | None, what: str, scenario: Scenario, findings: Findings) -> str | None:
    """A type of obstacle that the scenario knows."""
    kind = read.text(node, what, findings)
    types = list(scenario.catalogue.obstacles)
    if kind is None or kind in types:
        return kind
    assert node is not None
    hint = suggestion(kind, types) or f"the scenario's types are {', '.join(sorted(types))}"
    findings.add(node, f"the scenario has no type of obstacle '{kind}'", hint)
    return None


def _station(
    name: str, defaults: Node | None, own: Node | None, findings: Findings, scenario: Scenario
) -> Station:
    """A robot's station: its own keys, else those of the defaults."""
    items: list[MappingNode] = []
    for node, what in ((own, f"robot '{name}'"), (defaults, "'defaults'")):
        item = read.mapping(node, what, findings, STATION_KEYS)
        if item is not None:
            items.append(item)

    def at(key: str) -> Node | None:
        return next((found for item in items if (found := item.get(key)) is not None), None)

    base = Station(f"/{name}")
    label = f"of robot '{name}'"
    tolerance = read.positive(at("tolerance"), f"'tolerance' {label}", findings)
    speed = read.positive(at("speed"), f"'speed' {label}", findings)
    timeout = read.positive(at("timeout"), f"'timeout' {label}", findings)
    retries = read.integer(
        at("retries"), f"'retries' {label}", findings, least=0, most=MOST_RETRIES
    )
    namespace = read.text(at("namespace"), f"'namespace' {label}", findings)
    acts = read.mapping(at("act"), f"'act' {label}", findings)
    act = {
        key.text: service
        for key, value in (acts.entries if acts else ())
        if (service := read.text(value, f"'{key.text}' {label}", findings)) is not None
    }
    return Station(
        (namespace or base.namespace).rstrip("/"),
        tolerance or base.tolerance,
        speed or base.speed,
        timeout or base.timeout,
        base.retries if retries is None else retries,
        _scan(at("scan"), label, findings, scenario),
        read.text(at("report"), f"'report' {label}", findings),
        _follow(at("follow"), label, findings),
        act,
    )


def _scan(node: Node | None, label: str, findings: Findings, scenario: Scenario) -> ScanUse | None:
    item = read.mapping(
        node, f"'scan' {label}", findings, SCAN_KEYS, {"obstacle": "a type of obstacle"}
    )
    if item is None:
        return None
    kind = _kind(item.get("obstacle"), f"'obstacle' of scan {label}", scenario, findings)
    topic = read.text(item.get("topic"), f"'topic' of scan {label}", findings)
    beyond = read.positive(item.get("beyond"), f"'beyond' of scan {label}", findings)
    if kind is None:
        return None
    use = ScanUse(topic or "scan", kind)
    return use if beyond is None else replace(use, beyond=beyond)


def _follow(node: Node | None, label: str, findings: Findings) -> FollowUse | None:
    item = read.mapping(node, f"'follow' {label}", findings, FOLLOW_KEYS)
    if item is None:
        return None
    topic = read.text(item.get("topic"), f"'topic' of follow {label}", findings)
    tolerance = read.positive(item.get("tolerance"), f"'tolerance' of follow {label}", findings)
    base = FollowUse()
    return FollowUse(topic or base.topic, tolerance or base.tolerance)


def schema_text() -> str:
    """The JSON Schema (draft 2020-12) of fleet files."""
    return Path(__file__).with_name("schema.json").read_text(encoding="utf-8")


def template_text(scenario: Scenario) -> str:
    """An example of a fleet file for the robots of a scenario, commented; it loads unchanged."""
    lines = [
        "# How safenav reaches each robot, what it senses and how it acts (docs/drive.md).",
        "safenav-fleet: 1",
        "transport: ros2          # ros2, ros1, simulation or pyrobosim",
        "network:",
        "  domain: 0              # ROS_DOMAIN_ID",
        "  interface: lo          # the network of your robots, for example wlan0",
        "  peers: [127.0.0.1]     # their addresses; [] for multicast",
        "defaults:",
        "  tolerance: 0.3         # metres from the middle of a region: arrived",
        "  timeout: 3             # times the expected time, then the goal is cancelled",
        "  retries: 2             # how often a failed goal is sent again",
        "  # follow: {topic: reference, tolerance: 0.25}  # references instead of goals",
        "robots:",
    ]
    if scenario.inputs:
        topics = ", ".join(f"{each.name}: /{each.name}" for each in scenario.inputs)
        lines.insert(-1, f"inputs: {{{topics}}}  # topics, std_msgs/Bool")
    seen = next((o.type.name for o in scenario.obstacles), None)
    for robot in scenario.robots:
        acts = ", ".join(f"{action}: {action}" for action in sorted(robot.capabilities))
        speed = 0.5 if robot.model.speed is None else robot.model.speed
        lines += [
            f"  {robot.name}:",
            f"    namespace: /{robot.name}",
            f"    speed: {speed:g}",
            "    report: obstacles    # std_msgs/String: 'door@47', or '-door@47' when it is gone",
        ]
        if seen is not None:
            lines.append(f"    scan: {{topic: scan, obstacle: {seen}}}")
        if acts:
            lines.append(f"    act: {{{acts}}}   # std_srvs/Trigger")
    return "\n".join(lines) + "\n"
