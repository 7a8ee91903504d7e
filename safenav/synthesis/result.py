"""The output of a finished synthesizer: its verdict, an exhausted limit, or an error.

The verdict is the RESULT line on standard error, whatever the exit status: upstream's binary exits
with 0 on both verdicts, safenav's with 0 and 10.
"""

from __future__ import annotations

import re
import signal
from enum import IntEnum

from safenav.errors import SynthesizerError
from safenav.outcome import Verdict
from safenav.synthesis.binary import VARIABLE, Binary
from safenav.synthesis.process import Finished

_RESULT = re.compile(rb"^RESULT: Specification is (realizable|unrealizable)\b", re.MULTILINE)
_OUT_OF_MEMORY = re.compile(
    rb"bad_alloc|out of memory|memory (limit|exhausted|allocation)|cannot allocate", re.IGNORECASE
)
_TOO_MANY_NODES = b"slugs: node limit reached"
_INTERRUPTED = re.compile(rb"interrupted", re.IGNORECASE)


class ExitStatus(IntEnum):
    """Exit statuses of safenav's binary (``slugs --help``)."""

    REALIZABLE = 0
    UNREALIZABLE = 10
    BAD_INPUT = 2
    RESOURCE_LIMIT = 3


def verdict_of(finished: Finished, binary: Binary, robot: str) -> Verdict:
    """Return the verdict. Raises SynthesizerError, with the last messages, if there is none."""
    if finished.timed_out:
        return Verdict.TIMEOUT
    verdicts = _RESULT.findall(finished.stderr)
    if finished.status < 0:
        return _killed(finished, binary, robot)
    if binary.native and finished.status == ExitStatus.RESOURCE_LIMIT:
        if _OUT_OF_MEMORY.search(finished.stderr):
            return Verdict.OUT_OF_MEMORY
        return Verdict.INTERRUPTED if _INTERRUPTED.search(finished.stderr) else Verdict.TIMEOUT
    if binary.native and finished.status == ExitStatus.BAD_INPUT:
        raise failure("rejects the specification", finished, binary, robot)
    if not verdicts:
        if _OUT_OF_MEMORY.search(finished.stderr):
            return Verdict.OUT_OF_MEMORY
        problem = f"printed no verdict (exit status {finished.status})"
        raise failure(problem, finished, binary, robot)
    verdict = Verdict(verdicts[-1].decode())
    if binary.native and finished.status != ExitStatus[verdict.name]:
        problem = f"printed {verdict}, but ended with exit status {finished.status}"
        raise failure(problem, finished, binary, robot)
    return verdict


def too_large(finished: Finished) -> bool:
    """Return whether the strategy has more nodes than its limit."""
    return finished.status == ExitStatus.RESOURCE_LIMIT and _TOO_MANY_NODES in finished.stderr


def failure(problem: str, finished: Finished, binary: Binary, robot: str) -> SynthesizerError:
    """Return an error with the problem, the synthesizer's last messages, and advice."""
    lines = [f"the synthesizer {binary.path} {problem} (robot '{robot}')"]
    words = finished.last_words
    if words:
        lines.append("    its last output:")
        lines += [f"      {line}" for line in words.splitlines()]
    else:
        lines.append("    it printed nothing")
    if binary.native:
        lines.append(
            "    `safenav synth -o DIR` writes the specification, to try and to report this"
        )
    else:
        lines.append(
            f"    check the binary that {VARIABLE} names, or unset it to use safenav's own"
        )
    return SynthesizerError("\n".join(lines))


def _killed(finished: Finished, binary: Binary, robot: str) -> Verdict:
    number = -finished.status
    try:
        name = signal.Signals(number).name
    except ValueError:
        name = f"signal {number}"
    if _OUT_OF_MEMORY.search(finished.stderr):  # foreign programs abort when memory is short
        return Verdict.OUT_OF_MEMORY
    problem = f"crashed ({name})"
    if number == signal.SIGKILL:
        problem = "was killed from outside (SIGKILL: perhaps the machine ran out of memory)"
    raise failure(problem, finished, binary, robot)
