"""YAML text as a tree of nodes that know their place, read without trusting it.

The tree is built from PyYAML's events with an explicit stack, not by its composer: nesting,
size and the expansion of aliases are bounded, every tag is refused (nothing is ever
constructed), and duplicate keys are seen. Plain scalars follow the YAML 1.2 core schema, so
that ``no`` is a word and ``012`` is twelve.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml
from msgspec import Struct, field
from msgspec.structs import replace

from safenav.lines import HINT, foreign_character, printable

MAX_DEPTH = 50
MAX_NODES = 100_000
"""Nodes of a document, counting an alias as all that it stands for."""

MAX_NUMBER_LENGTH = 100

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class Place(Struct, frozen=True):
    """Line and column, both from 1."""

    line: int = 1
    column: int = 1


class Scalar(Struct, frozen=True):
    """A number, truth value, null or text.

    ``text`` is as written, ``style`` YAML's: empty for plain, the quote, or ``|`` and ``>``
    for blocks. ``literal``: it stands in one line without escapes, so that a column of the
    text is a column of the line.
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
    """Keys are text and differ from each other."""

    place: Place
    entries: tuple[tuple[Scalar, Node], ...]

    def get(self, key: str) -> Node | None:
        for name, node in self.entries:
            if name.value == key:
                return node
        return None


Node = Scalar | Sequence | Mapping

_KEYS = "keys are words; a list needs brackets: [3, 8]"


def below(node: Node | None, *keys: str) -> Node | None:
    """The node below another one, under one key after the other; None if there is none."""
    for key in keys:
        node = node.get(key) if isinstance(node, Mapping) else None
    return node


def entries_of(node: Node | None) -> tuple[tuple[Scalar, Node], ...]:
    """The keys and values of a mapping; none of any other node."""
    return node.entries if isinstance(node, Mapping) else ()


def items_of(node: Node | None) -> tuple[Node, ...]:
    """The items of a list; none of any other node."""
    return node.items if isinstance(node, Sequence) else ()


def plain(node: Node) -> Any:
    """The data that a node stands for."""
    if isinstance(node, Scalar):
        return node.value
    if isinstance(node, Mapping):
        return {key.text: plain(item) for key, item in node.entries}
    return [plain(item) for item in node.items]


class DocumentError(Exception):
    """The text is not valid YAML: where, what, and what to do about it."""

    def __init__(self, place: Place, found: str, hint: str = "") -> None:
        self.place = place
        self.found = found
        self.hint = hint
        super().__init__(found)


class Document(Struct, frozen=True):
    """A tree, and what is wrong with it although it could be read: (place, found, hint)."""

    root: Node
    flaws: tuple[tuple[Place, str, str], ...] = ()


def read_document(text: str) -> Document:
    """The only document in ``text``. Raises DocumentError."""
    if (foreign := foreign_character(text)) is not None:
        line, column, found = foreign
        raise DocumentError(Place(line, column), f"not text: {found}", HINT)
    try:
        return _build(yaml.parse(text, Loader=_LOADER))
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = Place(mark.line + 1, mark.column + 1) if mark else Place()
        raise DocumentError(place, f"not YAML: {_sentence(error)}", _syntax_hint(error)) from None
    except yaml.reader.ReaderError as error:
        raise DocumentError(*_bad_character(text, error)) from None
    except UnicodeEncodeError as error:
        found = "a character that no file can hold (a lone surrogate)"
        raise DocumentError(_place_of(text, error.start), found) from None


def scalar_value(text: str) -> str | int | float | bool | None:
    """The value of a plain scalar in the YAML 1.2 core schema."""
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


class _Open(Struct):
    """A collection that is being read."""

    place: Place
    anchor: str | None
    is_mapping: bool
    items: list[Node] = field(default_factory=list)
    entries: list[tuple[Scalar, Node]] = field(default_factory=list)
    lines: dict[str, int] = field(default_factory=dict)
    key: Node | None = None
    weight: int = 1


class _Builder:
    def __init__(self) -> None:
        self.root: Node | None = None
        self.flaws: list[tuple[Place, str, str]] = []
        self.stack: list[_Open] = []
        self.anchors: dict[str, tuple[Node, int]] = {}

    def open(self, event: Any, is_mapping: bool) -> None:
        place = _place(event)
        self._refuse_tag(event, place)
        if len(self.stack) >= MAX_DEPTH:
            raise DocumentError(place, f"nested more than {MAX_DEPTH} deep")
        self.anchors.pop(event.anchor, None)
        self.stack.append(_Open(place, event.anchor, is_mapping))

    def close(self) -> None:
        done = self.stack.pop()
        node: Node
        if done.is_mapping:
            node = Mapping(done.place, tuple(done.entries))
        else:
            node = Sequence(done.place, tuple(done.items))
        self.add(node, done.anchor, done.weight)

    def scalar(self, event: Any) -> None:
        place = _place(event)
        self._refuse_tag(event, place)
        if (foreign := foreign_character(event.value)) is not None:
            self.flaws.append((place, f"the text holds {foreign[2]}", HINT))
        style = event.style or ""
        value = event.value if style else scalar_value(event.value)
        begin, end = event.start_mark, event.end_mark
        width = len(event.value) + (2 if style else 0)
        literal = begin.line == end.line and end.column - begin.column == width
        self.add(Scalar(place, value, event.value, style, literal), event.anchor, 1)

    def alias(self, event: Any) -> None:
        place = _place(event)
        if event.anchor not in self.anchors:
            if any(collection.anchor == event.anchor for collection in self.stack):
                raise DocumentError(place, f"*{event.anchor} contains itself")
            raise DocumentError(
                place, f"*{event.anchor} refers to nothing", f"no &{event.anchor} before it"
            )
        node, weight = self.anchors[event.anchor]
        # A diagnostic points at the alias for a scalar, into what it stands for otherwise.
        here = replace(node, place=place, literal=False) if isinstance(node, Scalar) else node
        self.add(here, None, weight, place)

    def add(self, node: Node, anchor: str | None, weight: int, place: Place | None = None) -> None:
        if anchor is not None:
            self.anchors[anchor] = (node, weight)
        if not self.stack:
            self.root = node
            return
        parent = self.stack[-1]
        parent.weight += weight
        if parent.weight > MAX_NODES:
            hint = "aliases count with all their content"
            raise DocumentError(
                place or node.place, f"more than {MAX_NODES} values in one file", hint
            )
        if not parent.is_mapping:
            parent.items.append(node)
        elif parent.key is None:
            parent.key = node
        else:
            key, parent.key = parent.key, None
            self._entry(parent, key, node)

    def _entry(self, parent: _Open, key: Node, node: Node) -> None:
        if not isinstance(key, Scalar):
            self.flaws.append((key.place, "a key is a list or a mapping", "keys are words"))
        elif not isinstance(key.value, str):
            shown = key.text or "(nothing)"
            self.flaws.append((key.place, f"the key {shown} is not a word", _KEYS))
        elif key.value in parent.lines:
            first = parent.lines[key.value]
            found = f"duplicate key '{clipped(key.value)}'"
            self.flaws.append((key.place, found, f"it is already in line {first}"))
        else:
            parent.lines[key.value] = key.place.line
            parent.entries.append((key, node))

    @staticmethod
    def _refuse_tag(event: Any, place: Place) -> None:
        if event.tag is not None and event.tag != "!":
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            hint = "write the plain value: nothing in a scenario is ever executed"
            if not tag.startswith("!!"):
                hint = f'put a formula in quotes: "{clipped(tag)} ..."'
            raise DocumentError(place, f"the tag {clipped(tag)}", hint)


def _build(events: Iterator[Any]) -> Document:
    builder = _Builder()
    documents = 0
    for event in events:
        match event:
            case yaml.DocumentStartEvent():
                documents += 1
                if documents > 1:
                    hint = "keep one scenario in a file; remove '---' and what follows"
                    raise DocumentError(_place(event), "a second document", hint)
            case yaml.MappingStartEvent():
                builder.open(event, True)
            case yaml.SequenceStartEvent():
                builder.open(event, False)
            case yaml.MappingEndEvent() | yaml.SequenceEndEvent():
                builder.close()
            case yaml.ScalarEvent():
                builder.scalar(event)
            case yaml.AliasEvent():
                builder.alias(event)
    if builder.root is None or (isinstance(builder.root, Scalar) and builder.root.value is None):
        hint = "safenav new FILE writes a scenario, with --fleet SCENARIO a fleet file"
        raise DocumentError(Place(), "the file is empty", hint)
    return Document(builder.root, tuple(builder.flaws))


def clipped(text: str, width: int = 40) -> str:
    """Text from a file, fit for a message: one line, printable, not too long."""
    shown = printable(text).replace("\n", "?")
    return shown if len(shown) <= width else shown[: width - 3] + "..."


def _place(event: Any) -> Place:
    return Place(event.start_mark.line + 1, event.start_mark.column + 1)


def _sentence(error: yaml.MarkedYAMLError) -> str:
    parts = [error.context, error.problem]
    return clipped(", ".join(str(part) for part in parts if part), 160)


def _syntax_hint(error: yaml.MarkedYAMLError) -> str:
    problem = str(error.problem)
    if "\\t" in problem or "tab" in problem or "cannot start any token" in problem:
        return "indent with spaces, not tabs; quote text that begins with a special character"
    if "mapping values are not allowed" in problem:
        return "check the indentation of this line and the one before; quote text that holds ': '"
    if any(word in f"{error.context} {problem}" for word in ("anchor", "alias", "tag")):
        return "put a formula in quotes: '&', '*' and '!' have a meaning in YAML"
    if "quoted scalar" in str(error.context) and error.context_mark:
        begin = error.context_mark
        return f"the quote in line {begin.line + 1}, column {begin.column + 1} is not closed"
    if "block" in problem or "block" in str(error.context):
        return "check the indentation: items of one mapping or list begin in one column"
    if "flow" in str(error.context):
        mark = error.context_mark
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        return f"the '[' or '{{'{where} is not closed, or a ',' is missing"
    return "check quotes, brackets and colons on this line and the one before"


def _bad_character(text: str, error: yaml.reader.ReaderError) -> tuple[Place, str, str]:
    match = yaml.reader.Reader.NON_PRINTABLE.search(text)
    place = _place_of(text, match.start()) if match else Place()
    shown = f"the character U+{ord(match.group()):04X}" if match else str(error.reason)
    return place, f"not text: {clipped(shown, 120)}", "remove it; is this a text file?"


def _place_of(text: str, index: int) -> Place:
    before = text[:index]
    return Place(before.count("\n") + 1, index - (before.rfind("\n") + 1) + 1)
