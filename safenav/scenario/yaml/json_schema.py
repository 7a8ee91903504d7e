"""The JSON Schema (draft 2020-12) of a document, generated from its tables."""

from __future__ import annotations

import json
from collections.abc import Mapping
from enum import StrEnum
from typing import Any

from msgspec.structs import fields

from safenav.scenario.yaml.shapes import Key, Shape, Table


def schema_text(root: type[Table], title: str) -> str:
    """Return the schema of documents described by a table, as JSON text."""
    definitions: dict[str, object] = {}
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **_table(root, definitions),
        "$defs": dict(sorted(definitions.items())),
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _written(part: object, definitions: dict[str, object]) -> object:
    """Return a part of a schema in JSON; shapes and tables with a name become definitions."""
    if isinstance(part, Shape):
        about = {"description": part.about} if part.about else {}
        return _defined(part.name, {**about, **_shape(part.schema, definitions)}, definitions)
    if isinstance(part, type) and issubclass(part, Table):
        return _defined(part.definition, _table(part, definitions), definitions)
    if isinstance(part, Mapping):
        return {key: _written(value, definitions) for key, value in part.items()}
    if isinstance(part, tuple | list):
        return [_written(value, definitions) for value in part]
    return part.value if isinstance(part, StrEnum) else part


def _shape(part: object, definitions: dict[str, object]) -> dict[str, object]:
    found = _written(part, definitions)
    assert isinstance(found, dict), "a shape is a mapping in JSON"
    return found


def _defined(name: str, schema: object, definitions: dict[str, object]) -> object:
    """Return the schema, or a reference to it if it has a name."""
    if not name:
        return schema
    definitions[name] = schema
    return {"$ref": f"#/$defs/{name}"}


def _table(table: type[Table], definitions: dict[str, object]) -> dict[str, object]:
    found: dict[str, object] = {"description": table.about} if table.about else {}
    found["type"] = "object"
    found["properties"] = {name: _key(key, table, definitions) for name, key in table.known.items()}
    found["additionalProperties"] = False
    if table.needed:
        found["required"] = [key.name for key in table.needed]
    return {**found, **_shape(table.rules, definitions)}


def _key(key: Key[Any], table: type[Table], definitions: dict[str, object]) -> object:
    shape = _shape(key.shape, definitions)
    about = _own(key, table)
    return {"description": about, **shape} if about else shape


def described(key: Key[Any], table: type[Table]) -> str:
    """Return the description of a key, or else that of its shape."""
    shape = key.shape
    inner = shape.about or getattr(shape.schema, "about", "")
    return _own(key, table) or inner


def _own(key: Key[Any], table: type[Table]) -> str:
    return " ".join(filter(None, (key.about, _default(key.name, table))))


def _default(name: str, table: type[Table]) -> str:
    """Return the default value of a key in words, from the structure that the table fills."""
    made = fields(table.made) if table.made is not None else ()
    default = next((field.default for field in made if field.encode_name == name), None)
    if isinstance(default, bool):
        default = "true" if default else "false"
    if isinstance(default, float):
        default = f"{default:g}"
    return f"Default: {default}." if isinstance(default, str | int) else ""
