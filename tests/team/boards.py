"""Random small boards with a team: free and heading robots, doors of several needs, objectives."""

from __future__ import annotations

from random import Random
from typing import Any

import yaml

from safenav.errors import InputError
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text

HEADINGS = ("north", "east", "south", "west")
KINDS = ("visit", "patrol", "cover", "hold", "once")
MOST = 60
"""Draws until the loader accepts one."""


def scenario(seed: int, *, robots: int = 4) -> Scenario:
    """Return the first scenario of a seed's draws that the loader accepts."""
    random = Random(f"board {seed}")
    for _ in range(MOST):
        try:
            return load_scenario_text(yaml.safe_dump(drawn(random, robots), sort_keys=False))
        except InputError:
            continue
    raise AssertionError(f"the loader accepts none of {MOST} draws of seed {seed}")


def drawn(random: Random, most: int) -> dict[str, Any]:
    rows, cols = random.randint(3, 5), random.randint(4, 7)
    free = {(r, c) for r in range(rows) for c in range(cols) if random.random() < 0.8}
    grid = ["".join(".#"[(r, c) not in free] for c in range(cols)) for r in range(rows)]
    cells = [list(cell) for cell in sorted(free)]
    random.shuffle(cells)
    count = random.randint(1, most)
    robots = {}
    for number in range(count):
        heading = random.random() < 0.4
        kind = random.choice(KINDS)
        targets = random.sample(cells, min(len(cells), 1 if kind == "hold" else 2))
        robot: dict[str, Any] = {
            "model": f"m{number}",
            "start": cells[number],
            "objective": {kind: targets[0] if kind == "hold" else targets},
        }
        if heading:
            robot["heading"] = random.choice(HEADINGS)
        robots[f"r{number}"] = robot
    models = {
        f"m{number}": {
            "mobility": "heading" if "heading" in robot else "free",
            "layer": random.choice(["ground", "ground", "air"]),
            "capabilities": random.sample(["push", "open", "carry"], random.randint(0, 2)),
        }
        for number, robot in enumerate(robots.values())
    }
    types = {
        "box": {"action": "push", "resolve_at": "neighbours"},
        "door": {"action": "open", "resolve_at": "self"},
        "gate": {"needs": [{"action": "push"}, {"action": "open", "at": "neighbours"}]},
    }
    taken = {tuple(robot["start"]) for robot in robots.values()}
    places = [cell for cell in cells if tuple(cell) not in taken][: random.randint(0, 3)]
    obstacles = [{"type": random.choice([*types]), "region": place} for place in places]
    return {
        "safenav": 1,
        "map": {"grid": grid},
        "catalogue": {"robots": models, "obstacles": types},
        "robots": robots,
        "obstacles": obstacles,
        "until": {"rounds": random.randint(1, 2)},
        "limits": {"ticks": 300},
        "seed": random.randint(0, 999),
    }
