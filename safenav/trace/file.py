"""Trace files (docs/trace.md): reading and appending typed records.

A killed writer leaves an incomplete last line, which is not an error: ``cut_off`` records it. Any
other line that violates the format is one diagnostic: the first ones are reported, others counted.
If the first line is not a header, only this is reported. Each line is flushed as it happens.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import IO, Any, TypeVar

from msgspec import Struct
from msgspec.structs import replace

import safenav
from safenav.errors import Diagnostic, InputError, UsageError
from safenav.files import check_kind, json_flaw, json_line, read_input
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
    """A whole trace. ``cut_off``: whether its last line is incomplete (the writer was killed).
    ``digest``: sha256 of its file; ``first``: the text of its first line."""

    source: str
    header: Header
    records: tuple[Record, ...]
    cut_off: bool
    digest: str = ""
    first: bytes = b""

    @property
    def outcome(self) -> End | None:
        """The end of the run; None if the trace does not contain it."""
        return next((r for r in reversed(self.records) if isinstance(r, End)), None)

    @property
    def scenario(self) -> Scenario:
        """The scenario of the run, with the trace as its source."""
        return replace(self.header.scenario, source=self.source)

    @property
    def robots(self) -> dict[str, Robot]:
        """All robots by name."""
        return {robot.name: robot for robot in self.header.scenario.robots}

    @property
    def obstacles(self) -> dict[str, Obstacle]:
        """All obstacles by name: those of the header and those discovered later."""
        found = [r.obstacle for r in self.records if isinstance(r, Discovered)]
        return {o.name: o for o in (*self.header.scenario.obstacles, *found)}

    @property
    def steps(self) -> list[tuple[Depart, Arrive | None]]:
        """The steps of a live run as pairs of departure and arrival; None for a step in progress at
        the end of the run."""
        ends = {r.command: r for r in self.records if isinstance(r, Arrive)}
        return [(r, ends.get(r.command)) for r in self.records if isinstance(r, Depart)]

    @property
    def acts(self) -> list[tuple[Act, ActionEnd | None]]:
        """The actions of a live run as pairs of start and end (None: it has not ended)."""
        ends = {r.command: r for r in self.records if isinstance(r, ActionEnd)}
        return [(r, ends.get(r.command)) for r in self.records if isinstance(r, Act)]


def unstarted(scenario: Scenario) -> Trace:
    """Return the trace of a run of the scenario that has not begun."""
    header = Header(0, VERSION, safenav.__version__, scenario.recorded, "external")
    return Trace(scenario.name, header, (), cut_off=False)


_DIAGNOSTIC_LIMIT = 20
MOST_OF_A_LINE = 10_000_000
"""Maximum length of a line, in bytes."""
_BEGINNING = 4000
"""Initial bytes of a file that show its kind."""
_HEADER = '{{"type":"header","{}":{}'
_WRITTEN = (
    f"a trace begins with {_HEADER.format('trace', VERSION)} ('safenav run SCENARIO --trace FILE' "
    f"writes one), a motion file with {_HEADER.format('motion', 1)} ('safenav export TRACE "
    "--motion FILE')"
)
_PERHAPS_CONTROL = re.compile(rb"\\[bfnrtu]|[\x7f-\xff]")
"""Bytes of a line whose strings may contain control characters."""
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
_TEXTS = ("explanation", "because", "reason")
"""Fields whose text may have several lines."""


def read_trace(path: str | Path) -> Trace:
    """Return the trace in a file (``-``: standard input). Raises InputError if it is unreadable or
    not a trace."""
    return read_bytes(read_input(path), str(path))


def read_bytes(content: bytes, source: str = "<trace>") -> Trace:
    """Return the trace in the bytes of a file. ``source``: its name in messages. Raises InputError
    with up to twenty diagnostics, one per invalid line, and the number of others."""
    check_kind(content[:_BEGINNING], "trace", source)
    lines = content.split(b"\n")
    cut_off = bool(lines[-1].strip()) and not _is_json(lines[-1])
    reader, found, more = _Reader(), list[Diagnostic](), 0
    for number, line in enumerate(lines[:-1] if cut_off else lines, start=1):
        try:
            if line.strip():
                reader.take(number, line)
        except (WrongError, RecursionError) as error:
            words = error.args if isinstance(error, WrongError) else ("it is nested too deeply",)
            if len(found) < _DIAGNOSTIC_LIMIT:
                found.append(Diagnostic(source, number, 1, *words))
            else:
                more += 1
            if reader.header is None:
                break
    if reader.header is None and not found:
        message = "the first line is incomplete" if cut_off else "the trace is empty"
        found = [Diagnostic(source, 0, 0, message)]
    if found:
        rest = [Diagnostic(source, 0, 0, f"and {more} more errors")] if more else []
        raise InputError([*found, *rest])
    assert reader.header is not None
    first, digest = content.lstrip().partition(b"\n")[0].strip(), sha256(content).hexdigest()
    records = tuple(reader.records)
    return Trace(source, reader.header, records, cut_off, digest, first)


def _is_json(content: bytes) -> bool:
    try:
        read_json(content)
    except ValueError:
        return False
    return True


def _shown(value: Any, *, lines: bool = False) -> Any:
    """Return a value with all strings safe on a terminal. ``lines``: keep line ends."""
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
    """Return a text with each control character replaced by an escape, such as ``\\x1b``: a
    terminal would obey it, a line end would start a new line, and no SVG can hold it."""
    return _CONTROL.sub(lambda found: found.group().encode("unicode_escape").decode(), text)


class _Reader:
    """A reader of the lines of a file, in order."""

    def __init__(self) -> None:
        self.header: Header | None = None
        self.records: list[Record] = []
        self._robots: set[str] = set()
        self._obstacles: set[str] = set()

    def take(self, number: int, content: bytes) -> None:
        """Read a line. Raises WrongError, with a hint if the file is not a trace."""
        hint = () if self.header else (_WRITTEN,)
        if len(content) > MOST_OF_A_LINE:
            raise WrongError(f"the line is longer than {MOST_OF_A_LINE // 1_000_000} MB", *hint)
        try:
            data = read_json(content)
        except ValueError as error:
            raise WrongError(f"this line is not JSON: {json_flaw(error)}", *hint) from None
        if not isinstance(data, dict):
            raise WrongError("each line of a trace must be a JSON object", *hint)
        if _PERHAPS_CONTROL.search(content):
            data = _shown(data)
        kind = data.get("type")
        if not isinstance(kind, str):
            raise WrongError("`type` must be a string that names the kind of the line", *hint)
        if self.header is None:
            self._begin(number, data)
        elif kind == Header.type:
            raise WrongError("a second header: a trace holds one run")
        elif found := note_flaw(data, kind, fact=kind in KINDS and not KINDS[kind].note):
            raise WrongError(found)
        elif kind in KINDS:  # a note of another type is skipped
            self._add(_converted(number, KINDS[kind], data))

    def _begin(self, number: int, data: dict[str, Any]) -> None:
        if data["type"] != Header.type:
            raise WrongError("the first line must be the header", _WRITTEN)
        version = data.get("trace")
        if type(version) is int and version != VERSION:
            again = "run its scenario again, or use the safenav that wrote it"
            raise WrongError(f"`trace` is {version}: version {VERSION} can be read", again)
        header = _converted(number, Header, {"tick": 0, **data})
        scenario = header.scenario
        if found := _misfit(scenario):
            raise WrongError(found)
        # A reappearing obstacle has several entries, in any order.
        first = [each.name for each in scenario.obstacles if each.appears is None]
        if len({*first}) < len(first):
            raise WrongError("two obstacles have the same name")
        self._obstacles = {each.name for each in scenario.obstacles}
        self._robots = {robot.name for robot in scenario.robots}
        self.header = header

    def _add(self, record: Record) -> None:
        """Add a record. Only a dropped report may name robots that are not in the header."""
        if isinstance(record, Discovered):
            if record.obstacle.name in self._obstacles:
                raise WrongError(f"{record.obstacle.name} already exists")
            self._obstacles.add(record.obstacle.name)
        named = {getattr(record, "robot", None), *(getattr(record, "robots", None) or ())} - {None}
        if not (isinstance(record, Late) or named <= self._robots):
            raise WrongError(f"the header has no robot {min(named - self._robots)}")
        self.records.append(record)


R = TypeVar("R", bound=Record)


def _converted(number: int, kind: type[R], data: dict[str, Any]) -> R:
    """Return a line's data as a record. Raises WrongError."""
    record: R = convert(kind, data)
    if flaw := next(flaws(data, kind.type), None):
        raise WrongError(flaw)
    return replace(record, line=number)


def _misfit(scenario: Scenario) -> str | None:
    """Return an error if a scenario names a robot or region that its team or map lacks, or has two
    robots with one name; else None."""
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


Listener = Callable[[Record], None]
"""A function that receives each record of a run as it happens."""


def as_data(record: Record) -> dict[str, Any]:
    """Return the record as a JSON object of the trace."""
    data = {"type": record.type, **plain(record)}
    if record.note:
        data["note"] = True
    if isinstance(record, Header):
        del data["tick"]
    return data


class TraceWriter:
    """A listener that appends each record to a file and flushes it. The first record replaces the
    file's content; a run that is refused earlier leaves the content unchanged.

    Raises UsageError if the file cannot be opened or written, since a run whose trace is lost must
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

    def __call__(self, record: Record) -> None:
        line = json_line(as_data(record))
        try:
            if not self._begun and stat.S_ISREG((file := os.fstat(self._file.fileno())).st_mode):
                self._made = True
                if file.st_size:  # the close of a truncated file waits for the disk
                    self._file.truncate(0)
            self._file.write(line)
            self._file.flush()
            self._begun = True
        except OSError as error:
            raise self._failure(error) from error

    def _remove_empty(self) -> None:
        """Remove the file if this writer has created it and written nothing."""
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
