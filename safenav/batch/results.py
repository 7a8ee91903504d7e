"""The results of a batch as a file: one line per case, written when it arrives.

However a batch ends, its results so far are in the file: ``--resume`` continues from them. A result
is reused only for an equal case (by its fingerprint). Only one batch at a time may use the folder.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import IO

from msgspec import convert, to_builtins

from safenav.batch.case import Result
from safenav.errors import UsageError
from safenav.lines import json_line

NAME = "results.jsonl"


class ResultsFile:
    """The file ``directory/results.jsonl``. ``resume``: keep its results; otherwise they are
    discarded, and must be of ``cases`` (names).

    ``former``: the kept results, by fingerprint; ``existed``: whether a batch has used the
    directory before.

    Raises UsageError if the directory cannot be used, is in use by another batch, or holds the
    results of another one.
    """

    def __init__(self, directory: Path, *, resume: bool, cases: Collection[str] = ()) -> None:
        self.path = directory / NAME
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self.existed = self.path.exists()
            self._file: IO[str] = self.path.open("a+", encoding="utf-8")
        except OSError as error:
            raise self._unusable(error) from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise UsageError(
                f"another batch is writing to {directory}\n    wait for it, or use another --out"
            ) from None
        found = self._read()
        others = sorted(result.name for result in found.values() if result.name not in {*cases})
        if others and not resume:
            self._file.close()
            count = f" and {len(others) - 1} more" if len(others) > 1 else ""
            raise UsageError(
                f"{directory} holds the results of another batch, of {others[0]}{count}\n"
                "    use another --out, or remove that one; --resume adds to it"
            )
        self.former = found if resume else {}
        self._file.truncate(0)  # in place, since this file is locked
        for result in self.former.values():
            self.add(result)
        os.fsync(self._file.fileno())

    def add(self, result: Result) -> None:
        """Append a result, which then survives the end of this process."""
        try:
            self._file.write(json_line(to_builtins(result)))
            self._file.flush()
        except OSError as error:
            raise self._unusable(error) from error

    def _read(self) -> dict[str, Result]:
        """Return the results by fingerprint. A line that was cut off is ignored: its case is run
        again."""
        found = {}
        self._file.seek(0)
        for line in self._file:
            try:
                result = convert(json.loads(line), Result)
            except ValueError:
                continue
            found[result.fingerprint] = result
        return found

    def _unusable(self, error: OSError) -> UsageError:
        return UsageError(f"cannot write the results of the batch, {self.path}: {error.strerror}")

    def __enter__(self) -> ResultsFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
