"""Traces of shipped scenarios and their motions, each made once for all tests of motion."""

import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from once import SCENARIOS, made_once, trace_of_shipped
from runtime.played import play
from runtime.worlds import Uneven
from safenav import Clock, load_scenario
from warm import safenav

SHIPPED = sorted(path.stem for path in SCENARIOS.glob("*.yaml"))


def played(text: str) -> bytes:
    """The trace of a scenario that is given as text."""
    return "".join(play(text).lines).encode()


@cache
def live_trace(name: str, delayed: float = 0.0) -> Path:
    """The trace of a shipped scenario with a clock; a share of its steps takes longer."""

    def make(folder: Path) -> None:
        scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
        world = Uneven(scenario, delayed=delayed, factor=1.7)
        (folder / f"{name}.jsonl").write_text("".join(play(scenario, world=world).lines))

    return made_once(f"live trace of {name} {delayed}", make) / f"{name}.jsonl"


def moved(trace: Path, folder: Path, *more: str) -> Path:
    """The motion of a trace, as a file in a folder."""
    motion = folder / f"{trace.stem}.motion.jsonl"
    done = safenav("export", trace, "--motion", motion, *more)
    assert done.returncode == 0, done.stderr
    return motion


@cache
def motion(name: str) -> Path:
    """The motion of a shipped scenario."""
    made = made_once(f"motion of {name}", lambda at: moved(trace_of_shipped(name), at))
    return made / f"{name}.motion.jsonl"


def findings(trace: Path, *motions: Path) -> list[dict[str, Any]]:
    """What ``safenav check`` says of motions of a trace, as data."""
    (_, *found) = json.loads(safenav("check", "--json", trace, *motions).stdout)
    return found


def written(lines: Sequence[dict[str, Any]], file: Path) -> Path:
    file.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    return file
