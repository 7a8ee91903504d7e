"""Random missions by family and seed: the same seed always gives the same mission."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from random import Random
from typing import Any

from support.boards import ACTIONS, Data, Draft, corridor, open_floor, rooms, scattered
from support.mixed import formula_mission, hall_mission, mixed_mission, tracked_mission

OBJECTIVES = ("patrol", "visit", "visit", "cover", "cover", "hold")


def mission(family: str, seed: int) -> Data:
    """The mission of a family with this seed, as a scenario's data."""
    random, kind = Random(f"{family} {seed}"), FAMILIES[family]
    if family in MIXED:
        return MIXED[family](seed)
    make = kind.drawn if isinstance(kind, Family) else kind
    for _ in range(200):
        data = make(random, f"{family} {seed}", seed)
        if data is not None:
            return data
    raise AssertionError(f"no mission of {family} with seed {seed}")


def line(least: int, most: int) -> Callable[[Random], list[str]]:
    return lambda random: open_floor(1, random.randint(least, most))


def room(
    rows: tuple[int, int], cols: tuple[int, int], walls: float
) -> Callable[[Random], list[str]]:
    return lambda random: scattered(random, random.randint(*rows), random.randint(*cols), walls)


def bays(random: Random) -> list[str]:
    return corridor(random, random.randint(3, 8))


def small_rooms(random: Random) -> list[str]:
    return rooms(random, 1, random.randint(2, 3), random.randint(1, 2), random.randint(1, 3))


def large_rooms(random: Random) -> list[str]:
    return rooms(random, random.randint(1, 2), random.randint(1, 4), 2, random.randint(2, 3))


@dataclass(frozen=True)
class Family:
    """Random missions of a few robots in little space: the choices of floors, numbers of robots and
    objectives, and the chances that robots never hinder each other (``apart``) and have a heading,
    and that an obstacle has several needs (``needs``), or comes late and goes (``passing``).
    ``hidden``: the least and the most obstacles; ``rounds``: the most."""

    floors: Sequence[Callable[[Random], list[str]]]
    robots: Sequence[int] = (2, 2, 3)
    kinds: tuple[str, ...] = OBJECTIVES
    apart: float = 0.0
    heading: float = 0.35
    hidden: tuple[int, int] = (0, 0)
    needs: float = 0.0
    passing: float = 0.0
    rounds: int = 2
    ticks: int = 3000

    def drawn(self, random: Random, name: str, seed: int) -> Data | None:
        """A mission; None if there is no room for its robots."""
        draft = Draft(random, random.choice(self.floors)(random), name)
        count = random.choice(self.robots)
        if len(draft.free) < count + 2:
            return None
        how = random.choice(["layers", "avoids"]) if random.random() < self.apart else "together"
        taken: set[int] = set()
        for k in range(count):
            shared = "air" if k and random.random() < 0.2 else "ground"
            draft.models[f"m{k}"] = self._model(draft, f"l{k}" if how == "layers" else shared)
            more: Data = {"avoids": []} if how == "avoids" else {}
            if not draft.place(f"r{k}", f"m{k}", self.kinds, taken, **more):
                return None
        for k in range(random.randint(*self.hidden)):
            self._hide(draft, k)
        return draft.data(random.randint(1, self.rounds), self.ticks, seed)

    def _model(self, draft: Draft, layer: str) -> Data:
        random = draft.random
        return {
            "mobility": "heading" if random.random() < self.heading else "free",
            "layer": layer,
            "capabilities": [action for action in ACTIONS if random.random() < 0.35],
            "timing": draft.timing(),
        }

    def _hide(self, draft: Draft, k: int) -> None:
        """A hidden obstacle, most often in a narrow place."""
        random, narrow = draft.random, draft.narrow()
        region = random.choice(narrow if narrow and random.random() < 0.7 else draft.free)
        more: Data = {}
        if random.random() < self.passing:
            more["from"] = random.randint(1, 40)
        if random.random() < self.passing:
            more["until"] = more.get("from", 0) + random.randint(5, 60)
        kind = random.choice(["door", "uncertainty", "own", "own", "own"])
        if kind == "uncertainty":
            truth = random.choice([True, True, False, True])
            draft.obstacle(kind, region, traversable=truth, **more)
        elif kind == "door":
            draft.obstacle(kind, region, **more)
        elif draft.obstacle(f"o{k}", region, **more):
            draft.types[f"o{k}"] = self._type(draft, region)

    def _type(self, draft: Draft, region: int) -> Data:
        random, models = draft.random, draft.models
        able = sorted({action for model in models.values() for action in model["capabilities"]})
        actions = able if able and random.random() < 0.6 else list(ACTIONS)
        found: Data = {"action": random.choice(actions), "resolve_at": _where(draft, region)}
        if random.random() < self.needs:
            count = random.choice([1, 1, 2, 2, 3])
            found = {"needs": [_need(draft, region, actions) for _ in range(count)]}
        if random.random() < 0.3:
            layers = sorted({model["layer"] for model in models.values()})
            stopped = [*layers, *layers, *models, *draft.robots]
            found["blocks"] = sorted({*random.sample(stopped, random.choice([0, 1, 1, 2]))})
        return found


def _need(draft: Draft, region: int, actions: list[str]) -> Data:
    """Most often elsewhere: only robots that fulfil all remaining needs may enter the region."""
    random = draft.random
    need: Data = {"action": random.choice(actions), "at": _where(draft, region)}
    if need["at"] == "self" and random.random() < 0.7:
        need["at"] = "neighbours"
    if random.random() < 0.33:
        need |= {"robots": 2, "together": random.random() < 0.7}
    return need


def _where(draft: Draft, region: int) -> Any:
    """Where an action is performed."""
    random, others = draft.random, [r for r in draft.free if r != region]
    there = sorted(random.sample(others, min(len(others), random.randint(1, 3))))
    return random.choice(["self", "neighbours", there])


def crowd_hidden(random: Random, name: str, seed: int) -> Data | None:
    """Two to eight ground robots and flyers in rooms with doors one region wide, and hidden
    obstacles in doorways."""
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
    doors = draft.narrow()
    for region in random.sample(doors, min(len(doors), random.randint(1, 3))):
        draft.obstacle(random.choice(["door", "door", "uncertainty"]), region)
    return draft.data(2, 5000, seed)


APART = Family(
    (line(4, 12), room((2, 6), (3, 8), 0.3), large_rooms, small_rooms),
    robots=(1, 2, 3, 4),
    kinds=(*OBJECTIVES, "ltl"),
    apart=1.0,
    hidden=(0, 5),
)
"""Robots that never hinder each other in rooms and corridors, obstacles of all types."""
TIGHT = Family((line(4, 8), *[room((1, 3), (3, 4), 0.15)] * 3), heading=0.75)
"""Robots with headings in little space, without hidden obstacles."""
PARKING = Family(
    (line(3, 8), bays, small_rooms, *[room((2, 3), (2, 4), 0.2)] * 2),
    (2, 2, 3, 3, 4),
    ("hold", "hold", "once", "once", "once", "visit", "cover"),
    heading=0.3,
)
"""Robots that end at their last targets, where they may be in each other's way."""
MIXED: dict[str, Callable[[int], Data]] = {
    "mixed": mixed_mission,
    "halls": hall_mission,
    "tracked": tracked_mission,
    "spoken": formula_mission,
}
"""Many keys together: by seed alone, and often refused by the loader."""
FAMILIES: dict[str, Family | Callable[..., Data | None]] = {
    **MIXED,
    "apart": APART,
    "apart_needs": replace(APART, needs=0.6, passing=0.25),
    # One-way choices: obstacles that are resolved from where not all robots can return.
    "traps": Family(
        (room((3, 4), (3, 5), 0.3),), (2,), apart=1.0, heading=0.9, hidden=(2, 4), needs=0.3
    ),
    # Needs performed elsewhere, obstacles that come and go.
    "labs": Family(
        (line(5, 9), bays, small_rooms, room((3, 3), (3, 4), 0.2)),
        (1, 2, 2, 3),
        apart=0.4,
        heading=0.15,
        hidden=(1, 3),
        needs=0.55,
        passing=0.15,
        ticks=600,
    ),
    "tight": TIGHT,
    "tight_hidden": replace(TIGHT, hidden=(1, 2)),
    "tight_needs": replace(TIGHT, hidden=(1, 2), needs=0.7),
    # Formulas, some about single steps.
    "formulas": Family(
        (bays, room((1, 4), (3, 5), 0.25)),
        kinds=("ltl", "ltl_steps", "ltl_steps", "visit"),
        heading=0.3,
        hidden=(0, 2),
        needs=0.2,
        ticks=1000,
    ),
    "parking": PARKING,
    "parking_hidden": replace(PARKING, hidden=(1, 2)),
    "crowd_hidden": crowd_hidden,
}
