"""A campaign from the shell: ``python -m campaigns --family tight --seeds 0:500`` (in tests/).

Counts outcomes by family; ``--file`` plays a mission from a file instead.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from random import Random

import yaml

from campaigns.command import Command
from campaigns.generate.families import FAMILIES, mission
from campaigns.seeds import Judged, parser_of, play_all
from campaigns.verdict import judge, judge_interrupted

PLAYED = [family for family in FAMILIES if family != "narrow"]


def main() -> int:
    """Play the seeds of the families, or a file; 1 if there is a finding."""
    parser = parser_of(__doc__, "assignable live")
    parser.add_argument("--family", nargs="+", choices=PLAYED, default=[])
    parser.add_argument("--file", type=Path, help="play this mission, not those of a family")
    parser.add_argument("--budget", type=int, default=200_000, help="states of the judge")
    parser.add_argument(
        "--interrupt", type=float, metavar="SECONDS", help="send SIGINT at some moment until then"
    )
    parser.set_defaults(patience=30.0)
    options, command = parser.parse_args(), Command()
    if options.file is not None:
        return _play_file(options.file, command, options.patience)
    plays = {family: partial(judged, command, family) for family in options.family}
    return int(sum(play_all(play, options, f"{name} ") for name, play in plays.items()) > 0)


def judged(command: Command, family: str, seed: int, options: argparse.Namespace) -> Judged:
    """The run of one seed of a family."""
    data = mission(family, seed)
    if options.assignable:
        data["coordination"] = "assignable"
    if options.live:
        data["clock"] = "live"
    if options.interrupt:
        after = Random(seed).uniform(0.0, options.interrupt)
        result = judge_interrupted(data, command, after)
    else:
        result = judge(data, command, options.patience, options.budget)
    text = yaml.safe_dump(data, sort_keys=False)
    story = "".join(f"# {line}\n" for line in result.detail.splitlines())
    found = [f"{result.kind}: {result.detail}"] if result.is_finding else []
    return Judged(found, {result.kind: 1}, {"yaml": story + text})


def _play_file(file: Path, command: Command, seconds: float) -> int:
    """1 if the mission of a file is a finding, or does not end as the file expects."""
    data = yaml.safe_load(file.read_text(encoding="utf-8"))
    result = judge(data, command, seconds)
    print(f"{file.name}: {result.kind} {result.detail}".strip())
    wanted = (data.get("expect") or {}).get("outcome")
    return int(result.is_finding or (wanted == "completed" and result.kind != "completed"))


if __name__ == "__main__":
    sys.exit(main())
