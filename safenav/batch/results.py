"""The results of a batch as a file: one line per case, written when it arrives.

However a batch ends, its results so far are in the file: ``--resume`` continues from them, and
``--baseline`` compares with them. A result is reused only for an equal case (by its fingerprint).
Only one batch at a time may use the folder.

Two runs of the same scenario behave identically, to the tick, so every difference from a baseline
is reported. Time is noisy: a case counts as slower only if its run took longer by ``RATIO`` and by
more than ``NOISE_SECONDS``.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import IO

from msgspec import Struct, convert, field, to_builtins

from safenav.batch.case import Result
from safenav.errors import UsageError
from safenav.lines import json_flaw, json_line, read_file
from safenav.strict_json import read_json

NAME = "results.jsonl"
RATIO = 1.5
NOISE_SECONDS = 0.1

_BEHAVIOUR = ("outcome", "cause", "ticks", "rounds", "resolved", "blocked", "helpers", "syntheses")


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


def read_results(path: Path) -> dict[str, Result]:
    """Return the results of an earlier batch by name: its folder, or the file in it. Raises
    UsageError for any other file."""
    path = path / NAME if path.is_dir() else path
    try:
        lines = read_file(path).splitlines()
    except OSError as error:
        raise UsageError(f"cannot read the baseline {path}: {error.strerror}") from error
    found = {}
    for number, line in enumerate(lines, 1):
        try:
            result = convert(read_json(line), Result)
        except ValueError as error:
            raise UsageError(
                f"{path}:{number} is not a result of a batch ({json_flaw(error)})\n"
                f"    a baseline is the {NAME} that a batch wrote into its --out"
            ) from error
        found[result.name] = result
    return found


class BaselineComparison(Struct, frozen=True):
    """Differences from a baseline. ``changed``: by case, one sentence per difference; ``slower``:
    seconds before and now, the most lost first; ``new``, ``gone``: names of cases with a result
    only in this batch, or only in the baseline."""

    changed: dict[str, list[str]] = field(default_factory=dict)
    slower: dict[str, tuple[float, float]] = field(default_factory=dict)
    new: list[str] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)


def compare(
    results: Iterable[Result], former: Mapping[str, Result], not_run: Iterable[str] = ()
) -> BaselineComparison:
    """Return the differences from the baseline. ``not_run``: names of cases of this batch without a
    result."""
    now = {result.name: result for result in results}
    both = [(former[name], result) for name, result in now.items() if name in former]
    changed = {result.name: _differences(before, result) for before, result in both}
    slower = {}
    for before, result in both:
        times = before.duration, result.duration
        lost = times[1] - times[0]
        if (
            before.passed
            and result.passed
            and lost > NOISE_SECONDS
            and times[1] >= RATIO * times[0]
        ):
            slower[result.name] = times
    return BaselineComparison(
        {name: what for name, what in changed.items() if what},
        dict(sorted(slower.items(), key=lambda item: item[1][0] - item[1][1])),
        [name for name in now if name not in former],
        [name for name in former if name not in now and name not in {*not_run}],
    )


def _differences(before: Result, now: Result) -> list[str]:
    found = []
    if before.verdict is not now.verdict:
        found.append(f"{before.verdict.value} before, {now.verdict.value} now")
    if before.outcome is None or now.outcome is None:
        return found
    for name in _BEHAVIOUR:
        was, is_now = getattr(before, name), getattr(now, name)
        if was != is_now:
            found.append(f"{name}: {_shown(was)} before, {_shown(is_now)} now")
    return found


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {item}" for key, item in sorted(value.items())) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(str(item) for item in value) + "]"
    return "nothing" if value is None else str(value)
