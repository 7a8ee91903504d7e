"""The JSON Schema of scenario files, for editors and other tools.

It describes the shape of a scenario; what the shape cannot say (a region in a wall, an
unknown robot model) only the loader knows.
"""

from __future__ import annotations

from safenav.scenario.reading.loader import ScenarioKeys
from safenav.scenario.yaml import json_schema


def schema_text() -> str:
    """The schema (draft 2020-12) as JSON text."""
    return json_schema.schema_text(ScenarioKeys, "safenav scenario")
