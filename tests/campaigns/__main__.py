"""A campaign from the shell: ``python -m campaigns --family tight --seeds 0:500`` (in tests/).

Counts outcomes by family; writes the smallest mission of each kind of finding into a folder.
``--file`` plays a mission from a file instead.
"""

import argparse
import sys
import time
from collections import Counter, defaultdict
from pathlib import Path
from random import Random

import yaml

from campaigns.command import Command
from campaigns.generate.families import FAMILIES, mission
from campaigns.verdict import judge, judge_interrupted


def main() -> int:
    """Play the seeds of the families; 1 if there is a finding."""
    options = _options()
    command = Command()
    if options.file is not None:
        return _play_file(options.file, command, options.seconds)
    found = 0
    until = time.monotonic() + options.within
    for family in options.family:
        counts: Counter[str] = Counter()
        seeds: defaultdict[str, list[int]] = defaultdict(list)
        smallest: dict[str, str] = {}
        times = []
        for seed in range(*options.seeds):
            if time.monotonic() > until:
                print(f"{family}: stopped before seed {seed}")
                break
            data = mission(family, seed)
            if options.assignable:
                data["coordination"] = "assignable"
            if options.interrupt:
                after = Random(seed).uniform(0.0, options.interrupt)
                result = judge_interrupted(data, command, after)
            else:
                result = judge(data, command, options.seconds, options.budget)
            counts[result.kind] += 1
            times.append(result.seconds)
            if result.is_finding:
                seeds[result.kind].append(seed)
                text = yaml.safe_dump(data, sort_keys=False)
                story = "".join(f"# {line}\n" for line in result.detail.splitlines())
                if len(text) < len(smallest.get(result.kind, text + " ")):
                    smallest[result.kind] = text
                    options.out.mkdir(parents=True, exist_ok=True)
                    kind = "".join(c if c.isalnum() else "_" for c in result.kind)
                    (options.out / f"{family}_{kind}.yaml").write_text(story + text)
        found += sum(map(len, seeds.values()))
        if not times:
            continue
        times.sort()
        print(
            f"{family}: {dict(counts)}; median {times[len(times) // 2]:.2f} s, "
            f"worst {times[-1]:.1f} s"
        )
        for kind, which in sorted(seeds.items()):
            print(f"  {kind}: {', '.join(map(str, which[:40]))}")
        sys.stdout.flush()
    return int(found > 0)


def _play_file(file: Path, command: Command, seconds: float) -> int:
    """1 if the mission of a file is a finding, or does not end as the file expects."""
    data = yaml.safe_load(file.read_text(encoding="utf-8"))
    result = judge(data, command, seconds)
    print(f"{file.name}: {result.kind} {result.detail}".strip())
    wanted = (data.get("expect") or {}).get("outcome")
    return int(result.is_finding or (wanted == "completed" and result.kind != "completed"))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="campaigns", description=__doc__)
    parser.add_argument("--family", nargs="+", choices=FAMILIES, default=[])
    parser.add_argument("--file", type=Path, help="play this mission, not those of a family")
    parser.add_argument("--seeds", type=_range, default=(0, 100), help="first:behind")
    parser.add_argument("--seconds", type=float, default=30.0, help="for one run")
    parser.add_argument(
        "--within", type=float, default=float("inf"), help="seconds for all seeds: then it stops"
    )
    parser.add_argument("--budget", type=int, default=200_000, help="states of the judge")
    parser.add_argument(
        "--interrupt", type=float, metavar="SECONDS", help="send SIGINT at some moment until then"
    )
    parser.add_argument("--assignable", action="store_true", help="tell robots by signals")
    parser.add_argument("--out", type=Path, default=Path("build/findings"))
    return parser.parse_args()


def _range(text: str) -> tuple[int, int]:
    first, behind = text.split(":")
    return int(first), int(behind)


if __name__ == "__main__":
    sys.exit(main())
