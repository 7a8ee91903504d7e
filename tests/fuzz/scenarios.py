"""Random scenarios, small enough to run by the hundred and odd enough to matter.

Rooms with random inner walls, one to three robots of all kinds that share the floor or fly over
it, hidden obstacles of all kinds, every model of the others, steps that take several ticks, both
ways of coordination. Most are valid; targets may be out of reach, and that is found out.
"""

from typing import Any

from hypothesis import strategies as st

CATALOGUE = {
    "robots": {
        "rover": {"mobility": "free", "layer": "ground", "capabilities": ["push"]},
        "cart": {
            "mobility": "free",
            "layer": "ground",
            "capabilities": [],
            "timing": {"least": 1, "most": 2},
        },
        "walker": {"mobility": "heading", "layer": "ground", "capabilities": ["clear"]},
    },
    "obstacles": {
        "debris": {"action": "clear", "resolve_at": "neighbours", "blocks": ["ground"]},
    },
}
MODELS = ("digit", "walker", "rover", "cart", "quadcopter")


@st.composite
def scenarios(draw: st.DrawFn, robots: int = 3) -> dict[str, Any]:
    """A scenario as data."""
    rows, cols = draw(st.integers(1, 4)), draw(st.integers(3, 5))
    cells = [[draw(st.sampled_from("....#")) for _ in range(cols)] for _ in range(rows)]
    width = cols + 2
    free = [(r + 1) * width + c + 1 for r in range(rows) for c in range(cols) if cells[r][c] == "."]
    if len(free) < robots + 1:
        cells = [["."] * cols for _ in range(rows)]
        free = [(r + 1) * width + c + 1 for r in range(rows) for c in range(cols)]
    grid = ["#" * width, *("#" + "".join(row) + "#" for row in cells), "#" * width]
    regions = st.sampled_from(free)
    starts = draw(st.lists(regions, min_size=1, max_size=robots, unique=True))
    hidden = draw(st.lists(regions.filter(lambda r: r not in starts), max_size=2, unique=True))
    return {
        "safenav": 1,
        "map": {"grid": grid},
        "robots": {f"r{k}": _robot(draw, start, regions) for k, start in enumerate(starts)},
        "obstacles": [_obstacle(draw, region) for region in hidden],
        "until": {"rounds": draw(st.integers(1, 2))},
        "limits": {"ticks": 60, "synthesis_seconds": 20},
        "seed": draw(st.integers(0, 999)),
        "coordination": draw(st.sampled_from(["resynthesis", "resynthesis", "assignable"])),
        "deadlock": draw(st.booleans()),
        "catalogue": CATALOGUE,
    }


def _robot(draw: st.DrawFn, start: int, regions: st.SearchStrategy[int]) -> dict[str, Any]:
    model = draw(st.sampled_from(MODELS))
    found: dict[str, Any] = {
        "model": model,
        "start": start,
        "objective": _objective(draw, regions),
        "tracking": draw(st.sampled_from(["nearby", "nearby", "exact", "belief"])),
    }
    if model in ("digit", "walker"):
        found["heading"] = draw(st.sampled_from(["north", "east", "south", "west"]))
    if found["tracking"] == "belief":
        found["vision"] = draw(st.integers(1, 4))
    return found


def _objective(draw: st.DrawFn, regions: st.SearchStrategy[int]) -> dict[str, Any]:
    kind = draw(st.sampled_from(["patrol", "visit", "visit", "cover", "hold", "ltl"]))
    if kind == "patrol":
        return {kind: draw(st.lists(regions, min_size=2, max_size=2, unique=True))}
    if kind == "hold":
        return {kind: draw(regions)}
    if kind == "ltl":
        goals = draw(st.lists(regions, min_size=1, max_size=2))
        never = [f"region' != {draw(regions)}"] if draw(st.booleans()) else []
        return {kind: {"liveness": [f"region = {g}" for g in goals], "safety": never}}
    return {kind: draw(st.lists(regions, min_size=1, max_size=3))}


def _obstacle(draw: st.DrawFn, region: int) -> dict[str, Any]:
    kind = draw(st.sampled_from(["door", "uncertainty", "debris"]))
    found: dict[str, Any] = {"type": kind, "region": region}
    if kind == "uncertainty":
        found["traversable"] = draw(st.booleans())
    return found
