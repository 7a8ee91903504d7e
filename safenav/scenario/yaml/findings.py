"""Files of users as text, and all errors in them, in words that name what was meant."""

import re
import stat
import sys
from collections.abc import Callable, Collection, Iterable
from collections.abc import Mapping as Wanted
from copy import copy
from functools import cache
from pathlib import Path
from typing import Self, TypeVar

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, UsageError
from safenav.files import another_kind
from safenav.scenario.yaml.document import (
    DocumentError,
    Mapping,
    Node,
    Place,
    Scalar,
    Sequence,
    below,
    clipped,
    read_document,
)

MAX_REPORTED = 100


class Findings:
    """Diagnostics of one file; ``beside`` returns those of another file of the same input.
    ``reach``: the folder whose files it may name; None for any file."""

    def __init__(self, file: str, reach: Path | None = None) -> None:
        self.file = file
        self.reach = reach
        self._found: list[Diagnostic] = []
        self._files = [file]
        self._texts: dict[str, list[str]] = {}

    def beside(self, file: str) -> Self:
        """Return the findings of a file that this one refers to; both are raised together."""
        other = copy(self)
        other.file = file
        self._files.append(file)
        return other

    @property
    def home(self) -> Path:
        """The folder of the input itself."""
        return Path(self._files[0]).parent

    def read_from(self, text: str) -> None:
        """Set the text of this file, for messages to quote."""
        self._texts[self.file] = text.split("\n")

    @property
    def lines(self) -> list[str]:
        """The lines of this file."""
        return self._texts.get(self.file, [])

    def add(self, where: Node | Place | None, found: str, hint: str = "") -> None:
        """Add a diagnostic: its place (None: of the whole file), ``found`` and ``hint``."""
        if where is None:
            self._found.append(Diagnostic(self.file, 0, 0, found, hint))
            return
        place = where if isinstance(where, Place) else where.place
        self._found.append(Diagnostic(self.file, place.line, place.column, found, hint))

    def unknown(
        self,
        where: Node | None,
        found: str,
        word: str,
        known: Iterable[str],
        hint: str = "",
        column: int | None = None,
    ) -> None:
        """Report a word that is not ``known``; ``hint``: if no known word is suggested; ``column``:
        that of the word in a text."""
        message = f"{found} '{clipped(word)}'", suggestion(word, known) or hint
        if column is not None and isinstance(where, Scalar):
            self.add_inside(where, column, *message)
        else:
            self.add(where, *message)

    def add_inside(self, node: Scalar, column: int, found: str, hint: str = "") -> None:
        """Report an error at a column of a text: at that column of the file if the text is
        ``literal``, else at its beginning, with the column in the message."""
        if node.literal:
            quote = 1 if node.style else 0
            self.add(Place(node.place.line, node.place.column + quote + column - 1), found, hint)
        else:
            self.add(node, f"{found} (column {column} of the formula)", hint)

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics so far, in the order in which they were added."""
        return tuple(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def raise_if_any(self) -> None:
        """Raise InputError with all diagnostics in file order, if there are any."""
        if not self._found:
            return
        rank = {file: index for index, file in reversed(list(enumerate(self._files)))}
        once = dict.fromkeys(self._found)
        ordered = sorted(once, key=lambda d: (rank[d.file], d.line, d.column))
        if len(ordered) > MAX_REPORTED:
            more = f"and {len(ordered) - MAX_REPORTED} more"
            ordered[MAX_REPORTED:] = [Diagnostic(self.file, 0, 0, more)]
        raise InputError([d._replace(source=self._line(d)) for d in ordered])

    def refuse_if_any(self) -> None:
        """Raise UsageError with all diagnostics in one line, if there are any."""
        try:
            self.raise_if_any()
        except InputError as error:
            message = (f"{d.found} ({d.hint})" if d.hint else d.found for d in error.diagnostics)
            raise UsageError("; ".join(message)) from error

    def _line(self, found: Diagnostic) -> str:
        lines = self._texts.get(found.file, [])
        return lines[found.line - 1] if 1 <= found.line <= len(lines) else ""


def closest(word: str, known: Iterable[str], alike: float = 0.6) -> list[str]:
    """Return the known word that was probably meant, if any; ``alike``: similarity from 0 to 1."""
    from difflib import get_close_matches  # only needed for errors

    return get_close_matches(word[:80], sorted(known), n=1, cutoff=alike)


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return a hint with the word that was probably meant, and all known words if they are few."""
    words = sorted(known)
    close = closest(word, words)
    parts = [f"did you mean '{close[0]}'?"] if close else []
    if words and len(words) <= 12:
        parts.append(f"known: {listed(words)}")
    return " ".join(parts)


def listed(words: Collection[str]) -> str:
    """Return the first twelve words from a file, on one line."""
    some = [clipped(word) for word in list(words)[:12]]
    return ", ".join(some) + (", ..." if len(words) > 12 else "")


def described(node: Node) -> str:
    """Return a description of a node's value, for "found ..."."""
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
    """Report that a node is not of the expected type; do nothing if it is missing, or a mapping
    without a key that can be one, which was reported."""
    if node is None or (isinstance(node, Mapping) and node.cut and not node.entries):
        return
    if isinstance(node, Scalar) and node.style in ("'", '"') and "number" in expected:
        hint = hint or "numbers are written without quotes"
    elif isinstance(node, Scalar):
        number = re.fullmatch(r"(-?\d+(?:\.\d+)?) ?([a-z/%°]+)", node.text)
        truth = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(node.text.lower())
        if number is not None and "number" in expected:
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
    """Report keys that are not ``known``. Return the mapping with the keys that were probably meant
    in their place, and the set of these: a misspelt key neither hides nor causes other errors.
    ``elsewhere``: hints for keys that belong in another mapping."""
    words = set(known)
    free = words - {key.text for key, _ in node.entries}
    entries, meant = [], set()
    for key, value in node.entries:
        word = key.text
        if word not in words:
            also = [other for other in _ALSO_CALLED.get(word, ()) if other in free]
            hint = elsewhere.get(word) or suggestion(also[0] if also else word, free)
            found = f"unknown key '{clipped(word)}' in {what}"
            probable = [] if word in elsewhere else also[:1] or closest(word, free)
            run_on = re.match(r"(\w+)[: ]\s*(.+)", word)
            if run_on and run_on[1] in free and is_nothing(value):
                hint = f"write '{run_on[1]}: {clipped(run_on[2])}', with a colon and a space"
                probable = [run_on[1]]
            findings.add(key, found, hint)
            free.difference_update(probable)
            meant.update(probable)
            if probable and not is_nothing(value):
                key = replace(key, value=probable[0], text=probable[0])
        entries.append((key, value))
    return Mapping(node.place, tuple(entries)), meant


def is_nothing(node: Node) -> bool:
    """Return whether a key has no value."""
    return isinstance(node, Scalar) and node.value is None


_ALSO_CALLED = {
    word: keys
    for words, keys in (
        ("regions labels locations waypoints", ("names",)),
        ("rooms zones", ("areas",)),
        ("agents", ("robots",)),
        ("doors hazards", ("obstacles",)),
        ("timeout", ("limits",)),
        ("type", ("model",)),
        ("kind", ("type", "model")),
        ("position location cell", ("start", "region")),
        ("initial", ("start",)),
        ("facing direction orientation", ("heading",)),
        ("tick", ("at", "from")),
        ("goal goals task mission specification", ("objective",)),
        ("skills abilities", ("capabilities",)),
        ("diameter", ("size",)),
        ("max_speed velocity", ("speed",)),
        ("deadline", ("within", "resolve_within", "by")),
    )
    for word in words.split()
}
"""Keys of other tools, and the scenario's keys that may be meant."""


T = TypeVar("T")

MAX_BYTES = 5_000_000
"""Largest size of a text."""
MOST_OF_AN_IMAGE = 150_000_000

STDIN = "-"
"""The path that means standard input."""

_SUFFIXES = {"", ".yaml", ".yml", ".json", ".txt"}
_FOREIGN = (
    "a scenario is YAML ('safenav new FILE' writes one); 'check' also reads traces and motions "
    "(.jsonl) and bundles, 'synth' specifications of slugs, as LTLMoP and TuLiP write them"
)
_OTHERS = {".py": "a Python program", ".md": "a Markdown text", ".toml": "a TOML file"}
"""Files in other languages, by suffix."""
_ROOM = "save the floor as an occupancy map (ROS map_saver): safenav new FILE --map MAP.yaml"
_STARTS = (
    "each line has a map, and x and y (column and row) of a start and a goal: safenav new FILE "
    "--map MAP.map, then each as [ROW, COLUMN]"
)
_BODY = (
    "a scenario lists robots by models: 'safenav new --catalogue', or its own with 'size' and "
    "'speed'"
)
FOREIGN = {
    ".scen": _STARTS,
    **dict.fromkeys((".sdf", ".world"), _ROOM),
    **dict.fromkeys((".urdf", ".xacro"), _BODY),
}
"""Hints for files of other tools that contain a part of a scenario, by suffix."""
_IMAGES = {b"\x89PNG": "PNG", b"P5": "PGM", b"P2": "PGM", b"\xff\xd8\xff": "JPEG", b"GIF8": "GIF"}


def read_source(path: Path, findings: Findings, named_at: Node | None = None) -> str | None:
    """Return the text of a file; None if an error was reported.

    ``named_at``: the node at which another file (that of ``findings``) names this one.
    """
    return _made(_decoded, path, findings, named_at, MAX_BYTES)


def read_bytes(path: Path, findings: Findings, named_at: Node) -> bytes | None:
    """Return the content of an image; None as ``read_source``."""
    return _made(bytes, path, findings, named_at, MOST_OF_AN_IMAGE)


def _made(
    make: Callable[[bytes], T], path: Path, findings: Findings, named_at: Node | None, limit: int
) -> T | None:
    """Return the content of a file, converted by ``make``; None if an error was reported."""
    try:
        _refuse_outside(path, findings, named_at)
        if named_at is None and str(path) == STDIN:
            return make(_within(sys.stdin.buffer.read(limit + 1), limit))
        return make(_bytes(path, limit))
    except DocumentError as error:
        if named_at is None:
            findings.add(error.place, error.found, error.hint)
        else:
            findings.add(named_at, f"file '{path}': {error.found}", error.hint)
        return None


def _refuse_outside(path: Path, findings: Findings, named_at: Node | None) -> None:
    """Raise before opening a file outside the folder that ``findings.reach`` allows. Without such a
    limit (the user named the input), only note a file outside the input's folder."""
    reach = findings.reach
    if named_at is None:
        return
    if reach is None:
        if not _is_inside(path, findings.home):
            _tell_outside(findings.file, path)
        return
    if _is_inside(path, reach):
        return
    where = f"put it into {reach}, or start the studio with --folder and a folder above both"
    raise DocumentError(None, "not read: it is outside the folder of the scenario", where)


def _is_inside(path: Path, folder: Path) -> bool:
    """Return whether a path is inside a folder after following links."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):
        return False


@cache
def _tell_outside(file: str, path: Path) -> None:
    """Log a note once per file; without a handler it goes to standard error."""
    from logging import getLogger  # only needed here

    getLogger("safenav").warning("note: %s reads a file outside of its folder: %s", file, path)


def _bytes(path: Path, limit: int) -> bytes:
    try:
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise DocumentError(None, "this is a directory", "name a file in it")
        if not stat.S_ISREG(kind):
            # A pipe may never deliver data, and /dev/zero never ends.
            raise DocumentError(None, "this is not a regular file", "copy its contents into a file")
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except FileNotFoundError:
        raise DocumentError(None, "no such file", neighbours(path)) from None
    except PermissionError:
        raise DocumentError(None, "permission denied", "check who may read the file") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise DocumentError(None, f"not readable: {reason}") from None
    return _within(data, limit)


def _within(data: bytes, limit: int) -> bytes:
    if len(data) > limit:
        raise DocumentError(None, f"the file is larger than {limit // 1_000_000} MB")
    return data


def _decoded(data: bytes) -> str:
    for signature, kind in _IMAGES.items():
        if data.startswith(signature):
            hint = (
                "name it by 'image' of map, or the YAML file of its ROS map by 'ros'; to see it: "
            )
            hint += "safenav draw FILE"
            raise DocumentError(None, f"this is an image ({kind}), not text", hint)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line_start = before.rfind(b"\n") + 1
        column = len(before[line_start:].decode("utf-8", "replace")) + 1
        place = Place(before.count(b"\n") + 1, column)
        found = f"not UTF-8: byte 0x{data[error.start]:02X}"
        raise DocumentError(place, found, "save it as UTF-8") from None


def parsed(text: str, findings: Findings, expected: str = "scenario") -> Node | None:
    """Return the YAML document in a text; report its errors. None if it is not readable.
    ``expected``: its kind of file."""
    if wrong := another_kind(text, expected, findings.file):
        findings.add(None, *wrong)
        return None
    if len(text) > MAX_BYTES:
        findings.add(None, f"the text is larger than {MAX_BYTES // 1_000_000} MB")
        return None
    findings.read_from(text)
    suffix = Path(findings.file).suffix
    foreign = suffix not in _SUFFIXES
    advice = FOREIGN.get(suffix, _FOREIGN)
    other = f"this is {_OTHERS[suffix]}, not a {expected}" if suffix in _OTHERS else ""
    try:
        document = read_document(text)
    except DocumentError as error:
        if other:
            findings.add(None, other, advice)
            return None
        findings.add(error.place, error.found, advice if foreign else error.hint)
        return None
    if foreign and not isinstance(document.root, Mapping):
        neither = "neither a scenario (YAML) nor a specification of slugs"
        findings.add(None, other or neither, advice)
        return None
    for place, found, hint in document.flaws:
        findings.add(place, found, hint)
    return document.root


def neighbours(path: Path, *, folders: bool = False) -> str:
    """Return a hint that names a similar file of the same directory; ``folders``: or folder."""
    from difflib import get_close_matches

    try:
        files = [each for each in path.parent.iterdir() if folders or each.is_file()]
    except OSError:
        return f"the directory {path.parent} cannot be read or does not exist"
    # A common suffix does not make two names alike.
    alike = {*get_close_matches(path.stem, [file.stem for file in files], cutoff=0.6)}
    names = [file.name for file in files if file.stem in alike]
    close = get_close_matches(path.name, names, n=1, cutoff=0.6)
    return f"did you mean '{path.parent / close[0]}'?" if close else "check the path"


_NAMED = (("catalogue",), ("map", "image"), ("map", "ros"), ("map", "movingai"))
"""The keys of a scenario that name files."""


def referenced_files(root: Node | None, folder: Path) -> list[Path]:
    """Return the files that a scenario in ``folder`` names, existing or not, each once."""
    found = [_file(below(root, *keys), folder) for keys in _NAMED]
    ros = _file(below(root, "map", "ros"), folder)
    if ros is not None:
        text = read_source(ros, Findings(str(ros)))
        found.append(_file(below(root_of(text or ""), "image"), ros.parent))
    return list(dict.fromkeys(path for path in found if path is not None))


def root_of(text: str) -> Node | None:
    """Return the YAML document in a text; None if it is not valid."""
    try:
        return read_document(text).root
    except DocumentError:
        return None


def _file(node: Node | None, folder: Path) -> Path | None:
    """Return the path in a node; None if it is not text, such as a catalogue in place."""
    return folder / node.value if isinstance(node, Scalar) and isinstance(node.value, str) else None
