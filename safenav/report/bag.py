"""A run as ROS 2 messages with topics and times.

docs/run.md lists the topics. Regions are squares in the frame `map` (x east, y north, origin at
the south-western corner)."""

import re
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from heapq import merge
from itertools import count
from math import cos, radians, sin
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import astuple

from safenav.errors import missing_package
from safenav.fleet.ros2.interfaces import INTERFACES
from safenav.pace.robot import AIR
from safenav.report.picture.floor import INK
from safenav.report.picture.svg import STATUS_MARKS
from safenav.run.run import CLOSED, Run
from safenav.run.tracks import RobotTrack
from safenav.run.values import Event, Hidden, ObstacleStatus, StoryKind
from safenav.world.map import Frame, Region

Message = Mapping[str, Any]
_ARROW, _CUBE, _CYLINDER, _TEXT = 0, 1, 3, 9
_ADD, _DELETE = 0, 2
_FLIES = 0.8
"""Height of the bodies of the layer ``air``, in regions."""
_HEIGHTS = {ObstacleStatus.FOUND: 0.15, ObstacleStatus.BLOCKED: 0.8}
"""Heights of obstacles by status, in regions, for people who cannot tell the colours apart."""
_INFO, _WARN, _ERROR = 20, 30, 40
_LEVELS = {
    StoryKind.VIOLATION: _WARN,
    StoryKind.BLOCKED: _WARN,
    StoryKind.DEADLINE: _WARN,
    StoryKind.ASSUMPTION: _ERROR,
}


class Stamped(Struct, frozen=True):
    """One message of a bag. ``kind``: its ROS type; ``seconds``: its time since the start."""

    seconds: float
    topic: str
    kind: str
    message: Message


Poses = Mapping[str, Sequence[tuple[float, float, float, float]]]
"""Poses by robot: seconds, x, y (metres in the frame ``map``) and yaw, at common times."""


def messages(run: Run, frame: Frame, motion: Poses | None = None) -> Iterator[Stamped]:
    """Return all messages of a run, in the order of their times; a tick of a run without a clock
    lasts a second. ``motion``: poses of a motion, instead of the centres of regions."""
    found = _Messages(run, frame)
    if motion is None:
        return found.all()
    still = (one for one in found.all() if one.topic != "/tf")
    return merge(found.moved(motion), still, key=lambda one: one.seconds)


def names_of(run: Run) -> dict[str, str]:
    """Return each robot's name in ROS, also of its frame: letters, digits and underscores, unique,
    and never ``map``."""
    found: dict[str, str] = {}
    for track in run.robots:
        plain = re.sub(r"\W", "_", track.name, flags=re.ASCII).strip("_") or "robot"
        plain = f"r_{plain}" if plain[0].isdigit() else plain
        names = (plain if number == 1 else f"{plain}_{number}" for number in count(1))
        found[track.name] = next(name for name in names if name not in ("map", *found.values()))
    return found


class _Messages:
    def __init__(self, run: Run, frame: Frame) -> None:
        self.run, self.frame, self.side = run, frame, frame.resolution
        self.names = names_of(run)

    def all(self) -> Iterator[Stamped]:
        """Yield the messages of all that never changes, then the changes of each tick."""
        run = self.run
        yield Stamped(run.time(0), "/map", "nav_msgs/msg/OccupancyGrid", self._map())
        yield self._markers(0, "/robots", self._bodies())
        for tick in range(run.last + 1):
            poses = {track.name: self._pose(track, tick) for track in run.robots}
            yield self._frames(run.time(tick), poses)
            obstacles = [*self._obstacles(tick)]
            if obstacles:
                yield self._markers(tick, "/obstacles", obstacles)
            yield from (self._log(tick, event) for event in run.happened(tick))

    def moved(self, motion: Poses) -> Iterator[Stamped]:
        """Yield the frames of the robots at the poses of a motion."""
        for poses in zip(*motion.values(), strict=True):
            placed = (_pose(x, y, yaw) for _, x, y, yaw in poses)
            yield self._frames(poses[0][0], dict(zip(motion, placed, strict=True)))

    def _frames(self, seconds: float, poses: Mapping[str, Message]) -> Stamped:
        """Return the frames of robots at poses."""
        transforms = [
            {
                "header": {"stamp": stamp(seconds), "frame_id": "map"},
                "child_frame_id": self.names[name],
                "transform": {"translation": pose["position"], "rotation": pose["orientation"]},
            }
            for name, pose in poses.items()
        ]
        return Stamped(seconds, "/tf", "tf2_msgs/msg/TFMessage", {"transforms": transforms})

    def _log(self, tick: int, event: Event) -> Stamped:
        failed = event.kind is StoryKind.OUTCOME and self.run.failed
        seconds = self.run.time(tick)
        log = {
            "stamp": stamp(seconds),
            "level": _ERROR if failed else _LEVELS.get(event.kind, _INFO),
            "name": self.names.get(event.robot or "", "safenav"),
            "msg": event.text,
            "function": event.kind.value,
            "line": tick,
        }
        return Stamped(seconds, "/rosout", "rcl_interfaces/msg/Log", log)

    def _map(self) -> Message:
        world = self.run.map
        rows = (range(row * world.cols, (row + 1) * world.cols) for row in range(world.rows))
        data = [100 if region in world.walls else 0 for row in reversed([*rows]) for region in row]
        info = {
            "map_load_time": stamp(self.run.time(0)),
            "resolution": self.side,
            "width": world.cols,
            "height": world.rows,
            "origin": _pose(*self.frame.origin, self.frame.yaw),
        }
        return {"header": self._header(0), "info": info, "data": data}

    def _header(self, tick: int) -> Message:
        return {"stamp": stamp(self.run.time(tick)), "frame_id": "map"}

    def _pose(self, track: RobotTrack, tick: int) -> Message:
        """Return a robot's pose, interpolated during a step of several ticks."""
        row, col, heading = self.run.place(track, tick)
        x, y = self.frame.centre(row, col, self.run.map.rows)
        facing = 0.0 if heading is None else radians(90.0 - heading)
        return _pose(x, y, self.frame.yaw + facing)

    def _obstacles(self, tick: int) -> Iterator[Message]:
        """Yield the box of each obstacle whose status has changed; an obstacle that is no longer
        closed loses its box."""
        for number, hidden in enumerate(self.run.hidden.values()):
            status = _shown(hidden, tick)
            if status is _shown(hidden, tick - 1):
                continue
            action = _ADD if status in CLOSED else _DELETE
            size = self._size(0.9, _HEIGHTS.get(status, 0.4))
            colour = STATUS_MARKS[status].colour if status in CLOSED else INK
            look = {"scale": size, "color": _colour(colour, 0.8), "pose": self._at(hidden.region)}
            text = hidden.label(self.run.map)
            yield self._marker(tick, "obstacles", number, _CUBE, action=action, text=text, **look)

    def _bodies(self) -> Iterator[Message]:
        """Yield a body, a nose and a name in the frame of each robot, so that they move with it."""
        side = self.side
        for number, track in enumerate(self.run.robots):
            colour = track.look.colour
            height = (_FLIES if track.layer == AIR else 0.15) * side
            nose = {"x": 0.5 * side, "y": 0.12 * side, "z": 0.12 * side}
            parts = [("bodies", _CYLINDER, self._size(0.55, 0.3), height, colour, "")]
            if any(heading is not None for heading in track.headings):
                parts.append(("headings", _ARROW, nose, height, INK, ""))
            above = height + 0.5 * side
            parts.append(("names", _TEXT, self._size(0.35, 0.35), above, colour, track.name))
            header = {"stamp": stamp(0.0), "frame_id": self.names[track.name]}
            for kind, shape, size, z, ink, text in parts:
                pose = _pose(0.0, 0.0, 0.0) | {"position": {"x": 0.0, "y": 0.0, "z": z}}
                look = {"scale": size, "color": _colour(ink, 1.0), "text": text}
                more = {"header": header, "frame_locked": True, "pose": pose}
                yield self._marker(0, kind, number, shape, **look, **more)

    def _marker(self, tick: int, kind: str, number: int, shape: int, **look: Any) -> Message:
        """Return a marker; the MCAP writer adds the defaults of other fields."""
        return {
            "header": self._header(tick),
            "ns": kind,
            "id": number,
            "type": shape,
            "action": _ADD,
            "pose": _pose(0.0, 0.0, 0.0),
            "scale": self._size(1.0, 1.0),
            "color": _colour("#000000", 1.0),
        } | look

    def _markers(self, tick: int, topic: str, markers: Iterable[Message]) -> Stamped:
        kind = "visualization_msgs/msg/MarkerArray"
        return Stamped(self.run.time(tick), topic, kind, {"markers": [*markers]})

    def _at(self, region: Region) -> Message:
        world = self.run.map
        return _pose(*self.frame.centre(*world.position(region), world.rows), self.frame.yaw)

    def _size(self, wide: float, high: float) -> Message:
        return {"x": wide * self.side, "y": wide * self.side, "z": high * self.side}


def _shown(hidden: Hidden, tick: int) -> ObstacleStatus:
    """Return the status of an obstacle that the team knows to be closed; ``ABSENT`` for others."""
    status = hidden.status.at(tick)
    return status if tick >= 0 and status in CLOSED else ObstacleStatus.ABSENT


def stamp(seconds: float) -> Message:
    nanoseconds = round(seconds * 1e9)
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def _pose(x: float, y: float, yaw: float) -> dict[str, Message]:
    turned = {"x": 0.0, "y": 0.0, "z": sin(yaw / 2), "w": cos(yaw / 2)}
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned}


def _colour(text: str, opacity: float) -> Message:
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return {"r": red, "g": green, "b": blue, "a": opacity}


def write_mcap(path: Path, messages: Iterable[Stamped]) -> None:
    """Write the messages. Raises UsageError if the extra is not installed."""
    try:
        from mcap.writer import Writer
    except ImportError:
        raise missing_package("an MCAP file", "mcap", "mcap") from None
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="safenav")
        schemas: dict[str, int] = {}
        channels: dict[str, int] = {}
        for number, (seconds, topic, kind, message) in enumerate(map(astuple, messages)):
            if kind not in schemas:
                schemas[kind] = writer.register_schema(kind, "ros2msg", definition(kind).encode())
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
            at, out = round(seconds * 1e9), bytearray()
            _write(out, kind.replace("/msg/", "/"), message)
            # The header of little-endian CDR comes first; from there on values are aligned.
            writer.add_message(channels[topic], at, b"\0\1\0\0" + out, at, number)
        finish: Callable[[], None] = writer.finish
        finish()


_LETTERS = {"bool": "?", "byte": "B", "char": "B", "float32": "f", "float64": "d"}
_LETTERS |= {"int8": "b", "int16": "h", "int32": "i", "int64": "q"}
_LETTERS |= {"uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q"}
_NUMBERS = {kind: struct.Struct(f"<{letter}") for kind, letter in _LETTERS.items()}


def _write(out: bytearray, kind: str, value: Any) -> None:
    """Append a value (``float64``, ``string[]``, ``geometry_msgs/Pose``) as CDR, aligned; absent
    values have their defaults."""
    base, array, length = kind.removesuffix("]").partition("[")
    if array:
        values = value or [None] * int(length or 0)
        if not length:
            _write(out, "uint32", len(values))
        for each in values:
            _write(out, base, each)
    elif base in _NUMBERS:
        number = _NUMBERS[base]
        out += bytes(-len(out) % number.size)
        out += number.pack(value or 0)
    elif base == "string":
        text = (value or "").encode() + b"\0"
        _write(out, "uint32", len(text))
        out += text
    else:
        for of, key in INTERFACES[base]:
            _write(out, of, value and value.get(key))


_SEPARATOR = "\n" + "=" * 80 + "\n"


def definition(kind: str) -> str:
    """Return the definition of a message (``nav_msgs/msg/Path``) and of all its parts."""
    wanted = [kind.replace("/msg/", "/")]
    for name in wanted:
        parts = (of.removesuffix("[]") for of, _ in INTERFACES[name])
        wanted += dict.fromkeys(part for part in parts if part in INTERFACES.keys() - wanted)
    first, *texts = ("\n".join(map(" ".join, INTERFACES[name])) for name in wanted)
    named = (f"MSG: {name}\n{text}" for name, text in zip(wanted[1:], texts, strict=True))
    return _SEPARATOR.join((first, *named))
