"""Traces that the replay and the pictures are tested on: runs that are played once."""

import json
import random
from pathlib import Path
from typing import Any

from once import beside, made_once, trace_of_shipped
from runtime.played import play

DETOUR = beside(__file__, "scenarios/scouting.yaml")

MEETING = beside(__file__, "scenarios/meeting.yaml")

SLOW = beside(__file__, "scenarios/slow.yaml")

Lines = list[dict[str, Any]]


def door() -> Lines:
    """Case study 1: the quadcopter meets a door, Digit opens it."""
    return _read(trace_of_shipped("case_study_1"))


def chain() -> Lines:
    """Case study 3: a request while another is open, stack depth 2."""
    return _read(trace_of_shipped("case_study_3"))


def detour() -> Lines:
    """An uncertainty that turns out untraversable: its region is closed to Digit."""
    return _played("detour", DETOUR)


def meeting() -> Lines:
    """Two robots that see three regions far, and believe each other in a room until they meet."""
    return _played("meeting", MEETING)


def slow() -> Lines:
    """A robot whose steps take three ticks."""
    return _played("slow", SLOW)


def crowd() -> Lines:
    """A long run of many robots on a large map."""
    return _played("crowd", crowded())


def crowded(robots: int = 6, ticks: int = 400) -> dict[str, Any]:
    """The scenario of that run."""
    rows, cols = 20, 32
    grid = [
        "".join(
            "#" if r in (0, rows - 1) or c in (0, cols - 1) or (c % 6 == 4 and r % 5 != 2) else "."
            for c in range(cols)
        )
        for r in range(rows)
    ]
    free = [region for region, cell in enumerate("".join(grid)) if cell == "."]
    places = iter(random.Random(1).sample(free, 3 * robots + 8))
    team = {}
    for k in range(robots):
        model = {"model": "quadcopter"} if k % 2 else {"model": "digit", "heading": "east"}
        objective = {"visit": [next(places), next(places)]}
        team[f"{model['model']}{k}"] = {**model, "start": next(places), "objective": objective}
    kinds = ("door", "uncertainty")
    return {
        "safenav": 1,
        "name": "a crowd",
        "map": {"grid": grid},
        "robots": team,
        "obstacles": [{"type": kinds[k % 2], "region": next(places)} for k in range(8)],
        "until": {"rounds": 1000},
        "limits": {"ticks": ticks},
    }


def _played(name: str, scenario: str | dict[str, Any]) -> Lines:
    folder = made_once(f"trace of {name}", lambda at: write(play(scenario).records, at / "t.jsonl"))
    return _read(folder / "t.jsonl")


def _read(trace: Path) -> Lines:
    return [json.loads(line) for line in trace.read_text().splitlines()]


def write(lines: Lines, path: Path) -> Path:
    """The lines as a trace file."""
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path
