"""Declarations of the language of a YAML document: the annotations of frozen classes, a class for
each mapping, a field for each key.

Annotations: ``int``, ``float``, ``str``, ``bool``, ``Literal``, ``StrEnum``, ``X | Y``, lists
(``tuple[X, ...]``), pairs (``tuple[X, Y]``), mappings (``dict[Scalar, X]`` or ``dict[str, X]``),
``Scalar`` (a text with its place), frozen classes, and ``Raw`` values. A ``Key``, in ``Annotated``
or in place of a default, describes and limits a value.
"""

from __future__ import annotations

import re
import types
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from msgspec import NODEFAULT, Struct
from msgspec.structs import replace

from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Scalar, clipped

if TYPE_CHECKING:
    from safenav.scenario.yaml.findings import Findings

MOST = 2**31 - 1
"""The largest whole number unless a key sets another limit."""
MOST_OF_A_NAME = 100
NAME = "[A-Za-z_][A-Za-z0-9_-]{0,99}"
IDENTIFIER = "[A-Za-z_][A-Za-z0-9_]{0,99}"
"""The form of names that become variables of specifications."""

Check = Callable[[Any, Node, str, "Findings"], Any]
"""Returns the value that was read (with its node and name), changed if need be; None after it
reported an error."""


class Key(Struct, frozen=True, eq=False):
    """Description and limits of a value.

    ``about``: its meaning; ``required``: the hint if it is missing, or an example that continues
    ``about``; ``least``, ``most``, ``above``: limits of a number, ``why``: the hint beside them;
    ``entries``: the least number of items; ``expected``: in messages; ``example``: of a mapping;
    ``check``: a further check, ``schema``: what it adds to the JSON Schema; ``form``: the form of
    the value in a document, an annotation or a JSON Schema; ``by``: the method of the findings that
    returns the value, which looks up a name or a place; ``without``: members of an enumeration that
    it cannot have; ``default``: the value if it is missing.

    ``entries`` fills the rest for a key of a class: its ``field``, its spelling (``word``), its
    annotation, whether its value is a ``part`` of the document: an item or several.
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
    field: str = ""
    word: str = ""
    annotation: Any = None
    part: bool = False

    @property
    def described(self) -> str:
        """Its meaning, with its default."""
        value = self.default
        shown = {True: "true", False: "false"}.get(value, value) if type(value) is bool else value
        plain = isinstance(value, str | int | float) and value != ""
        default = f"Default: {f'{shown:g}' if isinstance(shown, float) else shown}."
        return " ".join(filter(None, (self.about, default if plain else "")))

    @property
    def hint(self) -> str:
        """The hint of the message about a missing key."""
        what = f"{self.about[:1].lower()}{self.about[1:-1]}, "
        return (what if self.required.startswith("for example") else "") + self.required


def key(about: str = "", required: str = "", **rest: Any) -> Any:
    """Return a key in place of the default of a field."""
    return Key(about, required, **rest)


class NameForm(Struct, frozen=True):
    """Names that a file declares, for ``what``. ``identifier``: without hyphens; ``taken`` and
    ``prefixes``: reserved words and beginnings of names; ``reserved``, ``why``: the message."""

    what: str
    identifier: bool = False
    taken: frozenset[str] = frozenset()
    prefixes: tuple[str, ...] = ()
    reserved: str = "is reserved"
    why: str = "use another name"

    @property
    def pattern(self) -> str:
        """The form of such a name, as a regular expression."""
        return IDENTIFIER if self.identifier else NAME

    def check(self, key: Scalar, findings: Findings) -> bool:
        """Return whether a key can be such a name; report it if not."""
        if not re.fullmatch(self.pattern, key.text):
            signs = "digits and '_'" if self.identifier else "digits, '_' and '-'"
            hint = f"use letters from a to z, {signs}, beginning with a letter"
            if len(key.text) > MOST_OF_A_NAME:
                hint = f"it has {len(key.text)} characters; use at most {MOST_OF_A_NAME}"
            elif not key.text.isascii():
                hint += ": specifications are ASCII; 'name' of the scenario may be any text"
            findings.add(key, f"'{clipped(key.text)}' cannot name {self.what}", hint)
            return False
        if key.text in self.taken or (self.prefixes and key.text.startswith(self.prefixes)):
            findings.add(key, f"'{clipped(key.text)}' {self.reserved}", self.why)
            return False
        return True

    @property
    def schema(self) -> dict[str, object]:
        """The JSON Schema of such a name."""
        barred: list[object] = [{"enum": sorted(self.taken)}] if self.taken else []
        if self.prefixes:
            barred.append({"pattern": f"^({'|'.join(self.prefixes)})"})
        unless = {"not": {"anyOf": barred}} if barred else {}
        return {"type": "string", "pattern": f"^{self.pattern}$", **unless}


class Raw(Struct, frozen=True):
    """A value that is checked later: its node, and its name in messages."""

    node: Node
    what: str


class OneOf(Struct, frozen=True):
    """Keys of which a mapping has exactly one; without ``several``, at least one. ``missing`` and
    ``several``: the hints if it has none, and beside another one."""

    keys: tuple[str, ...]
    missing: str
    several: str = ""

    @property
    def schema(self) -> dict[str, object]:
        return {"oneOf" if self.several else "anyOf": [{"required": [key]} for key in self.keys]}


class Beside(Struct, frozen=True):
    """A key that has a meaning only beside one of others."""

    key: str
    others: tuple[str, ...]
    hint: str

    @property
    def schema(self) -> dict[str, object]:
        return {"dependentSchemas": {self.key: {"anyOf": [{"required": [o]} for o in self.others]}}}


class Item(Struct, frozen=True, kw_only=True):
    """A mapping in a document; a field without a default is None if its key is missing or was
    reported.

    ``node``, ``of``: the mapping, and what follows its keys in messages; ``flawed``: an error in it
    was reported. ``rules``: which keys need others; ``example``: for messages;
    ``elsewhere``: hints for keys that it does not have; ``open``: other keys are allowed. ``one``
    names an item of a list or a mapping in messages, ``label`` follows a key: {what} is the item,
    {rest} that without its first word, {name} its number or key, {type} the text of its key
    ``type``.
    """

    rules: ClassVar[tuple[OneOf | Beside, ...]] = ()
    example: ClassVar[str] = ""
    elsewhere: ClassVar[Mapping[str, str]] = {}
    open: ClassVar[bool] = False
    one: ClassVar[str] = "an item of {what}"
    label: ClassVar[str] = "of {what}"
    node: document.Mapping
    of: str
    flawed: bool = False

    def at(self, key: str) -> Node | None:
        """Return the node of a key, for diagnostics; None if it is missing."""
        return self.node.get(key)

    def named(self, key: str) -> str:
        """Name a value for messages."""
        return f"'{key}' {self.of}".rstrip()


@cache
def entries(kind: type[Struct]) -> Mapping[str, Key]:
    """Return the keys of a class, by their spelling."""
    hints = get_type_hints(kind, include_extras=True)
    fields = [f for f in kind.__struct_fields__ if not (issubclass(kind, Item) and f in _OWN)]
    backwards = zip(
        reversed(kind.__struct_fields__), reversed(kind.__struct_defaults__), strict=False
    )
    given = dict(backwards)
    found = {}
    for name in fields:
        annotation, default = hints[name], given.get(name, NODEFAULT)
        key = default if isinstance(default, Key) else replace(key_of(annotation), default=default)
        word = getattr(kind, "spelled", {}).get(name, name.rstrip("_"))
        part = any(map(_is_item, _inside(annotation)))
        found[word] = replace(key, field=name, word=word, annotation=annotation, part=part)
    return found


_OWN = ("node", "of", "flawed")


def key_of(annotation: Any) -> Key:
    """Return the key of an annotation."""
    return next((k for k in get_args(annotation)[1:] if isinstance(k, Key)), _PLAIN_KEY)


_PLAIN_KEY = Key()


def _is_item(annotation: Any) -> bool:
    return (
        isinstance(annotation, type)
        and issubclass(annotation, Struct)
        and not issubclass(annotation, Raw | Scalar)
    )


def _inside(annotation: Any) -> Iterator[Any]:
    """Yield an annotation and, for unions, lists and mappings, the annotations inside."""
    if key_of(annotation).by:
        return  # looked up, not read
    yield annotation
    if get_origin(annotation) in (Annotated, Union, types.UnionType, tuple, dict):
        for part in get_args(annotation):
            yield from _inside(part)


def version(number: int, file: str, mark: str) -> Any:
    """Return the key of the version of a format: ``safenav: 1``."""

    def check(value: int, node: Node, _what: str, findings: Findings) -> int:
        if value != number:
            found = f"version {value} of the {file} format is unknown"
            findings.add(node, found, f"this safenav reads '{mark}: {number}'")
        return value

    needed = f"begin the file with '{mark}: {number}', the version of its format"
    about = "Version of the format."
    return Key(about, needed, least=-MOST, check=check, schema={"const": number})
