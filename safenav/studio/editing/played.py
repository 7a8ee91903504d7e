"""The scenario that repeats a run whose world a user changed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from safenav.scenario.model import name_parts
from safenav.studio.editing.operations import MapPlaces, add_change, add_obstacle, add_order
from safenav.studio.editing.splice import YamlText, flow
from safenav.trace.records import (
    Appeared,
    Discovered,
    Gone,
    Header,
    NewObjective,
    Ordered,
    Record,
    Resolved,
    Service,
    Truth,
)
from safenav.trace.vocabulary import ChangeCause


def played(text: str, records: Sequence[Record], seed: int | None) -> str:
    """Return the text with the user's changes during the run, and the seed of the run."""
    if not any(_by_user(record) for record in records) and seed is None:
        return text
    file = YamlText(text)
    _replay(file, records, seed)
    return file.text


def _by_user(record: Record) -> bool:
    return getattr(record, "cause", None) is ChangeCause.USER


def _replay(file: YamlText, records: Sequence[Record], seed: int | None) -> None:
    known = {}
    truths: dict[str, bool] = {}
    standing: set[str] = set()
    orders = {(r.tick, r.obstacle) for r in records if isinstance(r, Ordered)}
    for record in records:
        if isinstance(record, Header):
            standing |= {o.name for o in record.scenario.obstacles if not o.from_}
        elif isinstance(record, Resolved | Gone):
            standing.discard(record.obstacle)
        elif isinstance(record, Appeared):
            standing.add(record.obstacle)
        if isinstance(record, Discovered):
            known[record.obstacle.name] = record.obstacle
        elif not _by_user(record):
            continue
        elif isinstance(record, Appeared):
            kind, region, _ = name_parts(record.obstacle)
            if (record.tick, record.obstacle) in orders:
                add_order(file, {"at": record.tick, "type": kind, "region": int(region)})
                continue
            earlier = _entries_in(file, int(region))
            for index in earlier:  # each was resolved before the next appeared
                if file.at("obstacles", index, "until") is None:
                    _set(file, index, "until", record.tick)
            header = known.get(record.obstacle)
            since = header.from_ if header is not None and not earlier else None
            new = {"type": kind, "region": int(region), "from": since or record.tick}
            truth = truths.get(record.obstacle, header.traversable if header else None)
            if truth is not None:
                new["traversable"] = truth
            add_obstacle(file, new)
        elif isinstance(record, Gone):
            entry = _entry(file, record.obstacle, record.tick)
            if entry is not None:
                _set(file, entry, "until", record.tick)
        elif isinstance(record, Truth):
            truths[record.obstacle] = record.traversable
            entry = _entry(file, record.obstacle, record.tick)
            if entry is not None and record.obstacle in standing:
                _settle_draws(file, records)
                _set(file, entry, "traversable", record.traversable)
        elif isinstance(record, NewObjective):
            change: dict[str, Any] = {"at": record.tick, "robot": record.robot}
            add_change(file, change | {"objective": record.objective.data})
        elif isinstance(record, Service):
            service = "back" if record.active else "out"
            add_change(file, {"at": record.tick, "robot": record.robot, "service": service})
    if seed is not None:
        file.put(("seed",), flow(seed))


def _settle_draws(file: YamlText, records: Sequence[Record]) -> None:
    """Replace all probabilities by the values drawn from the seed: replacing only one would change
    the others' draws."""
    header = next(record for record in records if isinstance(record, Header))
    for entry, drawn in enumerate(header.scenario.obstacles):
        probable = isinstance(file.at("obstacles", entry, "traversable"), dict)
        if probable and drawn.traversable is not None:
            _set(file, entry, "traversable", drawn.traversable)


def _set(file: YamlText, entry: int, key: str, value: Any) -> None:
    file.put(("obstacles", entry, key), flow(value))


def _entry(file: YamlText, name: str, tick: int) -> int | None:
    """Return the index of the last obstacle of that name that has appeared by a tick."""
    kind, region, _ = name_parts(name)
    since = {
        entry: file.at("obstacles", entry, "from") or 0
        for entry in _entries_in(file, int(region))
        if file.at("obstacles", entry, "type") == kind
    }
    there = [entry for entry, begin in since.items() if begin <= tick]
    return max(there, key=lambda entry: since[entry], default=None)


def _entries_in(file: YamlText, region: int) -> list[int]:
    """Return the indices of the obstacles in a region, in order."""
    places = MapPlaces(file)
    return [
        index
        for index, entry in enumerate(file.at("obstacles") or ())
        if isinstance(entry, dict) and places.read(entry.get("region")) == region
    ]
