"""``ros: map.yaml`` in the map of a scenario: an occupancy map of ROS map_server.

An unknown pixel is a wall: a strategy must not rely on it. A pixel is free only if map_server reads
it as free: occupancy (darkness, or brightness if ``negate``) at most ``free_thresh`` and below
``occupied_thresh``. The modes trinary and scale agree on that (``map_io.cpp`` of Nav2).
"""

from __future__ import annotations

from fractions import Fraction
from math import ceil
from pathlib import Path
from typing import ClassVar

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from safenav.file_kind import ROS_MAP
from safenav.scenario.language import MapKeys
from safenav.scenario.reading.maps.grid import NO_SIZE, read_origin, too_large
from safenav.scenario.reading.maps.map_file import (
    misread,
    named_path,
    read_count,
    read_pixels,
    with_walls,
)
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.source import parsed, read_source
from safenav.scenario.yaml.typed import Item, Raw, key, read
from safenav.world.files.image import Image
from safenav.world.files.pixels import Blocked, Layout
from safenav.world.map import MAX_REGIONS, Frame, RegionMap


class RosMap(Struct, frozen=True):
    """The YAML file of a map. ``resolution``: metres per pixel; ``origin``: x, y (metres) and yaw
    (radians) of its lower left corner; thresholds: occupancy from 0 to 1."""

    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float


def occupied(image: Image, settings: RosMap) -> Blocked:
    """Return the pixels that are occupied or unknown; transparent ones are unknown."""
    values = np.arange(image.white + 1)
    occupancy = (values if settings.negate else image.white - values) / image.white
    free = (occupancy <= settings.free_thresh) & ~(occupancy >= settings.occupied_thresh)
    found = image.where(~free)
    return found if image.transparent is None else found | image.transparent


UNKNOWN = 205 / 255
"""Brightness with which map_saver writes an unknown pixel in trinary mode."""


def doubts(image: Image, settings: RosMap, path: Path) -> tuple[str, ...]:
    """Warn of unknown pixels that count as free: until 2025 map_saver of Nav2 wrote 0.25, with
    which map_server reads them so (pull request 5278 of ros-navigation/navigation2)."""
    gray = np.arange(image.white + 1) == round(UNKNOWN * image.white)
    count = int((image.where(gray) & ~occupied(image, settings)).sum())
    if settings.negate or not count:
        return ()
    return (
        f"{path}: pixels of gray 205 ({count}), which map_saver writes for unknown, count as free, "
        f"since 'free_thresh: {settings.free_thresh:g}' is above 0.196; if they are unknown, write "
        "'free_thresh: 0.196' there",
    )


def _mode(word: Scalar, node: Node, what: str, findings: Findings) -> Scalar:
    """Report a mode of map_server other than those in which white is free and black occupied."""
    if word.text == "raw":
        hint = "save it again with 'mode: trinary'"
        findings.add(node, "maps of the mode 'raw', whose pixels are occupancies", hint)
    elif word.text not in _MODES:
        found = f"{what}: unknown word '{clipped(word.text)}'"
        findings.add(node, found, suggestion(word.text, _MODES))
    return word


_MODES = ("trinary", "scale")


class RosFile(Item, frozen=True):
    """The YAML file of a map; further keys are ignored."""

    open: ClassVar = True
    label: ClassVar = ""
    image: Scalar | None = key("", "the path of the image, relative to this file")
    resolution: float | None = key("", "metres per pixel, for example 'resolution: 0.05'", above=0)
    origin: Raw | None = key("", "[x, y, yaw] of the lower left corner")
    occupied_thresh: float | None = key(
        "", "map_saver writes 'occupied_thresh: 0.65'", least=0, most=1
    )
    free_thresh: float | None = key("", "map_saver writes 'free_thresh: 0.196'", least=0, most=1)
    negate: bool | int | None = key("", "map_saver writes 'negate: 0'", most=1, expected="0 or 1")
    mode: Scalar | None = key(check=_mode)


def read_ros(node: Node, item: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map with its frame; None after an error was reported."""
    before = len(findings)
    count = read_count(item, findings)
    side = item.resolution if isinstance(item.resolution, float) else None
    share = item.share or 0.0
    sized = [word for word, _ in item.node.entries if word.text in ("rows", "cols", "resolution")]
    if item.at("resolution") is not None and len(sized) > 1:
        extra = next(word for word in sized if word.text != "resolution")
        hint = "the size of a region follows from either of them"
        findings.add(extra, f"map: both '{extra.text}' and 'resolution'", hint)
    path = named_path(node, "ros", findings)
    text = None if path is None else read_source(path, findings, node)
    if path is None or text is None:
        return None
    inside = findings.beside(str(path))
    inside.folder = path.parent
    settings, image, blocked = read_ros_file(text, inside)
    if settings is None or image is None or blocked is None:
        return None
    height, width = (pixels * settings.resolution for pixels in blocked.shape)
    if not sized:
        hint = (
            f"the map measures {width:g} x {height:g} m: give the size of a region, for example "
            "'resolution: 0.5' (metres), or give 'rows' and 'cols'"
        )
        findings.add(node, NO_SIZE, hint)
    if len(findings) > before or misread(item):
        return None
    if side is not None:
        rows, cols = ceil(height / side), ceil(width / side)
        if rows * cols > MAX_REGIONS:
            findings.add(item.at("resolution"), *too_large(rows, cols))
            return None
        layout = Layout.of_size(blocked, _decimal(side) / _decimal(settings.resolution))
        resolution = (side, side)
    else:
        assert count is not None
        layout = Layout.of_count(blocked, *count)
        resolution = (width / layout.cols, height / layout.rows)
    world = with_walls(blocked, layout, share, node, findings)
    if world is None:
        return None
    x, y, yaw = settings.origin
    notes = (*doubts(image, settings, path), *world.notes)
    return replace(world, frame=Frame(resolution, (x, y), yaw), notes=notes)


def _decimal(number: float) -> Fraction:
    """Return the exact decimal value of a number, so that 0.5 / 0.05 is exactly 10."""
    return Fraction(repr(number))


def read_ros_file(
    text: str, findings: Reading
) -> tuple[RosMap | None, Image | None, Blocked | None]:
    """Return the settings, their image, and its pixels that are not free; three times None after
    an error was reported."""
    before = len(findings)
    item: RosFile | None = read(RosFile, parsed(text, findings, ROS_MAP), "a ROS map", findings)
    if item is None:
        return None, None, None
    origin = item.origin and read_origin(item.origin.node, item.origin.what, findings)
    flawed = len(findings) > before
    image = read_pixels(item.image, findings) if item.image is not None else None
    needed = item.resolution, origin, item.occupied_thresh, item.free_thresh
    if flawed or image is None or None in needed:
        return None, None, None
    settings = RosMap(*needed[:2], item.negate == 1, *needed[2:])  # type: ignore[arg-type]
    return settings, image, occupied(image, settings)
