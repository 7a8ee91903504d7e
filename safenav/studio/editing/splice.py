"""Changes of values in YAML text at the places of its nodes: all other characters stay.

Comments inside a replaced value follow the new one; those at the end of a removed line go with it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import yaml
from msgspec import Struct

from safenav.errors import UsageError
from safenav.scenario.yaml.document import DocumentError, plain, read_document, scalar_value

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_WORD = re.compile(r"[A-Za-z_][\w-]*")

Step = str | int
"""A key of a mapping or an index of a list."""


class Spot(Struct, frozen=True):
    """A node: its first character and the one after its last. ``flow``: between brackets.
    ``entries``: for each key or index the place of the entry and its value; None for a scalar."""

    start: int
    end: int
    flow: bool = False
    entries: dict[Step, tuple[int, Spot]] | None = None


def flow(value: Any) -> str:
    """Return a value as YAML on one line."""
    match value:
        case dict():
            return "{" + ", ".join(f"{flow(k)}: {flow(v)}" for k, v in value.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(map(flow, value)) + "]"
        case str() if _WORD.fullmatch(value) and isinstance(scalar_value(value), str):
            return value
    return json.dumps(value, ensure_ascii=False)


class YamlText:
    """A text that is edited, and its ``data``. Raises UsageError for invalid YAML."""

    def __init__(self, text: str) -> None:
        self._read(text)

    def _read(self, text: str) -> None:
        try:
            self.data: Any = plain(read_document(text).root)
        except DocumentError as error:
            raise UsageError("fix the text first: it is not valid YAML") from error
        if not isinstance(self.data, dict):
            raise UsageError("fix the text first: it is not a scenario")
        self.text = text
        events: Any = yaml.parse(text, Loader=_LOADER)
        self._root = _spot(text, next(e for e in events if isinstance(e, _NODES)), events)

    def at(self, *path: Step) -> Any:
        """Return the data at a path; None if there is none."""
        found = self.data
        for step in path:
            if isinstance(found, list) and isinstance(step, int) and step < len(found):
                found = found[step]
            else:
                found = found.get(step) if isinstance(found, dict) else None
        return found

    def spot(self, *path: Step) -> Spot | None:
        """Return the node at a path; None if there is none."""
        found: Spot | None = self._root
        for step in path:
            found = ((found and found.entries) or {}).get(step, (0, None))[1]
        return found

    def put(self, path: tuple[Step, ...], value: str, after: str = "") -> None:
        """Set the YAML at a path; a new key comes after the key ``after``, else last."""
        spot, holder = self.spot(*path), self.spot(*path[:-1])
        if spot is not None:
            return self._replace(spot, value)
        *above, key = path
        if not holder or not holder.entries:
            whole = f"{flow(key)}: {value}"
            block = len(above) == 1 and above[0] == "robots"
            return self.put(tuple(above), f"\n  {whole}" if block else f"{{{whole}}}")
        before = holder.entries.get(after) or [*holder.entries.values()][-1]
        return self._add(holder, before[1], f"{flow(key)}: {value}")

    def append(self, path: tuple[str, ...], value: str, after: str) -> None:
        """Append YAML to a list; a new list comes after the key ``after``."""
        holder = self.spot(*path)
        if holder and holder.entries:
            return self._add(holder, [*holder.entries.values()][-1][1], value, "- ")
        return self.put(path, f"\n  - {value}", after)

    def remove(self, *path: Step) -> None:
        """Remove an entry; of a list or mapping with one entry, all of it becomes empty."""
        holder = self.spot(*path[:-1])
        assert holder is not None and holder.entries is not None
        entries = [*holder.entries.values()]
        number = [*holder.entries].index(path[-1])
        begin, end = entries[number][0], entries[number][1].end
        if len(entries) == 1 and len(path) > 1:
            return self._replace(holder, "[]" if isinstance(path[-1], int) else "{}")
        if not holder.flow:
            begin, end = self.text.rfind("\n", 0, begin) + 1, self._line_end(end) + 1
        elif number + 1 < len(entries):
            end = entries[number + 1][0]
        elif number:
            begin = entries[number - 1][1].end
        return self._splice(begin, end, "")

    def redraw(self, characters: dict[int, str]) -> None:
        """Replace single characters, by their place in the text."""
        letters = list(self.text)
        for place, letter in characters.items():
            letters[place] = letter
        self._read("".join(letters))

    def _add(self, holder: Spot, before: Spot, entry: str, dash: str = "") -> None:
        if holder.flow:
            return self._splice(before.end, before.end, f", {entry}")
        indent = holder.start - self.text.rfind("\n", 0, holder.start) - 1
        end = self._line_end(before.end)
        return self._splice(end, end, f"\n{' ' * indent}{dash}{entry}")

    def _replace(self, spot: Spot, value: str) -> None:
        start = spot.start
        kept = "".join(f"  {found}" for found in self._comments(spot))
        if kept:
            end = self._line_end(spot.end)
            rest = self.text[spot.end : end]
            return self._splice(start, end, value + rest + kept)
        if value.startswith("\n"):
            start = len(self.text[:start].rstrip(" "))
        gap = " " if value[0] != "\n" and self.text[start - 1] == ":" else ""
        return self._splice(start, spot.end, gap + value)

    def _comments(self, spot: Spot) -> Iterator[str]:
        """Yield the comments inside a node: what begins with # between its scalars."""
        at = spot.start
        for leaf in [*_leaves(spot), Spot(spot.end, spot.end)]:
            yield from re.findall(r"(?<=\s)#[^\n]*", self.text[max(0, at - 1) : leaf.start])
            at = leaf.end

    def _line_end(self, at: int) -> int:
        end = self.text.find("\n", at)
        return len(self.text) if end < 0 else end

    def _splice(self, start: int, end: int, new: str) -> None:
        self._read(self.text[:start] + new + self.text[end:])


_NODES = (yaml.ScalarEvent, yaml.AliasEvent, yaml.MappingStartEvent, yaml.SequenceStartEvent)
_ENDS = (yaml.MappingEndEvent, yaml.SequenceEndEvent)


def _spot(text: str, event: Any, events: Any) -> Spot:
    """Return the node that begins with an event."""
    start, end = event.start_mark.index, event.end_mark.index
    if not isinstance(event, yaml.CollectionStartEvent):
        return Spot(start, max(start, len(text[:end].rstrip())) if end > start else start)
    entries: dict[Step, tuple[int, Spot]] = {}
    is_mapping = isinstance(event, yaml.MappingStartEvent)
    first: Any
    while not isinstance(first := next(events), _ENDS):
        key: Step = len(entries)
        begin = first.start_mark.index
        if is_mapping:
            key = getattr(first, "value", "")
            first = next(events)
        entries[key] = (begin, _spot(text, first, events))
    closing: Any = first
    end = closing.end_mark.index
    if not event.flow_style and entries:
        end = [*entries.values()][-1][1].end
    return Spot(start, end, bool(event.flow_style), entries)


def _leaves(spot: Spot) -> Iterator[Spot]:
    if spot.entries is None:
        yield spot
    for begin, value in (spot.entries or {}).values():
        yield Spot(begin, begin)
        yield from _leaves(value)
