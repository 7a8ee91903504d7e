"""Maps from images: ``image: floor.png``. Pixels darker than half are walls."""

from __future__ import annotations

from safenav.scenario.reading.maps.keys import MapKeys
from safenav.scenario.reading.maps.map_file import read_count, read_pixels, with_walls
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Node
from safenav.world.files.image import dark
from safenav.world.files.pixels import Layout
from safenav.world.files.spots import suggested
from safenav.world.map import RegionMap


def read_image_map(node: Node, fields: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map of an image with ``rows`` and ``cols``; None after an error was reported."""
    before = len(findings)
    count, share = read_count(fields, findings), fields.share or 0.0
    image = read_pixels(node, findings)
    if image is None or len(findings) > before:
        return None
    walls = dark(image)
    if count is None:
        height, width = walls.shape
        rows, cols = suggested(walls)
        found = f"map: the image of {width} x {height} pixels needs a number of rows and columns"
        findings.add(node, found, f"add 'rows: {rows}' and 'cols: {cols}'")
        return None
    return with_walls(walls, Layout.of_count(walls, *count), share, node, findings)
