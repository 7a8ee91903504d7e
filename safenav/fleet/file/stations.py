"""The data of a fleet file: connection, sensors and actions of each robot."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated

from msgspec import Struct, field

from safenav.scenario.model import Obstacle
from safenav.scenario.settings import Failures
from safenav.scenario.yaml.typed import Key
from safenav.world.map import RegionMap


class TransportKind(StrEnum):
    """The middleware or simulator by which robots are driven."""

    ROS2 = "ros2"
    SIMULATION = "simulation"


class ScanUse(Struct, frozen=True):
    """The meaning of a lidar's rays: a ray that ends less than ``beyond`` metres behind the centre
    of an adjacent region has hit an obstacle of type ``obstacle`` there. The default is for regions
    of one metre; behind half a side a ray hits the wall of the next region."""

    topic: str
    obstacle: str
    beyond: float = 0.35


class TfUse(Struct, frozen=True):
    """A robot whose pose is the transform from ``map`` to its ``frame``, from the ``topic`` of
    transforms and that of static ones (``TOPIC_static``), instead of its odometry."""

    topic: str = "tf"
    frame: str = "base_link"


class FollowUse(Struct, frozen=True):
    """A robot that tracks references: the ``topic`` on which it receives them, and the maximum
    deviation in metres (``tolerance``)."""

    topic: str = "reference"
    tolerance: float = 0.25


class Station(Struct, frozen=True):
    """One robot. ``tolerance``: distance from the centre of a region, in metres, that counts as
    arrival; ``speed``: metres per second, for the time limit of a goal, which is ``timeout`` times
    the expected time; ``retries``: number of times that a failed goal is sent again; ``scan`` and
    ``report``: its sensors; ``tf``: None for a robot whose odometry is in the frame of the map;
    ``follow``: None for a robot that navigates to goals by itself;
    ``act``: the service that performs each action."""

    namespace: str
    tolerance: float = 0.3
    speed: float = 0.5
    timeout: float = 3.0
    retries: int = 2
    scan: ScanUse | None = None
    report: str | None = None
    tf: TfUse | None = None
    follow: FollowUse | None = None
    act: Mapping[str, str] = field(default_factory=dict)

    @property
    def pose_topic(self) -> str:
        """Return the full name of the topic from which its pose comes."""
        return self.path("odom" if self.tf is None else self.tf.topic)

    def path(self, name: str) -> str:
        """Return the full name of a topic, service or action: below the namespace unless
        absolute."""
        return name if name.startswith("/") else f"{self.namespace}/{name}"


def side_of(world: RegionMap | None) -> float:
    """Return the side of a region in metres; 1 for a map without metres."""
    return min(world.frame.resolution) if world is not None and world.frame is not None else 1.0


def on_regions(metres: float, side: float) -> float:
    """Return a default distance for regions with this side (metres): less on small regions, where a
    robot so far from the centre would be in the next one."""
    return min(1.0, side) * metres


class Network(Struct, frozen=True):
    """Where the robots are. Default: this machine alone."""

    domain: Annotated[int, Key("ROS_DOMAIN_ID.", most=232)] = 0
    interface: Annotated[str, Key("The network interface; lo: loopback.")] = "lo"
    peers: Annotated[
        tuple[str, ...], Key("Where to find robots; []: multicast. Default: 127.0.0.1.")
    ] = ("127.0.0.1",)


class SimulationUse(Struct, frozen=True):
    """``pace``: maximum speed-up over real time; ``obstacles``: the true ones, None for those of
    the scenario."""

    pace: float = 1.0
    obstacles: tuple[Obstacle, ...] | None = None


class FleetFile(Struct, frozen=True):
    """The data of a fleet file. ``inputs``: the topic (std_msgs/Bool) of each input of the
    environment that has one. ``failures``: the policies of the drive."""

    transport: TransportKind
    network: Network
    simulation: SimulationUse
    stations: Mapping[str, Station]
    inputs: Mapping[str, str] = field(default_factory=dict)
    failures: Failures = Failures()
