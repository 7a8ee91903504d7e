"""A run as ROS 2 messages with topics and times.

docs/run.md lists the topics. Regions are squares in the frame `map` (x east, y north, origin at
the south-western corner)."""

import re
import struct
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from heapq import merge
from math import cos, radians, sin
from pathlib import Path
from typing import Any

from msgspec import Struct

from safenav.errors import missing_package
from safenav.fleet.ros2.interfaces import INTERFACES
from safenav.pace.robot import AIR
from safenav.report.picture.floor import INK
from safenav.report.picture.svg import STATUS_MARKS
from safenav.run.run import CLOSED, Run
from safenav.run.values import Event, Hidden, ObstacleStatus, StoryKind
from safenav.scenario.objective import Objective, target_regions
from safenav.world.map import Frame, Region

Message = Mapping[str, Any]
_ARROW, _CUBE, _CYLINDER, _LINE, _CUBES, _TEXT = 0, 1, 3, 4, 6, 9
_FLIES = 0.8
"""Height of the bodies of the layer ``air``, in regions."""
_HEIGHTS = {ObstacleStatus.FOUND: 0.15, ObstacleStatus.BLOCKED: 0.8}
"""Heights of obstacles by status, in regions, for people who cannot tell the colours apart."""
_COLOURS = {status: mark.colour for status, mark in STATUS_MARKS.items()}
TRAIL = 8
"""Most corners in a path: with all so far, bags would grow with the square of the ticks."""
_ADD, _DELETE, _DELETE_ALL = 0, 2, 3
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
    lasts a second. ``motion``: poses of a motion, instead of the centres of regions.

    Raises ValueError for regions that are not square: an occupancy grid has one resolution."""
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
        name, number = plain, 2
        while name in ("map", *found.values()):
            name, number = f"{plain}_{number}", number + 1
        found[track.name] = name
    return found


class _Messages:
    def __init__(self, run: Run, frame: Frame) -> None:
        width, height = frame.resolution
        if abs(width - height) > 1e-6 * width:
            raise ValueError(f"regions of {width:g} x {height:g} m are not square")
        self.run, self.frame, self.side = run, frame, width
        self.names = names_of(run)

    def all(self) -> Iterator[Stamped]:
        """Yield the messages of what never changes, then of each tick what has changed."""
        run, changes = self.run, _Latest()
        yield Stamped(run.time(0), "/map", "nav_msgs/msg/OccupancyGrid", self._map())
        yield self._markers(0, "/places", self._places())
        yield self._markers(0, "/robots", self._bodies())
        passed = {track.name: deque[Message](maxlen=TRAIL) for track in run.robots}
        for tick in range(run.last + 1):
            seconds, poses = run.time(tick), self._poses(tick)
            yield self._frames(seconds, poses)
            for track in run.robots:
                if changes.new(track.name, track.regions[tick]):
                    path = self._path(tick, passed[track.name], poses[track.name])
                    topic = f"/{self.names[track.name]}/path"
                    yield Stamped(seconds, topic, "nav_msgs/msg/Path", path)
            known = ((hidden, hidden.status.at(tick)) for hidden in run.hidden.values())
            told = ((hidden, s if s in CLOSED else ObstacleStatus.ABSENT) for hidden, s in known)
            shown = [(h, s) for h, s in told if changes.new(h.name, s, ObstacleStatus.ABSENT)]
            if shown:
                yield self._markers(tick, "/obstacles", (self._obstacle(tick, *s) for s in shown))
            plan = run.plans.at(tick)
            objectives = [track.objectives.at(tick) for track in run.robots]
            if changes.new("plan", (plan, objectives)):
                yield self._markers(tick, "/plan", self._plan(tick, plan, objectives))
            yield from (self._log(seconds, tick, event) for event in run.happened(tick))

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

    def _log(self, seconds: float, tick: int, event: Event) -> Stamped:
        failed = event.kind is StoryKind.OUTCOME and self.run.failed
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

    def _poses(self, tick: int) -> dict[str, Message]:
        """Return each robot's pose, interpolated during a step of several ticks."""
        found = {}
        for track in self.run.robots:
            row, col, heading = self.run.place(track, tick)
            x, y = self.frame.centre(row, col, self.run.map.rows)
            facing = 0.0 if heading is None else radians(90.0 - heading)
            found[track.name] = _pose(x, y, self.frame.yaw + facing)
        return found

    def _path(self, tick: int, passed: deque[Message], pose: Message) -> Message:
        if len(passed) > 1 and _straight(passed[-2]["pose"], passed[-1]["pose"], pose):
            passed.pop()
        passed.append({"header": self._header(tick), "pose": pose})
        return {"header": self._header(tick), "poses": list(passed)}

    def _obstacle(self, tick: int, hidden: Hidden, status: ObstacleStatus) -> Message:
        number = [*self.run.hidden].index(hidden.name)
        action = _DELETE if status is ObstacleStatus.ABSENT else _ADD
        look = {"scale": self._size(0.9, _HEIGHTS.get(status, 0.4))}
        look |= {"color": _colour(_COLOURS.get(status, INK), 0.8)}
        marker = self._marker(tick, "obstacles", number, _CUBE, action) | look
        return marker | {"pose": self._at(hidden.region), "text": hidden.label(self.run.map)}

    def _places(self) -> Iterator[Message]:
        """Yield names of regions and areas."""
        world = self.run.map
        named = [(name, [region]) for name, region in world.names.items()]
        named += [(name, sorted(area)) for name, area in world.areas.items()]
        for number, (name, regions) in enumerate(named):
            places = self._points(regions)
            middle = {axis: sum(p[axis] for p in places) / len(places) for axis in "xyz"}
            look = {"scale": self._size(0.4, 0.4), "color": _colour(INK, 1.0), "text": name}
            pose = {**_pose(0.0, 0.0, 0.0), "position": middle}
            yield self._marker(0, "places", number, _TEXT) | look | {"pose": pose}

    def _bodies(self) -> Iterator[Message]:
        """Yield a body, a nose and a name in the frame of each robot, so that they move with it."""
        side = self.side
        for number, track in enumerate(self.run.robots):
            look = track.look
            height = (_FLIES if track.layer == AIR else 0.15) * side
            nose = {"x": 0.5 * side, "y": 0.12 * side, "z": 0.12 * side}
            parts = [("bodies", _CYLINDER, self._size(0.55, 0.3), height, look.colour, "")]
            if any(heading is not None for heading in track.headings):
                parts.append(("headings", _ARROW, nose, height, INK, ""))
            name = ("names", _TEXT, self._size(0.35, 0.35))
            parts.append((*name, height + 0.5 * side, look.colour, track.name))
            for kind, shape, size, z, colour, text in parts:
                more = {"scale": size, "color": _colour(colour, 1.0), "text": text}
                yield (
                    self._marker(0, kind, number, shape)
                    | more
                    | {
                        "header": {"stamp": stamp(0.0), "frame_id": self.names[track.name]},
                        "frame_locked": True,
                        "pose": {**_pose(0.0, 0.0, 0.0), "position": {"x": 0.0, "y": 0.0, "z": z}},
                    }
                )

    def _plan(
        self,
        tick: int,
        plan: Mapping[str, Sequence[Region]],
        objectives: Sequence[Objective | None],
    ) -> Iterator[Message]:
        """Yield each robot's targets, and its path while a joint plan is carried out."""
        yield self._marker(tick, "plan", 0, _LINE, _DELETE_ALL)
        for number, track in enumerate(self.run.robots):
            if regions := sorted(target_regions(objectives[number])):
                colour, size = _colour(track.look.colour, 0.25), self._size(0.8, 0.02)
                more = {"scale": size, "color": colour, "points": self._points(regions)}
                yield self._marker(tick, "targets", number, _CUBES) | more | {"text": track.name}
            if len(way := plan.get(track.name, ())) > 1:
                colour, size = _colour(track.look.colour, 0.8), self._size(0.1, 0.0)
                more = {"scale": size, "color": colour, "points": self._points(way)}
                yield self._marker(tick, "ways", number, _LINE) | more | {"text": track.name}

    def _marker(
        self, tick: int, kind: str, number: int, shape: int, action: int = _ADD
    ) -> dict[str, Any]:
        """Return a marker; the MCAP writer adds the defaults of other fields."""
        return {
            "header": self._header(tick),
            "ns": kind,
            "id": number,
            "type": shape,
            "action": action,
            "pose": _pose(0.0, 0.0, 0.0),
            "scale": self._size(1.0, 1.0),
            "color": _colour("#000000", 1.0),
        }

    def _markers(self, tick: int, topic: str, markers: Iterable[Message]) -> Stamped:
        kind = "visualization_msgs/msg/MarkerArray"
        return Stamped(self.run.time(tick), topic, kind, {"markers": [*markers]})

    def _points(self, regions: Iterable[Region]) -> list[Message]:
        return [self._at(region)["position"] for region in regions]

    def _at(self, region: Region) -> Message:
        world = self.run.map
        return _pose(*self.frame.centre(*world.position(region), world.rows), self.frame.yaw)

    def _size(self, wide: float, high: float) -> Message:
        return {"x": wide * self.side, "y": wide * self.side, "z": high * self.side}


class _Latest(dict[str, object]):
    """The latest value of each thing that has a message when it changes."""

    def new(self, key: str, value: object, first: object = None) -> bool:
        """Return whether a value has changed, and keep it."""
        before = self.get(key, first)
        self[key] = value
        return value != before


def _straight(first: Message, middle: Message, last: Message) -> bool:
    """Return whether a robot passed the middle pose without a turn."""
    a, b, c = (pose["position"] for pose in (first, middle, last))
    ahead, then = (b["x"] - a["x"], b["y"] - a["y"]), (c["x"] - b["x"], c["y"] - b["y"])
    turned: float = ahead[0] * then[1] - ahead[1] * then[0]
    return bool(abs(turned) < 1e-9 < ahead[0] * then[0] + ahead[1] * then[1])


def stamp(seconds: float) -> Message:
    nanoseconds = round(seconds * 1e9)
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def _pose(x: float, y: float, yaw: float) -> Message:
    turned = {"x": 0.0, "y": 0.0, "z": sin(yaw / 2), "w": cos(yaw / 2)}
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turned}


def _colour(text: str, opacity: float) -> Message:
    red, green, blue = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return {"r": red, "g": green, "b": blue, "a": opacity}


Encoder = Callable[[bytearray, Any], None]
"""Appends a value, aligned; without one (None), a default."""

_NUMBERS = {"bool": "?", "byte": "B", "char": "B", "float32": "f", "float64": "d"}
_NUMBERS |= {"int8": "b", "int16": "h", "int32": "i", "int64": "q"}
_NUMBERS |= {"uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q"}


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
        for number, message in enumerate(messages):
            kind, at = message.kind, round(message.seconds * 1e9)
            if kind not in schemas:
                schemas[kind] = writer.register_schema(kind, "ros2msg", definition(kind).encode())
            if message.topic not in channels:
                channels[message.topic] = writer.register_channel(
                    message.topic, "cdr", schemas[kind]
                )
            data = encoded(kind, message.message)
            writer.add_message(channels[message.topic], at, data, at, number)
        finish: Callable[[], None] = writer.finish
        finish()


def encoded(kind: str, message: Message) -> bytes:
    """Return a message (``nav_msgs/msg/Path``) as CDR; absent fields have their defaults."""
    out = bytearray()
    _encoder(kind.replace("/msg/", "/"))(out, message)
    return b"\0\1\0\0" + out  # the header of little-endian CDR, from which on values are aligned


@cache
def _encoder(kind: str) -> Encoder:
    """Return the encoder of a type of field: ``float64``, ``string[]``, ``geometry_msgs/Pose``."""
    base, sequence, count = kind.removesuffix("]").partition("[")
    if sequence:
        return _sequence(_encoder(base), int(count or 0))
    if base in _NUMBERS:
        return _number(struct.Struct(f"<{_NUMBERS[base]}"))
    if base == "string":
        return _string
    lines = [line.split() for line in INTERFACES[base]]
    if all(of == "float64" for of, _ in lines):
        return _numbers([key for _, key in lines])
    fields = [(key, _encoder(of)) for of, key in lines]

    def encode(out: bytearray, value: Any) -> None:
        value = value or {}
        for key, field in fields:
            field(out, value.get(key))

    return encode


def _number(form: struct.Struct) -> Encoder:
    size, pack = form.size, form.pack

    def encode(out: bytearray, value: Any) -> None:
        out += bytes(-len(out) % size)
        out += pack(value or 0)

    return encode


def _numbers(keys: Sequence[str]) -> Encoder:
    """Return the encoder of a type of 64-bit numbers only, of which bags are full."""
    pack = struct.Struct(f"<{len(keys)}d").pack

    def encode(out: bytearray, value: Any) -> None:
        out += bytes(-len(out) % 8)
        out += pack(*[value.get(key, 0.0) for key in keys] if value else [0.0] * len(keys))

    return encode


_length = _number(struct.Struct("<I"))


def _string(out: bytearray, value: Any) -> None:
    text = (value or "").encode() + b"\0"
    _length(out, len(text))
    out += text


def _sequence(item: Encoder, count: int) -> Encoder:
    """Return the encoder of an array of ``count`` items; 0: of any number."""

    def encode(out: bytearray, value: Any) -> None:
        values = value or [None] * count
        if not count:
            _length(out, len(values))
        for each in values:
            item(out, each)

    return encode


_SEPARATOR = "\n" + "=" * 80 + "\n"


def definition(kind: str) -> str:
    """Return the definition of a message (``nav_msgs/msg/Path``) and of all its parts."""
    wanted = [kind.replace("/msg/", "/")]
    for name in wanted:
        parts = (field.split()[0].removesuffix("[]") for field in INTERFACES[name])
        wanted += dict.fromkeys(part for part in parts if part in INTERFACES.keys() - wanted)
    first, *texts = ("\n".join(INTERFACES[name]) for name in wanted)
    named = (f"MSG: {name}\n{text}" for name, text in zip(wanted[1:], texts, strict=True))
    return _SEPARATOR.join((first, *named))
