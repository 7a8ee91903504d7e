"""Random missions: ``python -m campaigns --family tight mixed --seeds 0:500 --live --faults``.

In ``tests/``. Each run is judged (``play``); ``--keep FOLDER`` shrinks what has a finding to a case
file: a scenario with facts in its comments. ``--file`` plays such files instead.

The first comment of a file is its story. Its lines ``#:`` are YAML: the ``faults`` of the world by
their chances, with the ``seed`` that they strike by; the words of an ``operator``, each with its
pass, and whether the run is ``attended``; the pass at which a ``kill`` cuts it off; the
``outcome``; ``blocking``: a world behind calls; ``open``: why a known finding is not fixed.
"""

import argparse
import copy
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from campaigns.play import Played, play
from campaigns.world import faults_of
from drawn import tried
from once import from_yaml
from safenav import InputError
from scenario.mistakes import places
from support.missions import FAMILIES, mission

Data = dict[str, Any]
OPTIONS = ("operator", "attended", "kill", "blocking")
"""Those of ``play`` that are facts of a case file."""
SWITCHES = ("live", "faults", "operator", "kill", "assignable", "certified")


def drawn(
    family: str, seed: int, switches: tuple[str, ...] = (), patience: float = 60
) -> tuple[Data, Played, dict[str, Any]]:
    """Play the mission of a seed: its data, the run, and the options of ``play``. A mission that
    the loader refuses is drawn again."""
    options: dict[str, Any] = {"patience": patience, "certified": "certified" in switches}
    options["faults"] = faults_of(seed) if "faults" in switches else None
    options["operator"] = "operator" in switches
    options["kill"] = 1 + seed % 12 if "kill" in switches else None

    def attempt(number: int) -> tuple[Data, Played]:
        data = mission(family, number)
        data |= {"clock": "live"} if {"live", "faults"} & {*switches} else {}
        data |= {"coordination": "assignable"} if "assignable" in switches else {}
        data |= {"coordination": "resynthesis"} if "certified" in switches else {}
        return data, play(data, seed, **options)

    data, one = tried(attempt, seed)
    return data, one, options


def read_case(file: Path) -> tuple[Data, dict[str, Any], dict[str, Any]]:
    """The mission of a file, the options of ``play``, and all facts."""
    text = file.read_text(encoding="utf-8")
    said = "\n".join(line[2:] for line in text.splitlines() if line.startswith("#:"))
    facts, data = from_yaml(said) or {}, from_yaml(text)
    facts["outcome"] = facts.get("outcome") or (data.get("expect") or {}).get("outcome")
    options = {k: v for k, v in facts.items() if k in OPTIONS}
    if "faults" in facts:
        options["faults"] = {k: v for k, v in facts["faults"].items() if k != "seed"}
        options["seed"] = facts["faults"]["seed"]
    return data, options, facts


def case_text(story: str, data: Data, options: Mapping[str, Any]) -> str:
    """A mission and its options as the text of a case file."""
    facts = {k: options[k] for k in OPTIONS if options.get(k)}
    if options.get("faults") is not None:
        facts["faults"] = {"seed": options["seed"], **options["faults"]}
    form: Data = {"default_flow_style": None, "sort_keys": False, "width": 100}
    lines = [f"# {line}" for line in story.splitlines()]
    lines += [f"#: {line}" for line in yaml.safe_dump(facts, **form).splitlines() if facts]
    return "\n".join([*lines, yaml.safe_dump(data, **form)])


def shrunk(data: Data, options: dict[str, Any], finding: str) -> tuple[Data, dict[str, Any]]:
    """A smaller mission with a finding of the same kind: without a value, a kind of fault, or a
    word of the operator, as long as one of them can go."""
    kind = finding.partition(":")[0]
    options = {**options, "certified": kind == "certify"}

    def fails(data: Data, options: dict[str, Any]) -> bool:
        try:
            found = play(data, **options).found
        except InputError:
            return False
        return bool(found) and found[0].startswith(kind)

    while smaller := next((fewer for fewer in _fewer(data, options) if fails(*fewer)), None):
        data, options = smaller
    return data, options


def _fewer(data: Data, options: dict[str, Any]) -> Iterator[tuple[Data, dict[str, Any]]]:
    for name in ("faults", "operator"):
        for each in options.get(name) or ():
            left: Any = copy.copy(options[name])
            left.pop(each) if name == "faults" else left.remove(each)
            yield data, {**options, name: left}
    for *way, last in places(data):
        if len(way) < 3 and {*way[:1], last}.isdisjoint(("safenav", "map")):
            changed = holder = copy.deepcopy(data)
            for step in way:
                holder = holder[step]
            del holder[last]
            yield changed, options


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
    if asked.faults and asked.kill:
        parser.error("a run in a world with faults is not resumed: give --faults or --kill")
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
                    options |= {"operator": one.given, "attended": one.attended}
                    small, fewer = shrunk(data, {**options, "seed": seed}, one.found[0])
                    text = case_text(f"{one.found[0]} (seed {seed})", small, fewer)
                    (asked.keep / f"{family}_{seed}.yaml").write_text(text)
        print(f"{family}: {dict(counts)}", flush=True)
    return int(findings > 0)


if __name__ == "__main__":
    sys.exit(main())
