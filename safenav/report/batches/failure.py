"""Files that a batch keeps of a failed case: the reason, the trace, and its replay as a page."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from safenav.batch.case import Result, file_name
from safenav.errors import UsageError
from safenav.report.batches.junit import result_lines

FOLDER = "failures"


class FailureFolder:
    """Folders of failed cases below ``directory/failures``. Unless ``keep``, files of a former
    batch are removed."""

    def __init__(self, directory: Path, *, keep: bool) -> None:
        self._root = directory / FOLDER
        if not keep:
            shutil.rmtree(self._root, ignore_errors=True)

    def keep_only(self, results: Iterable[Result]) -> None:
        """Remove the files of all other results: failures that were fixed, or whose scenario has
        changed."""
        kept = {self._folder(result) for result in results if not result.passed}
        for folder in self._root.glob("*") if self._root.is_dir() else ():
            if folder not in kept and (folder / "reason.txt").is_file():
                shutil.rmtree(folder, ignore_errors=True)

    def _folder(self, result: Result) -> Path:
        return self._root / file_name(result.name, result.fingerprint)

    def __call__(self, result: Result, trace: bytes) -> list[str]:
        folder = self._folder(result)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            return self._write(folder, result, trace)
        except OSError as error:
            raise UsageError(f"cannot write to {folder}: {error.strerror}") from error

    @staticmethod
    def _write(folder: Path, result: Result, trace: bytes) -> list[str]:
        files = [folder / "reason.txt"]
        lines = [result.name, *result_lines(result)]
        if trace:
            files.append(folder / "trace.jsonl")
            files[-1].write_bytes(trace)
            try:
                from safenav.report.page.html import page_of_trace
                from safenav.trace.reading import read_trace

                page = page_of_trace(read_trace(files[-1]), files[-1].name)
            except Exception as error:
                # A trace cut off in its first line is unreadable, and no error of the replay of a
                # failure must end the batch.
                lines += ["", f"no replay: {type(error).__name__}: {error}"]
            else:
                files.append(folder / "replay.html")
                files[-1].write_text(page, encoding="utf-8")
        files[0].write_text("\n".join([*lines, ""]), encoding="utf-8")
        return [str(file) for file in files]
