"""Cases from named files, folders, patterns and matrix files.

A search, in a folder or by a pattern, takes the scenarios that it finds and skips the rest: YAML
files that are not scenarios (maps, catalogues), matrix files, and folders in ``LEFT_OUT``. A named
file is always taken. A case also contains a digest of the files that its scenario names.
"""

import glob
import hashlib
import json
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePath
from typing import Any

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.batch.case import Case, Settings
from safenav.batch.matrix import Placed, is_matrix, read_matrix, varied
from safenav.data import cached_method
from safenav.errors import UsageError
from safenav.files import kind_of
from safenav.scenario.yaml.document import DocumentError, Mapping, Node, Place, read_document
from safenav.scenario.yaml.findings import (
    STDIN,
    Findings,
    read_bytes,
    read_source,
    referenced_files,
    root_of,
)

LEFT_OUT = ("invalid", "unrealizable")
"""Names of folders that searches skip, since their scenarios fail on purpose."""

_SUFFIXES = (".yaml", ".yml")
_MAGIC = re.compile(r"[*?\[]")
_WIDTH = 40


class FoundCases(Struct):
    """The found cases, and the YAML files that searches have ``skipped``: those that are not
    scenarios, and matrix files, which run only if the user names them."""

    cases: list[Case] = field(default_factory=list)
    skipped: list[str] = field(default_factory=list)


def find_cases(paths: Sequence[str]) -> FoundCases:
    """Return the cases of ``paths``, each once, in this order, sorted within a search.

    ``-`` is a scenario on standard input. Raises UsageError for a path without a scenario,
    InputError for a bad matrix file.
    """
    search = _Search()
    for path in paths:
        try:
            search.add(path)
        except OSError as error:  # for example, a name that is too long
            raise UsageError(f"{path[:60]}: {error.strerror}") from error
    named = {str(Path(path)) for path in paths}
    search.found.skipped = [file for file in search.found.skipped if file not in named]
    return search.found


class _Search:
    def __init__(self) -> None:
        self.found = FoundCases()
        self._known: set[tuple[str, str]] = set()
        self._names: set[str] = set()

    def add(self, named: str, settings: Sequence[Placed] | None = None) -> None:
        """Add the cases at a path. ``settings``: those of the matrix file that names the path."""
        path = Path(named)
        if path.is_dir():
            self._searched(named, _files_below(path), settings)
        elif path.exists() or not _MAGIC.search(named):
            self._named_file(path, settings)
        else:
            self._searched(named, _files_matching(named), settings)

    def _searched(
        self, named: str, files: Iterable[Path], settings: Sequence[Placed] | None
    ) -> None:
        count = 0
        for file in files:
            if _is_scenario(self._text(file)):
                self._cases(file, settings)
                count += 1
            elif str(file) not in self.found.skipped:
                self.found.skipped.append(str(file))
        if not count:
            raise UsageError(
                f"no scenario found: {named}\n"
                "    folders and patterns select *.yaml and *.yml files; name matrix files "
                f"explicitly, and folders called {' or '.join(LEFT_OUT)}"
            )

    def _named_file(self, path: Path, settings: Sequence[Placed] | None) -> None:
        if not path.exists() and str(path) != STDIN:
            raise UsageError(f"no such file or folder: {path}\n    check the path")
        text = self._text(path)
        if text is None or not is_matrix(text):
            return self._cases(path, settings)
        if settings is not None:
            raise UsageError(f"{path} is a matrix file itself\n    list scenarios here")
        matrix = read_matrix(text, str(path))
        for named in matrix.scenarios:
            try:
                self.add(str(path.parent / named.text), matrix.settings)
            except (UsageError, OSError) as error:
                reason = error.strerror if isinstance(error, OSError) else error
                place = f"{path}:{named.place.line}:{named.place.column}"
                raise UsageError(f"{place}: {reason}") from None
        return None

    def _cases(self, path: Path, settings: Sequence[Placed] | None) -> None:
        file, text = Path(os.path.normpath(path)).as_posix(), self._text(path)
        for placed in ({},) if settings is None else settings:
            each = {key: value for key, (value, _) in placed.items()}
            places = {key: place for key, (_, place) in placed.items()}
            identity = (os.path.realpath(path), repr(sorted(each.items())))
            if identity not in self._known:
                self._known.add(identity)
                case = Case(self._name(file, each), file, text, each, places=places)
                references = "" if text is None else self._references(path, text, case)
                self.found.cases.append(replace(case, references=references))

    def _name(self, file: str, settings: Settings) -> str:
        parts = [f"{path}={_clipped(value)}" for path, value in settings.items()]
        wanted = name = f"{file} [{', '.join(parts)}]" if parts else file
        number = 2
        while name in self._names:
            name, number = f"{wanted} #{number}", number + 1
        self._names.add(name)
        return name

    def _references(self, scenario: Path, text: str, case: Case) -> str:
        """Return a digest of the files that a scenario names with the settings of its case; empty
        if it names none."""
        root = self._root(text)
        if root is None:
            return ""
        root = varied(root, case, Findings(str(scenario)))
        parts = [self._digest(path) for path in referenced_files(root, scenario.parent)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16] if parts else ""

    @cached_method
    def _text(self, path: Path) -> str | None:
        """Return the text of a file; None if it is unreadable, which the run then reports."""
        return read_source(path, Findings(str(path)))

    @cached_method
    def _root(self, text: str) -> Node | None:
        return root_of(text)

    @cached_method
    def _digest(self, path: Path) -> str:
        data = read_bytes(path, Findings(str(path)), Place())
        return "" if data is None else hashlib.sha256(data).hexdigest()


def _is_scenario(text: str | None) -> bool:
    """Return whether a found file is intended as a scenario. In doubt, True: a broken scenario must
    not disappear from the batch."""
    if text is None or kind_of(text) == "scenario":
        return True
    try:
        root = read_document(text).root
    except DocumentError:
        return bool(re.search(r"^(map|robots)\s*:", text, re.MULTILINE))
    if not isinstance(root, Mapping) or root.get("batch") is not None:
        return False
    keys = {key.text for key, _ in root.entries}
    return "safenav" in keys or {"map", "robots"} <= keys


def _files_below(folder: Path) -> list[Path]:
    """Return the sorted YAML files below a folder, without hidden folders and ``LEFT_OUT``. Do not
    follow links to folders, since they could form a cycle."""

    def unreadable(error: OSError) -> None:
        raise UsageError(f"cannot read the folder {error.filename}: {error.strerror}") from error

    found: list[Path] = []
    for place, folders, files in os.walk(folder, onerror=unreadable):
        folders[:] = [f for f in folders if f not in LEFT_OUT and not f.startswith(".")]
        found += [Path(place, file) for file in files if not file.startswith(".")]
    return sorted(file for file in found if file.suffix in _SUFFIXES)


def _files_matching(pattern: str) -> list[Path]:
    wanted = not set(LEFT_OUT).isdisjoint(PurePath(pattern).parts)
    found = map(Path, sorted(glob.glob(pattern, recursive=True)))  # noqa: PTH207 (may be absolute)
    return [
        path
        for path in found
        if (wanted or set(LEFT_OUT).isdisjoint(path.parent.parts))
        and path.suffix in _SUFFIXES
        and not path.is_dir()
    ]


def _clipped(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    line = " ".join(text.split())
    return line if len(line) <= _WIDTH else line[: _WIDTH - 3] + "..."
