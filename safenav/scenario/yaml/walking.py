"""Search in a document, by its tables, for the values of some shape."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

from safenav.scenario.yaml.shapes import Shape, Table


def values_of(sought: Collection[object], root: object, data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the container and the key or index of each value of a sought shape or table in data
    (mappings, lists, scalars) of the shape ``root``. Data of another form is skipped."""
    yield from _below(sought, root, {"": data}, "")


def table_at(root: object, path: Collection[object]) -> type[Table] | None:
    """Return the table of the item at a path of keys and indices; None if it has none."""
    parts = [root]
    for step in path:
        inner = (_inner(form, step) for part in parts for form in forms(part))
        parts = [part for part in inner if part is not None]
    found = (form for part in parts for form in forms(part))
    return next((f for f in found if isinstance(f, type) and issubclass(f, Table)), None)


def forms(part: object, sought: Collection[object] = ()) -> Iterator[object]:
    """Yield the forms that a value may have: tables, schemas, and sought shapes."""
    if any(part is each for each in sought):
        yield part
    elif isinstance(part, Shape):
        yield from forms(part.schema, sought)
    elif isinstance(part, Mapping) and "anyOf" in part:
        for each in part["anyOf"]:
            yield from forms(each, sought)
    else:
        yield part


def _below(
    sought: Collection[object], part: object, holder: Any, key: Any
) -> Iterator[tuple[Any, Any]]:
    value = holder[key]
    listed = range(len(value)) if isinstance(value, list) else ()
    steps = list(value) if isinstance(value, dict) else listed
    ways = [(s, i) for f in forms(part, sought) for s in steps if (i := _inner(f, s)) is not None]
    for form in forms(part, sought):
        if isinstance(form, Shape):
            # [3, 8] may be one region or a list of two: where lists are allowed, it is a list.
            if not ways and not isinstance(value, dict):
                yield holder, key
        elif isinstance(value, dict) and any(form is each for each in sought):
            yield holder, key
    for step, inner in ways:
        yield from _below(sought, inner, value, step)


def _inner(form: object, step: object) -> object:
    """Return the part of a form for a key or an index; None if it has none."""
    if isinstance(form, type) and issubclass(form, Table):
        return form.known[step].shape if isinstance(step, str) and step in form.known else None
    schema = form if isinstance(form, Mapping) else {}
    return schema.get("items" if isinstance(step, int) else "additionalProperties") or None
