"""Map files that a scenario names (docs/maps.md): images (pixels darker than half are walls),
MovingAI maps, and occupancy maps of ROS map_server.

Messages point to the line of the file, if known, or else to the place where the scenario names it.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import ceil
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from msgspec.structs import replace

from safenav.files import ROS_MAP
from safenav.scenario.language import MapKeys
from safenav.scenario.reading.regions import Reading, too_large
from safenav.scenario.values import CORNER, LEAST_SIDE, MOST_SIDE, Corner
from safenav.scenario.yaml.document import Node, Scalar
from safenav.scenario.yaml.findings import Findings, parsed, read_bytes, read_source
from safenav.scenario.yaml.keys import Part, key
from safenav.scenario.yaml.typed import read
from safenav.strict_json import MOST_REGIONS
from safenav.world import images
from safenav.world.images import Blocked, Image, Layout
from safenav.world.map import Frame, RegionMap


def read_drawing(form: str, node: Scalar, item: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map of an ``image`` divided into ``rows`` and ``cols``, or of a ``movingai`` file
    (each character is a region unless it is divided); None after a reported error."""
    path = findings.folder / node.text
    blocked = None
    if form == "image":
        if (image := read_pixels(node, findings)) is not None:
            blocked = images.dark(image)
    elif (text := read_source(path, findings, node)) is not None:
        blocked = findings.attempt(lambda: images.read_movingai(text), path, node)
    if blocked is None or item.flawed:
        return None
    height, width = blocked.shape
    if form == "image" and item.rows is None:
        found = f"map: the image of {width} x {height} pixels needs a number of rows and columns"
        findings.add(node, found, "for example 'rows: 20' and 'cols: 30'")
        return None
    layout = Layout.of_count(blocked, item.rows or height, item.cols or width)
    return with_walls(blocked, layout, item.share or 0.0, node, findings)


def read_pixels(node: Scalar, findings: Reading) -> Image | None:
    """Return the image that the node names; None after a reported error."""
    path = findings.folder / node.text
    data = read_bytes(path, findings, node)
    return None if data is None else findings.attempt(lambda: images.read_image(data), path, node)


def with_walls(
    blocked: Blocked, layout: Layout, share: float, node: Node, findings: Findings
) -> RegionMap | None:
    """Return the map with this layout over the pixels; None after a reported error. ``share``: the
    minimum blocked share of a region that is a wall (0: any part)."""
    if layout.rows * layout.cols > MOST_REGIONS:
        found, hint = too_large(layout.rows, layout.cols)
        findings.add(node, found, f"{hint}: 'rows' and 'cols' divide the file into fewer")
        return None
    found_walls = images.walls(blocked, layout, share)
    if len(found_walls) == layout.rows * layout.cols:
        hint = "by default one blocked pixel makes a wall: try 'share: 0.5' or smaller regions"
        if bool(blocked.all()):
            hint = "nothing in the file is free: dark, unknown and occupied pixels are walls"
        findings.add(node, "map: every region is a wall", hint)
        return None
    world = RegionMap(layout.rows, layout.cols, found_walls)
    if share == 0 or layout.height == layout.width == 1:
        return world
    return replace(world, notes=tuple(lost_walls(blocked, layout, world, share)))


def lost_walls(blocked: Blocked, layout: Layout, world: RegionMap, share: float) -> Iterator[str]:
    """Yield a warning if a wall of the drawing crosses free regions."""
    if lost := images.crossed(blocked, layout, world):
        some = f"region {world.label(lost[0])} is"
        if len(lost) > 1:
            some = f"{len(lost)} regions from {world.label(lost[0])} to {world.label(lost[-1])} are"
        yield (
            f"a share of {share:g} removes a wall: {some} free although the image draws a wall "
            "across; use a smaller share or smaller regions"
        )


def occupied(image: Image, settings: RosMap) -> Blocked:
    """Return the pixels that are walls: occupied or unknown ones, since a strategy must not rely on
    the latter. Transparent pixels are unknown. A pixel is free only if map_server agrees: occupancy
    (darkness, or brightness if ``negate``) at most ``free_thresh`` and below ``occupied_thresh``.
    The modes trinary and scale agree on that (``map_io.cpp`` of Nav2)."""
    values = np.arange(image.white + 1)
    occupancy = (values if settings.negate else image.white - values) / image.white
    free = (occupancy <= settings.free_thresh) & ~(occupancy >= settings.occupied_thresh)
    found: Blocked = ~free[image.brightness]
    return found if image.transparent is None else found | image.transparent


UNKNOWN = 205 / 255
"""The brightness of unknown pixels of map_saver in trinary mode."""


def doubts(image: Image, settings: RosMap, path: Path) -> tuple[str, ...]:
    """Yield a warning about unknown pixels that count as free. Until 2025 Nav2's map_saver wrote a
    threshold of 0.25, by which map_server reads them as free (pull request 5278 of
    ros-navigation/navigation2)."""
    gray = np.arange(image.white + 1) == round(UNKNOWN * image.white)
    count = int((gray[image.brightness] & ~occupied(image, settings)).sum())
    if settings.negate or not count:
        return ()
    return (
        f"{path}: pixels of gray 205 ({count}), which map_saver writes for unknown, count as free, "
        f"since 'free_thresh: {settings.free_thresh:g}' is above 0.196; if they are unknown, write "
        "'free_thresh: 0.196' there",
    )


class RosMap(Part, frozen=True):
    """The YAML file of a map (further keys are ignored). ``resolution``: metres per pixel;
    ``origin``: x, y (metres) and yaw (radians) of its lower left corner; thresholds: occupancy from
    0 to 1."""

    open: ClassVar = True
    label: ClassVar = ""
    image: Scalar = key("", "the path of the image, relative to this file")
    resolution: float = key(
        "", "metres per pixel, for example 'resolution: 0.05'", least=LEAST_SIDE, most=MOST_SIDE
    )
    origin: Corner = key("", "[x, y, yaw] of the lower left corner", expected=CORNER)
    negate: bool | int = key("", "map_saver writes 'negate: 0'", most=1, expected="0 or 1")
    occupied_thresh: float = key("", "map_saver writes 'occupied_thresh: 0.65'", least=0, most=1)
    free_thresh: float = key("", "map_saver writes 'free_thresh: 0.196'", least=0, most=1)
    mode: Literal["trinary", "scale"] | None = key(why="save it again with 'mode: trinary'")

    def flaws(self) -> Iterator[tuple[str, str, str]]:
        """Yield an error if the lower threshold is above the other one."""
        if self.free_thresh > self.occupied_thresh:
            most = f"'occupied_thresh: {self.occupied_thresh:g}'"
            found = f"is {self.free_thresh:g}, more than {most}"
            yield "free_thresh", found, "map_saver writes 0.196, and 0.65 for the other"


def read_ros(node: Scalar, item: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map with its frame; None after a reported error."""
    before, path = len(findings), findings.folder / node.text
    text = read_source(path, findings, node)
    if text is None:
        return None
    inside = findings.beside(str(path), node)
    inside.folder = path.parent
    settings: RosMap | None = read(RosMap, parsed(text, inside, ROS_MAP), "a ROS map", inside)
    image = None if settings is None else read_pixels(settings.image, inside)
    if settings is None or image is None:
        return None
    blocked, side = occupied(image, settings), item.resolution
    height, width = (pixels * settings.resolution for pixels in blocked.shape)
    if item.at("resolution") is None:
        hint = (
            f"the map measures {width:g} x {height:g} m: give the side of a region in metres, for "
            "example 'resolution: 0.5' (as an option: --side 0.5)"
        )
        findings.add(node, "map: region size missing", hint)
    if side is None or len(findings) > before or item.flawed:
        return None
    pixels = _decimal(side) / _decimal(settings.resolution)
    rows, cols = (ceil(count / pixels) for count in blocked.shape)
    if rows * cols > MOST_REGIONS:
        findings.add(item.at("resolution"), *too_large(rows, cols))
        return None
    world = with_walls(blocked, Layout.of_size(blocked, pixels), item.share or 0.0, node, findings)
    if world is None:
        return None
    x, y, yaw = (*settings.origin, 0.0)[:3]
    notes = (*doubts(image, settings, path), *world.notes)
    return replace(world, frame=Frame(side, (x, y), yaw), notes=notes)


def _decimal(number: float) -> Fraction:
    """Return the exact decimal value of a number, so that 0.5 / 0.05 is exactly 10."""
    return Fraction(repr(number))
