"""Maps from images: ``image: floor.png``, or ``image: {file: floor.png, legend: {...}}``.

Without a legend, dark pixels are walls. With one, each pixel has the meaning of the nearest colour
of the legend: wall, free floor, or an area. A colour far from all of them means free floor.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import replace

from safenav.scenario.reading.maps.keys import COLOUR, ImageKeys, MapKeys, Text
from safenav.scenario.reading.maps.map_file import read_count, read_pixels, with_walls
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, clipped
from safenav.scenario.yaml.fields import NAME
from safenav.scenario.yaml.findings import Findings
from safenav.world.files.image import Colour, dark, meanings
from safenav.world.files.pixels import Blocked, Layout, shares
from safenav.world.files.spots import Label, suggested, without_text
from safenav.world.map import RegionMap

WALL, FREE = "wall", "free"
DEFAULT_THRESHOLD = 0.5


def read_image_map(node: Node, fields: MapKeys, findings: Reading) -> RegionMap | None:
    """Return the map of an image with ``rows`` and ``cols``; None after an error was reported."""
    before = len(findings)
    count = read_count(fields, findings)
    threshold, share = fields.threshold, fields.share or 0.0
    file, legend, text = _described(node, findings)
    if legend and (stray := fields.where(MapKeys.threshold)) is not None:
        findings.add(stray, "map: 'threshold' has no effect with a legend", "leave it out")
    image = None if file is None else read_pixels(file, findings)
    if image is None or len(findings) > before:
        return None
    masks = meanings(image, legend)
    limit = DEFAULT_THRESHOLD if threshold is None else threshold
    blocked = masks.pop(WALL) if legend else dark(image, limit)
    cleared, labels = without_text(blocked)
    walls = cleared if text is Text.IGNORE else blocked
    if count is None:
        height, width = walls.shape
        rows, cols = suggested(walls)
        found = f"map: the image of {width} x {height} pixels needs a number of rows and columns"
        findings.add(node, found, f"add 'rows: {rows}' and 'cols: {cols}'")
        return None
    layout = Layout.of_count(blocked, *count)
    world = with_walls(walls, layout, share, node, findings)
    if world is None:
        return None
    masks.pop(FREE, None)
    areas = dict(_areas(masks, walls, layout, world, node, findings))
    notes = [*world.notes, *_text_notes(labels, text, blocked.shape, world)]
    return replace(world, areas=areas, notes=tuple(notes))


def _described(node: Node, findings: Findings) -> tuple[Node | None, dict[Colour, str], Text]:
    """Return the file, the legend and the treatment of text. With a path alone the legend is empty
    and text is walls."""
    if not isinstance(node, Mapping):
        return node, {}, Text.WALL
    item = ImageKeys.read(node, "'image' of map", findings, "of image")
    assert item is not None
    text = item.text
    legend = read.mapping(item.legend, "'legend' of image", findings)
    found: dict[Colour, str] = {}
    for key, value in legend.entries if legend else ():
        match = COLOUR.fullmatch(key.text)
        meaning = read.text(value, f"colour {clipped(key.text)} of legend", findings)
        if match is None:
            hint = 'write it as on web pages, in quotes: "#ffcc00"'
            findings.add(key, f"'{clipped(key.text)}' is not a colour", hint)
        elif meaning is not None and not NAME.fullmatch(meaning):
            hint = f"'{WALL}', '{FREE}' or the name of an area"
            findings.add(value, f"'{clipped(meaning)}' cannot name an area", hint)
        elif meaning is not None:
            found[int(match[1], 16), int(match[2], 16), int(match[3], 16)] = meaning
    if legend and WALL not in found.values() and len(found) == len(legend.entries):
        findings.add(legend, "legend without walls", f'add the colour of walls: "#000000": {WALL}')
    return item.file, found, text or Text.IGNORE


def _areas(
    masks: dict[str, Blocked],
    blocked: Blocked,
    layout: Layout,
    world: RegionMap,
    node: Node,
    findings: Findings,
) -> Iterator[tuple[str, frozenset[int]]]:
    """Yield the free regions of each area: at least half of their free pixels have its colour."""
    open_ = 1 - shares(blocked, layout)
    for name, mask in masks.items():
        most = (shares(mask & ~blocked, layout) >= 0.5 * open_).ravel()
        area = frozenset(region for region in world.free if most[region])
        if not area:
            found = f"map: no region has the colour of '{name}'"
            findings.add(node, found, "check the colour, or use smaller regions")
        yield name, area


def _text_notes(
    labels: tuple[Label, ...], text: Text, shape: tuple[int, ...], world: RegionMap
) -> Iterator[str]:
    if not labels:
        return
    rows, cols = ((world.rows, shape[0]), (world.cols, shape[1]))
    places = [
        world.label(
            world.region(label.box[0] * rows[0] // rows[1], label.box[1] * cols[0] // cols[1])
        )
        for label in labels[:3]
    ]
    where = ", ".join(places) + (", ..." if len(labels) > 3 else "")
    labels_of = f"{len(labels)} label{'s' if len(labels) > 1 else ''} (at {where})"
    if text is Text.IGNORE:
        yield f"{labels_of} on the image are ignored as text; 'text: wall' makes them walls"
    else:
        yield (
            f"{labels_of} on the image became walls; if they are text, write "
            "'image: {file: ..., text: ignore}'"
        )
