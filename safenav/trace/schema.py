"""The JSON Schema of a line of a trace, from the annotations of the records."""

from __future__ import annotations

import json
import types
from collections.abc import Mapping
from enum import StrEnum
from inspect import cleandoc
from typing import Annotated, Any, Union, get_args, get_origin

from msgspec import Struct

from safenav.trace.fields import annotations_of, entries
from safenav.trace.objective import EXAMPLE, Objective
from safenav.trace.records import KINDS, VERSION, Header

Schema = dict[str, Any]

_PLAIN: dict[Any, Schema] = {
    str: {"type": "string"},
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
    object: {},
}
_OBJECTIVE: Schema = {
    "description": f"An objective, such as {EXAMPLE}.",
    "type": "object",
    "minProperties": 1,
    "properties": {
        "form": {"const": "literal"},
        "avoid": {"type": "array", "items": {"type": "integer"}},
        "always": {"type": "array", "items": {"type": "string"}},
    },
}


def trace_schema() -> Schema:
    """The schema (draft 2020-12) that every line of a trace meets.

    Lines of other types, and fields that are not named here, are to be ignored by readers; so
    the schema allows them.
    """
    definitions: dict[str, Schema] = {"Objective": _OBJECTIVE}
    lines = []
    for name, kind in KINDS.items():
        _define(kind, definitions, name)
        line = {"$ref": f"#/$defs/{kind.__name__}"}
        lines.append({"if": {"properties": {"type": {"const": name}}}, "then": line})
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"A line of a safenav trace, version {VERSION}",
        "type": "object",
        "required": ["type"],
        "properties": {"type": {"type": "string"}},
        "allOf": lines,
        "$defs": dict(sorted(definitions.items())),
    }


def schema_text() -> str:
    """The schema as it is published."""
    return json.dumps(trace_schema(), indent=2) + "\n"


def _define(kind: Any, definitions: dict[str, Schema], name: str | None = None) -> Schema:
    if kind.__name__ not in definitions:
        definitions[kind.__name__] = {}
        listed = [e for e in entries(kind) if not (kind is Header and e.key == "tick")]
        hints = annotations_of(kind)
        properties = {entry.key: _schema(hints[entry.name], definitions) for entry in listed}
        if name is not None:
            properties = {"type": {"const": name}, **properties}
        definitions[kind.__name__] = {
            "description": " ".join(cleandoc(kind.__doc__).split()),
            "type": "object",
            "required": [entry.key for entry in listed if not entry.optional],
            "properties": properties,
        }
    return {"$ref": f"#/$defs/{kind.__name__}"}


def _schema(annotation: Any, definitions: dict[str, Schema]) -> Schema:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        bound, plain = arguments[1], _schema(arguments[0], definitions)
        if bound.pattern is None:
            if bound.min_length is not None:
                return {**plain, "minItems": bound.min_length}
            return {**plain, "minimum": bound.ge}
        return {**plain, "pattern": f"^({bound.pattern})$"}
    if origin in (Union, types.UnionType):
        choices = [_schema(a, definitions) for a in arguments if a is not type(None)]
        null = [{"type": "null"}] if type(None) in arguments else []
        return {"anyOf": [*choices, *null]}
    if origin is tuple and arguments[-1] is not Ellipsis:
        items = [_schema(a, definitions) for a in arguments]
        count = len(items)
        return {"type": "array", "prefixItems": items, "minItems": count, "maxItems": count}
    if origin in (tuple, frozenset):
        return {"type": "array", "items": _schema(arguments[0], definitions)}
    if origin is not None and issubclass(origin, Mapping):
        return {"type": "object", "additionalProperties": _schema(arguments[1], definitions)}
    if annotation is Objective:
        return {"$ref": "#/$defs/Objective"}
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        return {"enum": [member.value for member in annotation]}
    if isinstance(annotation, type) and issubclass(annotation, Struct):
        return _define(annotation, definitions)
    return _PLAIN[annotation]
