"""Untrusted YAML text as a tree of nodes with their places.

PyYAML's events, not its composer, build the tree: nesting, size and the expansion of aliases are
bounded, every tag is refused (no object is ever constructed), and duplicate keys are reported.
Plain scalars follow the YAML 1.2 core schema, so ``no`` is a word and ``012`` is twelve.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from typing import Any

import yaml
from msgspec import Struct
from msgspec.structs import replace

from safenav.files import HINT, foreign_character, printable

MAX_DEPTH = 50
_TOO_DEEP = f"nested more than {MAX_DEPTH} deep"
MAX_NODES = 100_000
"""Maximum number of nodes of a document. An alias counts with all its nodes."""

MAX_NUMBER_LENGTH = 100

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class Place(Struct, frozen=True):
    """Line and column, both from 1. ``file``: the file of a replacing value."""

    line: int = 1
    column: int = 1
    file: str = ""


class Scalar(Struct, frozen=True):
    """A number, truth value, null or text.

    ``text`` is as written; ``style`` is YAML's: empty for plain, the quote, or ``|`` and ``>`` for
    blocks. ``literal``: whether the text is on one line without escapes, so that its columns are
    columns of the line.
    """

    place: Place
    value: str | int | float | bool | None
    text: str
    style: str = ""
    literal: bool = False


class Sequence(Struct, frozen=True):
    place: Place
    items: tuple[Node, ...]


class Mapping(Struct, frozen=True):
    """A mapping with distinct keys of text. ``cut``: whether other keys were omitted."""

    place: Place
    entries: tuple[tuple[Scalar, Node], ...]
    cut: bool = False

    def get(self, key: str) -> Node | None:
        for name, node in self.entries:
            if name.value == key:
                return node
        return None


Node = Scalar | Sequence | Mapping

_KEYS = "keys are words; a list needs brackets: [3, 8]"


def below(node: Node | None, *keys: str) -> Node | None:
    """Return the node at a path of keys below another node; None if there is none."""
    for key in keys:
        node = node.get(key) if isinstance(node, Mapping) else None
    return node


def entries_of(node: Node | None) -> tuple[tuple[Scalar, Node], ...]:
    """Return the keys and values of a mapping, or an empty sequence for another node."""
    return node.entries if isinstance(node, Mapping) else ()


def items_of(node: Node | None) -> tuple[Node, ...]:
    """Return the items of a list, or an empty sequence for another node."""
    return node.items if isinstance(node, Sequence) else ()


def is_nothing(node: Node) -> bool:
    """Return whether a key has no value."""
    return isinstance(node, Scalar) and node.value is None


def reported(node: Node) -> Node:
    """Return a node in place of one whose errors were reported."""
    return Mapping(node.place, (), cut=True)


Entry = tuple[Scalar, Node]


def continued(last: Entry, key: Scalar, value: Node) -> tuple[Entry, str] | None:
    """Return None unless a key without a value continues the previous value (``region: 1, 3``).
    Otherwise return the previous entry, whose errors count as reported, and a hint (empty if the
    error was reported for an earlier key)."""
    name, before = last
    if not is_nothing(value) or name.place.line != key.place.line:
        return None
    if isinstance(before, Mapping):
        return (last, "") if before == reported(before) else None
    if not isinstance(before, Scalar) or before.value is None:
        return None
    items = clipped(f"{before.text}, {key.text}").strip("()")
    hint = f"if it belongs to '{clipped(name.text)}', write the list in brackets: [{items}]"
    if _THOUSANDS.fullmatch(f"{before.text},{key.text}"):
        hint = f"; {hint}" if key.text[0] != "0" else ""
        hint = f"write the number without a comma: {before.text}{key.text}{hint}"
    return (name, reported(before)), hint


_THOUSANDS = re.compile(r"-?[0-9]{1,3}(?:[ _,'][0-9]{3})+")


def without_separators(text: str) -> str:
    """Return a number such as ``1 000`` or ``1_000`` as ``1000``, any other text as ''."""
    return re.sub(r"[^-0-9]", "", text) if _THOUSANDS.fullmatch(text) else ""


def plain(node: Node) -> Any:
    """Return the data of a node as Python scalars, lists and dicts."""
    if isinstance(node, Scalar):
        return node.value
    if isinstance(node, Mapping):
        return {key.text: plain(item) for key, item in node.entries}
    return [plain(item) for item in node.items]


def node_of(data: Any, place: Place) -> Node:
    """Return plain data as a node. All nodes have the same place."""
    if isinstance(data, dict):
        entries = ((Scalar(place, k, k), node_of(item, place)) for k, item in data.items())
        return Mapping(place, tuple(entries))
    if isinstance(data, list | tuple):
        return Sequence(place, tuple(node_of(item, place) for item in data))
    return Scalar(
        place, data, "" if data is None else data if isinstance(data, str) else flow(data)
    )


class DocumentError(Exception):
    """An error that makes a file or text unusable: place (None: the whole text), description and
    remedy."""

    def __init__(self, place: Place | None, found: str, hint: str = "") -> None:
        self.place = place
        self.found = found
        self.hint = hint
        super().__init__(found)


class Document(Struct, frozen=True):
    """A tree, and errors in a readable text, as triples (place, found, hint)."""

    root: Node
    flaws: tuple[tuple[Place, str, str], ...] = ()


def read_document(text: str) -> Document:
    """Return the only document in ``text``. Raises DocumentError."""
    if (foreign := foreign_character(text)) is not None:
        line, column, found = foreign
        raise DocumentError(Place(line, column), f"not text: {found}", HINT)
    if (alike := _ALIKE.search(text)) is not None:
        line, column = text.count("\n", 0, alike.start(1)) + 1, len(alike[0])
        name = f"not a space or a hyphen, but the character U+{ord(alike[1]):04X}"
        hint = "write plain spaces and '-': word processors and web pages replace them"
        raise DocumentError(Place(line, column), name, hint)
    try:
        return _build(yaml.parse(text, Loader=_LOADER))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(mark.line + 1, mark.column + 1) if mark else Place()
        if "nesting depth" in (error.problem or ""):  # a limit of newer versions of libyaml
            raise DocumentError(place, _TOO_DEEP) from None
        raise DocumentError(place, f"not YAML: {_sentence(error)}", _syntax_hint(error)) from None


_ALIKE = re.compile(
    r"^[ -]*([\u00a0\u2000-\u200b\u202f\u3000]|[\u2010-\u2015](?=\s))", re.MULTILINE
)
"""Characters at the beginning of a line that resemble those of YAML."""


def scalar_value(text: str) -> str | int | float | bool | None:
    """Return the value of a plain scalar in the YAML 1.2 core schema."""
    if text in _WORDS:
        return _WORDS[text]
    if len(text) > MAX_NUMBER_LENGTH:
        return text
    if _INTEGER.fullmatch(text):
        return int(text)
    if _RADIX.fullmatch(text):
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text)
    if match := _SPECIAL.fullmatch(text):
        return float((match["sign"] or "") + match["word"].lower())
    return text


_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_INTEGER = re.compile(r"[-+]?[0-9]+", re.ASCII)
_RADIX = re.compile(r"0x[0-9a-fA-F]+|0o[0-7]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"(?P<sign>[-+])?\.(?P<word>inf|Inf|INF|nan|NaN|NAN)")


class _Builder:
    """Builder of nodes from PyYAML's events, by recursion of bounded depth. ``_open``: the anchors
    of unfinished collections; ``_known``: finished nodes and their numbers of values, by anchor."""

    def __init__(self, events: Iterator[Any]) -> None:
        self._events = events
        self._open: list[str | None] = []
        self._known: dict[str, tuple[Node, int]] = {}
        self.flaws: list[tuple[Place, str, str]] = []

    def node(self, event: Any) -> tuple[Node, int]:
        """Return the node that begins with an event and its number of values."""
        place = _place(event)
        if isinstance(event, yaml.AliasEvent):
            return self._named(event.anchor, place)
        _refuse_tag(event, place)
        if isinstance(event, yaml.ScalarEvent):
            found: tuple[Node, int] = self._scalar(event, place), 1
        else:
            if len(self._open) >= MAX_DEPTH:
                raise DocumentError(place, _TOO_DEEP)
            self._known.pop(event.anchor, None)
            self._open.append(event.anchor)
            found = self._collection(event, place)
            self._open.pop()
        if event.anchor is not None:
            self._known[event.anchor] = found
        return found

    def _collection(self, start: Any, place: Place) -> tuple[Node, int]:
        items: list[Node] = []
        weight = 1
        for event in self._events:
            if isinstance(event, yaml.CollectionEndEvent):
                break
            node, more = self.node(event)
            weight += more
            if weight > MAX_NODES:
                alias = isinstance(event, yaml.AliasEvent)
                hint = "write a large map as rows of a 'grid', or name its file"
                if alias:
                    hint = "aliases count with all their content"
                found = f"more than {MAX_NODES} values in one file"
                raise DocumentError(_place(event) if alias else node.place, found, hint)
            items.append(node)
        if not isinstance(start, yaml.MappingStartEvent):
            return Sequence(place, tuple(items)), weight
        keys, values = items[::2], items[1::2]
        numbers = any(isinstance(k, Scalar) and isinstance(k.value, int | float) for k in keys)
        if start.flow_style and numbers and all(map(is_nothing, values)):
            shown = clipped(", ".join(k.text for k in keys if isinstance(k, Scalar)))
            self.flaws.append((place, f"found {{{shown}}}", f"a list needs brackets: [{shown}]"))
            return Mapping(place, (), cut=True), weight
        entries: dict[str, tuple[Scalar, Node]] = {}
        for key, value in zip(keys, values, strict=True):
            self._enter(entries, key, value)
        return Mapping(place, tuple(entries.values()), len(entries) < len(keys)), weight

    def _scalar(self, event: Any, place: Place) -> Scalar:
        if (foreign := foreign_character(event.value)) is not None:
            self.flaws.append((place, f"the text holds {foreign[2]}", HINT))
        style = event.style or ""
        value = event.value if style else scalar_value(event.value)
        begin, end = event.start_mark, event.end_mark
        width = len(event.value) + (2 if style else 0)
        literal = begin.line == end.line and end.column - begin.column == width
        return Scalar(place, value, event.value, style, literal)

    def _named(self, anchor: str | None, place: Place) -> tuple[Node, int]:
        """Return the node to which an alias refers and its number of values."""
        if (known := self._known.get(anchor or "")) is not None:
            node, weight = known
            # Diagnostics point at the alias of a scalar, but otherwise into the anchored node.
            here = isinstance(node, Scalar)
            return (replace(node, place=place, literal=False) if here else node), weight
        if anchor in self._open:
            raise DocumentError(place, f"*{anchor} contains itself")
        raise DocumentError(place, f"*{anchor} refers to nothing", f"no &{anchor} before it")

    def _enter(self, entries: dict[str, tuple[Scalar, Node]], key: Node, node: Node) -> None:
        """Add a key and its value to ``entries``, or report why it cannot be a key."""
        if not isinstance(key, Scalar):
            self.flaws.append((key.place, "a key is a list or a mapping", "keys are words"))
        elif not isinstance(key.value, str):
            shown, hint = key.text or "(nothing)", _KEYS
            if isinstance(node, Mapping) or (isinstance(node, Sequence) and key.text):
                hint = "begin it with a letter"
            elif isinstance(node, Scalar) and isinstance(node.value, str):
                hint = f"the word comes first: {clipped(node.text)}: {shown}"
            elif isinstance(node, Scalar) and node.value is not None:
                hint = f"keys are words; a list needs brackets: [{shown}]"
            elif entries and (run_on := continued([*entries.values()][-1], key, node)):
                (name, _), hint = run_on
                entries[name.text] = run_on[0]
                if not hint:
                    return
            self.flaws.append((key.place, f"the key {shown} is not a word", hint))
        elif key.value in entries:
            hint = f"the first one is in line {entries[key.value][0].place.line}"
            self.flaws.append((key.place, f"duplicate key '{clipped(key.value)}'", hint))
        else:
            entries[key.value] = key, node


def _refuse_tag(event: Any, place: Place) -> None:
    if event.tag is not None and event.tag != "!":
        tag = event.tag.replace("tag:yaml.org,2002:", "!!")
        hint = "write the plain value: nothing in a scenario is ever executed"
        if not tag.startswith("!!"):
            hint = f'put a formula in quotes: "{clipped(tag)} ..."'
        raise DocumentError(place, f"found the tag {clipped(tag)}", hint)


def _build(events: Iterator[Any]) -> Document:
    builder, root = _Builder(events), None
    for event in events:
        if isinstance(event, yaml.DocumentStartEvent) and root is not None:
            hint = "keep one scenario in a file; remove '---' and the text below"
            raise DocumentError(_place(event), "found a second document", hint)
        if isinstance(event, yaml.NodeEvent):
            root, _ = builder.node(event)
    if root is None or (isinstance(root, Scalar) and root.value is None):
        hint = "safenav new FILE writes a scenario; docs/drive.md has a fleet file"
        raise DocumentError(Place(), "the file is empty, or has only comments", hint)
    return Document(root, tuple(builder.flaws))


def clipped(text: str, width: int = 40) -> str:
    """Return a file's text for a message: a printable line of at most ``width`` characters."""
    shown = printable(text).replace("\n", "?")
    return shown if len(shown) <= width else shown[: width - 3] + "..."


def one_of(keys: Iterable[str], quote: str = "") -> str:
    """Return keys as alternatives in a message: ``patrol, visit or hold``."""
    *some, last = (f"{quote}{key}{quote}" for key in keys)
    return f"{', '.join(some)} or {last}" if some else last


def _place(event: Any) -> Place:
    return Place(event.start_mark.line + 1, event.start_mark.column + 1)


def _sentence(error: yaml.MarkedYAMLError) -> str:
    return clipped(", ".join(str(part) for part in (error.context, error.problem) if part), 160)


def _syntax_hint(error: yaml.MarkedYAMLError) -> str:
    problem = str(error.problem)
    if "\\t" in problem or "tab" in problem or "cannot start any token" in problem:
        return "indent with spaces, not tabs; quote text that begins with a special character"
    if "mapping values are not allowed" in problem:
        hint = "check indentation and colons here and in the line before: 'key: value'"
        return f"{hint}; quote text that holds ': '"
    if any(word in f"{error.context} {problem}" for word in ("anchor", "alias", "tag")):
        return "put a formula in quotes: '&', '*' and '!' have a meaning in YAML"
    if "quoted scalar" in str(error.context) and error.context_mark:
        begin = error.context_mark
        return f"the quote in line {begin.line + 1}, column {begin.column + 1} is not closed"
    if "block" in problem or "block" in str(error.context):
        return "check the indentation: items of one mapping or list begin in one column"
    if "flow" in str(error.context):
        # during a node, the context is the error itself, not the bracket
        mark = None if "node" in str(error.context) else error.context_mark
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        return f"the '[' or '{{'{where} is not closed, or a ',' is missing"
    return "check quotes, brackets and colons on this line and the one before"


_WORD = re.compile(r"[A-Za-z_][\w-]*", re.ASCII)


def flow(data: object) -> str:
    """Return data as YAML on one line. Keys with the value None are omitted."""
    match data:
        case dict():
            entries = (
                f"{flow(k)}: {flow(value)}" for k, value in data.items() if value is not None
            )
            return f"{{{', '.join(entries)}}}"
        case list() | tuple():
            return f"[{', '.join(map(flow, data))}]"
        case str() if _WORD.fullmatch(data) and isinstance(scalar_value(data), str):
            return data
    return json.dumps(data, ensure_ascii=False)
