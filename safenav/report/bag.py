"""A run as ROS 2 messages with topics and times.

docs/replay.md lists the topics. Regions are squares in the frame `map` (x east, y north, origin at
the south-western corner)."""

import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from heapq import merge
from math import cos, radians, sin
from pathlib import Path
from typing import Any

from msgspec import Struct
from msgspec.structs import astuple

from safenav.errors import needing
from safenav.fleet.ros2.interfaces import INTERFACES
from safenav.run.run import CLOSED, Run
from safenav.run.tracks import RobotTrack
from safenav.run.values import Event, StoryKind
from safenav.world.map import Frame, Region

Message = Mapping[str, Any]
_INFO, _ERROR = 20, 40


class Stamped(Struct, frozen=True):
    """A message of a bag. ``kind``: its ROS type; ``seconds``: its time since the start."""

    seconds: float
    topic: str
    kind: str
    message: Message


Poses = Mapping[str, Sequence[tuple[float, float, float, float]]]
"""Poses by robot: seconds, x, y (metres in the frame ``map``) and yaw, at common times."""


def messages(run: Run, frame: Frame, motion: Poses | None = None) -> Iterator[Stamped]:
    """Return all messages of a run in the order of their times. A tick of a run without a clock
    lasts a second. ``motion``: poses of a motion, in place of the centres of regions."""
    found = _Messages(run, frame)
    if motion is None:
        return found.all()
    still = (one for one in found.all() if one.topic != "/tf")
    return merge(found.moved(motion), still, key=lambda one: one.seconds)


class _Messages:
    def __init__(self, run: Run, frame: Frame) -> None:
        self.run, self.frame, self.side = run, frame, frame.resolution
        names = [track.name for track in run.robots]
        self.frames = {name: "robot/map" if name == "map" else name for name in names}

    def all(self) -> Iterator[Stamped]:
        """Yield the messages of each tick: the map if it changed, the robots' frames, the log."""
        run, before = self.run, None
        for tick in range(run.last + 1):
            closed = {each.region for each in run.hidden.values() if each.status.at(tick) in CLOSED}
            if closed != before:
                grid = self._map(tick, run.map.walls | closed)
                yield Stamped(run.time(tick), "/map", "nav_msgs/msg/OccupancyGrid", grid)
            before = closed
            poses = {track.name: self._pose(track, tick) for track in run.robots}
            yield self._frames(run.time(tick), poses)
            yield from (self._log(tick, event) for event in run.happened(tick))

    def moved(self, motion: Poses) -> Iterator[Stamped]:
        """Yield a message with the robots' frames for each time of a motion."""
        for poses in zip(*motion.values(), strict=True):
            placed = (_pose(x, y, yaw) for _, x, y, yaw in poses)
            yield self._frames(poses[0][0], dict(zip(motion, placed, strict=True)))

    def _frames(self, seconds: float, poses: Mapping[str, Message]) -> Stamped:
        """Return the message with the robots' frames at these poses."""
        transforms = [
            {
                "header": {"stamp": stamp(seconds), "frame_id": "map"},
                "child_frame_id": self.frames[name],
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
            "level": _ERROR if failed else _INFO,
            "name": event.robot or "safenav",
            "msg": event.text,
            "function": event.kind.value,
            "line": tick,
        }
        return Stamped(seconds, "/rosout", "rcl_interfaces/msg/Log", log)

    def _map(self, tick: int, occupied: Collection[Region]) -> Message:
        """Return an occupancy grid with full ``occupied`` regions and free other ones."""
        world = self.run.map
        rows = (range(row * world.cols, (row + 1) * world.cols) for row in range(world.rows))
        data = [100 if region in occupied else 0 for row in reversed([*rows]) for region in row]
        info = {
            "map_load_time": stamp(self.run.time(tick)),
            "resolution": self.side,
            "width": world.cols,
            "height": world.rows,
            "origin": _pose(*self.frame.origin, self.frame.yaw),
        }
        header = {"stamp": stamp(self.run.time(tick)), "frame_id": "map"}
        return {"header": header, "info": info, "data": data}

    def _pose(self, track: RobotTrack, tick: int) -> Message:
        """Return a robot's pose at a tick, interpolated during a step of several ticks."""
        row, col, heading = self.run.place(track, tick)
        x, y = self.frame.centre(row, col, self.run.map.rows)
        facing = 0.0 if heading is None else radians(90.0 - heading)
        return _pose(x, y, self.frame.yaw + facing)


def stamp(seconds: float) -> Message:
    nanoseconds = round(seconds * 1e9)
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def _pose(x: float, y: float, yaw: float) -> dict[str, Message]:
    turned = {"x": 0.0, "y": 0.0, "z": sin(yaw / 2), "w": cos(yaw / 2)}
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned}


def write_mcap(path: Path, messages: Iterable[Stamped]) -> None:
    """Write the messages. Raises UsageError if the extra is not installed."""
    with needing("an MCAP file", "mcap"):
        from mcap.writer import Writer
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
            # Values are aligned after the header of little-endian CDR.
            writer.add_message(channels[topic], at, b"\0\1\0\0" + out, at, number)
        finish: Callable[[], None] = writer.finish
        finish()


_LETTERS = {"bool": "?", "byte": "B", "char": "B", "float32": "f", "float64": "d"}
_LETTERS |= {"int8": "b", "int16": "h", "int32": "i", "int64": "q"}
_LETTERS |= {"uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q"}
_NUMBERS = {kind: struct.Struct(f"<{letter}") for kind, letter in _LETTERS.items()}


def _write(out: bytearray, kind: str, value: Any) -> None:
    """Append a value (``float64``, ``string[]``, ``geometry_msgs/Pose``) as aligned CDR. Absent
    values have their defaults."""
    base, array, length = kind.removesuffix("]").partition("[")
    if array:
        values = value or [None] * int(length or 0)
        if not length:
            _write(out, "uint32", len(values))
        if base == "int8":  # the cells of a map
            out += struct.pack(f"{len(values)}b", *values)
            return
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
    """Return the definition of a message (``nav_msgs/msg/Odometry``) and of all its parts."""
    wanted = [kind.replace("/msg/", "/")]
    for name in wanted:
        parts = (of.removesuffix("[]") for of, _ in INTERFACES[name])
        wanted += dict.fromkeys(part for part in parts if part in INTERFACES.keys() - wanted)
    first, *texts = ("\n".join(map(" ".join, INTERFACES[name])) for name in wanted)
    named = (f"MSG: {name}\n{text}" for name, text in zip(wanted[1:], texts, strict=True))
    return _SEPARATOR.join((first, *named))
