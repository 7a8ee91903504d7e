"""Robots that are never together in some regions: judged by a walk over the trace, and by a search
over the joint poses of this file's own."""

import json
import os
import random
from collections import deque
from typing import Any

import pytest

from certify.making import certified
from runtime.played import play

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
ROWS, COLS = 3, 4
BUNDLED = 7
CATALOGUE = {"robots": {"rover": {"mobility": "free", "layer": "ground"}}}


def drawn(seed: int) -> dict[str, Any]:
    """A connected map without obstacles."""
    rng, count = random.Random(f"together {seed}"), 2
    while True:
        walls = {r for r in range(ROWS * COLS) if rng.random() < 0.45}
        free = [r for r in range(ROWS * COLS) if r not in walls]
        if len(free) > count and len(reached(free[0], {*free})) == len(free):
            break
    zone = rng.sample(free, rng.randint(1, min(4, len(free) - count)))
    outside = [r for r in free if r not in zone]
    starts = rng.sample(outside, count)
    if rng.random() < 0.5:
        starts[0] = rng.choice(zone)
    robots: dict[str, Any] = {}
    for k, start in enumerate(starts):
        model = rng.choice(["rover", "quadcopter"])
        targets = rng.sample(free, rng.randint(1, 2))
        robots[f"r{k}"] = {"model": model, "start": start, "objective": {"visit": targets}}
    cells = ["#" if r in walls else "." for r in range(ROWS * COLS)]
    return {
        "safenav": 1,
        "map": {"grid": ["".join(cells[k : k + COLS]) for k in range(0, ROWS * COLS, COLS)]},
        "robots": robots,
        "never_together": [{"robots": [*robots], "in": [{"any": sorted(zone)}]}],
        "catalogue": CATALOGUE,
        "until": {"rounds": 1},
        "limits": {"ticks": 300},
    }


def beside(region: int) -> list[int]:
    row, col = divmod(region, COLS)
    ways = ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1))
    return [r * COLS + c for r, c in ways if 0 <= r < ROWS and 0 <= c < COLS]


def reached(start: int, free: set[int]) -> set[int]:
    found, queue = {start}, [start]
    while queue:
        for after in beside(queue.pop()):
            if after in free and after not in found:
                found.add(after)
                queue.append(after)
    return found


def can_complete(document: dict[str, Any]) -> bool:
    """Whether some order of single moves lets both robots visit their targets."""
    cells = "".join(document["map"]["grid"])
    one, other = document["robots"].values()
    zone = {*document["never_together"][0]["in"][0]["any"]}
    same = (one["model"] == "quadcopter") == (other["model"] == "quadcopter")
    lists = one["objective"]["visit"], other["objective"]["visit"]

    def counted(places: tuple[int, ...], done: tuple[int, ...]) -> Any:
        met = []
        for place, k, targets in zip(places, done, lists, strict=True):
            while k < len(targets) and targets[k] == place:
                k += 1
            met.append(k)
        return places, tuple(met)

    first = counted((one["start"], other["start"]), (0, 0))
    seen, queue = {first}, deque([first])
    while queue:
        places, done = queue.popleft()
        if all(k == len(targets) for k, targets in zip(done, lists, strict=True)):
            return True
        for k in (0, 1):
            for after in beside(places[k]):
                rest = places[1 - k]
                if cells[after] == "#" or (same and after == rest) or {after, rest} <= zone:
                    continue
                if after in zone and rest in zone:
                    continue
                state = counted((after, rest) if k == 0 else (rest, after), done)
                if state not in seen:
                    seen.add(state)
                    queue.append(state)
    return False


def played(document: dict[str, Any]) -> str:
    """Run it; the team is never together in its zone at any line of the trace."""
    run = play(document)
    zone = {*document["never_together"][0]["in"][0]["any"]}
    inside = {name: {robot["start"]} for name, robot in document["robots"].items()}
    for line in run.records:
        if line["type"] in ("move", "depart", "arrive"):
            regions = {"move": ("to", "toward"), "depart": ("from", "to"), "arrive": ("at",)}
            inside[line["robot"]] = {line[k] for k in regions[line["type"]] if k in line}
            there = [name for name, regions in inside.items() if regions & zone]
            assert len(there) <= 1, (there, line)
    return str(run.outcome["outcome"])


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("seed", range(WANTED))
def test_the_mission_completes_iff_some_order_of_moves_does(seed: int, clock: str) -> None:
    document = drawn(seed) | {"clock": clock}
    wanted = "completed" if can_complete(document) else "operator_needed"
    assert played(document) == wanted, json.dumps(document)
    if seed % BUNDLED == 0 or (wanted == "operator_needed" and clock == "lockstep"):
        certified(json.dumps(document))
