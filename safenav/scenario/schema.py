"""The JSON Schema of scenario files, for editors and other tools.

It describes the shape of a scenario; what the shape cannot say (a region in a wall, an
unknown robot model) only the loader knows.
"""

from __future__ import annotations

from pathlib import Path


def schema_text() -> str:
    """The schema (draft 2020-12) as JSON text."""
    return Path(__file__).with_name("schema.json").read_text(encoding="utf-8")
