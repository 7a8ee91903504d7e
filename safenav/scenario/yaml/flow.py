"""Data as YAML on one line."""

from __future__ import annotations

from collections.abc import Mapping


def flow(data: object) -> str:
    """Return mappings, lists, numbers and truth values as YAML; texts must be YAML already. A key
    whose value is None is left out."""
    match data:
        case bool():
            return "true" if data else "false"
        case float():
            return f"{data:g}"
        case list() | tuple():
            return f"[{', '.join(map(flow, data))}]"
        case Mapping():
            entries = (f"{key}: {flow(value)}" for key, value in data.items() if value is not None)
            return f"{{{', '.join(entries)}}}"
    return str(data)
