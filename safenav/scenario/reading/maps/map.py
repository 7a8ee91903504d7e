"""The ``map:`` of a scenario: drawn in it or read from a file, with names and metres."""

from __future__ import annotations

from importlib.util import find_spec

from msgspec.structs import replace

from safenav.extras import install_command
from safenav.scenario.reading.maps.grid import read_grid
from safenav.scenario.reading.maps.keys import FORMS, OPTIONS, MapKeys, read_origin
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Mapping, Node, Scalar
from safenav.scenario.yaml.fields import mapping, well_named, wrong_type
from safenav.scenario.yaml.findings import Findings, listed
from safenav.world.map import Frame, RegionMap

_HINT = (
    "write 'grid: |' and below it one indented line of '#' and '.' for each row, or name a file: "
    "'image', 'ros' or 'movingai'"
)

_BESIDE = {"areas": "'areas' stands beside 'map', not in it"}


def read_map(node: Node | None, reading: Reading) -> None:
    """Read the map and its names into ``reading``. After an error in the map was reported, only its
    names are available."""
    item = MapKeys.read(node, "map", reading, elsewhere=_BESIDE)
    reading.names_known = item is not None
    if item is not None:
        form = _form(item.node, reading)
        reading.world = _read_form(form, item, reading) if form else None
        _read_names(item, reading)


def _form(fields: Mapping, findings: Findings) -> str | None:
    """Return the form of the map; report keys that do not belong to it."""
    forms = [key for key, _ in fields.entries if key.text in FORMS]
    if not forms:
        if all(key.text in MapKeys.known for key, _ in fields.entries):
            findings.add(fields, f"map: one of {listed(list(FORMS))} is missing", _HINT)
        return None
    form = forms[0].text
    for key in forms[1:]:
        findings.add(key, f"map: both '{form}' and '{key.text}'", "a map has one form")
    for key, _ in fields.entries:
        if len(forms) == 1 and key.text in OPTIONS and key.text not in FORMS[form]:
            having = [other for other, keys in FORMS.items() if key.text in keys]
            hint = f"it belongs to {listed(having)}"
            if form == "ros" and key.text == "origin":
                hint = "the file has its own origin"
            findings.add(key, f"map: '{key.text}' has no meaning for '{form}'", hint)
    return form if len(forms) == 1 else None


def _read_form(form: str, fields: MapKeys, reading: Reading) -> RegionMap | None:
    node = fields.node.get(form)
    assert node is not None
    if form != "grid" and not _has_numpy():
        hint = f"{install_command('maps')}\n    or draw the map with 'grid'"
        reading.add(node, "a map file needs numpy, which is not installed", hint)
        return None
    # Only map files need numpy, whose import takes longer than reading a whole scenario.
    if form == "ros":
        from safenav.scenario.reading.maps.ros_map import read_ros

        return read_ros(node, fields, reading)
    frame = _frame(fields, reading)
    if form == "grid":
        world = read_grid(node, reading)
    else:
        from safenav.scenario.reading.maps.image_map import read_image_map
        from safenav.scenario.reading.maps.map_file import read_movingai_map

        reader = read_image_map if form == "image" else read_movingai_map
        world = reader(node, fields, reading)
    return world and replace(world, frame=frame)


def _has_numpy() -> bool:
    """Return whether numpy is installed, without loading it."""
    try:
        return find_spec("numpy") is not None
    except ValueError:  # hidden: ``sys.modules`` has None in its place
        return False


def _frame(fields: MapKeys, findings: Findings) -> Frame | None:
    """Return the frame of the map, if the scenario states the size of regions."""
    side, node = fields.resolution, fields.origin
    if node is not None and fields.where(MapKeys.resolution) is None:
        hint = "also write 'resolution', the side of a region in metres"
        findings.add(node, "map: 'origin' without 'resolution'", hint)
    origin = read_origin(node, "'origin' of map", findings)
    if side is None:
        return None
    x, y, yaw = origin or (0.0, 0.0, 0.0)
    return Frame((side, side), (x, y), yaw)


def _read_names(fields: MapKeys, reading: Reading) -> None:
    world = reading.world
    names: dict[str, int | None] = {}
    listed = mapping(fields.names, "'names' of map", reading)
    for key, node in listed.entries if listed else ():
        if not well_named(key, "a region", reading):
            continue
        if isinstance(node, Scalar) and isinstance(node.value, str):
            wrong_type(node, f"region '{key.text}'", "a number or [row, column]", reading)
            names[key.text] = None
        else:
            names[key.text] = reading.region(node, f"region '{key.text}'")
    if world is not None:
        known = {name: region for name, region in names.items() if region is not None}
        reading.world = replace(world, names=known)
    reading.names = names
