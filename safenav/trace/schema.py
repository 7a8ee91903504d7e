"""The JSON Schema of a trace's lines, from the annotations of the records."""

import json
from inspect import cleandoc
from typing import Any

import msgspec

from safenav.trace.fields import EXAMPLE
from safenav.trace.records import KINDS, VERSION

Schema = dict[str, Any]

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
    """Return the schema (draft 2020-12) that every line of a trace matches.

    Readers must ignore notes of other types and other fields, so the schema allows them.
    """
    _, definitions = msgspec.json.schema_components(
        KINDS.values(), schema_hook=_hook, ref_template="#/$defs/{name}"
    )
    for kind in KINDS.values():
        del definitions[kind.__name__]["properties"]["line"]
        about = definitions[kind.__name__]
        about["properties"]["note"] = {"const": True} if kind.note else False
        about["required"] += ["note"] if kind.note else []
    header = definitions["Header"]
    header["required"].remove("tick")
    del header["properties"]["tick"]
    for definition in definitions.values():
        if "description" in definition:
            definition["description"] = " ".join(cleandoc(definition["description"]).split())
    lines = [
        {
            "if": {"properties": {"type": {"const": name}}},
            "then": {"$ref": f"#/$defs/{kind.__name__}"},
        }
        for name, kind in KINDS.items()
    ]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"A line of a safenav trace, version {VERSION}",
        "type": "object",
        "required": ["type"],
        "properties": {"type": {"type": "string"}},
        "if": {"properties": {"type": {"enum": [*KINDS]}}},
        "else": {"properties": {"note": {"const": True}}, "required": ["note"]},
        "allOf": lines,
        "$defs": dict(sorted(definitions.items())),
    }


def _hook(kind: type) -> Schema:
    return {"description": "Any value."} if kind is object else _OBJECTIVE


def schema_text() -> str:
    """Return the text of the published schema."""
    return json.dumps(trace_schema(), indent=2) + "\n"
