"""Random small scenarios for drives, and their fleets."""

from __future__ import annotations

from random import Random
from typing import Any

from safenav.fleet.lab.model import body_of
from safenav.scenario.model import Scenario
from support.mixed import SIDES, metric_mission

Data = dict[str, Any]


def late_mission(seed: int) -> Data:
    """A mixed mission for a drive: on a real clock, all obstacles with bodies of one type, which
    the lidars see."""
    random = Random(f"late {seed}")
    if random.random() < 0.5:
        return _rooms(random)
    data = metric_mission(seed)
    data["clock"] = "live"
    data["limits"] = {"ticks": 300, "synthesis_seconds": 20, "seconds": 240}
    for key in ("by", "within"):
        data["until"].pop(key, None)
    data.pop("late", None)
    for robot in data["robots"].values():
        robot["objective"].pop("within", None)
        robot.pop("avoids", None)  # bodies do not share a region
    types, solid = data["catalogue"]["obstacles"], None
    for made in types.values():  # a door is in a passage
        for need in (made, *made.get("needs", ())):
            if need.get("action") == "push":
                need["action"] = "clear"
    kept = []
    for obstacle in data["obstacles"]:
        obstacle.pop("resolve_within", None)
        kind = obstacle["type"]
        if not types[kind].get("has_truth"):
            solid = solid or kind
            obstacle["type"] = solid
        kept.append(obstacle)
    data["obstacles"] = kept
    data["map"].setdefault("resolution", random.choice(SIDES))
    return data


def _rooms(random: Random) -> Data:
    """Two or three rooms with doors between them, and robots that cross them."""
    rooms = random.choice([2, 2, 3])
    rows, door = random.choice([1, 2, 2, 3]), random.choice([1, 2])
    wide = [random.choice([1, 2, 3]) for _ in range(rooms)]
    lines = []
    doors = [random.randrange(rows) for _ in range(rooms - 1)]
    for row in range(rows):
        cells = "#"
        for index, width in enumerate(wide):
            cells += "." * width
            last = index == rooms - 1
            cells += "#" if last or doors[index] != row else "."
        lines.append(cells)
    cols = len(lines[0])
    grid = ["#" * cols, *lines, "#" * cols]
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    at, places = 1, []
    for index, width in enumerate(wide[:-1]):
        at += width
        places.append((1 + doors[index]) * cols + at)
        at += 1
    inside = [k for k in free if k not in places]
    robots: Data = {}
    kinds = ["jackal", "mir250", "spot", "digit", "quadcopter", "tugger"]
    count = min(random.choice([1, 2, 2, 3]), len(inside) - 1)
    starts = random.sample(inside, count)
    models: Data = {"tugger": {"mobility": "free", "layer": "ground", "capabilities": ["push"]}}
    models["tugger"] |= {"size": 0.5, "speed": 0.8}
    for k, start in enumerate(starts):
        kind = random.choice(kinds)
        aims = random.sample(inside, 2)
        goal: Data = random.choice([{"visit": aims}, {"visit": [aims[0]]}, {"cover": aims}])
        robots[f"r{k}"] = {"model": kind, "start": start, "objective": goal}
        if kind == "digit":
            robots[f"r{k}"]["heading"] = random.choice(["north", "east", "south", "west"])
    kind = random.choice(["door", "door", "door", "debris"])
    hidden = [{"type": kind, "region": p} for p in places if random.random() < 0.8]
    return {
        "safenav": 1,
        "map": {"grid": grid, "resolution": random.choice([1.8, 2.0, 2.4])},
        "catalogue": {"robots": models},
        "robots": robots,
        "obstacles": hidden[:door],
        "until": {"rounds": random.choice([1, 1, 2])},
        "limits": {"ticks": 300, "synthesis_seconds": 20, "seconds": 240},
        "clock": "live",
        "seed": 0,
    }


def fleet_of(random: Random, hidden: list[Data], scenario: Scenario) -> Data:
    """The fleet of a scenario's robots in simulation. ``hidden``: the obstacles that are there."""
    side = min(scenario.map.frame.resolution) if scenario.map.frame is not None else 1.0
    kinds = scenario.catalogue.obstacles
    solid = [one["type"] for one in hidden if not kinds[one["type"]].has_truth]
    robots: Data = {}
    for robot in scenario.robots:
        wide = body_of(robot).radius * 2
        own: Data = {
            "act": {action: action for action in sorted(robot.capabilities)},
            "speed": robot.model.speed or 0.5,
            "tolerance": round(min(0.3, max(0.06, (side - wide) / 2)), 3),
        }
        if solid:
            own["scan"] = {"obstacle": solid[0], "beyond": round(0.3 * side, 2)}
        robots[robot.name] = own
    made: Data = {
        "safenav-fleet": 1,
        "transport": "simulation",
        "simulation": {"pace": 1e9} | ({} if scenario.obstacles else {"obstacles": hidden}),
        "defaults": {"timeout": random.choice([3, 6]), "report": "obstacles"},
        "robots": robots,
    }
    if random.random() < 0.2:
        made["defaults"]["follow"] = {}
    return made
