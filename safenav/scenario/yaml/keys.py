"""Declarations of a YAML language: annotated frozen classes, with a class for each mapping and a
field for each key. Also the JSON Schema of its documents.

Annotations: ``int``, ``float``, ``str``, ``bool``, ``Literal``, ``StrEnum``, ``X | Y``, lists
(``tuple[X, ...]``), pairs (``tuple[X, Y]``), mappings (``dict[Scalar, X]`` or ``dict[str, X]``),
``Scalar`` (a text with its place), a ``Part``, and ``Raw`` values. A ``Key``, in ``Annotated`` or
in place of a default, describes and limits a value.
"""

from __future__ import annotations

import json
import re
import types
from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from functools import cache
from inspect import cleandoc
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from msgspec import NODEFAULT, Meta, Struct, StructMeta
from msgspec.structs import fields, replace

from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Scalar, clipped
from safenav.strict_json import MOST_NUMBER

if TYPE_CHECKING:
    from safenav.scenario.yaml.findings import Findings

MOST = 2**31 - 1
"""The default maximum of whole numbers."""
MOST_OF_A_NAME = 100
NAME = "[A-Za-z_][A-Za-z0-9_-]{0,99}"
IDENTIFIER = "[A-Za-z_][A-Za-z0-9_]{0,99}"
"""The form of names that become variables of specifications."""

Check = Callable[[Any, Node, str, "Findings"], Any]
"""A function of a value, its node and its name. It returns the value, changed if necessary; None
after a reported error."""


class Key(Struct, frozen=True, eq=False):
    """Description and limits of a value.

    ``about``: its meaning; ``required``: the hint if it is missing, or an example that continues
    ``about``; ``least``, ``most``, ``above``: limits of a number, ``why``: the hint beside them;
    ``entries``: the minimum number of items; ``expected``: its type in messages; ``example``: an
    example of a mapping; ``check``: a further check, or a conversion from the form; ``schema``: its
    additions to the JSON Schema; ``form``: the form of the value in a document, an annotation or a
    JSON Schema; ``by``: the method of the findings that looks up the value, a name or a place;
    ``without``: members of an enumeration, or keys, that it cannot have; ``default``: the value if
    it is missing, ``like``: the field that has it; ``own``: whether it is not a key, but the item's
    name in the mapping that contains it.

    The function ``entries`` adds the other fields for a key of a class: ``field``, spelling
    (``word``) and annotation.
    """

    about: str = ""
    required: str = ""
    least: float | None = None
    most: float | None = None
    above: float | None = None
    why: str = ""
    entries: int = 0
    expected: str = ""
    example: str = ""
    check: Check | None = None
    schema: Mapping[str, object] = {}
    form: Any = None
    by: str = ""
    without: tuple[str, ...] = ()
    default: Any = None
    like: str = ""
    own: bool = False
    field: str = ""
    word: str = ""
    annotation: Any = None

    @property
    def described(self) -> str:
        """The meaning of the key and its default."""
        value = str(self.default).lower() if isinstance(self.default, bool) else self.default
        plain = isinstance(value, str | int | float) and value != ""
        default = f"Default: {f'{value:g}' if isinstance(value, float) else value}."
        return " ".join(filter(None, (self.about, default if plain else "")))

    def range(self, kind: type) -> tuple[float, float]:
        """Return the minimum and maximum number, by default those of traces."""
        least, most = (0, MOST) if kind is int else (-MOST_NUMBER, MOST_NUMBER)
        return least if self.least is None else self.least, most if self.most is None else self.most

    @property
    def hint(self) -> str:
        """The hint of the message about a missing key."""
        what = f"{self.about[:1].lower()}{self.about[1:-1]}, "
        return (what if self.required.startswith("for example") else "") + self.required


def key(about: str = "", required: str = "", **rest: Any) -> Any:
    """Return a key to be written in place of a field's default."""
    return Key(about, required, **rest)


def name_key(
    what: str,
    *,
    identifier: bool = False,
    taken: frozenset[str] = frozenset(),
    prefixes: tuple[str, ...] = (),
    reserved: str = "is reserved",
    why: str = "use another name",
) -> Key:
    """Return the key of a name for ``what``. ``identifier``: without hyphens; ``taken``,
    ``prefixes``: reserved words and beginnings; ``reserved``, ``why``: their error and remedy."""
    pattern, signs = (IDENTIFIER, "digits and '_'") if identifier else (NAME, "digits, '_' and '-'")

    def check(word: Any, node: Node, _what: str, findings: Findings) -> Any:
        assert isinstance(node, Scalar)
        text = node.text
        if not re.fullmatch(pattern, text):
            hint = f"use letters from a to z, {signs}, beginning with a letter or '_'"
            if len(text) > MOST_OF_A_NAME:
                hint = f"it has {len(text)} characters; use at most {MOST_OF_A_NAME}"
            elif not text.isascii():
                hint += ": specifications are ASCII; 'name' of the scenario may be any text"
            findings.add(node, f"'{clipped(text)}' cannot name {what}", hint)
            return None
        if text in taken or text.startswith(prefixes):
            findings.add(node, f"'{clipped(text)}' {reserved}", why)
            return None
        return word

    barred: list[object] = [{"enum": sorted(taken)}] if taken else []
    if prefixes:
        barred.append({"pattern": f"^({'|'.join(prefixes)})"})
    unless = {"not": {"anyOf": barred}} if barred else {}
    return Key(check=check, schema={"type": "string", "pattern": f"^{pattern}$", **unless})


class Raw(Struct, frozen=True):
    """A value for a later check: its node and its name in messages."""

    node: Node
    what: str


class OneOf(Struct, frozen=True):
    """Keys exactly one of which a mapping has (without ``several``, at least one). ``missing``: the
    hint if there is none; ``several``: the hint if there is more than one."""

    keys: tuple[str, ...]
    missing: str
    several: str = ""

    @property
    def schema(self) -> dict[str, object]:
        return {"oneOf" if self.several else "anyOf": [{"required": [key]} for key in self.keys]}


class Beside(Struct, frozen=True):
    """A key with a meaning only beside one of some other keys. If ``hint`` is empty, the class's
    reader reports the error."""

    key: str
    others: tuple[str, ...]
    hint: str = ""

    @property
    def schema(self) -> dict[str, object]:
        return {"dependentSchemas": {self.key: {"anyOf": [{"required": [o]} for o in self.others]}}}


class _TakesKeys(StructMeta):
    """The metaclass of classes with keys. It replaces each field's key by the key's default. Except
    in an ``Item``, a field has no default if its key is required or has a ``like``."""

    def __new__(
        cls, name: str, bases: tuple[type, ...], members: dict[str, Any], **config: Any
    ) -> Any:
        keys = {field: key for field, key in members.items() if isinstance(key, Key)}
        for field, key in keys.items():
            members[field] = key.default
            if (key.required or key.like) and not issubclass(bases[0], Item):
                del members[field]
        return super().__new__(cls, name, bases, {**members, "keys": keys}, **config)


class Part(Struct, metaclass=_TakesKeys, frozen=True):
    """A mapping in a document that becomes data of this class if it has no error.

    ``rules``: dependencies between keys; ``example``: for messages; ``elsewhere``: hints for keys
    that it lacks; ``open``: whether it may have other keys; ``spelled``: keys that are not spelled
    like their fields. ``one`` names an item of a list or a mapping in messages, ``label`` follows a
    key: {what} is the item, {rest} that without its first word, {name} its number or key, {type}
    the text of its key ``type``; ``title``: a schema's title.
    """

    keys: ClassVar[Mapping[str, Key]] = {}
    rules: ClassVar[tuple[OneOf | Beside, ...]] = ()
    example: ClassVar[str] = ""
    elsewhere: ClassVar[Mapping[str, str]] = {}
    spelled: ClassVar[Mapping[str, str]] = {}
    open: ClassVar[bool] = False
    one: ClassVar[str] = "an item of {what}"
    label: ClassVar[str] = "of {what}"
    title: ClassVar[str] = ""

    def flaws(self) -> Iterable[tuple[str, str, str]]:
        """Return keys with contradictory values, each with the error and a remedy."""
        return ()


class Item(Part, frozen=True, kw_only=True):
    """A part that is readable even with errors: a field is None if its key was reported, or is
    missing and has no default. ``node``: the mapping; ``of``: the words after its keys in messages;
    ``flawed``: whether an error in it was reported."""

    node: document.Mapping
    of: str
    flawed: bool = False

    def at(self, key: str) -> Node | None:
        """Return the node of a key's value for diagnostics; None if the key is missing."""
        return self.node.get(key)

    def named(self, key: str) -> str:
        """Return the name of a value in messages."""
        return f"'{key}' {self.of}".rstrip()


@cache
def entries(kind: type[Part]) -> Mapping[str, Key]:
    """Return the keys of a class by their spelling in documents."""
    found = {}
    for each in fields(kind):
        default = each.default if each.default_factory is NODEFAULT else None
        key = kind.keys.get(each.name) or replace(key_of(each.type), default=default)
        if each.name not in Item.__struct_fields__ and not key.own:
            word = kind.spelled.get(each.name, each.name.rstrip("_"))
            found[word] = replace(key, field=each.name, word=word, annotation=each.type)
    return found


@cache
def key_of(annotation: Any, outer: Key | None = None) -> Key:
    """Return the key of an annotation or the key ``outer``, with the limits of a ``Meta``."""
    parts = get_args(annotation)[1:] if get_origin(annotation) is Annotated else ()
    key = next((each for each in parts if isinstance(each, Key)), outer or _PLAIN_KEY)
    for each in parts:
        if isinstance(each, Meta) and key.least is None:
            key = replace(key, least=each.ge, most=each.le if key.most is None else key.most)
    return key


_PLAIN_KEY = Key()
OwnName = Annotated[str, Key(own=True)]
"""The name of an item: its key in the mapping that contains it."""


def version(number: int, file: str, mark: str) -> Any:
    """Return the key of a format's version: ``safenav: 1``."""

    def check(value: int, node: Node, _what: str, findings: Findings) -> int:
        if value != number:
            found = f"version {value} of the {file} format is unknown"
            findings.add(node, found, f"this safenav reads '{mark}: {number}'")
        return value

    needed = f"begin the file with '{mark}: {number}', the version of its format"
    about = "Version of the format."
    return Key(about, needed, least=-MOST, check=check, schema={"const": number})


def schema_text(root: type[Item]) -> str:
    """Return the JSON Schema (draft 2020-12) of documents of a class, as JSON text. It describes
    only their shape, so it accepts a region in a wall or an unknown robot model."""
    definitions: dict[str, Any] = {}
    schema(root, definitions)
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": root.title,
        **definitions.pop(_definition(root)),
        "$defs": dict(sorted(definitions.items())),
    }
    return json.dumps(whole, indent=2, ensure_ascii=False) + "\n"


def schema(annotation: Any, definitions: dict[str, Any], key: Key | None = None) -> Any:
    """Return the JSON Schema of an annotation, or a schema (a dict) unchanged. Classes become
    definitions."""
    if isinstance(annotation, dict):
        return annotation
    origin, arguments = get_origin(annotation), get_args(annotation)
    key = key_of(annotation, key)
    found: dict[str, Any]
    if origin is Annotated:
        found = schema(arguments[0] if key.form is None else key.form, definitions, key)
        about = {"description": key.about} if key.about else {}
        return {**about, **found, **key.schema}
    if origin in (Union, types.UnionType):
        choices = [schema(a, definitions, key) for a in arguments if a is not types.NoneType]
        return choices[0] if len(choices) == 1 else {"anyOf": choices}
    if origin is frozenset or (origin is tuple and arguments[-1] is Ellipsis):
        few = {"minItems": key.entries} if key.entries else {}
        return {"type": "array", **few, "items": schema(arguments[0], definitions)}
    if origin is tuple:
        items = [schema(a, definitions) for a in arguments]
        return {"type": "array", "prefixItems": items, "items": False, "minItems": len(items)}
    if origin is dict:
        found = {"type": "object", "additionalProperties": schema(arguments[1], definitions)}
        if get_origin(arguments[0]) is Annotated:
            found["propertyNames"] = schema(arguments[0], definitions)
        return found
    if origin is Literal:
        return {"enum": list(arguments)}
    if annotation in (int, float):
        least, most = key.range(annotation)
        limits = {"minimum": least, "maximum": most, "exclusiveMinimum": key.above}
        known = {n: limit for n, limit in limits.items() if limit is not None}
        return {"type": "integer" if annotation is int else "number", **known}
    if annotation is bool:
        return {"type": "boolean"}
    if annotation in (str, Scalar):
        return {"type": "string", "pattern": "\\S"}
    if issubclass(annotation, StrEnum):
        return {"enum": [member.value for member in annotation if member not in key.without]}
    assert issubclass(annotation, Part)
    return _defined(annotation, definitions)


def _defined(kind: type[Part], definitions: dict[str, Any]) -> dict[str, Any]:
    """Return a reference to the definition of a class. Add a new definition."""
    name = _definition(kind)
    if name not in definitions:
        definitions[name] = {}
        about = cleandoc(kind.__doc__ or "").partition("\n\n")[0].replace("\n", " ")
        described = {"description": about.replace("``", "")} if about else {}
        properties = {}
        for key in entries(kind).values():
            own = {"description": key.described} if key.described else {}
            part = schema(key.annotation, definitions, key)
            # the key's description replaces that of its class
            properties[key.word] = own | part | own | dict(key.schema)
        needed = [key.word for key in entries(kind).values() if key.required]
        definitions[name] = {
            **described,
            "type": "object",
            "properties": properties,
            "additionalProperties": False,
            **({"required": needed} if needed else {}),
            **({"allOf": [rule.schema for rule in kind.rules]} if kind.rules else {}),
        }
    return {"$ref": f"#/$defs/{name}"}


def _definition(kind: type[Part]) -> str:
    name = kind.__name__.removesuffix("Keys")
    return name[:1].lower() + name[1:]
