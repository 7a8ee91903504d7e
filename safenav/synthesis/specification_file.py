"""Specifications in files: slugsin and structured slugs."""

from __future__ import annotations

import re
from pathlib import Path

from safenav.errors import Diagnostic, InputError
from safenav.file_kind import another_kind
from safenav.lines import read_file
from safenav.spec.specification import Specification, read_specification
from safenav.synthesis.binary import find_own_binary
from safenav.synthesis.process import Finished, ProcessGroup
from safenav.synthesis.slugs import ExitStatus

_ERROR = re.compile(r"-:(\d+):(\d+): error: (.*)")
_HINT = re.compile(r"\s*hint: (.*)")
MOST_OF_A_TEXT = 20_000_000
"""Bytes."""
_SECONDS = 60.0


def load_specification(path: Path) -> Specification:
    """Return the specification in a file. Raises InputError as ``specification_in`` does."""
    try:
        data = read_file(path, MOST_OF_A_TEXT)
    except OSError as error:
        raise InputError([Diagnostic(str(path), 0, 0, error.strerror or str(error))]) from error
    return specification_in(data, str(path), path.stem)


def specification_in(data: bytes, file: str, robot: str) -> Specification:
    """Return the specification that a file holds.

    Raises InputError with all errors that safenav's synthesizer finds in its text.
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError([Diagnostic(file, 0, 0, "not valid UTF-8 text")]) from error
    if wrong := another_kind(text, "specification", file):
        raise InputError([Diagnostic(file, 0, 0, *wrong)])
    done = _translated(data)
    if done is not None and done.status == ExitStatus.BAD_INPUT:
        raise InputError(_diagnostics(done.stderr.decode("utf-8", "replace"), file, text))
    return read_specification(text, file, robot)


def slugsin_of(spec: Specification) -> bytes | None:
    """Return a specification in slugsin, as safenav's own slugs translates it; None without it."""
    done = _translated(spec.to_structuredslugs().encode())
    return done.stdout if done is not None and done.status == ExitStatus.REALIZABLE else None


def _translated(data: bytes) -> Finished | None:
    own = find_own_binary()
    if own is None:
        return None
    translate = [str(own.path), "--translate", "-"]
    return ProcessGroup().run(translate, data, _SECONDS, own=own.ours)


def _diagnostics(output: str, file: str, text: str) -> list[Diagnostic]:
    """Errors as the synthesizer wrote them on standard error."""
    found: list[Diagnostic] = []
    lines = text.split("\n")
    hint = ""
    for line in reversed(output.splitlines()):  # a hint follows its error
        if error := _ERROR.fullmatch(line):
            row = int(error[1])
            source = lines[row - 1] if 0 < row <= len(lines) else ""
            found.append(Diagnostic(file, row, int(error[2]), error[3], hint, source))
            hint = ""
        elif hinted := _HINT.fullmatch(line):
            hint = hinted[1]
    return found[::-1] or [Diagnostic(file, 0, 0, output.strip() or "not a specification")]
