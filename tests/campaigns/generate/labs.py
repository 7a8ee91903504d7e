"""Small labs with buttons, keys, crates for two and lifts, written as a user would.

Robots that have the action of an obstacle in their way are common, and so are needs of several
robots and actions performed elsewhere.
"""

from random import Random
from typing import Any

from campaigns.generate.build import Data, Draft, corridor, open_floor, rooms, scattered

ACTIONS = ("press", "lift", "fetch", "push", "sense")
NAMES = ("button", "desk", "dock", "shelf", "bay", "gate")
MODELS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "presser": ("free", "ground", ("press",)),
    "lifter": ("free", "ground", ("lift",)),
    "porter": ("free", "ground", ("press", "lift", "push")),
    "courier": ("free", "ground", ("fetch", "push")),
    "walker": ("heading", "ground", ("push", "press")),
    "cart": ("free", "ground", ()),
    "drone": ("free", "air", ("sense", "press")),
}
OBJECTIVES = ("visit", "visit", "patrol", "cover", "hold")


def labs(random: Random, name: str, seed: int) -> Data | None:
    """One to three robots on at most 12 regions, with one to three hidden obstacles."""
    draft = Draft(random, _floor(random), name)
    if not 4 <= len(draft.free) <= 12:
        return None
    places = dict(zip(NAMES, random.sample(draft.free, 3), strict=False))
    taken: set[int] = set()
    apart = random.random() < 0.4
    for k in range(random.choice([1, 2, 2, 3])):
        model = random.choice(list(MODELS))
        mobility, layer, can = MODELS[model]
        entry: Data = {"mobility": mobility, "layer": layer}
        if can:
            entry["capabilities"] = list(can)
        if random.random() < 0.15:
            entry["timing"] = random.choice([2, {"least": 1, "most": 3}])
        draft.models.setdefault(model, entry)
        more: Data = {"avoids": []} if apart else {}
        kinds = OBJECTIVES if k else OBJECTIVES[:-1]
        if not draft.place(f"{model[0]}{k}", model, kinds, taken, **more):
            return None
    for k in range(random.choice([1, 1, 2, 2, 3])):
        _hide(random, draft, k)
    if not draft.obstacles:
        return None
    data = draft.data(random.choice([1, 2]), 600, seed)
    return _with_names(data, places, draft.cols) if random.random() < 0.6 else data


def _floor(random: Random) -> list[str]:
    match random.randrange(5):
        case 0:
            return open_floor(1, random.randint(5, 9))
        case 1:
            return corridor(random, random.randint(4, 8))
        case 2:
            return rooms(random, 1, 2, random.randint(1, 2), random.randint(1, 2))
        case 3:
            return scattered(random, 3, random.randint(3, 4), 0.2)
        case _:
            return rooms(random, 1, 3, 1, random.randint(1, 2))


def _hide(random: Random, draft: Draft, k: int) -> None:
    """An obstacle on some robot's way, most often."""
    narrow = draft.narrow()
    region = random.choice(narrow if narrow and random.random() < 0.7 else draft.free)
    more: Data = {}
    if random.random() < 0.2:
        more["from"] = random.randint(1, 20)
    if random.random() < 0.15:
        more["until"] = more.get("from", 0) + random.randint(3, 40)
    kind = random.choice(["door", "uncertainty", "own", "own", "own", "own", "own"])
    if kind == "uncertainty":
        more["traversable"] = random.choice([True, True, False])
        draft.obstacle(kind, region, **more)
    elif kind == "door":
        draft.obstacle(kind, region, **more)
    else:
        kind = f"{random.choice(['barrier', 'crate', 'shutter', 'lock'])}_{k}"
        if draft.obstacle(kind, region, **more):
            draft.types[kind] = _type(random, draft, region)


def _type(random: Random, draft: Draft, region: int) -> Data:
    able = sorted({a for m in draft.models.values() for a in m.get("capabilities", ())})
    actions = able if able and random.random() < 0.9 else list(ACTIONS)
    found: Data
    if random.random() < 0.45:
        found = {
            "action": random.choice(actions),
            "resolve_at": _where(random, draft, region, elsewhere=0.7),
        }
        if found["resolve_at"] == "self" and random.random() < 0.5:
            del found["resolve_at"]
    else:
        count = random.choice([1, 1, 2, 2, 3])
        found = {"needs": [_need(random, draft, region, actions) for _ in range(count)]}
    if random.random() < 0.5:
        layers = sorted({model["layer"] for model in draft.models.values()})
        choice = [*layers, "ground", *draft.models, *draft.robots]
        found["blocks"] = sorted(set(random.sample(choice, random.choice([0, 1, 1, 2]))))
    return found


def _need(random: Random, draft: Draft, region: int, actions: list[str]) -> Data:
    need: Data = {"action": random.choice(actions)}
    if random.random() < 0.35:
        need["robots"] = 2
        if random.random() < 0.6:
            need["together"] = True
    where = _where(random, draft, region, elsewhere=0.5)
    if where != "self":
        need["at"] = where
    return need


def _where(random: Random, draft: Draft, region: int, elsewhere: float) -> Any:
    if random.random() > elsewhere:
        return random.choice(["self", "neighbours"])
    others = [r for r in draft.free if r != region]
    return sorted(random.sample(others, min(len(others), random.randint(1, 2))))


def _with_names(data: Data, places: dict[str, int], cols: int) -> Data:
    """With names for some regions, others as row and column."""
    names = {region: name for name, region in places.items()}

    def written(region: int) -> Any:
        return names.get(region, list(divmod(region, cols)))

    found = dict(data)
    found["map"] = {**data["map"], "names": {n: list(divmod(r, cols)) for n, r in places.items()}}
    found["robots"] = {
        name: {**robot, "start": written(robot["start"])} for name, robot in data["robots"].items()
    }
    found["obstacles"] = [{**one, "region": written(one["region"])} for one in data["obstacles"]]
    return found
