"""Trace files (docs/trace.md): typed records are read from them, and appended to them.

A writer that was killed leaves an incomplete last line: that is not an error, ``cut_off`` records
it. Any other line that violates the format is one diagnostic; all are reported. Each line is
flushed when it happens.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path
from typing import IO, Any

from msgspec import Struct
from msgspec.structs import replace

import safenav
from safenav.errors import Diagnostic, InputError, UsageError
from safenav.files import another_kind, json_flaw, json_line, read_file
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.objective import target_regions
from safenav.strict_json import flaws, note_flaw, read_json
from safenav.trace.fields import WrongError, convert, plain
from safenav.trace.records import (
    KINDS,
    VERSION,
    Act,
    ActionEnd,
    Arrive,
    Depart,
    Discovered,
    End,
    Header,
    Late,
    Record,
)


class Trace(Struct, frozen=True):
    """A whole trace. ``cut_off``: its last line was incomplete (the writer was killed).
    ``ignored`` counts the notes of types that this version does not know; ``digest``: sha256 of
    its file; ``first``: the text of its first line."""

    source: str
    header: Header
    records: tuple[Record, ...]
    cut_off: bool
    ignored: int
    digest: str = ""
    first: bytes = b""

    @property
    def outcome(self) -> End | None:
        """The end of the run, or None if the trace does not record it."""
        return next((r for r in reversed(self.records) if isinstance(r, End)), None)

    @property
    def scenario(self) -> Scenario:
        """The scenario of the run; its source is the trace."""
        return replace(self.header.scenario, source=self.source)

    @property
    def robots(self) -> dict[str, Robot]:
        """Return all robots by name."""
        return {robot.name: robot for robot in self.header.scenario.robots}

    @property
    def obstacles(self) -> dict[str, Obstacle]:
        """Return all obstacles by name: those of the header, and those discovered later."""
        found = [r.obstacle for r in self.records if isinstance(r, Discovered)]
        return {o.name: o for o in (*self.header.scenario.obstacles, *found)}

    @property
    def steps(self) -> list[tuple[Depart, Arrive | None]]:
        """The steps of a live run, each with its end: None if it was under way when the run
        ended."""
        ends = {r.command: r for r in self.records if isinstance(r, Arrive)}
        return [(r, ends.get(r.command)) for r in self.records if isinstance(r, Depart)]

    @property
    def acts(self) -> list[tuple[Act, ActionEnd | None]]:
        """The actions of a live run, likewise."""
        ends = {r.command: r for r in self.records if isinstance(r, ActionEnd)}
        return [(r, ends.get(r.command)) for r in self.records if isinstance(r, Act)]


def unstarted(scenario: Scenario) -> Trace:
    """Return the trace of a run of the scenario that has not begun."""
    header = Header(0, VERSION, safenav.__version__, scenario.recorded, "external")
    return Trace(scenario.name, header, (), cut_off=False, ignored=0)


_DIAGNOSTIC_LIMIT = 20
MOST_OF_A_LINE = 10_000_000
"""Bytes."""
_BEGINNING = 4000
"""Bytes of a file from which its kind is recognized."""
_WRITTEN = "not a trace of safenav: 'safenav run SCENARIO --trace FILE' writes one"
_PERHAPS_CONTROL = re.compile(rb"\\[bfnrtu]|[\x7f-\xff]")
"""Bytes of JSON whose strings may hold control characters."""
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
_TEXTS = ("explanation", "because", "reason")
"""Fields whose text may have several lines."""


def read_trace(path: str | Path) -> Trace:
    """The trace in a file (``-``: standard input). Raises InputError if it cannot be read or is not
    a trace."""
    return read_bytes(read_content(path), "<stdin>" if str(path) == "-" else str(path))


def read_content(path: str | Path) -> bytes:
    """The bytes of a file (``-``: standard input). Raises InputError if it cannot be read."""
    try:
        return read_file(None if str(path) == "-" else path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError([Diagnostic(str(path), 0, 0, f"cannot be read: {reason}")]) from error


def read_lines(lines: Iterable[str], source: str = "<trace>") -> Trace:
    """The trace in some lines (with or without their line ends). Raises InputError."""
    whole = "".join(line if line.endswith("\n") else line + "\n" for line in lines)
    return read_bytes(whole.encode("utf-8", "surrogatepass"), source)


def read_bytes(content: bytes, source: str = "<trace>") -> Trace:
    """The trace in some bytes. ``source`` names it in messages. Raises InputError."""
    if wrong := another_kind(content[:_BEGINNING].decode("utf-8", "replace"), "trace", source):
        raise InputError([Diagnostic(source, 0, 0, *wrong)])
    lines = content.split(b"\n")
    unfinished = lines.pop()  # empty if the last line is complete
    reader = _Reader(source)
    for number, line in enumerate(lines, start=1):
        reader.take(number, line)
    cut_off = False
    if unfinished.strip():
        cut_off = not _is_json(unfinished)
        if not cut_off:
            reader.take(len(lines) + 1, unfinished)
    first, digest = content.lstrip().partition(b"\n")[0].strip(), sha256(content).hexdigest()
    return replace(reader.trace(cut_off), digest=digest, first=first)


def _shown(value: Any, *, lines: bool = False) -> Any:
    """Return a value whose names are safe on a terminal; ``lines``: a text keeps its line ends."""
    match value:
        case str():
            return "\n".join(map(_escaped, value.split("\n"))) if lines else _escaped(value)
        case list():
            return [_shown(item) for item in value]
        case dict():
            items = value.items()
            return {_escaped(k): _shown(item, lines=k in _TEXTS) for k, item in items}
    return value


def _escaped(text: str) -> str:
    """The text with each control character as its escape, such as ``\\x1b``: a terminal would obey
    it, a line end would start a new line, and no SVG can hold it."""
    return _CONTROL.sub(lambda found: found.group().encode("unicode_escape").decode(), text)


class _Reader:
    def __init__(self, source: str) -> None:
        self._source = source
        self._header: Header | None = None
        self._records: list[Record] = []
        self._robots: set[str] = set()
        self._obstacles: set[str] = set()
        self._ignored = 0
        self._diagnostics: list[Diagnostic] = []  # the first ones
        self._found = 0
        self._headless = False

    def take(self, number: int, content: bytes) -> None:
        if self._headless or not content.strip():
            return
        if len(content) > MOST_OF_A_LINE:
            self._refuse(number, f"this line is longer than {MOST_OF_A_LINE // 1_000_000} MB")
            return
        try:
            data = read_json(content)
        except ValueError as error:
            self._refuse(number, f"this line is not JSON: {json_flaw(error)}")
            return
        if not isinstance(data, dict):
            self._refuse(number, "a line of a trace is a JSON object")
            return
        try:
            self._take_line(number, _shown(data) if _PERHAPS_CONTROL.search(content) else data)
        except RecursionError:
            self._report(number, "this line is too deeply nested")

    def _take_line(self, number: int, data: dict[str, Any]) -> None:
        kind = data.get("type")
        if not isinstance(kind, str):
            self._report(number, "`type` must be a string that says what kind of line this is")
        elif kind == Header.type:
            self._take_header(number, data)
        elif self._header is None and not self._diagnostics:
            self._refuse(number, "the first line must be the header")
        elif found := note_flaw(data, kind, fact=kind in KINDS and not KINDS[kind].note):
            self._report(number, found)
        elif kind in KINDS:
            record = self._convert(number, KINDS[kind], data)
            if isinstance(record, Discovered):
                self._announce(number, record.obstacle.name, "is known already")
            if record is not None and self._names_robots(number, record):
                self._records.append(record)
        else:
            self._ignored += 1

    def trace(self, cut_off: bool) -> Trace:
        """Return the trace as read. Raises InputError."""
        if self._diagnostics:
            shown = self._diagnostics
            if hidden := self._found - len(shown):
                shown.append(Diagnostic(self._source, 0, 0, f"and {hidden} more such problems"))
            raise InputError(shown)
        if self._header is None:
            message = "the first line is incomplete" if cut_off else "the trace is empty"
            raise InputError([Diagnostic(self._source, 0, 0, message)])
        return Trace(self._source, self._header, tuple(self._records), cut_off, self._ignored)

    def _take_header(self, number: int, data: dict[str, Any]) -> None:
        if self._header is not None:
            self._report(number, "a second header: a trace holds one run")
            return
        version = data.get("trace")
        if type(version) is int and version != VERSION:
            self._headless = True
            again = "run its scenario again, or use the safenav that wrote it"
            self._report(number, f"`trace` is {version}: version {VERSION} can be read", again)
            return
        header = self._convert(number, Header, {"tick": 0, **data})
        if isinstance(header, Header):
            self._header = header
            self._robots = {robot.name for robot in header.scenario.robots}
            if found := _misfit(header.scenario):
                self._report(number, found)
            # An obstacle that reappears has several entries, in any order.
            listed = sorted(header.scenario.obstacles, key=lambda each: each.appears is not None)
            for obstacle in listed:
                if obstacle.appears is not None and obstacle.name in self._obstacles:
                    continue
                self._announce(number, obstacle.name, "is the name of two obstacles")

    def _convert(self, number: int, kind: type[Record], data: dict[str, Any]) -> Record | None:
        try:
            record: Record = convert(kind, data)
        except WrongError as error:
            found = [str(error)]
        else:
            found = [*flaws(data, kind.type)]
        for sentence in found:
            self._report(number, sentence)
        return None if found else replace(record, line=number)

    def _names_robots(self, number: int, record: Record) -> bool:
        """Whether the header has all robots that a line names; a dropped report may name others."""
        known = self._robots
        named = {getattr(record, "robot", None), *(getattr(record, "robots", None) or ())} - {None}
        if self._header is None or isinstance(record, Late) or named <= known:
            return True
        self._report(number, f"the header has no robot {min(named - known)}")
        return False

    def _announce(self, number: int, obstacle: str, problem: str) -> None:
        if obstacle in self._obstacles:
            self._report(number, f"{obstacle} {problem}")
        self._obstacles.add(obstacle)

    def _refuse(self, number: int, found: str) -> None:
        """Report a line that is not a record; if it is the first one, no other is checked."""
        self._headless = self._header is None and not self._diagnostics
        self._report(number, found, _WRITTEN if self._headless else "")

    def _report(self, number: int, found: str, hint: str = "") -> None:
        self._found += 1
        if self._found <= _DIAGNOSTIC_LIMIT:
            self._diagnostics.append(Diagnostic(self._source, number, 1, found, hint))


def _misfit(scenario: Scenario) -> str | None:
    """The first name or region of a scenario that does not fit its map and its team."""
    world, names = scenario.map, {robot.name for robot in scenario.robots}
    objectives = [change.objective for change in scenario.changes]
    for robot in scenario.robots:
        inputs = (objective for _, objective in robot.when)
        objectives += [robot.objective, robot.while_waiting, *inputs]
    places = {
        "the map": {*world.walls, *world.names.values()}.union(*world.areas.values()),
        "robots": {robot.start.region for robot in scenario.robots},
        "obstacles": {each.region for each in scenario.obstacles},
        "objectives": target_regions(None).union(*map(target_regions, objectives)),
        "chargers": scenario.chargers,
        "never_together": frozenset[int]().union(*(z.regions for z in scenario.never_together)),
    }
    for what, regions in places.items():
        if regions and max(regions) >= world.size:
            return f"`scenario`: {what}: region {max(regions)} is not on the map"
    if len(names) < len(scenario.robots):
        return "`scenario`: two robots have one name"
    named = {each.robot for each in scenario.changes}
    named = named.union(*(zone.robots for zone in scenario.never_together))
    return f"the header has no robot {min(named - names)}" if named - names else None


def _is_json(content: bytes) -> bool:
    try:
        read_json(content)
    except ValueError:
        return False
    return True


Listener = Callable[[Record], None]
"""Receives each record of a run as it happens."""


def as_data(record: Record) -> dict[str, Any]:
    """The record as one JSON object of the trace."""
    data = {"type": record.type, **plain(record)}
    if record.note:
        data["note"] = True
    if isinstance(record, Header):
        del data["tick"]
    return data


class TraceWriter:
    """A listener that appends each record to a file and flushes it. The first record replaces what
    the file held; a run that is refused before leaves it as it was.

    Raises UsageError when the file cannot be opened or written: a run whose trace is lost must
    not continue.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path = Path(path)
        self._begun = False
        self._made = not path.exists()
        try:
            self._file: IO[str] = path.open("a", encoding="utf-8")
        except OSError as error:
            raise self._failure(error) from error
        except BaseException:
            self._remove_empty()
            raise

    def __call__(self, record: Record) -> None:
        line = json_line(as_data(record))
        try:
            if not self._begun and stat.S_ISREG(os.fstat(self._file.fileno()).st_mode):
                self._made = True
                self._file.truncate(0)
            self._file.write(line)
            self._file.flush()
            self._begun = True
        except OSError as error:
            raise self._failure(error) from error

    def _remove_empty(self) -> None:
        """An interrupt before the first record leaves no empty file."""
        if self._made and not self._begun:
            self._path.unlink(missing_ok=True)

    def _failure(self, error: OSError) -> UsageError:
        return UsageError(f"cannot write the trace {self._path}: {error.strerror}")

    def __enter__(self) -> TraceWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            self._file.close()
            self._remove_empty()
        except OSError as failure:
            if kind is None:
                raise self._failure(failure) from failure
