"""Runs one command and says what it cost: CPU time and peak memory of exactly that child.

`os.wait4` gives the resource usage of the child it reaps, so other work on the machine and the
runner itself are not in the figures (except that Linux never reports a peak below the memory that
the runner had when it forked: see `memory_floor`).
"""

import os
import resource
import signal
import statistics
import subprocess
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Ending = Literal["realizable", "unrealizable", "timeout", "failed"]


@dataclass(frozen=True)
class Measurement:
    """One run. Seconds of user and system time together, peak resident memory in MB."""

    ending: Ending
    cpu_seconds: float
    wall_seconds: float
    peak_mb: float
    output_bytes: int
    exit_status: int
    message: str


@dataclass(frozen=True)
class Summary:
    """The medians of some runs of the same command, and the spread of the CPU time."""

    ending: Ending
    runs: int
    cpu_seconds: float
    cpu_spread: tuple[float, float]
    wall_seconds: float
    peak_mb: float
    output_bytes: int
    message: str


def measure(command: Sequence[str], timeout: float) -> Measurement:
    """Run `command` to its end, or kill it after `timeout` seconds of wall time."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        clock = _Clock()
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True
        )
        late = threading.Event()

        def kill() -> None:
            late.set()
            os.killpg(process.pid, signal.SIGKILL)

        timer = threading.Timer(timeout, kill)
        timer.start()
        try:
            _, status, usage = os.wait4(process.pid, 0)
        except KeyboardInterrupt:
            os.killpg(process.pid, signal.SIGKILL)
            os.wait4(process.pid, 0)
            raise
        finally:
            timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        err.seek(0)
        message = err.read().decode(errors="replace")
        return Measurement(
            "timeout" if late.is_set() else _ending(message),
            usage.ru_utime + usage.ru_stime,
            clock.seconds(),
            usage.ru_maxrss / 1024,
            os.fstat(out.fileno()).st_size,
            process.returncode,
            message.strip().splitlines()[-1] if message.strip() else "",
        )


def interleaved(
    commands: Sequence[Sequence[str]],
    repeat: int,
    timeout: float,
    progress: Callable[[Sequence[str]], None],
) -> list[Summary]:
    """Run all commands in turn, `repeat` times over, so that drift of the machine hits all alike.

    A command that ran into the timeout or failed is not tried again.
    """
    runs: list[list[Measurement]] = [[] for _ in commands]
    for _ in range(repeat):
        for command, results in zip(commands, runs, strict=True):
            if results and results[-1].ending in ("timeout", "failed"):
                continue
            progress(command)
            results.append(measure(command, timeout))
    return [summarize(results) for results in runs]


def summarize(results: Sequence[Measurement]) -> Summary:
    """Medians over the runs of one command; the ending is that of the last run."""
    seconds = [m.cpu_seconds for m in results]
    return Summary(
        results[-1].ending,
        len(results),
        statistics.median(seconds),
        (min(seconds), max(seconds)),
        statistics.median(m.wall_seconds for m in results),
        max(m.peak_mb for m in results),
        results[-1].output_bytes,
        results[-1].message,
    )


def cpu_seconds(*whose: int) -> float:
    """Seconds of user and system time of this process and its ended children, or of these."""
    uses = map(resource.getrusage, whose or (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in uses)


def memory_floor() -> float:
    """MB below which a child's peak cannot be seen: what this process holds when it forks."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def count_nodes(command: Sequence[str], timeout: float) -> int | None:
    """The number of states of the strategy that the command prints, without keeping it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "strategy"
        with path.open("wb") as out:
            try:
                subprocess.run(
                    command, stdout=out, stderr=subprocess.DEVNULL, timeout=timeout, check=False
                )
            except subprocess.TimeoutExpired:
                return None
        with path.open("rb") as strategy:
            return sum(line.startswith(b'\t"rank"') for line in strategy)


def _ending(message: str) -> Ending:
    # The RESULT line, not the exit status: SLUGS exits 0 on both verdicts.
    if "RESULT: Specification is realizable" in message:
        return "realizable"
    if "RESULT: Specification is unrealizable" in message:
        return "unrealizable"
    return "failed"


class _Clock:
    def __init__(self) -> None:
        self._start = os.times().elapsed

    def seconds(self) -> float:
        return os.times().elapsed - self._start
