"""Random missions, small enough to run by the hundred: every tracking, timing, both kinds of
coordination, nested obstacles, several needs, obstacles that come and go, tight floors."""

from random import Random
from typing import Any

CATALOGUE = {
    "robots": {
        "rover": {"mobility": "free", "layer": "ground", "capabilities": ["push"]},
        "cart": {
            "mobility": "free",
            "layer": "ground",
            "capabilities": [],
            "timing": {"least": 1, "most": 3},
        },
        "walker": {"mobility": "heading", "layer": "ground", "capabilities": ["clear", "lift"]},
        "crane": {"mobility": "free", "layer": "ground", "capabilities": ["lift"]},
    },
    "obstacles": {
        "debris": {"action": "clear", "resolve_at": "neighbours", "blocks": ["ground"]},
        "beam": {
            "needs": [{"action": "lift", "robots": 2, "at": "neighbours", "together": True}],
            "blocks": ["ground"],
        },
        "pile": {
            "needs": [
                {"action": "lift", "robots": 1, "at": "neighbours"},
                {"action": "push", "robots": 1, "at": "neighbours"},
            ],
            "blocks": ["ground"],
        },
    },
}


def random_mission(source: Random) -> dict[str, Any]:
    """A scenario as data. Most are valid; targets may be out of reach."""
    rows, cols = source.randint(1, 4), source.randint(3, 6)
    walls = source.choice([0.0, 0.15, 0.3])
    cells = [["#" if source.random() < walls else "." for _ in range(cols)] for _ in range(rows)]
    width = cols + 2
    grid = ["#" * width, *("#" + "".join(row) + "#" for row in cells), "#" * width]
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    source.shuffle(free)
    count = min(source.choice([1, 2, 2, 2, 3, 3, 4]), max(1, len(free) - 1))
    starts, rest = free[:count], free[count:]
    shared = source.choice([None, None, "nearby", "exact", "belief"])
    mission = {
        "safenav": 1,
        "map": {"grid": grid},
        "robots": {f"r{k}": _robot(source, r, free, shared) for k, r in enumerate(starts)},
        "obstacles": [_obstacle(source, r) for r in rest[: source.choice([0, 1, 1, 2, 3])]],
        "until": {"rounds": source.randint(1, 2)},
        "limits": {"ticks": source.choice([12, 80, 80]), "synthesis_seconds": 20},
        "seed": source.randint(0, 999),
        "coordination": source.choice(["resynthesis", "resynthesis", "assignable"]),
        "catalogue": CATALOGUE,
    }
    return mission


def _robot(source: Random, start: int, free: list[int], shared: str | None) -> dict[str, Any]:
    model = source.choice(["digit", "walker", "rover", "cart", "quadcopter", "crane"])
    tracking = shared or source.choice(["nearby", "nearby", "exact", "belief"])
    robot: dict[str, Any] = {
        "model": model,
        "start": start,
        "objective": _objective(source, free),
        "tracking": "nearby" if model == "cart" else tracking,
    }
    if model in ("digit", "walker"):
        robot["heading"] = source.choice(["north", "east", "south", "west"])
    if robot["tracking"] == "belief":
        robot["vision"] = source.randint(1, 4)
    return robot


def _objective(source: Random, free: list[int]) -> dict[str, Any]:
    kind = source.choice(["patrol", "visit", "visit", "cover", "hold", "ltl"])
    if kind == "patrol" and len(free) > 1:
        return {kind: source.sample(free, 2)}
    if kind == "hold":
        return {kind: source.choice(free)}
    wanted = source.sample(free, source.randint(1, min(3, len(free))))
    if kind == "ltl":
        never = [f"region' != {source.choice(free)}"] if source.random() < 0.5 else []
        return {kind: {"liveness": [f"region = {goal}" for goal in wanted[:2]], "safety": never}}
    return {kind if kind == "cover" else "visit": wanted}


def _obstacle(source: Random, region: int) -> dict[str, Any]:
    kind = source.choice(["door", "uncertainty", "debris", "beam", "pile"])
    obstacle: dict[str, Any] = {"type": kind, "region": region}
    if kind == "uncertainty":
        obstacle["traversable"] = source.choice([True, False])
    if source.random() < 0.2:
        obstacle["from"] = source.randint(1, 6)
    if source.random() < 0.15:
        obstacle["until"] = source.randint(8, 20)
    return obstacle
