"""Users' files as text, and all errors in them, with suggestions of the intended words."""

import re
from collections.abc import Callable, Collection, Iterable
from collections.abc import Mapping as Wanted
from copy import copy
from math import inf
from pathlib import Path
from typing import Self, TypeVar

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, UsageError
from safenav.files import ADVICE, check_kind, decoded, read_input
from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Mapping, Node, Place, Scalar, Sequence, clipped

T = TypeVar("T")


class Findings:
    """The diagnostics of a file. ``beside`` returns those of another file of the same input.
    ``reach``: the folder whose files the file may name (None: any). ``within``: the list whose
    items are being read."""

    def __init__(self, file: str, reach: Path | None = None) -> None:
        self.file = file
        self.reach = reach
        self.within: Sequence | None = None
        self._found: list[Diagnostic] = []
        self._files = {file: ""}
        self._texts: dict[str, list[str]] = {}

    def beside(self, file: str, named_at: Node | Place) -> Self:
        """Return the findings of another file, which this file names at a place. Both are raised
        together. The first diagnostic of the other file states the place."""
        other, place = copy(self), named_at if isinstance(named_at, Place) else named_at.place
        other.file = file
        line = f", line {place.line}" if place.line else ""
        self._files.setdefault(file, f"{file} is named in {self.file}{line}")
        return other

    def read_from(self, text: str) -> None:
        """Store the text of this file, for quotations in messages."""
        self._texts[self.file] = text.split("\n")

    @property
    def lines(self) -> list[str]:
        """The lines of the file."""
        return self._texts.get(self.file, [])

    def add(self, where: Node | Place | None, found: str, hint: str = "", column: int = 0) -> None:
        """Add a diagnostic: its place (None: the whole file), ``found`` and ``hint``. An error at a
        ``column`` of a ``literal`` text is at that column of the file. In other texts it is at the
        beginning, with the column in the message."""
        place = where if isinstance(where, Place) else where.place if where else Place(0, 0)
        if column and isinstance(where, Scalar) and where.literal:
            place = replace(place, column=place.column + bool(where.style) + column - 1)
        elif column:
            found = f"{found} (column {column} of the formula)"
        file = place.file or self.file
        self._found.append(Diagnostic(file, place.line, place.column, found, hint))

    def unknown(
        self,
        where: Node | None,
        found: str,
        word: str,
        known: Iterable[str],
        hint: str = "",
        column: int = 0,
    ) -> None:
        """Report a word that is not ``known``. ``hint``: used without a suggestion; ``column``: the
        word's position in a text."""
        self.add(where, f"{found} '{clipped(word)}'", suggestion(word, known) or hint, column)

    def attempt(self, read: Callable[[], T], path: Path, named_at: Node | Place | None) -> T | None:
        """Return the result of ``read`` on a file; None if it raises InputError. Report its errors,
        those without a line at ``named_at``, where this file names the other one (None: they are
        the same)."""
        try:
            return read()
        except InputError as error:
            inside = self if named_at is None else self.beside(str(path), named_at)
            for flaw in error.diagnostics:
                if flaw.line or named_at is None:
                    inside.add(Place(flaw.line, flaw.column), flaw.found, flaw.hint)
                else:
                    named = clipped(str(path), 200)
                    self.add(named_at, f"file '{named}': {flaw.found}", flaw.hint)
            return None

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics so far with their lines, in the order of the files."""
        rank = {file: index for index, file in enumerate(self._files)}
        once = dict.fromkeys(self._found)
        ordered = sorted(once, key=lambda d: (rank.get(d.file, len(rank)), d.line, d.column))
        named, found = dict(self._files), list[Diagnostic]()
        for each in ordered:
            hint = "; ".join(filter(None, (each.hint, named.pop(each.file, ""))))
            found.append(each._replace(source=self._line(each), hint=hint))
        return tuple(found)

    def __len__(self) -> int:
        return len(self._found)

    def raise_if_any(self) -> None:
        """Raise InputError with all diagnostics if there are any."""
        if self._found:
            raise InputError(self.diagnostics)

    def refuse_if_any(self) -> None:
        """Raise UsageError with all diagnostics in one line if there are any."""
        message = (f"{d.found} ({d.hint})" if d.hint else d.found for d in self.diagnostics)
        if self._found:
            raise UsageError("; ".join(message))

    def _line(self, found: Diagnostic) -> str:
        lines = self._texts.get(found.file, [])
        return lines[found.line - 1] if 1 <= found.line <= len(lines) else ""


def closest(word: str, known: Iterable[str], alike: float = 0.6) -> list[str]:
    """Return the probably intended known word in a list. ``alike``: minimum similarity."""
    from difflib import get_close_matches  # only needed for errors

    return get_close_matches(word[:80], sorted(known), n=1, cutoff=alike)


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return a hint with the probably intended word, and all known words if there are few."""
    words = sorted(known)
    close = closest(word, words)
    parts = [f"did you mean '{close[0]}'?"] if close else []
    if words and len(words) <= 12:
        parts.append(f"known: {listed(words)}")
    return " ".join(parts)


def listed(words: Collection[str]) -> str:
    """Return words from a file on one line."""
    return ", ".join(map(clipped, words))


def described(node: Node) -> str:
    """Return words for a node's value after "found"."""
    match node:
        case Sequence(_, items):
            return f"a list of {len(items)}" if items else "an empty list"
        case Mapping(_, entries):
            return "a mapping" if entries else "an empty mapping"
        case Scalar(value=None):
            return "nothing"
        case Scalar(value=bool(value)):
            return "true" if value else "false"
        case Scalar(value=int() | float()):
            return f"the number {clipped(node.text)}"
        case Scalar():
            return f"the text '{clipped(node.text)}'"


def wrong_type(
    node: Node | None, what: str, expected: str, findings: Findings, hint: str = ""
) -> None:
    """Report that a node does not have the expected type. Do nothing if it is missing or its errors
    were reported."""
    if node is None or node == document.reported(node):
        return
    if isinstance(node, Scalar) and node.style in ("'", '"') and "number" in expected:
        hint = hint or "numbers are written without quotes"
    elif isinstance(node, Scalar):
        number = re.fullmatch(r"(-?\d+(?:\.\d+)?) ?([A-Za-z/%°]+)", node.text)
        alone = document.without_separators(node.text)
        if isinstance(node.value, float) and node.value.is_integer() and abs(node.value) < 1e9:
            alone = str(int(node.value)) if "whole number" in expected else ""
        truth = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(node.text.lower())
        if alone and "number" in expected:
            hint = hint or f"write {alone}"
        elif number is not None and "number" in expected:
            alone = f": {number[1]}" if number[2] in _UNITS else ""
            hint = hint or f"write the number alone, without a unit{alone}"
        elif truth is not None and expected == "true or false":
            hint = hint or f"write {truth}"
    findings.add(node, f"{what}: found {described(node)}, expected {expected}", hint)


_UNITS = {"tick", "ticks", "round", "rounds", "s", "sec", "seconds", "m", "metres", "m/s"}
"""The units of numbers in a scenario."""


def as_meant(
    node: Mapping, what: str, known: Iterable[str], elsewhere: Wanted[str, str], findings: Findings
) -> tuple[Mapping, set[str]]:
    """Report keys that are not ``known``. Return the mapping with the probably intended keys in
    their place, and the set of these keys, so that misspelt keys neither hide nor cause other
    errors. ``elsewhere``: hints for keys that belong in another mapping."""
    words = set(known)
    free = words - {key.text for key, _ in node.entries}
    entries, meant, before, told = list[document.Entry](), set[str](), "", set[str]()
    for key, value in node.entries:
        word, above = key.text, before
        before = word if document.is_nothing(value) else ""
        if word not in words:
            near = free.union(closest(word, words))  # also an existing key, for variations
            also = [other for other in _ALSO_CALLED.get(word, ()) if other in free]
            hint = elsewhere.get(word) or suggestion(also[0] if also else word, near)
            meant |= free.intersection(re.findall(r"(\w+)'?:", elsewhere.get(word, "")))
            probable = [] if word in elsewhere else also[:1] or closest(word, free)
            written = re.match(r"(\w+)\s*[:= ]\s*(.+)", word)
            if word == "<<":
                hint = "YAML's merge keys are not read: write the keys out"
                meant.update(free)
            elif written and written[1] in free and before:
                hint = f"write '{written[1]}: {clipped(written[2])}', with a colon and a space"
                probable = [written[1]]
            elif entries and (run_on := document.continued(entries[-1], key, value)):
                entries[-1], hint = run_on
                if hint:
                    findings.add(key, f"unknown key '{clipped(word)}' in {what}", hint)
                before = ""
                continue
            elif above:
                hint = "" if word in elsewhere or not hint else f"; {hint}"
                hint = f"if it belongs to '{above}', indent it{hint}"
                if document.is_nothing(entries[-1][1]):
                    entries[-1] = (entries[-1][0], document.reported(value))
                before = above
            if hint not in told or word not in elsewhere:
                findings.add(key, f"unknown key '{clipped(word)}' in {what}", hint)
            told.add(hint)
            free.difference_update(probable)
            meant.update(probable)
            if probable and not document.is_nothing(value):
                key = replace(key, value=probable[0], text=probable[0])
        entries.append((key, value))
    return Mapping(node.place, tuple(entries)), meant


_ALSO_CALLED = {
    word: keys
    for words, keys in (
        ("regions labels locations waypoints", ("names", "in")),
        ("rooms zones", ("areas",)),
        ("version", ("safenav",)),
        ("agents", ("robots",)),
        ("goto go_to reach", ("hold",)),
        ("doors hazards", ("obstacles",)),
        ("parcels tasks jobs deliveries", ("orders",)),
        ("timeout", ("limits",)),
        ("type", ("model",)),
        ("kind name", ("type", "model")),
        ("position location cell", ("start", "region")),
        ("initial", ("start",)),
        ("facing direction orientation", ("heading",)),
        ("tick time", ("at", "from")),
        ("at", ("resolve_at", "from")),
        ("resolve_at", ("at",)),
        ("goal goals task mission specification", ("objective",)),
        ("skills abilities", ("capabilities",)),
        ("diameter", ("size",)),
        ("max_speed velocity", ("speed",)),
        ("deadline", ("within", "resolve_within", "by")),
    )
    for word in words.split()
}
"""Keys of other tools, each with the keys of scenarios that a user may intend."""


MAX_BYTES = 5_000_000
"""Maximum bytes of a text."""
MOST_OF_AN_IMAGE = 150_000_000

STDIN = "-"
"""The path that denotes standard input."""

_SUFFIXES = {"", ".yaml", ".yml", ".json", ".txt"}


def read_source(path: Path, findings: Findings, named_at: Node | None = None) -> str | None:
    """Return the text of a file; None after a reported error.

    ``named_at``: the node at which the file of ``findings`` names this one.
    """
    data = read_bytes(path, findings, named_at, MAX_BYTES)
    if data is None:
        return None
    return findings.attempt(lambda: decoded(data, str(path)), path, named_at)


def read_bytes(
    path: Path, findings: Findings, named_at: Node | Place | None, most: int = MOST_OF_AN_IMAGE
) -> bytes | None:
    """Return the content of a file, such as an image; None as in ``read_source``."""
    named = named_at is not None

    def read() -> bytes:
        if named and findings.reach is not None:
            _refuse_outside(path, findings.reach)
        return read_input(path, most, named=named, values=inf)

    return findings.attempt(read, path, named_at)


def _refuse_outside(path: Path, reach: Path) -> None:
    """Raise InputError for a file outside a folder, before the file is opened."""
    try:
        inside = path.resolve().is_relative_to(reach.resolve())
    except (OSError, RuntimeError, ValueError):
        inside = False
    if not inside:
        found = "not read: it is outside the folder of the scenario"
        where = f"put it into {reach}, or start the studio with --folder and a folder above both"
        raise InputError([Diagnostic(str(path), 0, 0, found, where)])


def parsed(text: str, findings: Findings, expected: str = "scenario") -> Node | None:
    """Return the YAML document in a text and report its errors; None if the text is unreadable.
    ``expected``: the kind of file."""
    try:
        check_kind(text, expected, findings.file)
    except InputError as error:
        findings.add(None, error.diagnostics[0].found, error.diagnostics[0].hint)
        return None
    if len(text) > MAX_BYTES:
        hint = "put the map in a file and name it under 'map'"
        findings.add(None, f"the text is larger than {MAX_BYTES // 1_000_000} MB", hint)
        return None
    findings.read_from(text)
    foreign = Path(findings.file).suffix not in _SUFFIXES
    try:
        whole = document.read_document(text)
    except document.DocumentError as error:
        found = f"this is not a {expected}: {error.found}" if foreign else error.found
        findings.add(error.place, found, ADVICE if foreign else error.hint)
        return None
    if foreign and not isinstance(whole.root, Mapping):
        findings.add(None, f"this is not a {expected}", ADVICE)
        return None
    for place, found, hint in whole.flaws:
        findings.add(place, found, hint)
    return whole.root


_NAMED = (("catalogue",), ("map", "image"), ("map", "ros"), ("map", "movingai"))
"""The keys of scenarios that name files."""


def referenced_files(root: Node | None, folder: Path) -> list[Path]:
    """Return the files that a scenario in ``folder`` names, existing or not, each once."""
    found = [_file(document.below(root, *keys), folder) for keys in _NAMED]
    ros = _file(document.below(root, "map", "ros"), folder)
    if ros is not None:
        text = read_source(ros, Findings(str(ros)))
        found.append(_file(document.below(root_of(text or ""), "image"), ros.parent))
    return list(dict.fromkeys(path for path in found if path is not None))


def root_of(text: str) -> Node | None:
    """Return the YAML document in a text; None if it is invalid."""
    try:
        return document.read_document(text).root
    except document.DocumentError:
        return None


def _file(node: Node | None, folder: Path) -> Path | None:
    """Return the path in a node; None if it is not text but, for example, a catalogue."""
    return folder / node.value if isinstance(node, Scalar) and isinstance(node.value, str) else None
