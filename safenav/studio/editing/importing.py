"""Maps from images that the user divides into regions."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import cos, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import InputError, UsageError
from safenav.scenario.reading.maps.bare_map import form_of
from safenav.scenario.reading.maps.image_map import DEFAULT_THRESHOLD, FREE, WALL
from safenav.scenario.reading.maps.ros_map import RosMap, read_ros_file
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.fields import NAME
from safenav.scenario.yaml.findings import ReadableFolder
from safenav.world.files.flaws import MapFileError
from safenav.world.files.image import Colour, Image, dark, meanings, read_image
from safenav.world.files.pixels import Blocked, Layout, shares, walls
from safenav.world.files.spots import losses, rooms_of, suggested, without_text
from safenav.world.map import MAX_REGIONS, Frame, RegionMap

_SHOWN = 900
"""Maximum pixels of the longer side of the picture for the page."""
_COLOURS = 12
_COMMON = 0.002
"""Least share of an image for a colour to be offered for the legend."""


class FloorPlan(Struct, frozen=True):
    """An uploaded image. ``ros``: the settings of its ROS map, if it has one."""

    name: str
    image: Image
    blocked: Blocked
    ros: RosMap | None = None

    def message(self) -> dict[str, Any]:
        """Return the picture and the initial values of the sliders. ``gray``: a byte per pixel."""
        height, width = self.blocked.shape
        step = -(-max(height, width) // _SHOWN)
        gray = self.image.brightness[::step, ::step].astype(np.uint32) * 255 // self.image.white
        cleared, labels = without_text(self.blocked)
        return {
            "width": width,
            "height": height,
            "picture": {
                "width": gray.shape[1],
                "height": gray.shape[0],
                "gray": base64.b64encode(gray.astype(np.uint8).tobytes()).decode(),
            },
            "side": max(1, round(height / suggested(cleared)[0])),
            "metres": None if self.ros is None else self.ros.resolution,
            "labels": len(labels),
            "colours": [] if self.ros is not None else _colours(self.image),
        }


class Cut(Struct, frozen=True):
    """A division of a plan: squares of ``side`` pixels from pixel (``x``, ``y``) on. ``share``: a
    region is a wall if more than this share of it is blocked; ``text``: labels are walls;
    ``legend``: the meaning of colours; if empty, dark pixels are walls."""

    side: int
    x: int
    y: int
    share: float
    text: bool
    legend: Mapping[Colour, str]

    @classmethod
    def read(cls, data: Mapping[str, Any]) -> Cut:
        """Return the division that a page requests. Raises UsageError."""
        try:
            side, x, y = (int(data[key]) for key in ("side", "x", "y"))
            share = float(data["share"])
            legend = {_colour(key): str(word) for key, word in dict(data["legend"]).items()}
        except (KeyError, TypeError, ValueError) as error:
            raise UsageError(f"expected a division of the map into regions ({error})") from error
        if side < 1 or x < 0 or y < 0 or not 0 <= share <= 1:
            raise UsageError(
                "expected a side of at least 1 pixel, an origin from 0 on, a share from 0 to 1"
            )
        bad = next((word for word in legend.values() if not NAME.fullmatch(word)), None)
        if bad is not None:
            raise UsageError(f"'{bad[:40]}' is not 'wall', 'free' or the name of an area")
        return cls(side, x, y, share, bool(data.get("text")), legend)


def opened_plan(name: str, files: Mapping[str, bytes]) -> FloorPlan:
    """Return the plan of an image ``name``, or of the ROS map ``name`` and its image. Raises
    InputError or UsageError."""
    with TemporaryDirectory() as made:
        folder = Path(made).resolve()
        for other, content in files.items():
            (folder / Path(other).name).write_bytes(content)
        path = folder / Path(name).name
        if form_of(path) == "ros":
            findings = Reading(str(path), ReadableFolder(folder))
            settings, image, blocked = read_ros_file(path.read_text("utf-8-sig"), findings)
            try:
                findings.raise_if_any()
            except InputError as error:  # omit the temporary folder
                found = [replace(d, file=Path(d.file).name) for d in error.diagnostics]
                raise InputError(found) from None
            assert settings is not None and image is not None and blocked is not None
            return FloorPlan(path.stem, image, blocked, settings)
        try:
            image = read_image(path.read_bytes())
        except MapFileError as error:
            raise UsageError(
                "\n".join(f"{name}: {f.found}\n    {f.hint}" for f in error.flaws)
            ) from error
        return FloorPlan(path.stem, image, dark(image, DEFAULT_THRESHOLD))


def divided(plan: FloorPlan, cut: Cut) -> RegionMap:
    """Return the regions of a divided plan, with areas of the legend and notes about losses.
    Raises UsageError."""
    height, width = plan.blocked.shape
    rows, cols = (
        max(1, round((height - cut.y) / cut.side)),
        max(1, round((width - cut.x) / cut.side)),
    )
    if rows * cols > MAX_REGIONS or min(height - cut.y, width - cut.x) < cut.side:
        raise UsageError(f"{rows} x {cols} regions: too many or none; choose another side")
    masks = meanings(plan.image, cut.legend)
    blocked = masks.pop(WALL, None) if cut.legend else plan.blocked
    if blocked is None:
        raise UsageError("a legend needs the colour of walls")
    kept = _cropped(
        blocked if cut.text else without_text(blocked)[0], cut, rows, cols, outside=True
    )
    layout = Layout(rows, cols, Fraction(cut.side), Fraction(cut.side))
    world = RegionMap(rows, cols, walls(kept, layout, cut.share), {}, _frame(plan, cut, rows))
    if not world.free:
        raise UsageError("every region is a wall: choose a larger share, or a smaller side")
    masks.pop(FREE, None)
    open_ = 1 - shares(kept, layout)
    areas = {}
    for name, mask in masks.items():
        inside = _cropped(mask, cut, rows, cols, outside=False) & ~kept
        most = (shares(inside, layout) >= 0.5 * open_).ravel()
        areas[name] = frozenset(region for region in world.free if most[region])
    notes = losses(kept, layout, world, cut.share)
    return replace(world, areas={n: area for n, area in areas.items() if area}, notes=notes)


def preview(plan: FloorPlan, cut: Cut) -> dict[str, Any]:
    """Return the overlay that the page shows over the picture. ``sealed``: the regions of each room
    that is not connected to the largest one. Raises UsageError."""
    world = divided(plan, cut)
    return {
        "rows": world.rows,
        "cols": world.cols,
        "grid": list(world.grid_rows()),
        "sealed": rooms_of(world)[1:],
        "areas": {name: sorted(area) for name, area in world.areas.items()},
        "notes": world.notes,
    }


def _cropped(mask: Blocked, cut: Cut, rows: int, cols: int, *, outside: bool) -> Blocked:
    """Return the pixels of the division; ``outside``: the value of pixels beyond the image."""
    found = np.full((rows * cut.side, cols * cut.side), outside)
    part = mask[cut.y : cut.y + found.shape[0], cut.x : cut.x + found.shape[1]]
    found[: part.shape[0], : part.shape[1]] = part
    return found


def _frame(plan: FloorPlan, cut: Cut, rows: int) -> Frame | None:
    """Return the frame of the division of a ROS map, in metres; None for an image."""
    if plan.ros is None:
        return None
    x, y, yaw = plan.ros.origin
    east = cut.x * plan.ros.resolution
    north = (plan.blocked.shape[0] - cut.y - rows * cut.side) * plan.ros.resolution
    corner = (x + east * cos(yaw) - north * sin(yaw), y + east * sin(yaw) + north * cos(yaw))
    side = round(cut.side * plan.ros.resolution, 9)
    return Frame((side, side), (round(corner[0], 9), round(corner[1], 9)), yaw)


def _colours(image: Image) -> list[str]:
    """Return the common colours of an image, the most frequent first."""
    if image.channels is None:
        return []
    step = max(1, max(image.channels.shape) // _SHOWN)
    pixels = image.channels[::step, ::step].reshape(-1, 3)
    found, counts = np.unique(pixels, axis=0, return_counts=True)
    most: Sequence[int] = np.argsort(-counts)[:_COLOURS].tolist()
    return [
        "#" + "".join(f"{channel:02x}" for channel in found[i].tolist())
        for i in most
        if counts[i] >= _COMMON * len(pixels)
    ]


def _colour(text: str) -> Colour:
    if len(text) != 7 or text[0] != "#":
        raise ValueError(f"'{text[:20]}' is not a colour")
    red, green, blue = bytes.fromhex(text[1:])
    return red, green, blue
