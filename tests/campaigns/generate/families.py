"""Random missions by family and seed: the same seed always gives the same mission."""

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

from campaigns.generate.build import ACTIONS, Data, Draft, corridor, open_floor, rooms, scattered
from campaigns.generate.labs import labs

OBJECTIVES = ("patrol", "visit", "visit", "cover", "cover", "hold")
WITH_FORMULAS = (*OBJECTIVES, "ltl")


def mission(family: str, seed: int) -> Data:
    """The mission of a family with this seed, as a scenario's data."""
    random = Random(f"{family} {seed}")
    for _ in range(50):
        data = FAMILIES[family](random, f"{family} {seed}", seed)
        if data is not None:
            return data
    raise AssertionError(f"no mission of {family} with seed {seed}")


def apart(random: Random, name: str, seed: int) -> Data | None:
    """Robots that never hinder each other in rooms and corridors, obstacles of all types."""
    return _apart(random, name, seed, needs=0.0, passing=0.0)


def apart_needs(random: Random, name: str, seed: int) -> Data | None:
    """The same with obstacles that need several actions or robots, that appear and go."""
    return _apart(random, name, seed, needs=0.6, passing=0.25)


def _apart(random: Random, name: str, seed: int, needs: float, passing: float) -> Data | None:
    draft = Draft(random, _floor(random), name)
    if len(draft.free) < 5:
        return None
    layers = random.random() < 0.5
    count = random.randint(1, 4)
    taken: set[int] = set()
    for k in range(count):
        draft.models[f"m{k}"] = _model(random, draft, f"l{k}" if layers else "ground")
        more: Data = {} if layers else {"avoids": []}
        if not draft.place(f"r{k}", f"m{k}", WITH_FORMULAS, taken, **more):
            return None
    _hide(random, draft, random.randint(0, 5), needs, passing)
    return draft.data(random.randint(1, 2), 3000, seed)


def _floor(random: Random) -> list[str]:
    kind = random.randrange(4)
    if kind == 0:
        return open_floor(1, random.randint(4, 12))
    if kind == 1:
        return scattered(random, random.randint(2, 6), random.randint(3, 8), 0.3)
    if kind == 2:
        return rooms(random, random.randint(1, 2), random.randint(1, 3), 2, random.randint(2, 3))
    return rooms(random, 1, random.randint(2, 4), 1, random.randint(1, 3))


def _model(random: Random, draft: Draft, layer: str, heading: float = 0.35) -> Data:
    return {
        "mobility": "heading" if random.random() < heading else "free",
        "layer": layer,
        "capabilities": [action for action in ACTIONS if random.random() < 0.35],
        "timing": draft.timing(),
    }


def _hide(random: Random, draft: Draft, count: int, needs: float, passing: float) -> None:
    """Hidden obstacles, most of them in narrow places."""
    narrow = draft.narrow()
    for k in range(count):
        region = random.choice(narrow if narrow and random.random() < 0.7 else draft.free)
        more: Data = {}
        if random.random() < passing:
            more["from"] = random.randint(1, 40)
        if random.random() < passing:
            more["until"] = more.get("from", 0) + random.randint(5, 60)
        kind = random.choice(["door", "uncertainty", "own", "own"])
        if kind == "uncertainty":
            truth = random.choice([True, True, False, {"probability": 0.5}])
            draft.obstacle(kind, region, traversable=truth, **more)
        elif kind == "door" and random.random() >= needs:
            draft.obstacle(kind, region, **more)
        elif draft.obstacle(f"o{k}", region, **more):
            draft.types[f"o{k}"] = _type(random, draft, region, needs)


def _type(random: Random, draft: Draft, region: int, needs: float) -> Data:
    found: Data = {}
    if random.random() < needs:
        found["needs"] = [_need(random, draft, region) for _ in range(random.randint(1, 2))]
    else:
        found = {"action": random.choice(ACTIONS), "resolve_at": _where(random, draft, region)}
    if random.random() < 0.25:
        layers = sorted({model["layer"] for model in draft.models.values()})
        found["blocks"] = random.sample(layers, random.randint(1, len(layers)))
    return found


def _need(random: Random, draft: Draft, region: int) -> Data:
    robots = random.choice([1, 1, 2])
    found = {
        "action": random.choice(ACTIONS[:3]),
        "robots": robots,
        "at": _where(random, draft, region, apart=True),
    }
    if robots > 1:
        found["together"] = random.random() < 0.7
    return found


def _where(random: Random, draft: Draft, region: int, apart: bool = False) -> Any:
    """Where an action is performed; ``apart``: not in the region itself, which only robots that can
    fulfil all remaining needs may enter."""
    kinds = ["neighbours", "list"] if apart else ["self", "neighbours", "list"]
    kind = random.choice(kinds)
    if kind != "list":
        return kind
    others = [r for r in draft.free if r != region]
    return sorted(random.sample(others, min(len(others), random.randint(1, 3))))


def tight(random: Random, name: str, seed: int) -> Data | None:
    """Two or three robots with headings in little space, without hidden obstacles."""
    return _tight(random, name, seed, obstacles=0, needs=0.0)


def tight_hidden(random: Random, name: str, seed: int) -> Data | None:
    """The same with hidden obstacles of one action."""
    return _tight(random, name, seed, obstacles=2, needs=0.0)


def tight_needs(random: Random, name: str, seed: int) -> Data | None:
    """The same with obstacles that need several actions or robots."""
    return _tight(random, name, seed, obstacles=2, needs=0.7)


def _tight(random: Random, name: str, seed: int, obstacles: int, needs: float) -> Data | None:
    if random.random() < 0.25:
        grid = open_floor(1, random.randint(4, 8))
    else:
        grid = scattered(random, random.randint(1, 3), random.randint(3, 4), 0.15)
    draft = Draft(random, grid, name)
    count = random.choice([2, 2, 3])
    if len(draft.free) <= count:
        return None
    taken: set[int] = set()
    for k in range(count):
        layer = "a" if k == 0 or random.random() < 0.8 else "b"
        draft.models[f"m{k}"] = _model(random, draft, layer, heading=0.75)
        if not draft.place(f"r{k}", f"m{k}", OBJECTIVES, taken):
            return None
    if obstacles:
        _hide(random, draft, random.randint(1, obstacles), needs, 0.0)
    return draft.data(random.randint(1, 2), 3000, seed)


def traps(random: Random, name: str, seed: int) -> Data | None:
    """One-way choices: robots with headings that do not hinder each other, and obstacles that
    they resolve from places from which not all of them can come back."""
    draft = Draft(random, scattered(random, random.randint(3, 4), random.randint(3, 5), 0.3), name)
    if len(draft.free) < 6:
        return None
    taken: set[int] = set()
    for k in range(2):
        draft.models[f"m{k}"] = _model(random, draft, f"l{k}", heading=0.9)
        if not draft.place(f"r{k}", f"m{k}", OBJECTIVES, taken):
            return None
    _hide(random, draft, random.randint(2, 4), 0.3, 0.0)
    return draft.data(1, 3000, seed)


def formulas(random: Random, name: str, seed: int) -> Data | None:
    """Robots with formulas, some about single steps, in corridors with bays and on tight floors;
    in every other mission something is hidden."""
    if random.random() < 0.5:
        grid = corridor(random, random.randint(3, 8))
    else:
        grid = scattered(random, random.randint(1, 4), random.randint(3, 5), 0.25)
    draft = Draft(random, grid, name)
    count = random.choice([2, 2, 3])
    if len(draft.free) <= count + 1:
        return None
    taken: set[int] = set()
    for k in range(count):
        layer = "a" if k == 0 or random.random() < 0.8 else "b"
        draft.models[f"m{k}"] = _model(random, draft, layer, heading=0.3)
        kinds = ("ltl", "ltl_steps", "ltl_steps") if k < 2 else (*OBJECTIVES, "ltl_steps")
        if not draft.place(f"r{k}", f"m{k}", kinds, taken):
            return None
    if random.random() < 0.5:
        _hide(random, draft, random.randint(1, 2), 0.2, 0.0)
    return draft.data(random.randint(1, 2), 1000, seed)


def crowd(random: Random, name: str, seed: int) -> Data | None:
    """Two to eight ground robots and flyers in rooms with doors one region wide."""
    return _crowd(random, name, seed, hidden=False)


def crowd_hidden(random: Random, name: str, seed: int) -> Data | None:
    """The same with hidden obstacles in doorways."""
    return _crowd(random, name, seed, hidden=True)


def _crowd(random: Random, name: str, seed: int, hidden: bool) -> Data | None:
    grid = rooms(
        random,
        random.randint(1, 2),
        random.randint(2, 3),
        random.randint(2, 4),
        random.randint(3, 5),
    )
    draft = Draft(random, grid, name)
    draft.models["rover"] = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
    draft.models["cart"] = {
        "mobility": "free",
        "layer": "ground",
        "capabilities": [],
        "timing": draft.timing(),
    }
    kinds = OBJECTIVES if random.random() < 0.6 else ("patrol",)
    taken: set[int] = set()
    for k in range(random.randint(2, 8)):
        model = random.choice(["digit", "digit", "rover", "cart"])
        if not draft.place(f"{model}{k}", model, kinds, taken):
            return None
    for k in range(random.randint(0, 2)):
        draft.place(f"quad{k}", "quadcopter", kinds, taken)
    if hidden:
        doors = draft.narrow()
        for region in random.sample(doors, min(len(doors), random.randint(1, 3))):
            kind = random.choice(["door", "door", "uncertainty"])
            draft.obstacle(kind, region)
    return draft.data(2, 5000, seed)


def mirrored(random: Random, name: str, seed: int) -> Data | None:
    """Quadcopters on an open floor that go to mirrored places on the other side: seed 4 is
    four of them on 4 x 12 regions, 12 is twelve."""
    count = max(2, seed)
    rows = 4 if count <= 4 else 6
    draft = Draft(random, open_floor(rows, 12), name)
    west = [(r, c) for c in (1, 2) for r in range(1, rows + 1)][:count]
    for k, (row, col) in enumerate(west):
        start, target = [row, col], [rows + 1 - row, 13 - col]
        draft.robots[f"q{k}"] = {
            "model": "quadcopter",
            "start": start,
            "objective": {"visit": [target, start]},
        }
    return draft.data(1, 3000, seed)


def maps_folder() -> Path | None:
    """Return the folder of the MovingAI maps, if this machine has them."""
    here = Path(__file__).resolve()
    found = (parent / "shared" / "maps" for parent in here.parents)
    return next((folder for folder in found if folder.is_dir()), None)


def benchmark(robots: int, flyers: int, doors: int, seed: int) -> Data:
    """random-32-32-10 with starts and goals of its .scen: half of the robots with headings."""
    folder = maps_folder()
    assert folder is not None
    random = Random(f"benchmark {seed}")
    drawn = (folder / "random-32-32-10.map").read_text().split("map\n", 1)[1]
    text = drawn.replace("@", "#").split()
    cols = len(text[0])
    lines = (folder / "random-32-32-10-random-1.scen").read_text().splitlines()[1:]
    tasks = [list(map(int, line.split("\t")[4:8])) for line in lines]
    draft = Draft(random, text, f"random-32-32-10 {robots} {seed}")
    draft.models["rover"] = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
    taken: set[int] = set()
    for x, y, goal_x, goal_y in tasks[seed:]:
        start, goal = y * cols + x, goal_y * cols + goal_x
        k = len(draft.robots)
        if k == robots:
            break
        if start in taken or start == goal:
            continue
        model = "digit" if k % 2 else "rover"
        draft.robot(f"{model}{k}", model, start, {"visit": [goal, start]})
        if draft.can_go_on(f"{model}{k}"):
            taken.add(start)
        else:
            del draft.robots[f"{model}{k}"]
    for k in range(flyers):
        draft.place(f"quad{k}", "quadcopter", ("visit",), set())
    goals = {r for robot in draft.mission().robots for target in robot.targets for r in target}
    narrow = [r for r in draft.narrow() if r not in goals] or draft.free
    while len(draft.obstacles) < doors:
        draft.obstacle("door", random.choice(narrow))
    return draft.data(1, 5000, seed)


def big(random: Random, name: str, seed: int) -> Data | None:  # noqa: ARG001
    """Twenty robots, two flyers and five hidden doors on a map of 32 x 32."""
    return benchmark(20, 2, 5, seed)


FAMILIES: dict[str, Callable[[Random, str, int], Data | None]] = {
    "apart": apart,
    "apart_needs": apart_needs,
    "traps": traps,
    "labs": labs,
    "tight": tight,
    "tight_hidden": tight_hidden,
    "tight_needs": tight_needs,
    "formulas": formulas,
    "crowd": crowd,
    "crowd_hidden": crowd_hidden,
    "mirrored": mirrored,
    "big": big,
}
