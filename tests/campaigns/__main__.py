"""Random missions: ``python -m campaigns --family tight mixed --seeds 0:500 --live --faults``.

In ``tests/``. Each run is judged (``play``); ``--keep FOLDER`` shrinks what has a finding to a case
file. ``--file`` plays such files instead.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

from campaigns.casefile import case_text, read_case, shrunk
from campaigns.play import Played, play
from campaigns.world import faults_of
from drawn import tried
from support.missions import FAMILIES, mission

SWITCHES = ("live", "faults", "operator", "kill", "assignable", "certified")


def drawn(
    family: str, seed: int, switches: tuple[str, ...] = (), patience: float = 60
) -> tuple[dict[str, Any], Played, dict[str, Any]]:
    """Play the mission of a seed: its data, the run, and the options of ``play``. A mission that
    the loader refuses is drawn again."""
    options: dict[str, Any] = {"patience": patience, "certified": "certified" in switches}
    options["faults"] = faults_of(seed) if "faults" in switches else None
    options["operator"] = "operator" in switches
    options["kill"] = 1 + seed % 12 if "kill" in switches else None

    def attempt(number: int) -> tuple[dict[str, Any], Played]:
        data = mission(family, number)
        data |= {"clock": "live"} if {"live", "faults"} & {*switches} else {}
        data |= {"coordination": "assignable"} if "assignable" in switches else {}
        data |= {"coordination": "resynthesis"} if "certified" in switches else {}
        return data, play(data, seed, **options)

    data, one = tried(attempt, seed)
    return data, one, options


def main() -> int:
    """Play the seeds of the families, or files; 1 if there is a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--family", nargs="+", choices=[*FAMILIES], default=["mixed"])
    parser.add_argument("--file", nargs="+", type=Path, default=[], help="play these cases")
    parser.add_argument("--seeds", default="0:50", help="first:behind")
    parser.add_argument("--patience", type=float, default=60, help="CPU seconds for one run")
    parser.add_argument("--within", type=float, default=float("inf"), help="seconds for all")
    parser.add_argument("--keep", type=Path, help="a folder for case files of findings")
    for switch in SWITCHES:
        parser.add_argument(f"--{switch}", action="store_true")
    asked = parser.parse_args()
    findings, begun = 0, time.monotonic()
    for file in asked.file:
        data, options, _ = read_case(file)
        found = play(data, **options).found
        findings += bool(found)
        print(f"{file}: {found or 'sound'}")
    switches = tuple(each for each in SWITCHES if getattr(asked, each))
    for family in asked.family if not asked.file else ():
        counts: Counter[str] = Counter()
        for seed in range(*map(int, asked.seeds.split(":"))):
            if time.monotonic() > begun + asked.within:
                break
            data, one, options = drawn(family, seed, switches, asked.patience)
            counts.update({"runs": 1, one.outcome: 1, "undecided": one.undecided, **one.injected})
            if one.found:
                findings += 1
                print(f"{family} {seed}: {one.found[0][:400]}", flush=True)
                if asked.keep:
                    asked.keep.mkdir(exist_ok=True, parents=True)
                    options["operator"] = one.given
                    small, fewer = shrunk(data, {**options, "seed": seed}, one.found[0])
                    text = case_text(f"{one.found[0]} (seed {seed})", small, fewer)
                    (asked.keep / f"{family}_{seed}.yaml").write_text(text)
        print(f"{family}: {dict(counts)}", flush=True)
    return int(findings > 0)


if __name__ == "__main__":
    sys.exit(main())
