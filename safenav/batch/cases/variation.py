"""Replace values in a scenario by dotted paths: ``limits.ticks``, ``robots.quad.start``.

The document tree is changed before it is read, so that a variation is checked exactly as if it were
in the file. A diagnostic about a new value points at the value that it replaces.
"""

from __future__ import annotations

from collections.abc import Mapping as Values
from typing import Any

from safenav.scenario.yaml.document import Mapping, Node, Place, Scalar, Sequence
from safenav.scenario.yaml.findings import Findings


def varied(root: Node, settings: Values[str, Any], findings: Findings) -> Node:
    """Return the tree with all settings applied; report each path that does not exist."""
    for path, value in settings.items():
        root = _replaced(root, path.split("."), value, path, findings)
    return root


def node_of(value: Any, place: Place) -> Node:
    """Return plain data as nodes, all at one position."""
    if isinstance(value, Values):
        entries = [(Scalar(place, str(k), str(k)), node_of(v, place)) for k, v in value.items()]
        return Mapping(place, tuple(entries))
    if isinstance(value, list | tuple):
        return Sequence(place, tuple(node_of(item, place) for item in value))
    if isinstance(value, bool):
        return Scalar(place, value, "true" if value else "false")
    return Scalar(place, value, "" if value is None else str(value))


def _replaced(node: Node, steps: list[str], value: Any, path: str, findings: Findings) -> Node:
    """Return ``node`` with the value at ``steps`` replaced; missing mappings are created."""
    if not steps:
        return node_of(value, node.place)
    step, rest = steps[0], steps[1:]
    match node:
        case Sequence(place, items) if step.isdecimal() and int(step) < len(items):
            index = int(step)
            new = _replaced(items[index], rest, value, path, findings)
            return Sequence(place, (*items[:index], new, *items[index + 1 :]))
        case Mapping(place, entries):
            old = node.get(step)
            below = Mapping(place, ()) if old is None else old
            new = _replaced(below, rest, value, path, findings)
            if old is None:
                return Mapping(place, (*entries, (Scalar(place, step, step), new)))
            kept = [(key, new if key.value == step else item) for key, item in entries]
            return Mapping(place, tuple(kept))
    found = f"'{path}' of the matrix leads nowhere: there is no '{step}' here"
    findings.add(node, found, "a path names keys, or items of a list from 0: obstacles.0.region")
    return node
