"""The command line of the campaigns that play one seed after the other."""

import argparse
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Judged:
    """One run. ``found``: the finding, if any; ``counts``: numbers that the campaign adds up;
    ``files``: files of a finding, by their endings."""

    found: Sequence[str] = ()
    counts: Mapping[str, int] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)


def campaign(
    play: Callable[[int, argparse.Namespace], Judged], about: str | None, flags: str = ""
) -> int:
    """Play the seeds of the command line; 1 if there is a finding. ``flags``: words that it knows
    beside; one that ends with ``=`` has a number."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--seeds", default="0:50", help="first:behind")
    parser.add_argument("--patience", type=int, default=120, help="seconds for one run")
    parser.add_argument("--keep", type=Path, help="a folder for what was played with a finding")
    for flag in flags.split():
        if flag.endswith("="):
            parser.add_argument(f"--{flag[:-1]}", type=int)
        else:
            parser.add_argument(f"--{flag}", action="store_true")
    options = parser.parse_args()
    first, behind = map(int, options.seeds.split(":"))
    counts, findings = Counter[str](), 0
    for seed in range(first, behind):
        one = play(seed, options)
        counts.update(one.counts)
        if not one.found:
            continue
        findings += 1
        more = f" (and {len(one.found) - 1} more)" if len(one.found) > 1 else ""
        print(f"{seed}: {one.found[0][:400]}{more}", flush=True)
        for ending, text in one.files.items() if options.keep else ():
            options.keep.mkdir(exist_ok=True, parents=True)
            (options.keep / f"{seed}.{ending}").write_text(text)
    print(f"{behind - first} runs, {findings} findings: {dict(counts)}")
    return int(findings > 0)
