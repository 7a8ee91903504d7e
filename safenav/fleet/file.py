"""The fleet file: connection, sensors and actions of each robot of a scenario (docs/drive.md).

One file serves all scenarios with these robots.
"""

import re
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, ClassVar

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.scenario.language import ObstacleKeys, Type
from safenav.scenario.model import Failures, Obstacle, Robot, Scenario
from safenav.scenario.reading.events import obstacles_of
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Node, Scalar, below, clipped, entries_of
from safenav.scenario.yaml.findings import Findings, parsed, read_source
from safenav.scenario.yaml.keys import Item, Key, Part, key, version
from safenav.scenario.yaml.typed import read
from safenav.world.map import RegionMap


class TransportKind(StrEnum):
    """The middleware or simulator that drives robots."""

    ROS2 = "ros2"
    SIMULATION = "simulation"


NAME = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
"""Pattern of ROS names."""
NAMESPACE = re.compile(rf"/?|{NAME.pattern}/?")


def _in_ros(pattern: re.Pattern[str], about: str = "") -> Key:
    """Return a key for ROS names of this pattern. ``about``: its meaning."""

    def check(value: str, node: Node, what: str, findings: Findings) -> str | None:
        if pattern.fullmatch(value):
            return value
        hint = "use letters, digits and '_', for example /lab/digit"
        findings.add(node, f"{what}: '{clipped(value)}' is not a valid ROS name", hint)
        return None

    return Key(about, check=check, schema={"pattern": f"^(?:{pattern.pattern})$"})


RosName = Annotated[str, _in_ros(NAME)]


class ScanUse(Part, frozen=True):
    """A lidar that finds obstacles in the regions beside the robot."""

    example: ClassVar = "{obstacle: door}"
    obstacle: Type = key("The type of the obstacles that it reports.", "a type of obstacle")
    topic: RosName = "scan"


class TfUse(Part, frozen=True):
    """A pose from TF (from ``map`` to the robot's ``frame``) in place of odometry."""

    topic: Annotated[
        str, _in_ros(NAME, "The topic of transforms; TOPIC_static has the static ones.")
    ] = "tf"
    frame: Annotated[str, _in_ros(NAME, "The frame of the robot.")] = "base_link"


class FollowUse(Part, frozen=True):
    """References that the robot itself tracks, in place of goals."""

    example: ClassVar = "{topic: reference}"
    topic: Annotated[str, _in_ros(NAME, "The topic of its references.")] = "reference"


class Station(Part, frozen=True):
    """A robot of the fleet. ``namespace``: the prefix of its topics, services and actions; ``tf``:
    None if its odometry is in the frame of the map; ``follow``: None if it navigates to goals
    itself."""

    one: ClassVar = "robot '{name}'"
    example: ClassVar = "{speed: 0.5, act: {push: open_door}}"
    namespace: Annotated[
        str, _in_ros(NAMESPACE, "Prefix of its topics. Default: / and its name.")
    ] = ""
    tolerance: float = key(
        "Maximum distance in metres from the centre of a region on arrival, and from a reference; "
        "without this key at most 0.3 of a region's side.",
        above=0,
        default=0.3,
    )
    speed: float = key("Metres per second, for time limits.", above=0, default=0.5)
    timeout: float = key(
        "Time limit of a goal: this multiple of the expected time, plus 5 s.", above=0, default=3.0
    )
    scan: ScanUse | None = None
    report: Annotated[
        str | None, _in_ros(NAME, "A text topic: 'door@47' is present, '-door@47' is gone.")
    ] = None
    tf: TfUse | None = None
    follow: FollowUse | None = None
    act: dict[str, RosName] = key(
        "The service that performs each action.", default={}, example="{push: open_door}"
    )

    @property
    def pose_topic(self) -> str:
        """The full name of the topic with the robot's pose."""
        return self.path("odom" if self.tf is None else self.tf.topic)

    def path(self, name: str) -> str:
        """Return the full name of a topic or service: below the namespace unless it is absolute."""
        return name if name.startswith("/") else f"{self.namespace}/{name}"


class Network(Part, frozen=True):
    """The robots' network. Default: only this machine."""

    domain: int = key("ROS_DOMAIN_ID.", most=232, default=0)
    interface: str = key("The network interface; lo: loopback.", default="lo")
    peers: tuple[str, ...] = key(
        "Addresses of robots; []: multicast. Default: 127.0.0.1.", default=("127.0.0.1",)
    )


class SimulationUse(Part, frozen=True):
    """Settings of the transport 'simulation'."""

    pace: float = key("Upper limit of the speed-up over real time.", above=0, default=1.0)
    obstacles: tuple[ObstacleKeys, ...] | None = key(
        "The actual obstacles. Default: those of the scenario."
    )


class FleetFile(Struct, frozen=True):
    """The data of a fleet file. ``obstacles``: the true obstacles of a simulation. ``inputs``: the
    topics (std_msgs/Bool) of the environment's inputs, where they have one. ``failures``: the
    policies of the drive."""

    transport: TransportKind
    network: Network
    pace: float
    obstacles: Sequence[Obstacle]
    stations: Mapping[str, Station]
    inputs: Mapping[str, str] = field(default_factory=dict)
    failures: Failures = Failures()


class FleetKeys(Item, frozen=True):
    """Connection, sensors and actions of each robot of a scenario."""

    label: ClassVar = ""
    title: ClassVar = "safenav fleet file"
    spelled: ClassVar = {"version": "safenav-fleet"}
    version: int | None = version(1, "fleet file", "safenav-fleet")
    transport: TransportKind | None = key(
        "The middleware between safenav and the robots.", "'transport: ros2' or 'simulation'"
    )
    network: Network = key(default=Network())
    simulation: SimulationUse = key(default=SimulationUse())
    failures: Failures = key(default=Failures())
    inputs: dict[Scalar, RosName] | None = key(
        "ROS: the topic (std_msgs/Bool) of each input.", example="{alarm: /building/alarm}"
    )
    defaults: Station | None = key("Default values for all robots.")
    robots: dict[Scalar, Station] | None = key(
        "By name; robots not listed have the defaults.", example="{quad: {speed: 1.0}}"
    )


def load_fleet(path: Path, scenario: Scenario) -> FleetFile:
    """Read the fleet file for the robots of a scenario. Unlisted robots get the defaults. Raises
    InputError with all errors."""
    reading = Reading(str(path), world=scenario.map)
    reading.catalogue = scenario.catalogue
    text = read_source(path, reading)
    root = None if text is None else parsed(text, reading, "fleet file")
    item: FleetKeys | None = read(FleetKeys, root, "a fleet file", reading)
    fleet = None if item is None else _fleet(item, scenario, reading)
    reading.raise_if_any()
    assert fleet is not None
    return fleet


def _fleet(item: FleetKeys, scenario: Scenario, findings: Reading) -> FleetFile:
    own = {name.text: station for name, station in (item.robots or {}).items()}
    names = [robot.name for robot in scenario.robots]
    stations = {name: _station(item, name, own.get(name), findings.world) for name in names}
    for name, _ in entries_of(item.at("robots")):
        if name.text not in names:
            its = f"its robots are {', '.join(names)}"
            findings.unknown(name, "the scenario has no robot", name.text, names, its)
    kind = item.transport or TransportKind.ROS2
    if kind is TransportKind.ROS2:
        _check_apart(stations, item.at("robots") or item.node, findings)
    for robot in scenario.robots:
        if stations[robot.name].follow is not None and (why := _unfollowing(robot)) is not None:
            own_place = below(item.at("robots"), robot.name, "follow")
            findings.add(own_place or below(item.at("defaults"), "follow"), *why)
    inputs = _inputs(item, kind, scenario, findings)
    pace, true = item.simulation.pace, scenario.obstacles
    if (listed := item.simulation.obstacles) is not None:
        true = (*obstacles_of(listed, findings), *(each for each in true if each.ordered))
    return FleetFile(kind, item.network, pace, true, stations, inputs, item.failures)


def _unfollowing(robot: Robot) -> tuple[str, str] | None:
    """Return the reason why a robot cannot follow references, and a hint; None if it can."""
    figures = robot.model.figures
    if figures is not None and figures.kind != "walker":
        return None
    why = "has no motion" if figures is None else "walks"
    found = f"{robot.name} cannot follow references: the model '{robot.model.name}' {why}"
    return found, "only a flyer, a rover or a disc can; leave out its 'follow'"


def _check_apart(stations: Mapping[str, Station], node: Node, findings: Findings) -> None:
    """Report robots with the same namespace: they would receive each other's messages and goals."""
    first: dict[str, str] = {}
    for name, station in stations.items():
        if (other := first.setdefault(station.namespace, name)) != name:
            found = f"{other} and {name} have the same namespace, '{station.namespace or '/'}'"
            findings.add(node, found, "each robot needs one of its own")


def _inputs(
    item: FleetKeys, transport: TransportKind, scenario: Scenario, findings: Findings
) -> dict[str, str]:
    if item.inputs is None:
        return {}
    if transport is not TransportKind.ROS2:
        hint = "leave out 'inputs'; an operator sets them: 'input NAME on'"
        findings.add(item.at("inputs"), f"the transport {transport} has no topics", hint)
    names = [each.name for each in scenario.inputs]
    for name in item.inputs:
        if name.text not in names:
            listed = f"its inputs are {', '.join(names)}" if names else "it has none"
            findings.unknown(name, "the scenario has no input", name.text, names, listed)
    return {name.text: topic for name, topic in item.inputs.items()}


def _station(item: FleetKeys, name: str, own: Station | None, world: RegionMap | None) -> Station:
    """Return a robot's station: its own keys, completed by the defaults."""
    place, defaults = below(item.at("robots"), name), item.at("defaults")
    found = item.defaults or Station()
    mine = {
        key: getattr(own, key) for key in Station.__struct_fields__ if own and below(place, key)
    }
    if not below(place, "tolerance") and not below(defaults, "tolerance"):
        side = world.frame.resolution if world is not None and world.frame is not None else 1.0
        mine["tolerance"] = min(1.0, side) * Station().tolerance  # small enough for small regions
    found = replace(found, **mine)
    stripped = (found.namespace or name).strip("/")
    return replace(found, namespace=f"/{stripped}" if stripped else "")
