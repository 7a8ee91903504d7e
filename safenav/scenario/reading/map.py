"""The ``map:`` of a scenario, drawn in it or read from a file, with names and metres. Also a map
file alone, to draw it or to start a scenario on it."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.extras import install_command
from safenav.file_kind import ROS_MAP, kind_of
from safenav.scenario import language
from safenav.scenario.language import FORMS, OPTIONS, MapKeys
from safenav.scenario.reading.grid import NO_SIZE, read_grid, read_origin
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Scalar, clipped
from safenav.scenario.yaml.findings import (
    FOREIGN,
    Findings,
    ReadableFolder,
    listed,
    parsed,
    read_source,
    wrong_type,
)
from safenav.scenario.yaml.typed import entries, read
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
        from safenav.scenario.reading.map_file import read_ros

        return read_ros(node, item, reading)
    frame = _frame(item, reading)
    if form == "grid":
        world = read_grid(node, reading)
    else:
        from safenav.scenario.reading.map_file import read_image_map, read_movingai_map

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


_IMAGES = (".png", ".pgm")
_ASK = "give the size of the regions: --rows 20 --cols 30, or --side 0.5 (metres)"
_AS_OPTIONS = re.compile(r"'(rows|cols|share): ([\d.]+)'( and)?")


class Division(Struct, frozen=True):
    """Division of a map file: into rows and columns, or into squares with a side in metres.
    ``share``: a region is a wall if more than this share of it is blocked."""

    rows: int | None = None
    cols: int | None = None
    resolution: float | None = None
    share: float | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of a scenario's ``map`` for this division: ``rows: 20``, ..."""
        values = {
            "rows": self.rows,
            "cols": self.cols,
            "resolution": self.resolution,
            "share": self.share,
        }
        return tuple(f"{key}: {value:g}" for key, value in values.items() if value is not None)


def form_of(path: Path) -> str | None:
    """Return the form of a map file in a scenario: ``image``, ``ros`` or ``movingai``; None if it
    is not a map file."""
    suffix = path.suffix.lower()
    if suffix in _IMAGES:
        return "image"
    if suffix == ".map":
        return "movingai"
    if suffix not in (".yaml", ".yml"):
        return None
    text = read_source(path, Findings(str(path)))
    return "ros" if text is not None and kind_of(text) == ROS_MAP else None


def map_lines(path: Path, division: Division, folder: Path) -> list[str]:
    """Return the keys of a scenario's ``map`` for a file, relative to ``folder``.

    Raises InputError if the file is not a map file.
    """
    form = form_of(path)
    if form is None:
        maps = "PNG or PGM images, the YAML file of ROS map_server, MovingAI maps (.map)"
        hint = FOREIGN.get(path.suffix, maps)
        raise InputError([Diagnostic(str(path), 0, 0, "this is not a map file", hint)])
    name = os.path.relpath(path, folder)
    quoted = name if re.fullmatch(r"[\w./][\w./-]*", name) else "'" + name.replace("'", "''") + "'"
    return [f"{form}: {quoted}", *division.keys]


def load_map(path: Path, division: Division, reach: ReadableFolder | None = None) -> RegionMap:
    """Return the regions of a map file. ``reach``: the folder whose files it may name (None: any).
    Raises InputError with all errors."""
    if not path.is_file():
        message = "this is a directory" if path.is_dir() else "no such file"
        raise InputError([Diagnostic(str(path), 0, 0, message, "check the path")])
    reading = Reading(str(path), reach)
    reading.folder = Path.cwd()
    root = parsed("{" + ", ".join(map_lines(path, division, reading.folder)) + "}", reading)
    resolve_map(read(MapKeys, root, "map", reading), reading)
    _tell_whole_file(reading, division)
    assert reading.world is not None, "else it was reported"
    return reading.world


def _tell_whole_file(findings: Findings, division: Division) -> None:
    """Raise the errors, without places in the generated text and with options instead of keys in
    their hints."""
    try:
        findings.raise_if_any()
    except InputError as error:
        made = [
            d._replace(line=0, column=0, source="") if d.file == findings.file else d
            for d in error.diagnostics
        ]
        if division == Division() and form_of(Path(findings.file)) != "image":
            made = [d._replace(hint=_ASK) if d.found == NO_SIZE else d for d in made]
        made = [d._replace(hint=_AS_OPTIONS.sub(r"--\1 \2", d.hint)) for d in made]
        raise InputError(made) from None
