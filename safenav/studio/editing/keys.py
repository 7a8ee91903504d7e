"""Keys of a scenario with a text field in the studio: their meanings, and their values as text with
their lines in the document."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from safenav.scenario.objective import KINDS
from safenav.scenario.reading.catalogue import ModelKeys, TypeKeys
from safenav.scenario.reading.loader import ScenarioKeys
from safenav.scenario.reading.objective import ObjectiveKeys
from safenav.scenario.reading.obstacles import ObstacleKeys, OrderKeys
from safenav.scenario.reading.robots import RobotKeys
from safenav.scenario.yaml.document import Mapping, Node, Scalar, below, entries_of, items_of
from safenav.scenario.yaml.document import Sequence as Items
from safenav.scenario.yaml.json_schema import described
from safenav.scenario.yaml.shapes import Table, table_at

ROOM = 60
"""Maximum characters of a value on one line."""

_DRAWN = {
    "scenario": ("safenav", "name", "map", "robots", "obstacles", "orders", "seed"),
    "robot": ("model", "start", "heading", "objective"),
    "objective": (*KINDS, "form"),
    "obstacle": ("type", "region", "traversable", "from", "until", "resolve_within"),
    "order": ("at", "type", "region", "resolve_within"),
    "model": (),
    "type": (),
}
"""The keys of each kind of part that have other controls than a text field."""

_TABLES: dict[str, type[Table]] = {
    "scenario": ScenarioKeys,
    "robot": RobotKeys,
    "objective": ObjectiveKeys,
    "obstacle": ObstacleKeys,
    "order": OrderKeys,
    "model": ModelKeys,
    "type": TypeKeys,
}


@cache
def known_keys() -> dict[str, list[dict[str, str]]]:
    """Return the keys of each kind of part that have a text field, with their meanings."""
    return {
        kind: [
            {"key": key, "about": described(found, table)}
            for key, found in table.known.items()
            if key not in _DRAWN[kind]
        ]
        for kind, table in _TABLES.items()
    }


def ordered_keys(path: Sequence[Any]) -> list[str]:
    """Return all keys that are valid at a path of the document, in their usual order."""
    table = table_at(ScenarioKeys, path)
    return [] if table is None else list(table.known)


def parts_of(root: Node) -> dict[str, dict[str, list[Any]]]:
    """Return the values in a document by the path of their mapping, and by key: each value's text,
    line and column of its key, and its last line."""
    found = {"": _parts(root, without=("map", "robots", "obstacles"))}
    for name, robot in entries_of(below(root, "robots")):
        found[f"robots/{name.text}"] = _parts(robot)
        found[f"robots/{name.text}/objective"] = _parts(below(robot, "objective"))
    for key in ("obstacles", "orders"):
        for index, item in enumerate(items_of(below(root, key))):
            found[f"{key}/{index}"] = _parts(item)
    for key in ("robots", "obstacles"):
        for name, item in entries_of(below(root, "catalogue", key)):
            found[f"catalogue/{key}/{name.text}"] = _parts(item)
    return found


def _parts(node: Node | None, without: Sequence[str] = ()) -> dict[str, list[Any]]:
    return {
        key.text: [
            written(value),
            key.place.line,
            key.place.column,
            max(key.place.line, _last(value)),
        ]
        for key, value in entries_of(node)
        if key.text not in without
    }


def written(node: Node) -> str:
    """Return a value as YAML: on one line if it is short, else with a line for each entry."""
    flow = _flow(node)
    if isinstance(node, Scalar):
        return str(node.value) if node.style in ("|", ">") else flow
    return flow if len(flow) <= ROOM else "\n".join(_block(node))


def _block(node: Node) -> Iterator[str]:
    items: list[tuple[str, Node]] = []
    if isinstance(node, Mapping):
        items = [(f"{_flow(key)}:", value) for key, value in node.entries]
    elif isinstance(node, Items):
        items = [("-", value) for value in node.items]
    for head, value in items:
        flow = _flow(value)
        if isinstance(value, Scalar) or len(flow) <= ROOM or not _block_lines(value):
            yield f"{head} {flow}"
        elif head == "-":
            first, *rest = _block_lines(value)
            yield f"- {first}"
            yield from (f"  {line}" for line in rest)
        else:
            yield head
            yield from (f"  {line}" for line in _block_lines(value))


def _block_lines(node: Node) -> list[str]:
    return list(_block(node))


def _flow(node: Node) -> str:
    if isinstance(node, Items):
        return "[" + ", ".join(map(_flow, node.items)) + "]"
    if isinstance(node, Mapping):
        return "{" + ", ".join(f"{_flow(k)}: {_flow(v)}" for k, v in node.entries) + "}"
    plain = node.style == "" and not re.search(r"[,\[\]{}]|: |:$| #", node.text)
    return node.text if plain else json.dumps(node.value, ensure_ascii=False)


def _last(node: Node) -> int:
    inner: Sequence[Node] = ()
    if isinstance(node, Items):
        inner = node.items
    elif isinstance(node, Mapping):
        inner = [value for _, value in node.entries]
    lines = node.text.count("\n") if isinstance(node, Scalar) and node.style in ("|", ">") else 0
    return max([node.place.line + lines, *map(_last, inner)])
