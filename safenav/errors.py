"""Outcomes of runs, verdicts of syntheses, and all intended errors with their exit codes.

A proven negative (unrealizable, operator needed) is not an error but an outcome, returned as data.
Errors are bad input, exhausted resources, and broken or missing programs.
"""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import NamedTuple


class Outcome(StrEnum):
    """The end of a run. ``ERROR``: a part failed, or a synthesis hit a limit; the trace is kept."""

    COMPLETED = "completed"
    OPERATOR_NEEDED = "operator_needed"
    UNREALIZABLE = "unrealizable"
    TICK_LIMIT = "tick_limit"
    TIME_LIMIT = "time_limit"
    SEARCH_LIMIT = "search_limit"
    ASSUMPTION_VIOLATED = "assumption_violated"
    LATE = "late"
    INTERRUPTED = "interrupted"
    ERROR = "error"


class Verdict(StrEnum):
    """The result of a synthesis."""

    REALIZABLE = "realizable"
    UNREALIZABLE = "unrealizable"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out_of_memory"

    @property
    def proven(self) -> bool:
        """Whether the verdict holds regardless of the limits."""
        return self in (Verdict.REALIZABLE, Verdict.UNREALIZABLE)


class ExitCode(IntEnum):
    """Exit status of every command (docs/commands.md)."""

    OK = 0
    NEGATIVE = 1
    BAD_INPUT = 2
    RESOURCE_LIMIT = 3
    INTERNAL = 4
    INTERRUPTED = 130


_OF_OUTCOMES = {
    Outcome.COMPLETED: ExitCode.OK,
    Outcome.TICK_LIMIT: ExitCode.RESOURCE_LIMIT,
    Outcome.TIME_LIMIT: ExitCode.RESOURCE_LIMIT,
    Outcome.SEARCH_LIMIT: ExitCode.RESOURCE_LIMIT,
    Outcome.INTERRUPTED: ExitCode.INTERRUPTED,
    Outcome.ERROR: ExitCode.INTERNAL,
}


def exit_code_of(outcome: Outcome) -> ExitCode:
    """Return the exit code of a run with this outcome, before the check of expectations."""
    return _OF_OUTCOMES.get(outcome, ExitCode.NEGATIVE)


def file_words(error: OSError) -> str:
    """Return the name of an unusable file, shortened if necessary, and the reason."""
    name, why = str(error.filename or ""), error.strerror or str(error)
    shown = name if len(name) <= _NAME else f"{name[: _NAME - 3]}..."
    return f"{shown}: {why}" if shown else why


_NAME = 96
"""Maximum number of characters of a file's name in a message."""
_LINE = 76
"""Width of an excerpt with its line number. Indented, it fits into 80 columns, so the caret stays
below its column."""
REPORTED = 100
"""Maximum number of diagnostics in a message, which states the number of others."""


def follows_an_interruption(error: BaseException | None) -> bool:
    """Return whether Ctrl-C led to an error: Python wraps interrupts in ``__set_name__``, and the
    code that ends an interrupted step may fail."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


class Diagnostic(NamedTuple):
    """One error in an input, with a hint for fixing it.

    ``line`` and ``column`` count from 1 (0: no position). ``found``: the error; ``hint``: how to
    fix it; ``source``: the text of the line. A caret below it shows the column.
    """

    file: str
    line: int
    column: int
    found: str
    hint: str = ""
    source: str = ""

    def __str__(self) -> str:
        place = self.file
        if self.line:
            place += f":{self.line}:{self.column}"
        parts = [f"{place}: {self.found}", *self._excerpt()]
        return "\n    ".join([*parts, self.hint] if self.hint else parts)

    def _excerpt(self) -> list[str]:
        """Return the text around the column in the line, and a caret below the column."""
        if not self.source.strip() or not 1 <= self.column <= len(self.source) + 1:
            return []
        shown = "".join(char if char.isprintable() else " " for char in self.source)
        number = str(self.line)
        width = _LINE - len(f"{number} | ")
        begin = max(0, self.column - 1 - width // 2) if len(shown) > width else 0
        part = shown[begin : begin + width].rstrip()
        return [f"{number} | {part}", f"{' ' * len(number)} | {' ' * (self.column - 1 - begin)}^"]


class SafenavError(Exception):
    """The base of all intended errors. Users see one message, never a traceback."""

    exit_code: ExitCode = ExitCode.INTERNAL


class InputError(SafenavError):
    """An unusable input. ``diagnostics``: all errors found in it, in file order."""

    exit_code = ExitCode.BAD_INPUT

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        lines = [str(d) for d in self.diagnostics[:REPORTED]]
        if len(self.diagnostics) > REPORTED:
            lines.append(f"and {len(self.diagnostics) - REPORTED} more")
        super().__init__("\n".join(lines))

    def __reduce__(self) -> tuple[type[InputError], tuple[Sequence[Diagnostic]]]:
        return type(self), (self.diagnostics,)  # for pickling between processes


class UsageError(SafenavError):
    """An impossible request, such as an unknown robot on the command line."""

    exit_code = ExitCode.BAD_INPUT


class SynthesizerError(SafenavError):
    """A synthesizer that is missing, has crashed, or has printed an invalid result."""

    exit_code = ExitCode.INTERNAL


class ResourceLimitError(SafenavError):
    """An exhausted limit of time, memory or size."""

    exit_code = ExitCode.RESOURCE_LIMIT


class NotCertifiedError(SafenavError):
    """A run's bundle that its checker refuses."""

    exit_code = ExitCode.NEGATIVE


def requirements(extra: str = "") -> tuple[str, ...]:
    """Return the requirements of an extra and its included extras; for ``""``, those of safenav
    itself."""
    # Imported here since this takes longer than the rest of the command line.
    from importlib import metadata

    found: list[str] = []
    for entry in metadata.requires("safenav") or []:
        required, _, marker = (part.strip() for part in entry.partition(";"))
        named = re.search(r"""extra == ['"]([\w-]+)['"]""", marker)
        if (named[1] if named else "") != extra:
            continue
        own = re.fullmatch(r"safenav\[([\w, -]+)\]", required)
        if own is None:
            found.append(re.sub(r"(<[^,]+),(>=.+)", r"\2,\1", required))
        else:
            found += [r for name in own[1].split(",") for r in requirements(name.strip())]
    return tuple(dict.fromkeys(found))


def install_command(extra: str = "") -> str:
    """Return the command that installs the requirements of an extra for this Python."""
    pip = "pip" if Path(sys.executable).with_name("pip").exists() else f"{sys.executable} -m pip"
    return f"{pip} install {' '.join(map(shlex.quote, requirements(extra)))}"


@contextmanager
def needing(user: str, extra: str, package: str = "") -> Iterator[None]:
    """Raise UsageError if this context imports a missing package of an extra. ``user``: the feature
    that needs it; ``package``: its name, if it differs from the module's."""
    try:
        yield
    except ImportError as error:
        raise missing_package(user, package or str(error.name), extra) from error


def missing_package(user: str, package: str, extra: str) -> UsageError:
    """Return the error for ``user`` (a feature) that needs a missing package of an extra."""
    return UsageError(
        f"{user} needs {package}, which is not installed\n    {install_command(extra)}"
    )
