"""What an editor can begin with: a blank map, a template, a map from an image or another file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from safenav.errors import InputError, UsageError
from safenav.scenario.reading.bare_map import Division, load_map
from safenav.scenario.template import TEMPLATES, template_text
from safenav.scenario.yaml.findings import ReadableFolder
from safenav.world.map import RegionMap

BLANK = """\
safenav: 1
name: new scenario
map:
  grid: |
{grid}
robots: {{}}
until: {{rounds: 2}}
limits: {{ticks: 500}}
"""

ASK = "say into how many regions the map is divided: Rows x Columns, at the top of New"
"""The page's fields, where the command line has options."""


def blank(rows: int = 9, cols: int = 15) -> str:
    """A room without anybody."""
    if not (3 <= rows <= 512 and 3 <= cols <= 512):
        raise UsageError("a blank map has 3 to 512 rows and columns")
    inner = "#" + "." * (cols - 2) + "#"
    lines = ["#" * cols, *[inner] * (rows - 2), "#" * cols]
    return BLANK.format(grid="\n".join(f"    {line}" for line in lines))


def template(name: str) -> str:
    """A template by its name. Raises UsageError for an unknown one."""
    if name not in TEMPLATES:
        raise UsageError(f"there is no template '{name[:40]}'; known: {', '.join(TEMPLATES)}")
    return template_text(name)


def on_map(name: str, files: Mapping[str, bytes], division: Division) -> str:
    """A blank scenario on the uploaded map ``name``; the map is drawn into the scenario, and
    names no other file than the uploaded ones. Raises InputError."""
    with TemporaryDirectory() as made:
        folder = Path(made).resolve()
        for other, content in files.items():
            (folder / Path(other).name).write_bytes(content)
        try:
            world = load_map(folder / Path(name).name, division, ReadableFolder(folder), ASK)
        except InputError as error:  # nobody knows the folder
            told = [replace(d, file=Path(d.file).name) for d in error.diagnostics]
            raise InputError(told) from None
    return drawn(world, Path(name).stem)


def drawn(world: RegionMap, name: str) -> str:
    """A map as a scenario without robots."""
    lines = "\n".join(f"    {row}" for row in world.grid_rows())
    text = BLANK.format(grid=lines)
    safe = "".join(c for c in name if c.isalnum() or c in " _-") or "map"
    return text.replace("name: new scenario", f"name: {safe}")
