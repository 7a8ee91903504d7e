"""Scenario and catalogue files as text, or a message why a file is not usable."""

from __future__ import annotations

import stat
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar

from safenav.file_kind import another_kind
from safenav.scenario.yaml.document import (
    DocumentError,
    Mapping,
    Node,
    Place,
    Scalar,
    below,
    read_document,
)
from safenav.scenario.yaml.findings import Findings

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
        if not findings.home.holds(path):
            _tell_outside(findings.file, path)
        return
    if reach.holds(path):
        return
    where = f"put it into {reach.folder}, or start the studio with --folder and a folder above both"
    raise DocumentError(None, "not read: it is outside the folder of the scenario", where)


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
        raise DocumentError(None, "no such file", _neighbours(path)) from None
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
            hint = "name the YAML file that refers to it; to see a map alone: safenav draw FILE"
            raise DocumentError(None, f"this is an image ({kind}), not YAML", hint)
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


def _neighbours(path: Path) -> str:
    """Return a hint that names a similar file of the same directory."""
    from difflib import get_close_matches

    try:
        files = [entry for entry in path.parent.iterdir() if entry.is_file()]
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
