"""The scenario that repeats a run whose world a user changed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from safenav.scenario.model import name_parts
from safenav.studio.editing.operations import add_change, add_obstacle, add_order
from safenav.studio.editing.places import MapPlaces
from safenav.studio.editing.round_trip import changed
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
    return changed(text, lambda data: _replay(data, records, seed))


def _by_user(record: Record) -> bool:
    return getattr(record, "cause", None) is ChangeCause.USER


def _replay(data: Any, records: Sequence[Record], seed: int | None) -> None:
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
                add_order(data, {"at": record.tick, "type": kind, "region": int(region)})
                continue
            earlier = _entries_in(data, int(region))
            for entry in earlier:  # each was resolved before the next appeared
                entry.setdefault("until", record.tick)
            header = known.get(record.obstacle)
            since = header.from_ if header is not None and not earlier else None
            new = {"type": kind, "region": int(region), "from": since or record.tick}
            truth = truths.get(record.obstacle, header.traversable if header else None)
            if truth is not None:
                new["traversable"] = truth
            add_obstacle(data, new)
        elif isinstance(record, Gone):
            entry = _entry(data, record.obstacle, record.tick)
            if entry is not None:
                entry["until"] = record.tick
        elif isinstance(record, Truth):
            truths[record.obstacle] = record.traversable
            entry = _entry(data, record.obstacle, record.tick)
            if entry is not None and record.obstacle in standing:
                _settle_draws(data, records)
                entry["traversable"] = record.traversable
        elif isinstance(record, NewObjective):
            change: dict[str, Any] = {"at": record.tick, "robot": record.robot}
            add_change(data, change | {"objective": record.objective.data})
        elif isinstance(record, Service):
            service = "back" if record.active else "out"
            add_change(data, {"at": record.tick, "robot": record.robot, "service": service})
    if seed is not None:
        data["seed"] = seed


def _settle_draws(data: Any, records: Sequence[Record]) -> None:
    """Replace all probabilities by the values drawn from the seed: replacing only one would change
    the others' draws."""
    header = next(record for record in records if isinstance(record, Header))
    entries = [entry for entry in data.get("obstacles") or () if isinstance(entry, dict)]
    for entry, drawn in zip(entries, header.scenario.obstacles, strict=False):
        if isinstance(entry.get("traversable"), dict) and drawn.traversable is not None:
            entry["traversable"] = drawn.traversable


def _entry(data: Any, name: str, tick: int) -> Any:
    """Return the entry of the last obstacle of that name that has appeared by a tick."""
    kind, region, _ = name_parts(name)
    found = [
        entry
        for entry in _entries_in(data, int(region))
        if entry.get("type") == kind and (entry.get("from") or 0) <= tick
    ]
    return max(found, key=lambda entry: entry.get("from") or 0, default=None)


def _entries_in(data: Any, region: int) -> list[Any]:
    """Return the entries of obstacles in a region, in order."""
    places = MapPlaces(data)
    return [
        entry
        for entry in data.get("obstacles") or ()
        if isinstance(entry, dict) and places.read(entry.get("region")) == region
    ]
