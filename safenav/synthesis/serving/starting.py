"""Starting ``slugs --serve``: from a specification to a strategy that can be asked."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence

from safenav.errors import SynthesizerError
from safenav.outcome import Verdict
from safenav.spec.specification import Specification
from safenav.synthesis.binary import Binary, find_own_binary
from safenav.synthesis.process import Crew
from safenav.synthesis.result import failure, verdict_of
from safenav.synthesis.serving.connection import Connection
from safenav.synthesis.serving.served import ServedStrategy

PROTOCOL = 1
_OVERTIME_SECONDS = 1.0


def serve(
    specification: Specification,
    binary: Binary | None = None,
    *,
    options: Sequence[str] = (),
    seconds: float | None = 60.0,
    memory_mb: int | None = 2048,
    answer_seconds: float = 60.0,
    crew: Crew | None = None,
) -> ServedStrategy | Verdict:
    """Solve, and keep the process for moves; any verdict but realizable is returned as such.

    ``seconds`` (wall) and ``memory_mb`` limit the solving, ``answer_seconds`` each later answer.
    While it solves, the process belongs to ``crew``. Raises SynthesizerError if safenav's own
    binary is missing or breaks, DismissedError after the crew was dismissed.
    """
    binary = binary or find_own_binary()
    if binary is None or not binary.native:
        raise SynthesizerError(
            "safenav's own slugs binary, which serves strategies, is missing: run `make slugs` "
            "or `pip install .`"
        )
    command = [str(binary.path), *options]
    if seconds is not None:
        command += ["--timeout", f"{seconds:g}"]
    if memory_mb is not None:
        command += ["--memory", str(memory_mb)]
    crew = crew or Crew()
    begun = time.monotonic()
    # The program's standard input is for requests, so the specification is a file: one without
    # a name, of which nothing is left whatever becomes of us.
    with tempfile.TemporaryFile() as file:
        file.write(specification.to_structuredslugs().encode())
        file.seek(0)
        place = f"/dev/fd/{file.fileno()}"
        connection = Connection([*command, "--serve", place], answer_seconds, crew, file)
        try:
            line = connection.read_line(
                None if seconds is None else begun + seconds + _OVERTIME_SECONDS
            )
            if line is None:
                ended = connection.ended(begun)
                verdict = verdict_of(ended, binary, specification.robot)
                if verdict is Verdict.REALIZABLE:
                    raise failure("serves no strategy", ended, binary, specification.robot)
                return verdict
            greeting = connection.parsed(line)
            if greeting.get("protocol") != PROTOCOL:
                raise connection.invalid(greeting)
            strategy = ServedStrategy(connection, specification, greeting)
        except TimeoutError:
            connection.close()
            return Verdict.TIMEOUT
        except BaseException:
            connection.close()
            raise
    connection.leave_crew()
    return strategy
