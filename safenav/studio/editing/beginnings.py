"""Starting scenarios: a blank map, a template, a map from an image or another file."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from msgspec.structs import replace

from safenav.errors import InputError, UsageError
from safenav.scenario.beginning import TEMPLATES, template_text
from safenav.scenario.reading.maps.bare_map import Division, load_map
from safenav.scenario.yaml.findings import ReadableFolder
from safenav.studio.editing.round_trip import changed
from safenav.studio.editing.walls import embed
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


def blank(rows: int = 9, cols: int = 15) -> str:
    """Return a scenario of one walled room without robots. Raises UsageError for its size."""
    if not (3 <= rows <= 512 and 3 <= cols <= 512):
        raise UsageError("a blank map has 3 to 512 rows and columns")
    inner = "#" + "." * (cols - 2) + "#"
    lines = ["#" * cols, *[inner] * (rows - 2), "#" * cols]
    return BLANK.format(grid="\n".join(f"    {line}" for line in lines))


def template(name: str) -> str:
    """Return a template by its name. Raises UsageError for an unknown one."""
    if name not in TEMPLATES:
        raise UsageError(f"there is no template '{name[:40]}'; known: {', '.join(TEMPLATES)}")
    return template_text(name)


def movingai(name: str, content: bytes) -> str:
    """Return a blank scenario with an uploaded MovingAI map as its grid. Raises InputError."""
    with TemporaryDirectory() as made:
        path = Path(made).resolve() / Path(name).name
        path.write_bytes(content)
        try:
            world = load_map(path, Division(), ReadableFolder(path.parent))
        except InputError as error:  # omit the temporary folder
            found = [replace(d, file=Path(d.file).name) for d in error.diagnostics]
            raise InputError(found) from None
    return drawn(world, Path(name).stem)


def drawn(world: RegionMap, name: str) -> str:
    """Return a scenario without robots on a map."""
    safe = "".join(c for c in name if c.isalnum() or c in " _-") or "map"
    text = BLANK.replace("name: new scenario", f"name: {safe}").format(grid="    .")
    return changed(text, lambda data: embed(data, world))
