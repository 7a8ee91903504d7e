"""A map file without a scenario, to draw it or to start a scenario on it."""

from __future__ import annotations

import os
import re
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError
from safenav.file_kind import ROS_MAP, kind_of
from safenav.scenario.language import MapKeys
from safenav.scenario.reading.maps.grid import NO_SIZE
from safenav.scenario.reading.maps.map import resolve_map
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.findings import Findings, ReadableFolder
from safenav.scenario.yaml.source import FOREIGN, parsed, read_source
from safenav.scenario.yaml.typed import read
from safenav.world.map import RegionMap

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
            replace(d, line=0, column=0, source="") if d.file == findings.file else d
            for d in error.diagnostics
        ]
        if division == Division() and form_of(Path(findings.file)) != "image":
            made = [replace(d, hint=_ASK) if d.found == NO_SIZE else d for d in made]
        made = [replace(d, hint=_AS_OPTIONS.sub(r"--\1 \2", d.hint)) for d in made]
        raise InputError(made) from None
