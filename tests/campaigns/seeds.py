"""The command line of the campaigns that play one seed after the other."""

import argparse
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random


@dataclass(frozen=True)
class Judged:
    """One run. ``found``: the finding, if any; ``counts``: numbers that the campaign adds up;
    ``files``: files of a finding, by their endings."""

    found: Sequence[str] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


def parser_of(about: str | None, flags: str = "") -> argparse.ArgumentParser:
    """The options of a campaign. ``flags``: words that it knows beside; one that ends with ``=``
    has a number."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--seeds", default="0:50", help="first:behind")
    parser.add_argument("--patience", "--seconds", type=float, default=120, help="for one run")
    parser.add_argument("--within", type=float, default=float("inf"), help="seconds for all seeds")
    parser.add_argument("--keep", "--out", type=Path, help="a folder for the files of findings")
    for flag in flags.split():
        if flag.endswith("="):
            parser.add_argument(f"--{flag[:-1]}", type=int)
        else:
            parser.add_argument(f"--{flag}", action="store_true")
    return parser


def play_all(
    play: Callable[[int, argparse.Namespace], Judged], options: argparse.Namespace, name: str = ""
) -> int:
    """Play the seeds; the number of findings. ``name``: begins lines and names of files."""
    first, behind = map(int, options.seeds.split(":"))
    counts, findings, worst = Counter[str](), 0, 0.0
    begun = time.monotonic()
    for seed in range(first, behind):
        if (since := time.monotonic()) > begun + options.within:
            print(f"{name}stopped before seed {seed}")
            behind = seed
            break
        one = play(seed, options)
        worst = max(worst, time.monotonic() - since)
        counts.update(one.counts)
        if not one.found:
            continue
        findings += 1
        more = f" (and {len(one.found) - 1} more)" if len(one.found) > 1 else ""
        print(f"{name}{seed}: {one.found[0][:400]}{more}", flush=True)
        for ending, text in one.files.items() if options.keep else ():
            options.keep.mkdir(exist_ok=True, parents=True)
            (options.keep / f"{name.replace(' ', '_')}{seed}.{ending}").write_text(text)
    told = f"{behind - first} runs, the slowest in {worst:.1f} s, {findings} findings"
    print(f"{name}{told}: {dict(counts)}", flush=True)
    return findings


def campaign(
    play: Callable[[int, argparse.Namespace], Judged], about: str | None, flags: str = ""
) -> int:
    """Play the seeds of the command line; 1 if there is a finding."""
    return int(play_all(play, parser_of(about, flags).parse_args()) > 0)


class SlowError(Exception):
    pass


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise SlowError after this many seconds of CPU time, or six times as many of wall time."""

    def over(*_: object) -> None:
        raise SlowError

    former = {kind: signal.signal(kind, over) for kind in (signal.SIGALRM, signal.SIGPROF)}
    signal.setitimer(signal.ITIMER_REAL, 6 * seconds)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for kind, handler in former.items():
            signal.signal(kind, handler)


def crash_of(error: Exception) -> str:
    """Return a crash and its position in words."""
    where = traceback.extract_tb(error.__traceback__)[-3:]
    way = " < ".join(f"{w.filename.split('/')[-1]}:{w.lineno}" for w in where[::-1])
    return f"{type(error).__name__}: {error} ({way})"


def chances(seed: int, most: Mapping[str, float]) -> dict[str, float]:
    """Some kinds of faults, each with a chance of its own, at most so great."""
    random = Random(f"faults of {seed}")
    return {kind: random.random() * high for kind, high in most.items() if random.random() < 0.6}
