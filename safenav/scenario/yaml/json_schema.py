"""The JSON Schema (draft 2020-12) of documents, from the annotations that ``typed`` reads."""

from __future__ import annotations

import json
import types
from collections.abc import Mapping
from enum import StrEnum
from inspect import cleandoc
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from msgspec import Struct

from safenav.scenario.yaml.document import Scalar
from safenav.scenario.yaml.keys import Key, NameForm, entries, key_of
from safenav.scenario.yaml.typed import whole_range


def schema_text(root: type[Struct], title: str) -> str:
    """Return the JSON Schema (draft 2020-12) of documents of a class, as JSON text."""
    definitions: dict[str, Any] = {}
    schema(root, definitions)
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        **definitions.pop(_definition(root)),
        "$defs": dict(sorted(definitions.items())),
    }
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def schema(annotation: Any, definitions: dict[str, Any], key: Key | None = None) -> Any:
    """Return the JSON Schema of an annotation, or of a schema with annotations inside. Classes
    become definitions."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    key = key_of(annotation) if origin is Annotated or key is None else key
    found: dict[str, Any]
    if isinstance(annotation, Mapping):
        return {name: schema(value, definitions) for name, value in annotation.items()}
    if isinstance(annotation, list | tuple):
        return [schema(value, definitions) for value in annotation]
    if origin is Annotated:
        found = schema(arguments[0] if key.form is None else key.form, definitions, key)
        about = {"description": key.about} if key.about else {}
        return {**about, **found, **key.schema}
    if origin in (Union, types.UnionType):
        choices = [schema(a, definitions, key) for a in arguments if a is not types.NoneType]
        return choices[0] if len(choices) == 1 else {"anyOf": choices}
    if origin is tuple and arguments[-1] is Ellipsis:
        few = {"minItems": key.entries} if key.entries else {}
        return {"type": "array", **few, "items": schema(arguments[0], definitions)}
    if origin is tuple:
        items = [schema(a, definitions) for a in arguments]
        return {"type": "array", "prefixItems": items, "items": False, "minItems": len(items)}
    if origin is dict:
        found = {"type": "object", "additionalProperties": schema(arguments[1], definitions)}
        for name in get_args(arguments[0])[1:]:
            declared = isinstance(name, NameForm)
            found["propertyNames"] = name.schema if declared else schema(arguments[0], definitions)
        return found
    if origin is Literal:
        return {"enum": list(arguments)}
    if not isinstance(annotation, type):
        return annotation
    if annotation is int:
        least, most = whole_range(key)
        return {"type": "integer", "minimum": least, "maximum": most}
    if annotation is float:
        limits = {"minimum": key.least, "maximum": key.most, "exclusiveMinimum": key.above}
        return {"type": "number", **{n: limit for n, limit in limits.items() if limit is not None}}
    if annotation is bool:
        return {"type": "boolean"}
    if annotation in (str, Scalar):
        return {"type": "string", "pattern": "\\S"}
    if issubclass(annotation, StrEnum):
        return {"enum": [member.value for member in annotation if member not in key.without]}
    assert issubclass(annotation, Struct)
    return _defined(annotation, definitions)


def _defined(kind: type[Struct], definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the reference to a class, which becomes a definition."""
    name = _definition(kind)
    if name not in definitions:
        definitions[name] = {}
        about = cleandoc(kind.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
        described = {"description": about.replace("``", "")} if about else {}
        properties = {}
        for key in entries(kind).values():
            own = {"description": key.described} if key.described else {}
            part = schema(key.annotation, definitions, key)
            properties[key.word] = {**own, **part, **key.schema}
        rules = getattr(kind, "rules", ())
        needed = [key.word for key in entries(kind).values() if key.required]
        definitions[name] = {
            **described,
            "type": "object",
            "properties": properties,
            "additionalProperties": False,
            **({"required": needed} if needed else {}),
            **({"allOf": [rule.schema for rule in rules]} if rules else {}),
        }
    return {"$ref": f"#/$defs/{name}"}


def _definition(kind: type[Struct]) -> str:
    name = kind.__name__.removesuffix("Keys")
    return name[:1].lower() + name[1:]
