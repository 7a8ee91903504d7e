"""Requests to a running ``slugs --serve`` and its replies, one line each."""

from __future__ import annotations

import json
import selectors
import tempfile
import time
from collections.abc import Mapping, Sequence
from typing import IO, Any

from safenav.errors import SynthesizerError
from safenav.lines import json_line
from safenav.synthesis.process import Finished, ProcessGroup

_CHUNK = 1 << 16
_MOST_LINE = 64 << 20
"""Maximum length of a reply, in bytes."""


class Connection:
    """Lines to and from the process. ``seconds`` (wall) limit each reply; ``file``: an open file
    that the process shares; ``crew``: the group that can dismiss it until ``leave_crew``; ``own``:
    whether the program is safenav's own."""

    def __init__(
        self,
        command: Sequence[str],
        seconds: float,
        crew: ProcessGroup,
        file: IO[bytes],
        own: bool = False,
    ) -> None:
        self._program = command[0]
        self._seconds = seconds
        self._crew = crew
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 (closed in close)
        try:
            self._process = crew.start(command, self._errors, file, own)
        except BaseException:
            self._errors.close()
            raise
        self._selector = selectors.DefaultSelector()
        assert self._process.stdin and self._process.stdout
        self._given, self._output = self._process.stdin, self._process.stdout
        self._selector.register(self._output, selectors.EVENT_READ)
        self._read = b""
        self._closed = False

    @property
    def pid(self) -> int:
        return self._process.pid

    def leave_crew(self) -> None:
        """From now on, only the owner of the strategy ends the process."""
        self._crew.forget(self._process)

    def request(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the reply to a request. Raises SynthesizerError for an error or none in time."""
        if self._closed:
            raise SynthesizerError(f"the synthesizer {self._program} has been closed")
        try:
            self._given.write(json_line(request).encode())
            line = self.read_line(time.monotonic() + self._seconds)
        except TimeoutError:
            self.close()
            raise SynthesizerError(
                f"the synthesizer {self._program} sent no reply within {self._seconds:g} s"
            ) from None
        except BrokenPipeError:
            line = None
        if line is None:
            end = self.ended(0.0)
            words = end.last_words.rpartition("\n")[2][:500]
            raise SynthesizerError(
                f"the synthesizer {self._program} ended while it served a strategy (exit status "
                f"{end.status})\n    its last output: {words or 'nothing'}"
            )
        reply = self.parsed(line)
        if "error" in reply:
            raise SynthesizerError(
                f"the synthesizer {self._program} rejects a request: {reply['error']}"
            )
        return reply

    def read_line(self, deadline: float | None) -> bytes | None:
        """Return the next line, None at the end. Raises TimeoutError."""
        while b"\n" not in self._read:
            left = None if deadline is None else deadline - time.monotonic()
            if (left is not None and left <= 0) or not self._selector.select(left):
                raise TimeoutError
            data = self._output.read(_CHUNK)
            if not data:
                return None
            self._read += data
            if len(self._read) > _MOST_LINE:
                raise self.invalid(self._read[:200])
        line, _, self._read = self._read.partition(b"\n")
        return line

    def parsed(self, line: bytes) -> dict[str, Any]:
        try:
            reply = json.loads(line)
        except ValueError:
            reply = None
        if not isinstance(reply, dict):
            raise self.invalid(line[:200])
        return reply

    def invalid(self, reply: object) -> SynthesizerError:
        return SynthesizerError(f"the synthesizer {self._program} sent an invalid reply: {reply!r}")

    def ended(self, begun: float) -> Finished:
        """Return its result, after its output has ended."""
        status = self._process.wait()
        self._errors.seek(0)
        errors = self._errors.read()
        self.close()
        return Finished(status, b"", errors, time.monotonic() - begun)

    def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        self._selector.close()
        self._crew.end(self._process)
        self._errors.close()
