"""A short made trace of two robots that see three regions far, one of them slow.

They meet at a doorway: ``slow`` (whose steps take two ticks) gives way to ``fast``. It tells
what the traces of ``made_traces`` do not: beliefs, steps of several ticks, giving way.
"""

from typing import Any

from safenav.world.map import RegionMap
from safenav.world.sight import visible_from

GRID = ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]
WEST = [10, 11, 12, 19, 20, 21, 28, 29, 30]
EAST = [14, 15, 16, 23, 24, 25, 32, 33, 34]
FAST: dict[str, Any] = {"visit": [25, 19]}
SLOW: dict[str, Any] = {"visit": [19, 25]}
ASIDE: dict[str, Any] = {"hold": 15}


def meeting() -> list[dict[str, Any]]:
    """The lines of the trace."""
    objectives = {"fast": FAST, "slow": SLOW}
    giving = {"obstacle": None, "requester": "fast", "helper": "slow", "reason": "yield"}
    return [
        _header(),
        _synthesis(0, "fast", "initial", FAST),
        _synthesis(0, "slow", "initial", SLOW),
        _move(1, "fast", 19, 20),
        _belief(1, "fast", "slow", False, EAST),
        _move(1, "slow", 25, 25, toward=24),
        _belief(1, "slow", "fast", False, WEST),
        _move(2, "fast", 20, 20),
        _move(2, "slow", 25, 24),
        _move(3, "fast", 20, 21),
        _move(3, "slow", 24, 24),
        _belief(3, "slow", "fast", True, [21]),
        _line(3, "push", depth=1, objectives={**objectives, "slow": ASIDE}, **giving),
        _synthesis(3, "slow", "yield", ASIDE),
        _move(4, "fast", 21, 22),
        _belief(4, "fast", "slow", True, [24]),
        _move(4, "slow", 24, 24, toward=15),
        _belief(4, "slow", "fast", True, [22]),
        _move(5, "fast", 22, 22),
        _move(5, "slow", 24, 15),
        _line(5, "goal", robot="slow", goal=0, region=15, round=1),
        _move(6, "fast", 22, 23),
        _belief(6, "fast", "slow", True, [15]),
        _move(6, "slow", 15, 15),
        _belief(6, "slow", "fast", True, [23]),
        _line(6, "goal", robot="slow", goal=0, region=15, round=2),
        _move(7, "fast", 23, 24),
        _move(7, "slow", 15, 15),
        _belief(7, "slow", "fast", True, [24]),
        _line(7, "goal", robot="slow", goal=0, region=15, round=3),
        _move(8, "fast", 24, 25),
        _line(8, "goal", robot="fast", goal=0, region=25, round=0),
        _line(8, "pop", depth=0, objectives=objectives, **giving),
        _synthesis(8, "slow", "yield", SLOW),
        _move(8, "slow", 15, 15),
        _line(
            8,
            "outcome",
            outcome="interrupted",
            explanation="somebody pressed Ctrl-C",
            rounds={"fast": 0, "slow": 0},
            ticks=8,
            seconds=0.2,
            syntheses=4,
            synthesis_seconds=0.1,
        ),
    ]


def watched(lines: list[dict[str, Any]], vision: float, side: int = 5) -> list[dict[str, Any]]:
    """Another trace as if its robots saw only so far, and kept track of all others by beliefs
    about the square tiles of the map, ``side`` regions wide: the worst that a page can meet."""
    scenario = lines[0]["scenario"]
    world = RegionMap.from_grid(scenario["map"]["grid"])
    robots = {name: {**robot, "vision": vision} for name, robot in scenario["robots"].items()}
    tiles: dict[tuple[int, int], list[int]] = {}
    for region in world.free:
        row, col = world.position(region)
        tiles.setdefault((row // side, col // side), []).append(region)
    where = {name: robot["start"] for name, robot in robots.items()}
    view, known = visible_from(world, vision), dict[tuple[str, str], tuple[bool, list[int]]]()
    told = [{**lines[0], "scenario": {**scenario, "robots": robots}}]
    for line in lines[1:]:
        told.append(line)
        if line["type"] != "move":
            continue
        robot = line["robot"]
        where[robot] = line["to"]
        for other in robots:
            seen = other != robot and view.sees(where[robot], where[other])
            row, col = world.position(where[other])
            near = [(row // side + d, col // side + e) for d in (-1, 0, 1) for e in (-1, 0, 1)]
            around = sorted(region for tile in near for region in tiles.get(tile, []))
            belief = (seen, [where[other]] if seen else around)
            if other != robot and known.get((robot, other)) != belief:
                known[robot, other] = belief
                told.append(_belief(line["tick"], robot, other, *belief))
    return told


def _header() -> dict[str, Any]:
    robots = {
        name: {
            "model": "rover",
            "mobility": "free",
            "layer": "ground",
            "capabilities": [],
            "vision": 3.0,
            "conflicts": [other],
            "start": start,
            "heading": None,
            "objective": objective,
        }
        for name, other, start, objective in (
            ("fast", "slow", 19, FAST),
            ("slow", "fast", 25, SLOW),
        )
    }
    scenario = {
        "name": "meeting at a doorway",
        "map": {"rows": 5, "cols": 9, "grid": GRID},
        "robots": robots,
        "obstacles": [],
        "until": {"rounds": 1},
        "limits": {"ticks": 50},
        "seed": 0,
        "coordination": "resynthesis",
    }
    return {"type": "header", "trace": 3, "safenav": "0.1.0", "scenario": scenario}


def _line(tick: int, kind: str, **fields: Any) -> dict[str, Any]:
    return {"type": kind, "tick": tick, **fields}


def _move(tick: int, robot: str, origin: int, to: int, toward: int | None = None) -> dict[str, Any]:
    bound = {} if toward is None else {"toward": toward}
    return _line(tick, "move", robot=robot, **{"from": origin, "to": to, "heading": None}, **bound)


def _belief(tick: int, robot: str, of: str, seen: bool, regions: list[int]) -> dict[str, Any]:
    return _line(tick, "belief", robot=robot, of=of, seen=seen, regions=regions)


def _synthesis(tick: int, robot: str, reason: str, objective: dict[str, Any]) -> dict[str, Any]:
    return _line(
        tick,
        "synthesis",
        robot=robot,
        reason=reason,
        verdict="realizable",
        seconds=0.02,
        states=40,
        cached=False,
        verified=True,
        spec=f"{tick:064d}",
        strategy="1" * 64,
        objective=objective,
        assumptions=[],
    )
