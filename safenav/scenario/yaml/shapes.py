"""Shapes of values and tables of keys: the only description of a document's allowed contents.

Readers take values through a table; ``safenav.scenario.yaml.json_schema`` writes its JSON Schema.
A reader checks itself what depends on more than the value (a region of the map, a known model);
such a key returns its node.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from enum import StrEnum
from functools import partial
from typing import Any, ClassVar, Generic, Self, TypeVar, overload

from msgspec import Struct
from msgspec.structs import replace

from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping as MappingNode
from safenav.scenario.yaml.document import Node
from safenav.scenario.yaml.findings import Findings

T = TypeVar("T")
E = TypeVar("E", bound=StrEnum)
S = TypeVar("S", bound=Struct)

Schema = Mapping[str, object]
"""A JSON Schema (draft 2020-12) whose parts may be shapes and tables."""


class Shape(Struct, Generic[T], frozen=True):
    """Values of one form. ``schema``: a JSON Schema or a table. ``read`` returns the value of a
    node, or None if there is none or it was reported; its second argument names the item. ``name``
    and ``about``: name and description of its definition in the schema."""

    schema: object
    read: Callable[[Node | None, str, Any], T | None]
    name: str = ""
    about: str = ""


def form(schema: object, name: str = "", about: str = "") -> Shape[Node]:
    """Return the shape of a value that is read as its node."""
    return Shape(schema, lambda node, _what, _findings: node, name, about)


def whole(least: int = 0, most: int = read.MOST) -> Shape[int]:
    """Return the shape of a whole number from ``least`` to ``most``."""
    reads = partial(read.integer, least=least, most=most)
    return Shape({"type": "integer", "minimum": least, "maximum": most}, reads)


def word(known: Mapping[str, T]) -> Shape[T]:
    """Return the shape of one of some values, written as its word."""
    return Shape({"enum": tuple(known)}, partial(read.choice, known=known))


def by_word(options: Iterable[E]) -> dict[str, E]:
    """Return members of an enumeration by their words."""
    return {option.value: option for option in options}


def choice(options: Iterable[E]) -> Shape[E]:
    """Return the shape of one of some members of an enumeration, written as its word."""
    return word(by_word(options))


def many(items: object, least: int = 0) -> Schema:
    """Return the schema of a list of at least ``least`` items."""
    return {"type": "array", **({"minItems": least} if least else {}), "items": items}


def several(*items: object) -> Schema:
    """Return the schema of a list with one value of each of these shapes."""
    length = len(items)
    return {"type": "array", "prefixItems": items, "items": False, "minItems": length}


def matching(pattern: re.Pattern[str]) -> Schema:
    """Return the schema of a text that matches a pattern as a whole."""
    return {"type": "string", "pattern": f"^(?:{pattern.pattern})$"}


def named(values: object, names: Schema | None = None) -> Schema:
    """Return the schema of a mapping from names to values."""
    found = {"type": "object", "additionalProperties": values}
    return found if names is None else {**found, "propertyNames": names}


def either(*forms: object) -> Schema:
    """Return the schema of a value of one of several forms."""
    return {"anyOf": forms}


TEXT = Shape({"type": "string", "pattern": "\\S"}, read.text, "text")
TEXTS = Shape(many(TEXT), read.texts)
WORDS = Shape(many(TEXT), read.words)
TRUTH = Shape({"type": "boolean"}, read.boolean)
POSITIVE = Shape({"type": "number", "exclusiveMinimum": 0}, read.positive)
PROBABILITY = Shape({"type": "number", "minimum": 0, "maximum": 1}, read.probability)


class Key(Generic[T]):
    """A key of a table. As an attribute of an item it is the value of the key, or None if there is
    none or it was reported.

    ``about`` describes it; ``required`` is the hint if it is missing, or an example that continues
    ``about``; ``name`` is its spelling if Python reserves that word.
    """

    def __init__(
        self, shape: Shape[T], about: str = "", *, required: str = "", name: str = ""
    ) -> None:
        self.shape = shape
        self.about = about
        self.required = required
        self.name = name

    @property
    def hint(self) -> str:
        """The hint of the message about a missing key."""
        what = f"{self.about[:1].lower()}{self.about[1:-1]}, "
        return (what if self.required.startswith("for example") else "") + self.required

    def __set_name__(self, table: type[Table], name: str) -> None:
        self.name = self.name or name

    @overload
    def __get__(self, item: None, table: type[Table]) -> Key[T]: ...

    @overload
    def __get__(self, item: Table, table: type[Table]) -> T | None: ...

    def __get__(self, item: Table | None, table: type[Table]) -> Key[T] | T | None:
        if item is None:
            return self
        return self.shape.read(item.where(self), f"'{self.name}' {item.of}".rstrip(), item.findings)


class Table:
    """A mapping with known keys; an instance is such a mapping in a document.

    ``made``: the structure that it fills, whose fields of the same names have the defaults.
    ``rules``: the part of its JSON Schema beside its keys. ``definition``: its name there.
    ``example``: an example for messages. A subclass has the keys of its base, and ``more``.
    """

    about: ClassVar[str] = ""
    definition: ClassVar[str] = ""
    example: ClassVar[str] = ""
    made: ClassVar[type[Struct] | None] = None
    rules: ClassVar[Schema] = {}
    known: ClassVar[Mapping[str, Key[Any]]] = {}
    needed: ClassVar[tuple[Key[Any], ...]] = ()

    def __init_subclass__(cls, more: Iterable[Key[Any]] = ()) -> None:
        own = [*more, *(value for value in vars(cls).values() if isinstance(value, Key))]
        cls.known = {**cls.known, **{key.name: key for key in own}}
        cls.needed = tuple(key for key in cls.known.values() if key.required)

    def __init__(self, node: MappingNode, of: str, findings: Findings) -> None:
        self.node = node
        self.of = of
        self.findings = findings

    @classmethod
    def read(
        cls,
        node: Node | None,
        what: str,
        findings: Findings,
        of: str | None = None,
        elsewhere: Mapping[str, str] | None = None,
    ) -> Self | None:
        """Return the item of a node; report unknown and missing keys. ``of``: follows a key in
        messages, such as ``of until``; ``elsewhere``: hints for keys that belong in another
        mapping."""
        required = {key.name: key.hint for key in cls.needed}
        replaced = ((path.rpartition("."), hint) for path, hint in read.REPLACED.items())
        hints = {key: hint for (table, _, key), hint in replaced if table == cls.definition}
        hints |= elsewhere or {}
        found = read.mapping(node, what, findings, cls.known, required, hints, cls.example)
        return None if found is None else cls(found, f"of {what}" if of is None else of, findings)

    @classmethod
    def each(
        cls, node: Node | None, listing: str, what: str, findings: Findings, of: str | None = None
    ) -> Iterator[Self]:
        """Yield the readable items of a list; the other arguments as for ``read``."""
        for part in read.sequence(node, listing, findings) or ():
            item = cls.read(part, what, findings, of)
            if item is not None:
                yield item

    @classmethod
    def fill(
        cls, node: Node | None, what: str, findings: Findings, default: S, of: str | None = None
    ) -> S:
        """Read an item and return the default with its values."""
        item = cls.read(node, what, findings, of)
        return default if item is None else item.over(default)

    @classmethod
    def filling(cls, default: S) -> Shape[S]:
        """Return the shape of items that are read by ``fill``."""
        return Shape(
            cls, lambda node, what, found: cls.fill(node, what.strip("' "), found, default)
        )

    def over(self, default: S) -> S:
        """Return the default with the values of this item."""
        return replace(default, **self.given(*self.known.values()))

    def given(self, *keys: Key[Any]) -> dict[str, Any]:
        """Return the values of those ``keys`` that have one, by name."""
        found = ((key.name, key.__get__(self, type(self))) for key in keys)
        return {name: value for name, value in found if value is not None}

    def where(self, key: Key[Any]) -> Node | None:
        """Return the node of a key, for diagnostics; None if it is missing."""
        return self.node.get(key.name)


def values_of(sought: Collection[object], root: object, data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the container and the key or index of each value of a sought shape or table in data
    (mappings, lists, scalars) of the shape ``root``. Data of another form is skipped."""
    yield from _below(sought, root, {"": data}, "")


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
    found = [(s, i) for f in forms(part, sought) for s in steps if (i := _inner(f, s)) is not None]
    for form in forms(part, sought):
        if isinstance(form, Shape):
            # [3, 8] may be one region or a list of two: where lists are allowed, it is a list.
            if not found and not isinstance(value, dict):
                yield holder, key
        elif isinstance(value, dict) and any(form is each for each in sought):
            yield holder, key
    for step, inner in found:
        yield from _below(sought, inner, value, step)


def _inner(form: object, step: object) -> object:
    """Return the part of a form for a key or an index; None if it has none."""
    if isinstance(form, type) and issubclass(form, Table):
        return form.known[step].shape if isinstance(step, str) and step in form.known else None
    schema = form if isinstance(form, Mapping) else {}
    return schema.get("items" if isinstance(step, int) else "additionalProperties") or None
