"""A participant on the network of rmw_cyclonedds: topics and service clients, without ROS.

Names on the wire: a topic ``/odom`` is ``rt/odom``; a service ``/push`` is ``rq/pushRequest`` and
``rr/pushReply``. cyclonedds calls listeners from its own threads.
"""

import contextlib
import os
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partial
from html import escape
from itertools import count
from pathlib import Path
from threading import Lock
from typing import Any
from uuid import uuid4

from cyclonedds.core import DDSException, Listener, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.idl.annotations import final
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from safenav.errors import UsageError
from safenav.fleet.ros2.interfaces import INTERFACES

idl: Any = types


@cache
def message(kind: str) -> Any:
    """Return the class of a message by its name in ``INTERFACES``. Fields are zero, empty or a new
    message by default."""
    package, *folder, name = kind.split("/")
    fields: dict[str, Any] = {}
    if name.endswith(("_Request", "_Response")):
        fields = {"client": idl.uint64, "number": idl.int64}
    fields |= {key: _type(of) for of, key in INTERFACES[kind]}
    on_the_wire = f"{package}::{folder[0] if folder else 'msg'}::dds_::{name}_"
    made: Any = make_idl_struct(name, on_the_wire, fields, dataclassify=False)
    for key, of in fields.items():
        setattr(made, key, field(default_factory=partial(_default, of)))
    return dataclass(final(made))


def _type(of: str) -> Any:
    """Return the type of a field: ``float64``, ``float64[36]``, ``geometry_msgs/Pose[]``."""
    base, bracket, count = of.removesuffix("]").partition("[")
    plain = {"string": str, "bool": bool}
    inner = message(base) if "/" in base else plain.get(base) or getattr(idl, base)
    if not bracket:
        return inner
    return idl.array[inner, int(count)] if count else idl.sequence[inner]


def _default(of: Any) -> Any:
    detail = of.__metadata__[0] if hasattr(of, "__metadata__") else None
    if isinstance(detail, types.array):
        return [_default(detail.subtype) for _ in range(detail.length)]
    return [] if isinstance(detail, types.sequence) else getattr(of, "__origin__", of)()


SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Final states of a goal (action_msgs/msg/GoalStatus)."""

Time = message("builtin_interfaces/Time")
Duration = message("builtin_interfaces/Duration")
MessageHeader = message("std_msgs/Header")
UUID = message("unique_identifier_msgs/UUID")
Point = message("geometry_msgs/Point")
Quaternion = message("geometry_msgs/Quaternion")
PlacedPose = message("geometry_msgs/Pose")
PoseStamped = message("geometry_msgs/PoseStamped")
Vector3 = message("geometry_msgs/Vector3")
Twist = message("geometry_msgs/Twist")
Transform = message("geometry_msgs/Transform")
MultiDOFJointTrajectoryPoint = message("trajectory_msgs/MultiDOFJointTrajectoryPoint")
TRAJECTORY = "trajectory_msgs/MultiDOFJointTrajectory"
Trajectory = message(TRAJECTORY)
GoalInfo = message("action_msgs/GoalInfo")
"""With an empty id and stamp, a cancellation ends every goal of the server."""
NavigateGoal = message("nav2_msgs/action/NavigateToPose_Goal")

_RELIABLY = Policy.Reliability.Reliable(duration(seconds=1))
_NEW, _LAST = Policy.Durability.Volatile, Policy.History.KeepLast(10)
_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
SERVICE = Qos(_RELIABLY, _NEW, Policy.History.KeepAll, _CDR)
RELIABLE = Qos(_RELIABLY, _NEW, _LAST, _CDR)
SENSOR = Qos(Policy.Reliability.BestEffort, _NEW, Policy.History.KeepLast(5), _CDR)
"""A best-effort reader also receives from reliable writers. A reliable reader receives only from
these."""
LATCHED = Qos(_RELIABLY, Policy.Durability.TransientLocal, _LAST, _CDR)
"""Settings of topics whose last messages a new reader receives."""

CYCLONE = "0110"
VENDORS = {"0101": "RTI Connext", "0103": "OpenDDS", "010f": "Fast DDS", CYCLONE: "Cyclone DDS"}
"""Middleware by the first two bytes of a participant's guid (RTPS 2.2, 9.3.1.5)."""

_CONFIGURATION = (
    "<CycloneDDS><Domain><General>"
    '<Interfaces><NetworkInterface name="{interface}"/></Interfaces>'
    "<AllowMulticast>{multicast}</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>"
    "<Peers>{peers}</Peers></Discovery></Domain></CycloneDDS>"
)


def configuration(interface: str, peers: tuple[str, ...]) -> str:
    """Return the configuration of cyclonedds: one interface, and unicast discovery of the named
    peers (multicast only without peers)."""
    listed = "".join(f'<Peer address="{escape(peer)}"/>' for peer in peers)
    return _CONFIGURATION.format(
        interface=escape(interface), multicast="false" if peers else "spdp", peers=listed
    )


def _joined(domain: int, interface: str, peers: tuple[str, ...]) -> Any:
    """Join a domain. Raises UsageError if this machine lacks the interface or a peer has no
    address; cyclonedds would abort the process."""
    for peer in peers:
        host, colon, port = peer.partition(":")
        try:
            socket.getaddrinfo(host, None, socket.AF_INET)
            if colon and int(port) not in range(1, 65536):
                raise ValueError("ports are 1 to 65535")
        except (OSError, ValueError) as error:
            problem = f"'peers' of network: '{peer}' is not the address of a robot ({error})"
            raise UsageError(f"{problem}\n    use addresses such as 10.0.0.7") from error
    try:
        return Domain(domain, configuration(interface, peers))
    except DDSException as error:
        known = ", ".join(name for _, name in socket.if_nameindex())
        problem = f"ROS 2 cannot use the network interface '{interface}'"
        raise UsageError(f"{problem}\n    this machine has {known}") from error


def _confine(interface: str) -> None:
    """Restrict the sockets of this process that listen on all addresses to one interface.

    cyclonedds binds its receiving sockets to 0.0.0.0, whatever the configured interface (its issues
    1923 and 2090). Only Linux can bind an open socket to an interface; without privileges, only
    once."""
    if not sys.platform.startswith("linux"):
        return
    for entry in list(Path("/proc/self/fd").iterdir()):
        with contextlib.suppress(OSError):
            if not str(entry.readlink()).startswith("socket:"):
                continue
            with socket.socket(fileno=os.dup(int(entry.name))) as one:
                if one.type != socket.SOCK_DGRAM or one.getsockname()[0] not in ("0.0.0.0", "::"):
                    continue
                one.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, interface.encode())


class Taking(Listener):
    """A listener that passes each message to a function, one by one, in the order of arrival."""

    def __init__(self, take: Callable[[Any], None]) -> None:
        super().__init__()  # type: ignore[no-untyped-call]
        self._give = take
        self._lock = Lock()

    def on_data_available(self, reader: Any) -> None:
        if reader is None:  # not yet created, or closed; a later call takes all messages
            return
        with self._lock:
            for message in reader.take(N=256):
                if message.sample_info.valid_data:
                    self._give(message)


class Participant:
    """A participant of one domain. Call ``close`` to end all callbacks."""

    def __init__(self, domain: int, interface: str, peers: tuple[str, ...]) -> None:
        self._domain: Any = _joined(domain, interface, peers)
        self._participant: Any = DomainParticipant(domain)
        _confine(interface)
        self._topics: dict[str, Any] = {}
        self._readers: list[Any] = []
        self.client = uuid4().int & (2**63 - 1)

    def _topic(self, name: str, kind: str, qos: Qos) -> Any:
        if name not in self._topics:
            self._topics[name] = Topic(self._participant, name, message(kind), qos=qos)
        return self._topics[name]

    def listen(self, name: str, kind: str, take: Callable[[Any], None], qos: Qos) -> None:
        """Call ``take`` in another thread for every message of a topic (by its name on the
        wire)."""
        topic = self._topic(name, kind, qos)
        self._readers.append(DataReader(self._participant, topic, qos=qos, listener=Taking(take)))

    def writer(self, name: str, kind: str, qos: Qos) -> Any:
        """Return a writer for a topic (by its name on the wire)."""
        return DataWriter(self._participant, self._topic(name, kind, qos), qos=qos)

    def close(self) -> None:
        """End all callbacks and leave the network."""
        for reader in self._readers:
            reader.set_listener(None)
        self._readers.clear()
        self._topics.clear()
        self._participant = self._domain = None


class Client:
    """A client of one service. It ignores replies for other clients."""

    def __init__(self, node: Participant, service: str, kind: str) -> None:
        self._node = node
        self._request = message(f"{kind}_Request")
        self._numbers = count(1)
        self._calls: dict[int, Callable[[Any], None]] = {}
        node.listen(f"rr{service}Reply", f"{kind}_Response", self._answered, SERVICE)
        self._writer = node.writer(f"rq{service}Request", f"{kind}_Request", SERVICE)

    def call(self, take: Callable[[Any], None], **fields: Any) -> None:
        """Send a request unless a server of other middleware would receive it. The client calls
        ``take`` once with the reply, in another thread."""
        number = next(self._numbers)
        if not self.foreign:
            self._calls[number] = take
            self._writer.write(self._request(client=self._node.client, number=number, **fields))

    @property
    def foreign(self) -> str:
        """The middleware of a server other than Cyclone DDS; empty if there is none. Other
        middleware puts the identity of a request elsewhere: its servers would read our header as
        lengths and could exhaust their memory."""
        for handle in self._writer.get_matched_subscriptions():
            server = self._writer.get_matched_subscription_data(handle)
            vendor = CYCLONE if server is None else server.participant_key.bytes[:2].hex()
            if vendor != CYCLONE:
                return VENDORS.get(vendor, f"middleware {vendor}")
        return ""

    @property
    def connected(self) -> bool:
        """Whether a server that understands requests is connected."""
        return bool(self._writer.get_matched_subscriptions()) and not self.foreign

    def _answered(self, reply: Any) -> None:
        if reply.client == self._node.client:
            take = self._calls.pop(int(reply.number), None)
            if take is not None:
                take(reply)
