"""Random scenarios with several robots on one floor: maps, models, obstacles, timing by seed."""

import random
from collections.abc import Sequence

CATALOGUE = """\
catalogue:
  robots:
    rover: {mobility: free, layer: ground, capabilities: [push]}
    scout: {mobility: free, layer: ground, capabilities: [sense], timing: 2}
    truck: {mobility: heading, layer: ground, capabilities: [clear], timing: 2}
    drone: {mobility: free, layer: air, capabilities: [sense], vision: 3}
  obstacles:
    debris: {action: clear, resolve_at: neighbours, blocks: [ground]}
"""

MODELS = ("rover", "scout", "truck", "drone", "digit")
HEADINGS = ("north", "east", "south", "west")
KINDS = ("door", "uncertainty", "debris")


def team_scenario(seed: int) -> str:
    """A scenario as YAML. Not every one loads: targets may be out of reach."""
    rng = random.Random(seed)
    rows, cols = rng.randint(4, 7), rng.randint(5, 9)
    free = _rooms(rng, rows, cols)
    grid = ["".join("." if (r, c) in free else "#" for c in range(cols)) for r in range(rows)]
    places = [r * cols + c for r, c in sorted(free)]
    rng.shuffle(places)
    count = rng.randint(2, max(2, min(4, len(places) // 4)))
    starts, rest = places[:count], places[count:]
    lines = ["safenav: 1", f"name: team {seed}", "map:", "  grid: |"]
    lines += [f"    {row}" for row in grid]
    lines += [CATALOGUE.rstrip(), "robots:"]
    lines += [_robot(rng, f"r{i}", start, places) for i, start in enumerate(starts)]
    obstacles = [_obstacle(rng, region) for region in rest[: rng.randint(0, 2)]]
    if obstacles:
        lines += ["obstacles:", *obstacles]
    lines += ["until: {rounds: 1}", "limits: {ticks: 250}", f"seed: {seed}"]
    if rng.random() < 0.2:
        lines.append("coordination: assignable")
    return "\n".join(lines) + "\n"


def _rooms(rng: random.Random, rows: int, cols: int) -> set[tuple[int, int]]:
    """The free regions: an open floor with some walls, walled in."""
    inside = [(r, c) for r in range(1, rows - 1) for c in range(1, cols - 1)]
    walls = set(rng.sample(inside, k=len(inside) // 6))
    return set(inside) - walls


def _robot(rng: random.Random, name: str, start: int, places: Sequence[int]) -> str:
    model = rng.choice(MODELS)
    heading = f", heading: {rng.choice(HEADINGS)}" if model in ("truck", "digit") else ""
    targets = rng.sample(places, k=2)
    objective = rng.choice(
        [
            f"{{visit: {targets}}}",
            f"{{visit: {targets}}}",
            f"{{cover: {targets}}}",
            f"{{patrol: {targets}}}",
            f"{{hold: {targets[0]}}}",
        ]
    )
    return f"  {name}: {{model: {model}, start: {start}{heading}, objective: {objective}}}"


def _obstacle(rng: random.Random, region: int) -> str:
    kind = rng.choice(KINDS)
    truth = f", traversable: {rng.choice(['true', 'false'])}" if kind == "uncertainty" else ""
    return f"  - {{type: {kind}, region: {region}{truth}}}"
