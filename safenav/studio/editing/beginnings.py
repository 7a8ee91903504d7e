"""Starting scenarios: a blank map or a template."""

from __future__ import annotations

from safenav.errors import UsageError
from safenav.scenario.beginning import TEMPLATES, template_text

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
