"""Map files that a scenario names: images (pixels darker than half are walls), MovingAI maps, and
code shared by all forms (docs/maps.md).

A message points to the line of the file if known, else to the place where the scenario names the
file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from msgspec.structs import replace

from safenav.scenario.language import MapKeys
from safenav.scenario.reading.maps.grid import too_large
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Node, Place
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.source import read_bytes, read_source
from safenav.scenario.yaml.typed import read
from safenav.world.files.flaws import MAX_BYTES, MapFileError
from safenav.world.files.image import Image, dark, read_image
from safenav.world.files.movingai import read_movingai as parse_movingai
from safenav.world.files.pixels import Blocked, Layout, walls
from safenav.world.files.spots import losses, suggested
from safenav.world.map import MAX_REGIONS, RegionMap


def read_movingai_map(node: Node, item: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map of ``movingai: arena.map``, divided into ``rows`` and ``cols`` if given; None
    after an error was reported."""
    before = len(findings)
    count, share = read_count(item, findings), item.share or 0.0
    path = named_path(node, "movingai", findings)
    text = None if path is None else read_source(path, findings, node)
    if path is None or text is None:
        return None
    try:
        rows = parse_movingai(text)
    except MapFileError as error:
        report(error, path, node, findings)
        return None
    if len(findings) > before or misread(item):
        return None
    blocked = np.array(rows, dtype=np.bool_)
    layout = Layout.of_count(blocked, *(count or blocked.shape))
    return with_walls(blocked, layout, share, node, findings)


def read_image_map(node: Node, item: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map of an image with ``rows`` and ``cols``; None after an error was reported."""
    before = len(findings)
    count, share = read_count(item, findings), item.share or 0.0
    image = read_pixels(node, findings)
    if image is None or len(findings) > before or misread(item):
        return None
    walls = dark(image)
    if count is None:
        height, width = walls.shape
        rows, cols = suggested(walls)
        found = f"map: the image of {width} x {height} pixels needs a number of rows and columns"
        findings.add(node, found, f"add 'rows: {rows}' and 'cols: {cols}'")
        return None
    return with_walls(walls, Layout.of_count(walls, *count), share, node, findings)


def named_path(node: Node, key: str, findings: Reading) -> Path | None:
    """Return the file that a key of the map names; None if an error was reported."""
    name = read(str, node, f"'{key}' of map", findings)
    return None if name is None else findings.folder / name


def read_pixels(node: Node, findings: Reading) -> Image | None:
    """Return the image that the node names; None if an error was reported."""
    path = named_path(node, "image", findings)
    data = None if path is None else read_bytes(path, findings, node, MAX_BYTES)
    if path is None or data is None:
        return None
    try:
        return read_image(data)
    except MapFileError as error:
        report(error, path, node, findings)
        return None


def read_count(item: MapKeys, findings: Findings) -> tuple[int, int] | None:
    """Return ``rows`` and ``cols``; None unless both are given."""
    rows, cols = item.rows, item.cols
    for word, other in (("rows", "cols"), ("cols", "rows")):
        node = item.at(word)
        if node is not None and item.at(other) is None:
            findings.add(node, f"map: '{word}' without '{other}'", "give both or none")
    return None if rows is None or cols is None else (rows, cols)


def misread(item: MapKeys) -> bool:
    """Return whether a number of the map was reported."""
    numbers = ("rows", "cols", "share", "resolution")
    return any(item.at(key) is not None and getattr(item, key) is None for key in numbers)


def with_walls(
    blocked: Blocked, layout: Layout, share: float, node: Node, findings: Findings
) -> RegionMap | None:
    """Return the map of a layout over the pixels. ``share``: a region is a wall if more than this
    share of it is blocked. None after an error was reported."""
    if layout.rows * layout.cols > MAX_REGIONS:
        found, hint = too_large(layout.rows, layout.cols)
        findings.add(node, found, f"{hint}: 'rows' and 'cols' divide the file into fewer")
        return None
    found_walls = walls(blocked, layout, share)
    if len(found_walls) == layout.rows * layout.cols:
        hint = "by default one blocked pixel makes a wall: try 'share: 0.5' or smaller regions"
        if bool(blocked.all()):
            hint = "nothing in the file is free: dark, unknown and occupied pixels are walls"
        findings.add(node, "map: every region is a wall", hint)
        return None
    world = RegionMap(layout.rows, layout.cols, found_walls)
    return replace(world, notes=losses(blocked, layout, world, share))


def report(error: MapFileError, path: Path, node: Node, findings: Findings) -> None:
    """Report the errors of a map file; those without a line point at ``node``."""
    inside = findings.beside(str(path))
    for flaw in error.flaws:
        if flaw.line:
            inside.add(Place(flaw.line, flaw.column), flaw.found, flaw.hint)
        else:
            findings.add(node, f"file '{path}': {flaw.found}", flaw.hint)
