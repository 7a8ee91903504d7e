"""Random small scenarios with many keys together, as users combine them: loads, orders, inputs,
changes, batteries, deadlines, zones, obstacles that come later, rules beside objectives."""

from __future__ import annotations

from random import Random
from typing import Any

from support.boards import Data, framed, free_in, rooms

CAPABILITIES = ("clear", "lift", "look", "push")
FEATURES = ("zones", "inputs", "orders", "loads", "changes", "avoids", "waiting", "later")


def mixed_mission(seed: int, *, live: bool = False, scale: int = 1) -> Data:
    """A scenario as data; the loader refuses about half, mostly for unreachable targets. ``scale``:
    of a hall with rooms, its distances and times."""
    random = Random(seed)
    grid, free = _floor(random) if scale == 1 else _hall(random)
    features = set(random.sample(FEATURES, random.choice([0, 1, 2, 3])))
    count = min(random.choice([1, 2, 2, 2, 3]) + (scale > 1), len(free) - 2)
    starts = random.sample(free, count)
    layers = random.choice([["ground"], ["ground"], ["ground", "air"]])
    models: Data = {}
    robots: Data = {}
    types: Data = {}
    for k, start in enumerate(starts):
        models[f"m{k}"] = _model(random, layers)
        robots[f"r{k}"] = {
            "model": f"m{k}",
            "start": start,
            "heading": random.choice(["north", "east", "south", "west"]),
            "objective": _objective(random, free, [*starts]),
        }
    data: Data = {
        "safenav": 1,
        "map": {"grid": grid},
        "catalogue": {"robots": models, "obstacles": types},
        "robots": robots,
        "obstacles": _obstacles(
            random, [r for r in free if r not in starts], types, features, scale
        ),
        "until": {"rounds": random.choice([1, 1, 2])},
        "limits": {"ticks": 300 * scale, "synthesis_seconds": 20},
        "seed": seed,
    }
    if live:
        data["clock"] = "live"
    if random.random() < 0.15:
        data["coordination"] = "assignable"
    _add_work(random, free, data, features, scale)
    _add_people(random, free, data, features, scale)
    if random.random() < 0.4:
        _add_batteries(random, free, data, scale)
    if random.random() < 0.3:
        _add_promises(random, data, scale)
    return data


def _floor(random: Random) -> tuple[list[str], list[int]]:
    rows, cols = random.choice([(1, 4), (1, 5), (2, 3), (2, 4), (3, 3), (3, 4), (2, 5)])
    while True:
        grid = framed(["".join(random.choices("#.", [1, 5], k=cols)) for _ in range(rows)])
        if len(free := free_in(grid)) >= 4:
            return grid, free


def _hall(random: Random) -> tuple[list[str], list[int]]:
    grid = rooms(random, random.randint(1, 2), 2, random.randint(3, 4), random.randint(4, 6))
    return grid, free_in(grid)


def _model(random: Random, layers: list[str]) -> Data:
    model: Data = {
        "mobility": random.choice(["free", "free", "heading"]),
        "layer": random.choice(layers),
        "capabilities": sorted(random.sample(CAPABILITIES, random.choice([0, 1, 2, 3]))),
    }
    if random.random() < 0.15:
        model["timing"] = random.choice([2, 3])
    if random.random() < 0.15:
        model["vision"] = random.randint(1, 3)
    return model


def _objective(random: Random, free: list[int], starts: list[int]) -> Data:
    kinds = [("visit", 0), ("visit", 0), ("patrol", 2), ("patrol", 3), ("cover", 0), ("hold", 1)]
    kind, fixed = random.choice([*kinds, ("once", 0)])
    drawn = random.choice([1, 2, 2, 3])
    many = fixed or drawn
    wide = random.random() < 0.3
    targets: list[Any] = [
        {"any": sorted({region, *random.sample(free, 2)})} if wide else region
        for region in random.sample(free, many)
    ]
    objective: Data = {kind: targets[0] if kind == "hold" else targets}
    aims = {r for t in targets for r in (t["any"] if isinstance(t, dict) else [t])}
    others = [region for region in free if region not in {*starts, *aims}]
    if others and random.random() < 0.2:
        objective["avoid"] = [random.choice(others)]
    if random.random() < 0.15:
        one = random.choice(free)
        objective["always"] = f"region = {one} -> region' != {one + 1}"
    if kind in ("visit", "patrol") and random.random() < 0.1:
        objective["within"] = random.randint(6, 30)
    return objective


def _type(random: Random, free: list[int]) -> Data:
    action, other = random.choices(CAPABILITIES, k=2)
    where = random.choice(["self", "neighbours", "neighbours", random.sample(free, 2)])
    two = {"action": "lift", "robots": 2, "at": "neighbours", "together": True}
    match random.randrange(6):
        case 0:
            made: Data = {"needs": [{"action": action, "at": where}, {"action": other}]}
        case 1:
            made = {"needs": [two]}
        case 2:
            made = {"action": "look", "resolve_at": "neighbours", "has_truth": True}
        case _:
            made = {"action": action, "resolve_at": where}
    blocks = random.choice([None, None, ["ground"], ["air"], ["r0"]])
    return made if blocks is None else {**made, "blocks": blocks}


def _obstacles(
    random: Random, places: list[int], types: Data, features: set[str], scale: int
) -> list[Data]:
    found = []
    for k, region in enumerate(random.sample(places, min(len(places), random.choice([0, 1, 2])))):
        types[f"t{k}"] = _type(random, places if len(places) > 1 else [*places, *places])
        obstacle: Data = {"type": f"t{k}", "region": region}
        if types[f"t{k}"].get("has_truth"):
            obstacle["traversable"] = random.random() < 0.5
        if "later" in features and random.random() < 0.5:
            obstacle["from"] = random.randint(2, 12) * scale
        found.append(obstacle)
    return found


def _add_work(random: Random, free: list[int], data: Data, features: set[str], scale: int) -> None:
    if not features & {"orders", "loads"}:
        return
    data["orders"] = []
    for k in range(random.choice([1, 2, 3])):
        one, other = random.choices(free, k=2)
        fetched = {"action": "lift", "at": [one]}, {"action": "lift", "at": [other], "same": True}
        done = {"action": random.choice(CAPABILITIES), "at": [one]}
        needs = [*fetched] if "loads" in features else [done]
        data["catalogue"]["obstacles"][f"p{k}"] = {"needs": needs, "blocks": []}
        data["orders"].append({"at": random.randint(1, 8) * scale, "type": f"p{k}", "region": one})


def _add_people(
    random: Random, free: list[int], data: Data, features: set[str], scale: int
) -> None:
    """What others decide, and who may be where."""
    robots, places = data["robots"], random.sample(free, 2)
    names = sorted(robots)
    if "inputs" in features:
        data["inputs"] = {"alarm": {"at": [random.choice(["3-9", "5", "2-4"])]}}
        robots["r0"]["when"] = {"alarm": {"visit": places}}
    elif "changes" in features:
        at = random.randint(1, 10) * scale
        data["changes"] = [{"at": at, "robot": "r0", "objective": {"cover": places}}]
        if random.random() < 0.3:
            data["changes"] += [
                {"at": at + 2, "robot": names[-1], "service": "out"},
                {"at": at + 9, "robot": names[-1], "service": "back"},
            ]
    if "waiting" in features:
        robots["r0"]["while_waiting"] = {"hold": places[0]}
    if "avoids" in features and len(names) > 1:
        robots["r0"]["avoids"] = random.choice([[], ["r1"]])
    if "zones" in features and len(names) > 1:
        data["never_together"] = [{"robots": names[:2], "in": random.sample(free, 3)}]


def _add_batteries(random: Random, free: list[int], data: Data, scale: int) -> None:
    for model in data["catalogue"]["robots"].values():
        if random.random() < 0.6:
            model["battery"] = {
                "capacity": random.randint(6, 24) * scale,
                "charge": random.choice([1, 3]),
                "stay": random.choice([0, 0, 0, 1]),
            }
    charged = "battery" in data["catalogue"]["robots"]["m0"]
    for change in data.get("changes", ()) if charged else ():
        if "objective" in change:  # with a battery its targets have an order
            change["objective"] = {"visit": next(iter(change["objective"].values()))}
    data["chargers"] = random.sample(free, random.randint(1, 3))
    if random.random() < 0.4:
        swap = {"action": "lift", "at": "neighbours"}
        fetch = {"action": "lift", "at": [random.choice(free)]}
        needs = random.choice([[swap], [fetch, {**swap, "same": True}]])
        data["catalogue"]["obstacles"]["empty"] = {"needs": needs, "blocks": []}
        data["flat"] = "empty"


def _add_promises(random: Random, data: Data, scale: int) -> None:
    if random.random() < 0.5:
        data["until"]["by"] = random.randint(5, 40) * scale
        data["late"] = random.choice(["go_on", "stop"])
    for obstacle in data["obstacles"]:
        if random.random() < 0.5:
            obstacle["resolve_within"] = random.randint(3, 20) * scale


def hall_mission(seed: int) -> Data:
    """A mixed mission of the size of a small building."""
    return mixed_mission(seed, scale=5)


def tracked_mission(seed: int) -> Data:
    """A mixed mission of robots that share no floor, and track each other."""
    random, data = Random(f"tracked {seed}"), mixed_mission(seed)
    models = data["catalogue"]["robots"]
    quick = [n for n, robot in data["robots"].items() if "timing" not in models[robot["model"]]]
    for name, robot in data["robots"].items():
        robot["avoids"] = []
        if name in quick and (others := [other for other in quick if other != name]):
            robot["tracks"] = random.sample(others, random.randint(0, min(2, len(others))))
            robot["vision"] = random.randint(1, 4)
    return data


def formula_mission(seed: int) -> Data:
    """A mixed mission in which some objectives are formulas, most of them with memory, and others
    have rules beside them."""
    random, data = Random(f"formulas {seed}"), mixed_mission(seed)
    free = free_in(data["map"]["grid"])
    heard, assigned = "inputs" in data, "coordination" in data
    for number, (_, robot) in enumerate(sorted(data["robots"].items())):
        if "when" in robot:
            continue
        model = data["catalogue"]["robots"][robot["model"]]
        if number == len(data["robots"]) - 1 or random.random() < 0.5:
            model.pop("battery", None)
            robot["objective"] = {"ltl": _formulas(random, free, heard=heard, assigned=assigned)}
        elif random.random() < 0.5:
            one = random.choice(free)
            step = random.choice([1, -1])
            robot["objective"]["always"] = f"region = {one} -> region' != {one + step}"
    if random.random() < 0.5:
        data.pop("changes", None)
    return data


def _formulas(random: Random, free: list[int], *, heard: bool, assigned: bool) -> Data:
    x, y, z = random.sample(free, 3)
    made: Data = {}
    safety, liveness = list[str](), list[str]()
    match random.choice(["none", "flag", "toggle", "range", "none"]):
        case "flag":
            made |= {"memory": {"m": "bool"}, "init": "!m"}
            safety.append(f"m' <-> m | region = {x}")
            liveness.append(f"m & region = {y}")
        case "toggle":
            made |= {"memory": {"m": "bool"}, "init": "!m"}
            safety += [f"region' = {x} -> m'", f"region' = {y} -> !m'"]
            safety.append(f"region' != {x} & region' != {y} -> (m' <-> m)")
            liveness += [f"region = {x}", f"region = {y}"]
        case "range":
            made |= {"memory": {"c": [0, 2]}, "init": "c = 0"}
            enters = f"region' = {x} & region != {x}"
            safety += [f"{enters} & c = {k} -> c' = {(k + 1) % 3}" for k in range(3)]
            safety.append(f"!({enters}) -> c' = c")
            liveness.append(f"c = 2 & region = {y}")
        case _:
            liveness.append(f"region = {x}")
            liveness += [f"region = {y}"] if random.random() < 0.5 else []
    leaves = [f"region = {z} -> region' != {z}"] if random.random() < 0.3 else []
    safety += [] if assigned else leaves  # docs/limits.md
    safety += [f"region' != {z}"] if random.random() < 0.3 else []
    if heard and random.random() < 0.6:
        match random.choice(["go", "stay", "avoid"]):
            case "go":
                liveness.append(f"alarm -> region = {z}")
            case "stay":
                safety.append("alarm' -> region' = region")
            case _:
                safety.append(f"alarm' & region != {z} -> region' != {z}")
    made["liveness"] = liveness
    return {**made, "safety": safety} if safety else made


SIDES = (0.8, 1.0, 1.25, 1.5, 1.8, 2.0, 2.4, 2.7, 3.3, 4.0)
"""Metres of a region: a walker needs 1.8."""


def metric_mission(seed: int) -> Data:
    """A mixed mission in metres, on either clock: robots of all kinds of motion and sizes, regions
    of many sizes, some on a map that is turned."""
    random = Random(f"metres {seed}")
    data = mixed_mission(seed, live=random.random() < 0.5)
    side = random.choice(SIDES)
    for model in data["catalogue"]["robots"].values():
        _add_motion(random, model, side)
    if random.random() < 0.8:
        data["map"]["resolution"] = side
        data["map"]["origin"] = [random.uniform(-20, 20), 3.5, random.choice([0.0, 0.5, -1.2, 3.0])]
    elif side < 2.7:
        data["map"]["resolution"] = 2.7
    return data


def _add_motion(random: Random, model: Data, side: float) -> None:
    walks = model["mobility"] == "heading" and side >= 1.8
    flies = model["layer"] == "air"
    kind = "flyer" if flies else "walker" if walks else random.choice(["rover", "disc"])
    most = min(0.6, side / 3) if kind == "walker" else min(1.2, side * 0.85)
    model["size"] = round(random.uniform(0.2, most), 2)
    model["speed"] = 0.45 if kind == "walker" else round(random.uniform(0.2, 1.5), 2)
    model["motion"] = kind
