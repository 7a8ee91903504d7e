"""Typed reading of YAML documents: the annotations of frozen classes are the language of a file.

``read`` returns the value of a node, or None after it reported why there is none; it continues
after an error, so that one error does not hide another. ``json_schema`` writes the JSON Schema of
the same annotations: ``int``, ``float``, ``str``, ``bool``, ``Literal``, ``StrEnum``, ``X | Y``,
lists (``tuple[X, ...]``), pairs (``tuple[X, Y]``), mappings (``dict[Scalar, X]`` or ``dict[str,
X]``), ``Scalar`` (a text with its place), frozen classes (a mapping with a key for each field), and
``Raw`` values. A ``Key``, in ``Annotated`` or in place of a default, describes and limits a value.
"""

from __future__ import annotations

import math
import re
import types
from collections.abc import Callable, Iterator, Mapping
from enum import StrEnum
from functools import cache
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin, get_type_hints

from msgspec import NODEFAULT, Struct
from msgspec.structs import replace

from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import (
    Findings,
    as_meant,
    is_nothing,
    listed,
    suggestion,
    wrong_type,
)

MOST = 2**31 - 1
"""The largest whole number unless a key sets another limit."""
MOST_OF_A_NAME = 100
NAME = "[A-Za-z_][A-Za-z0-9_-]{0,99}"
IDENTIFIER = "[A-Za-z_][A-Za-z0-9_]{0,99}"
"""The form of names that become variables of specifications."""

Check = Callable[[Any, Node, str, Findings], Any]
"""Returns the value that was read (with its node and name), changed if need be; None after it
reported an error."""


class Key(Struct, frozen=True, eq=False):
    """Description and limits of a value.

    ``about``: its meaning; ``required``: the hint if it is missing, or an example that continues
    ``about``; ``least``, ``most``, ``above``: limits of a number, ``why``: the hint beside them;
    ``entries``: the least number of items; ``expected``: in messages; ``example``: of a mapping;
    ``check``: a further check, ``schema``: what it adds to the JSON Schema; ``form``: the form of a
    raw value, an annotation or a JSON Schema; ``default``: the value if it is missing.

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


class Item(Struct, frozen=True, kw_only=True):
    """A mapping in a document; a field without a default is None if its key is missing or was
    reported.

    ``node``, ``of``: the mapping, and what follows its keys in messages; ``flawed``: an error in it
    was reported. ``rules``: the part of its JSON Schema beside its keys; ``example``: for messages;
    ``elsewhere``: hints for keys that it does not have; ``open``: other keys are allowed. ``one``
    names an item of a list or a mapping in messages, ``label`` follows a key: {what} is the item,
    {rest} that without its first word, {name} its number or key, {type} the text of its key
    ``type``.
    """

    rules: ClassVar[Mapping[str, object]] = {}
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
    yield annotation
    if get_origin(annotation) in (Annotated, Union, types.UnionType, tuple, dict):
        for part in get_args(annotation):
            yield from _inside(part)


def read(
    annotation: Any, node: Node | None, what: str, findings: Findings, key: Key | None = None
) -> Any:
    """Return the value of a node; None if there is none, or it was reported. ``what`` names it in
    messages; ``key`` describes it."""
    if node is None:
        return None
    origin, arguments = get_origin(annotation), get_args(annotation)
    key = key_of(annotation) if origin is Annotated or key is None else key
    if origin is Annotated:
        value = read(arguments[0], node, what, findings, key)
        for each in arguments[1:]:
            if isinstance(each, Key) and each.check is not None and value is not None:
                value = each.check(value, node, what, findings)
        return value
    if origin in (Union, types.UnionType):
        return _union([a for a in arguments if a is not types.NoneType], node, what, findings, key)
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return _list(arguments[0], node, what, findings, key)
        return _pair(arguments, node, what, findings, key)
    if origin is dict:
        return _mapping(arguments, node, what, findings, key)
    if origin is Literal:
        return _choice({str(a): a for a in arguments}, node, what, findings, key.why)
    if annotation in _PLAIN:
        return _PLAIN[annotation](node, what, findings, key)
    if issubclass(annotation, Raw):
        return annotation(node, what)
    if issubclass(annotation, Struct):
        return _item(annotation, node, what, findings)
    if issubclass(annotation, StrEnum):
        return _choice({member.value: member for member in annotation}, node, what, findings)
    raise TypeError(annotation)


def _item(kind: type[Struct], node: Node, what: str, findings: Findings) -> Any:
    if not isinstance(node, document.Mapping):
        example = getattr(kind, "example", "")
        hint = f"for example {example}" if example else ""
        wrong_type(node, what, "a mapping (key: value)", findings, hint)
        return None
    known, before = entries(kind), len(findings)
    hints = getattr(kind, "elsewhere", {})
    meant = set[str]()
    if not getattr(kind, "open", False):
        node, meant = as_meant(node, what, known, hints, findings)
    of = _filled(getattr(kind, "label", Item.label), what, node)
    values: dict[str, Any] = {}
    for key in known.values():
        inner = node.get(key.word)
        if inner is None:
            if key.required and key.word not in meant:
                findings.add(node, f"{what}: the key '{key.word}' is missing", key.hint)
            continue
        title = f"{key.word if key.part else repr(key.word)} {of}".rstrip()
        value = read(key.annotation, inner, title, findings, key)
        if value is not None and key.check is not None:
            value = key.check(value, inner, title, findings)
        if value is not None:
            values[key.field] = value
    if issubclass(kind, Item):
        defaults = {key.field: key.default for key in known.values()}
        flawed = len(findings) > before
        return kind(node=node, of=of, flawed=flawed, **{**defaults, **values})
    needed = {key.field for key in known.values() if key.default is NODEFAULT}
    return kind(**values) if needed <= values.keys() else None


def _filled(form: str, what: str, node: Node | None = None, name: str = "") -> str:
    """Return a name for messages, from its form in a class."""
    words = {"what": what, "rest": what.partition(" ")[2], "name": name}
    for field in re.findall(r"{(\w+)}", form):
        if field not in words:
            value = document.below(node, field)
            text = value.value if isinstance(value, Scalar) else None
            words[field] = clipped(text) if isinstance(text, str) and text else what
    return form.format(**words)


def _list(inner: Any, node: Node, what: str, findings: Findings, key: Key) -> Any:
    items = sequence(node, what, findings)
    if items is None:
        return None
    if len(items) < key.entries:
        least = f"{what} is empty" if not items else f"{what}: at least {key.entries} are needed"
        findings.add(node, least, key.why)
    one = getattr(inner, "one", Item.one)
    found = (
        read(inner, item, _filled(one, what, name=str(number)), findings)
        for number, item in enumerate(items, 1)
    )
    return tuple(value for value in found if value is not None)


def sequence(node: Node, what: str, findings: Findings) -> tuple[Node, ...] | None:
    """Return the items of a list; None if that was reported."""
    if isinstance(node, Sequence):
        return node.items
    shown = clipped(node.text) if isinstance(node, Scalar) else ""
    if isinstance(node, document.Mapping) and all(is_nothing(value) for _, value in node.entries):
        shown = clipped(", ".join(key.text for key, _ in node.entries))
    hint = f"put brackets around it: [{shown}]" if shown else "begin each item with '- '"
    if shown in ("none", "nothing", "no"):
        hint = "for none, write []"
    wrong_type(node, what, "a list [...]", findings, hint)
    return None


def _pair(inner: tuple[Any, ...], node: Node, what: str, findings: Findings, key: Key) -> Any:
    if not isinstance(node, Sequence) or len(node.items) != len(inner):
        wrong_type(node, what, key.expected or f"a list of {len(inner)}", findings)
        return None
    items = zip(inner, node.items, strict=True)
    found = tuple(read(each, item, f"an item of {what}", findings) for each, item in items)
    return None if None in found else found


def _mapping(inner: tuple[Any, ...], node: Node, what: str, findings: Findings, key: Key) -> Any:
    if not isinstance(node, document.Mapping):
        hint = f"for example {key.example}" if key.example else ""
        wrong_type(node, what, "a mapping (key: value)", findings, hint)
        return None
    names = next((n for n in get_args(inner[0]) if isinstance(n, NameForm)), None)
    one = getattr(inner[1], "one", "'{name}' of {what}")
    found = {}
    for name, item in node.entries:
        label = _filled(one, what, name=clipped(name.text))
        value = read(inner[1], item, label, findings)
        if names is not None and not names.check(name, findings):
            value = replace(value, flawed=True) if isinstance(value, Item) else None
        if value is not None:
            found[name.text if inner[0] is str else name] = value
    return found


def _choice(
    known: Mapping[str, Any], node: Node, what: str, findings: Findings, why: str = ""
) -> Any:
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, what, f"one of {listed(known)}", findings)
        return None
    if node.value not in known:
        hint = "; ".join(filter(None, (suggestion(node.value, known), why)))
        findings.add(node, f"{what}: unknown word '{clipped(node.value)}'", hint)
    return known.get(node.value)


def _union(choices: list[Any], node: Node, what: str, findings: Findings, key: Key) -> Any:
    """Read the choice that has the form of the node: mapping, list, number, text."""
    fitting = choices if len(choices) == 1 else [c for c in choices if _fits(c, node)]
    if fitting:
        return read(fitting[0], node, what, findings, key)
    wrong_type(node, what, key.expected, findings)
    return None


def _fits(annotation: Any, node: Node) -> bool:
    origin = get_origin(annotation)
    if origin is Annotated:
        return _fits(get_args(annotation)[0], node)
    if origin is tuple:
        arguments = get_args(annotation)
        any_length = arguments[-1] is Ellipsis
        return isinstance(node, Sequence) and (any_length or len(node.items) == len(arguments))
    if origin is dict:
        return isinstance(node, document.Mapping)
    if origin is Literal:
        return isinstance(node, Scalar) and node.value in get_args(annotation)
    if issubclass(annotation, Raw):
        return True
    if issubclass(annotation, Struct) and annotation is not Scalar:
        return isinstance(node, document.Mapping)
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool):
        return annotation is bool
    kinds: Mapping[Any, Any] = {int: int, float: int | float, bool: bool}
    return isinstance(value, kinds.get(annotation, str))


def _number(node: Node, what: str, findings: Findings, key: Key) -> Any:
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        wrong_type(node, what, key.expected or "a number", findings)
        return None
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        wrong_type(node, what, "a finite number", findings)
        return None
    least = -math.inf if key.least is None else key.least
    most = math.inf if key.most is None else key.most
    limits = "" if least <= number <= most else f"from {max(least, 0):g} to {most:g}"
    if limits and key.most is None:
        limits = f"at least {least:g}"
    if key.above is not None and number <= key.above:
        limits = f"more than {key.above:g}"
    if limits:
        findings.add(node, f"{what} is {number:g}, and must be {limits}", key.why)
    return None if limits else number


def _integer(node: Node, what: str, findings: Findings, key: Key) -> Any:
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool) or not isinstance(value, int):
        wrong_type(node, what, "a whole number", findings)
        return None
    least, most = whole_range(key)
    limits = f"at least {least}" if value < least else f"at most {most}" if value > most else ""
    if limits:
        findings.add(node, f"{what} is {clipped(str(value))}, and must be {limits}", key.why)
    return None if limits else value


def whole_range(key: Key) -> tuple[int, int]:
    """Return the limits of a whole number."""
    least = 0 if key.least is None else int(key.least)
    return least, MOST if key.most is None else int(key.most)


def _text(node: Node, what: str, findings: Findings, _: Key) -> Any:
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, what, "a text", findings)
        return None
    if not node.value.strip():
        findings.add(node, f"{what} is empty")
        return None
    return node.value


def _truth(node: Node, what: str, findings: Findings, _: Key) -> Any:
    if not isinstance(node, Scalar) or not isinstance(node.value, bool):
        wrong_type(node, what, "true or false", findings)
        return None
    return node.value


_PLAIN: Mapping[Any, Callable[[Node, str, Findings, Key], Any]] = {
    int: _integer,
    float: _number,
    str: _text,
    bool: _truth,
    Scalar: lambda node, what, findings, key: node if _text(node, what, findings, key) else None,
}


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
