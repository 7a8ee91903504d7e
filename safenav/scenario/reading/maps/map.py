"""The ``map:`` of a scenario: drawn in it or read from a file, with names and metres."""

from __future__ import annotations

from importlib.util import find_spec

from msgspec.structs import replace

from safenav.extras import install_command
from safenav.scenario import language
from safenav.scenario.language import FORMS, OPTIONS
from safenav.scenario.reading.maps.grid import read_grid, read_origin
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Scalar, clipped
from safenav.scenario.yaml.findings import Findings, listed, wrong_type
from safenav.scenario.yaml.typed import entries
from safenav.world.map import Frame, RegionMap

_HINT = (
    "write 'grid: |' and below it one indented line of '#' and '.' for each row, or name a file: "
    "'image', 'ros' or 'movingai'"
)


def resolve_map(item: language.MapKeys | None, reading: Reading) -> None:
    """Add the map and its names to ``reading``. After an error in the map was reported, only its
    names are available."""
    if item is not None:
        form = _form(item, reading)
        reading.world = _read_form(form, item, reading) if form else None
        _resolve_names(item, reading)


def _form(item: language.MapKeys, findings: Findings) -> str | None:
    """Return the form of the map; report keys that do not belong to it."""
    forms = [key for key, _ in item.node.entries if key.text in FORMS]
    if not forms:
        if all(key.text in entries(language.MapKeys) for key, _ in item.node.entries):
            findings.add(item.node, f"map: one of {listed(list(FORMS))} is missing", _HINT)
        return None
    form = forms[0].text
    for key in forms[1:]:
        findings.add(key, f"map: both '{form}' and '{key.text}'", "a map has one form")
    for key, _ in item.node.entries:
        if len(forms) == 1 and key.text in OPTIONS and key.text not in FORMS[form]:
            having = [other for other, keys in FORMS.items() if key.text in keys]
            hint = f"it belongs to {listed(having)}"
            if form == "ros" and key.text == "origin":
                hint = "the file has its own origin"
            findings.add(key, f"map: '{key.text}' has no meaning for '{form}'", hint)
    return form if len(forms) == 1 else None


def _read_form(form: str, item: language.MapKeys, reading: Reading) -> RegionMap | None:
    node = item.at(form)
    if node is None or getattr(item, form) is None:
        return None
    if form != "grid" and not _has_numpy():
        hint = f"{install_command('maps')}\n    or draw the map with 'grid'"
        reading.add(node, "a map file needs numpy, which is not installed", hint)
        return None
    if form != "grid" and isinstance(item.resolution, tuple):
        wrong_type(item.at("resolution"), "'resolution' of map", "a number", reading)
        return None
    # Only map files need numpy, whose import takes longer than reading a whole scenario.
    if form == "ros":
        from safenav.scenario.reading.maps.ros_map import read_ros

        return read_ros(node, item, reading)
    frame = _frame(item, reading)
    if form == "grid":
        world = read_grid(node, reading)
    else:
        from safenav.scenario.reading.maps.map_file import read_image_map, read_movingai_map

        reader = read_image_map if form == "image" else read_movingai_map
        world = reader(node, item, reading)
    return world and replace(world, frame=frame)


def _has_numpy() -> bool:
    """Return whether numpy is installed, without loading it."""
    try:
        return find_spec("numpy") is not None
    except ValueError:  # hidden: ``sys.modules`` has None in its place
        return False


def _frame(item: language.MapKeys, findings: Findings) -> Frame | None:
    """Return the frame of the map, if the scenario states the size of regions."""
    side, origin = item.resolution, item.origin
    if origin is not None and item.at("resolution") is None:
        hint = "also write 'resolution', the side of a region in metres"
        findings.add(origin.node, "map: 'origin' without 'resolution'", hint)
    x, y, yaw = (origin and read_origin(origin.node, origin.what, findings)) or (0.0, 0.0, 0.0)
    if side is None:
        return None
    return Frame(side if isinstance(side, tuple) else (side, side), (x, y), yaw)


def _resolve_names(item: language.MapKeys, reading: Reading) -> None:
    names: dict[str, int | None] = {}
    for key, value in (item.names or {}).items():
        what = f"region '{clipped(key.text)}'"
        if isinstance(value.node, Scalar) and isinstance(value.node.value, str):
            wrong_type(value.node, what, "a number or [row, column]", reading)
            names[key.text] = None
        else:
            names[key.text] = reading.region(value.node, what)
    if reading.world is not None:
        known = {name: region for name, region in names.items() if region is not None}
        reading.world = replace(reading.world, names=known)
    reading.names = names
