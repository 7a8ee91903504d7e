"""Requests to a running ``slugs --serve`` and its answers, a line each."""

from __future__ import annotations

import json
import selectors
import tempfile
import time
from collections.abc import Mapping, Sequence
from typing import IO, Any

from safenav.errors import SynthesizerError
from safenav.synthesis.process import Crew, Finished, kill_group

_CHUNK = 1 << 16
_MOST_LINE = 64 << 20
"""Bytes of an answer; a line that is longer is none."""


class Talk:
    """Lines to and from the process. ``seconds`` (wall) limit each answer; ``file``: an open one
    that the process shares; ``crew``: who can dismiss it, up to ``leave_crew``."""

    def __init__(self, command: Sequence[str], seconds: float, crew: Crew, file: IO[bytes]) -> None:
        self._program = command[0]
        self._seconds = seconds
        self._crew = crew
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 (closed in close)
        try:
            self._process = crew.start(command, self._errors, file)
        except BaseException:
            self._errors.close()
            raise
        self._selector = selectors.DefaultSelector()
        assert self._process.stdin and self._process.stdout
        self._given, self._output = self._process.stdin, self._process.stdout
        self._selector.register(self._output, selectors.EVENT_READ)
        self._heard = b""
        self._closed = False

    @property
    def pid(self) -> int:
        return self._process.pid

    def leave_crew(self) -> None:
        """From now on the owner of the strategy ends the process."""
        self._crew.forget(self._process)

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a request."""
        if self._closed:
            raise SynthesizerError(f"the synthesizer {self._program} has been closed")
        try:
            self._given.write(json.dumps(request).encode() + b"\n")
            line = self.hear(time.monotonic() + self._seconds)
        except TimeoutError:
            self.close()
            raise SynthesizerError(
                f"the synthesizer {self._program} gave no answer within {self._seconds:g} s"
            ) from None
        except BrokenPipeError:
            line = None
        if line is None:
            self._process.wait()
            status = self._process.returncode
            words = self._last_words()
            self.close()
            raise SynthesizerError(
                f"the synthesizer {self._program} ended while it served a strategy (exit status "
                f"{status})\n    it said last: {words or 'nothing'}"
            )
        answer = self.parsed(line)
        if "error" in answer:
            raise SynthesizerError(
                f"the synthesizer {self._program} does not understand a request: {answer['error']}"
            )
        return answer

    def hear(self, deadline: float | None) -> bytes | None:
        """The next line, None at the end. Raises TimeoutError."""
        while b"\n" not in self._heard:
            left = None if deadline is None else deadline - time.monotonic()
            if (left is not None and left <= 0) or not self._selector.select(left):
                raise TimeoutError
            data = self._output.read(_CHUNK)
            if not data:
                return None
            self._heard += data
            if len(self._heard) > _MOST_LINE:
                raise self.nonsense(self._heard[:200])
        line, _, self._heard = self._heard.partition(b"\n")
        return line

    def parsed(self, line: bytes) -> dict[str, Any]:
        try:
            answer = json.loads(line)
        except ValueError:
            answer = None
        if not isinstance(answer, dict):
            raise self.nonsense(line[:200])
        return answer

    def nonsense(self, answer: object) -> SynthesizerError:
        return SynthesizerError(f"the synthesizer {self._program} answers nonsense: {answer!r}")

    def ended(self, begun: float) -> Finished:
        """Its result, after its output has ended."""
        status = self._process.wait()
        self._errors.seek(0)
        errors = self._errors.read()
        self.close()
        return Finished(status, b"", errors, time.monotonic() - begun)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        kill_group(self._process)
        self._crew.forget(self._process)
        self._selector.close()
        self._given.close()
        self._output.close()
        self._process.wait()
        self._errors.close()

    def _last_words(self) -> str:
        self._errors.seek(0)
        return self._errors.read().decode("utf-8", "replace").strip().rpartition("\n")[2][:500]
