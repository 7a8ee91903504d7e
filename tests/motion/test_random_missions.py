"""Random missions with robots of all kinds, run by safenav: moved, and accepted by the
checker."""

import json
import os
import random
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pytest

from motion.runs import played as traced
from once import from_yaml
from safenav.motion.check.verdict import check_motion
from safenav.motion.file import parsed, text_of
from safenav.motion.making import motion_of
from safenav.trace.file import read_bytes
from support.missions import mission

RUNS = int(os.environ.get("SAFENAV_FUZZ", "12"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_SEED", "0"))
FAMILIES = ("apart_needs", "crowd_hidden", "apart", "tight_needs")
TICKS = 60
"""Runs are cut here: what is moved need not have come to an end."""
KNOWN = sorted((Path(__file__).parent / "scenarios" / "random").glob("*.yaml"))
"""Runs whose motion was refused."""


def missions(first: int) -> Iterator[dict[str, Any]]:
    """Missions of two robots or more, whose models move as walkers, flyers, rovers and discs."""
    seed = first
    while True:
        data = mission(FAMILIES[seed % len(FAMILIES)], seed)
        if len(data["robots"]) > 1:
            yield _moved(data, random.Random(seed))
        seed += 1


def _moved(data: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    for model in data.get("catalogue", {}).get("robots", {}).values():
        free = "flyer" if model["layer"] == "air" else chance.choice(("rover", "disc", "flyer"))
        model["motion"] = "walker" if model["mobility"] == "heading" else free
        model["size"] = chance.choice((0.4, 0.5, 0.6))
        model["speed"] = 0.45 if model["mobility"] == "heading" else chance.choice((0.5, 1.0))
    return data | {"limits": {"ticks": TICKS}}


@pytest.mark.parametrize("data", [*islice(missions(FIRST), RUNS)], ids=lambda data: data["name"])
def test_random_mission_is_moved_and_accepted(
    data: dict[str, Any], played: Callable[[], None]
) -> None:
    content = traced(json.dumps(data))
    played()
    trace = read_bytes(content, data["name"])
    motion = parsed(text_of(motion_of(trace)).encode(), "made")
    assert check_motion(motion, trace) == []


@pytest.mark.parametrize(
    "known", [*range(FIRST, FIRST + RUNS), *KNOWN], ids=lambda k: Path(str(k)).stem
)
def test_a_run_with_many_keys_is_moved_and_accepted(
    known: int | Path, played: Callable[[], None]
) -> None:
    data = from_yaml(known.read_text()) if isinstance(known, Path) else mission("metric", known)
    data["limits"] |= {"ticks": TICKS} | ({"seconds": 300} if data.get("clock") == "live" else {})
    trace = read_bytes(traced(json.dumps(data)), str(known))
    motion = parsed(text_of(motion_of(trace)).encode(), "made")
    assert check_motion(motion, trace) == []
    played()
