"""A run as ROS 2 messages with topics and times.

docs/run.md lists the topics. Regions are squares in the frame `map` (x east, y north, origin at
the south-western corner)."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from heapq import merge
from math import cos, radians, sin
from typing import Any

from msgspec import Struct

from safenav.report.picture.floor import INK
from safenav.report.picture.glyphs import STATUS_MARKS
from safenav.report.picture.names import AREA
from safenav.run.run import Run
from safenav.run.values import ObstacleStatus, StoryKind
from safenav.scenario.motion import AIR
from safenav.scenario.objective import Objective, target_regions
from safenav.trace.looks import looks
from safenav.world.map import Frame, Heading, Region

Message = Mapping[str, Any]
_ARROW, _CUBE, _CYLINDER, _LINE, _LINES, _CUBES, _TEXT = 0, 1, 3, 4, 5, 6, 9
_MARKERS = "visualization_msgs/msg/MarkerArray"
_FLIES = 0.8
"""Height of the bodies of the layer ``air``, in regions."""
_HEIGHTS = {ObstacleStatus.FOUND: 0.15, ObstacleStatus.BLOCKED: 0.8}
"""Heights of obstacles by status, in regions, for people who cannot tell the colours apart."""
_COLOURS = {status: mark.colour for status, mark in STATUS_MARKS.items()}
_UNSEEN = {ObstacleStatus.ABSENT, ObstacleStatus.HIDDEN, ObstacleStatus.RESOLVED}
"""Statuses of obstacles that have no marker."""
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
        self.run = run
        self.frame = frame
        self.names = names_of(run)
        self.looks = looks([track.name for track in run.robots])

    def all(self) -> Iterator[Stamped]:
        yield Stamped(self.run.time(0), "/map", "nav_msgs/msg/OccupancyGrid", self._map())
        yield Stamped(self.run.time(0), "/places", _MARKERS, {"markers": [*self._places()]})
        yield Stamped(self.run.time(0), "/robots", _MARKERS, {"markers": [*self._bodies()]})
        planned: object = ({}, [None] * len(self.run.robots))
        passed = {track.name: deque[Message](maxlen=TRAIL) for track in self.run.robots}
        shown: dict[str, ObstacleStatus] = {}
        for tick in range(self.run.last + 1):
            seconds = self.run.time(tick)
            poses = self._poses(tick)
            yield self._frames(seconds, poses)
            for track in self.run.robots:
                if tick and track.regions[tick] == track.regions[tick - 1]:
                    continue
                so_far, pose = passed[track.name], poses[track.name]
                if len(so_far) > 1 and _straight(so_far[-2]["pose"], so_far[-1]["pose"], pose):
                    so_far.pop()
                so_far.append({"header": self._header(tick), "pose": pose})
                path = {"header": self._header(tick), "poses": list(so_far)}
                topic = f"/{self.names[track.name]}/path"
                yield Stamped(seconds, topic, "nav_msgs/msg/Path", path)
            if changed := [*self._obstacles(tick, shown)]:
                yield Stamped(seconds, "/obstacles", _MARKERS, {"markers": changed})
            objectives = [self.run.objectives[t.name].at(tick) for t in self.run.robots]
            plan = self.run.plans.at(tick)
            if (plan, objectives) != planned:
                planned = plan, objectives
                deleted = self._marker(tick, "plan", 0, _LINE, _DELETE_ALL)
                drawn = [deleted, *self._plan(tick, plan, objectives)]
                yield Stamped(seconds, "/plan", _MARKERS, {"markers": drawn})
            if tick == 0 or self.run.stack.at(tick) != self.run.stack.at(tick - 1):
                yield Stamped(seconds, "/requests", _MARKERS, {"markers": [*self._requests(tick)]})
            for event in self.run.happened(tick):
                log = {
                    "stamp": stamp(seconds),
                    "level": self._level(event.kind),
                    "name": self.names.get(event.robot or "", "safenav"),
                    "msg": event.told,
                    "function": event.kind.value,
                    "line": tick,
                }
                yield Stamped(seconds, "/rosout", "rcl_interfaces/msg/Log", log)

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

    def _level(self, kind: StoryKind) -> int:
        if kind is StoryKind.OUTCOME and self.run.failed:
            return _ERROR
        return _LEVELS.get(kind, _INFO)

    def _map(self) -> Message:
        world = self.run.map
        rows = (range(row * world.cols, (row + 1) * world.cols) for row in range(world.rows))
        data = [100 if region in world.walls else 0 for row in reversed([*rows]) for region in row]
        x, y = self.frame.origin
        info = {
            "map_load_time": stamp(self.run.time(0)),
            "resolution": self.frame.resolution[0],
            "width": world.cols,
            "height": world.rows,
            "origin": _pose(x, y, self.frame.yaw),
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

    def _obstacles(self, tick: int, shown: dict[str, ObstacleStatus]) -> Iterator[Message]:
        """Yield markers of obstacles whose status has changed; ``shown``: the sent statuses."""
        for number, hidden in enumerate(self.run.hidden.values()):
            status = self.run.statuses[hidden.name].at(tick)
            if status in _UNSEEN:
                status = ObstacleStatus.ABSENT
            if status is not shown.get(hidden.name, ObstacleStatus.ABSENT):
                shown[hidden.name] = status
                action = _DELETE if status is ObstacleStatus.ABSENT else _ADD
                yield self._marker(tick, "obstacles", number, _CUBE, action) | {
                    "pose": self._at(hidden.region),
                    "scale": self._size(0.9, _HEIGHTS.get(status, 0.4)),
                    "color": _colour(_COLOURS.get(status, INK), 0.8),
                    "text": hidden.label(self.run.map),
                }

    def _requests(self, tick: int) -> Iterator[Message]:
        """Yield the deletion of former lines, and a line for each helper of a stack entry."""
        regions = {name: hidden.region for name, hidden in self.run.hidden.items()}
        scene = {track.name: track.regions[tick] for track in self.run.robots}
        yield self._marker(tick, "requests", 0, _LINE, _DELETE_ALL)
        frames = [f for f in self.run.stack.at(tick) if f.obstacle in regions]
        helping = ((frame, helper) for frame in frames for helper in frame.helpers)
        for number, (frame, helper) in enumerate(helping):
            yield self._marker(tick, "requests", number, _LINE) | {
                "points": self._points((scene[helper], regions[frame.obstacle or ""])),
                "scale": self._size(0.08, 0.0),
                "color": _colour(STATUS_MARKS[ObstacleStatus.REQUESTED].colour, 1.0),
                "text": f"{frame.about(self.run.map.word)}: {frame.roles}",
            }

    def _places(self) -> Iterator[Message]:
        """Yield names of regions and areas, and the borders of areas."""
        world = self.run.map
        named = [(name, [region]) for name, region in world.names.items()]
        named += [(name, sorted(area)) for name, area in world.areas.items()]
        for number, (name, regions) in enumerate(named):
            places = self._points(regions)
            middle = {axis: sum(p[axis] for p in places) / len(places) for axis in "xyz"}
            yield self._marker(0, "places", number, _TEXT) | {
                "pose": {**_pose(0.0, 0.0, 0.0), "position": middle},
                "scale": self._size(0.4, 0.4),
                "color": _colour(INK, 1.0),
                "text": name,
            }
        for number, area in enumerate(world.areas.values()):
            yield self._marker(0, "areas", number, _LINES) | {
                "scale": self._size(0.06, 0.06),
                "color": _colour(AREA, 1.0),
                "points": [*self._border(area)],
            }

    def _border(self, area: frozenset[Region]) -> Iterator[Message]:
        """Yield both ends of each side of a region on the area's border."""
        world = self.run.map
        for region in sorted(area):
            row, col = world.position(region)
            for heading in Heading:
                if world.step(region, heading) in area:
                    continue
                down, right = heading.step
                for along in (-0.5, 0.5):
                    side = row + down / 2 + along * right, col + right / 2 + along * down
                    x, y = self.frame.centre(*side, world.rows)
                    yield {"x": x, "y": y, "z": 0.0}

    def _bodies(self) -> Iterator[Message]:
        """Yield a body, a nose and a name in the frame of each robot, so that they move with it."""
        side = self.frame.resolution[0]
        for number, (track, look) in enumerate(zip(self.run.robots, self.looks, strict=True)):
            height = (_FLIES if track.layer == AIR else 0.15) * side
            turns = any(heading is not None for heading in track.headings)
            parts = [("bodies", _CYLINDER, self._size(0.55, 0.3), height, look.colour, "")]
            if turns:
                nose = {"x": 0.5 * side, "y": 0.12 * side, "z": 0.12 * side}
                parts.append(("headings", _ARROW, nose, height, INK, ""))
            name = self._size(0.35, 0.35)
            parts.append(("names", _TEXT, name, height + 0.5 * side, look.colour, track.name))
            for kind, shape, size, z, colour, text in parts:
                yield self._marker(0, kind, number, shape) | {
                    "header": {"stamp": stamp(0.0), "frame_id": self.names[track.name]},
                    "frame_locked": True,
                    "pose": {**_pose(0.0, 0.0, 0.0), "position": {"x": 0.0, "y": 0.0, "z": z}},
                    "scale": size,
                    "color": _colour(colour, 1.0),
                    "text": text,
                }

    def _plan(
        self,
        tick: int,
        plan: Mapping[str, Sequence[Region]],
        objectives: Sequence[Objective | None],
    ) -> Iterator[Message]:
        """Yield each robot's targets, and its path while a joint plan is carried out."""
        for number, (track, look) in enumerate(zip(self.run.robots, self.looks, strict=True)):
            if regions := sorted(target_regions(objectives[number])):
                yield self._marker(tick, "targets", number, _CUBES) | {
                    "scale": self._size(0.8, 0.02),
                    "color": _colour(look.colour, 0.25),
                    "points": self._points(regions),
                    "text": track.name,
                }
            if len(plan.get(track.name, ())) > 1:
                yield self._marker(tick, "ways", number, _LINE) | {
                    "scale": self._size(0.1, 0.0),
                    "color": _colour(look.colour, 0.8),
                    "points": self._points(plan[track.name]),
                    "text": track.name,
                }

    def _marker(
        self, tick: int, kind: str, number: int, shape: int, action: int = _ADD
    ) -> dict[str, Any]:
        """Return a marker without content; the MCAP writer adds the defaults of other fields."""
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

    def _points(self, regions: Iterable[Region]) -> list[Message]:
        return [self._at(region)["position"] for region in regions]

    def _at(self, region: Region) -> Message:
        world = self.run.map
        x, y = self.frame.centre(*world.position(region), world.rows)
        return _pose(x, y, self.frame.yaw)

    def _size(self, wide: float, high: float) -> Message:
        side = self.frame.resolution[0]
        return {"x": wide * side, "y": wide * side, "z": high * side}


def _straight(first: Message, middle: Message, last: Message) -> bool:
    """Whether a robot passed the middle pose without a turn."""
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
