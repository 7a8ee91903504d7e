"""Random missions by family and seed: the same seed always gives the same mission, as plain data.

A mission is made piece by piece. What the loader refuses is drawn again, or left out.
"""

from dataclasses import replace
from random import Random

from support.draft import ACTIONS, OBJECTIVES, SIDES, Data, Family, Floor
from support.floors import open_floor, rooms, scattered
from support.keys import KEYS, Keyed


class Drawn(Keyed):
    """A random mission of a family."""

    def made(self) -> Data | None:
        """The mission; None if there is no room for its robots."""
        random, family = self.random, self.family
        count = random.choice(family.robots)
        keys = random.sample(KEYS, random.choice(family.keys)) if family.keys else []
        if len(self.free) < count + 2:
            return None
        if family.keys and self.chance(0.15):
            self.data["coordination"] = "assignable"
        if "inputs" in keys:
            self.data["inputs"] = {"alarm": {"at": [random.choice(["3-9", "5", "2-4"])]}}
        how = random.choice(["layers", "avoids"]) if self.chance(family.apart) else "together"
        for k in range(count):
            shared = "air" if k and self.chance(0.2) else "ground"
            self.models[f"m{k}"] = self._model(f"l{k}" if how == "layers" else shared)
            more: Data = {"avoids": []} if how == "avoids" or family.tracks else {}
            if not self.place(f"r{k}", f"m{k}", self._objective, **more):
                return None
        if family.keys and self.chance(0.4):
            self.kept(self.batteries)
        for _ in range(random.randint(*family.hidden)):
            self.kept(self.hide)
        for key in keys:
            self.kept(getattr(self, key))
        if family.keys and self.chance(0.3):
            self.kept(self.promises)
        if family.tracks:
            self.kept(self._track)
        return self.data if not family.metric or self.kept(self._measure) else None

    def _model(self, layer: str) -> Data:
        random, family = self.random, self.family
        found: Data = {
            "mobility": "heading" if self.chance(family.heading) else "free",
            "layer": layer,
            "capabilities": [action for action in ACTIONS if self.chance(0.35)],
            "timing": random.choice([1, 1, 1, 2, 3]),
        }
        return found | ({"vision": random.randint(1, 3)} if self.chance(family.more) else {})

    def _objective(self, start: int) -> Data:
        random, more = self.random, self.family.more
        kind = "memory" if self.chance(self.family.formulas) else random.choice(self.family.kinds)
        if kind in ("ltl", "ltl_steps", "memory"):
            return {"ltl": self._formulas(kind, start)}
        found = self.targets(kind)
        others = [r for r in self.free if r != start and str(r) not in str(found)]
        if others and self.chance(more):
            found["avoid"] = [random.choice(others)]
        if self.chance(more):
            one = random.choice(self.free)
            found["always"] = f"region = {one} -> region' != {one + random.choice([1, -1])}"
        if kind in ("visit", "patrol") and self.chance(more):
            found["within"] = random.randint(6, 30)
        return found

    def _formulas(self, kind: str, start: int) -> Data:
        random = self.random
        x, y, z = random.sample(self.free, 3)
        made: Data = {}
        safety, liveness = list[str](), [f"region = {x}"]
        match random.choice(["flag", "toggle", "range"]) if kind == "memory" else "none":
            case "flag":
                made |= {"memory": {"m": "bool"}, "init": "!m"}
                safety.append(f"m' <-> m | region = {x}")
                liveness = [f"m & region = {y}"]
            case "toggle":
                made |= {"memory": {"m": "bool"}, "init": "!m"}
                safety += [f"region' = {x} -> m'", f"region' = {y} -> !m'"]
                safety.append(f"region' != {x} & region' != {y} -> (m' <-> m)")
                liveness.append(f"region = {y}")
            case "range":
                made |= {"memory": {"c": [0, 2]}, "init": "c = 0"}
                enters = f"region' = {x} & region != {x}"
                safety += [f"{enters} & c = {k} -> c' = {(k + 1) % 3}" for k in range(3)]
                safety.append(f"!({enters}) -> c' = c")
                liveness = [f"c = 2 & region = {y}"]
            case _:
                liveness += [f"region = {y}"] if self.chance(0.5) else []
        if z != start and self.chance(0.4):
            safety.append(f"region' != {z}")
        for _ in range(random.randint(0, 2) if kind != "ltl" else 0):
            step = random.choice(self.free)
            to = step + random.choice([1, -1, self.cols, -self.cols])
            safety += [f"region = {step} -> region' != {to}"] if to in self.free else []
        if kind == "memory" and "coordination" not in self.data and self.chance(0.3):
            safety.append(f"region = {z} -> region' != {z}")  # docs/limits.md
        if kind == "memory" and "inputs" in self.data and self.chance(0.6):
            heard = ["alarm' -> region' = region", f"alarm' & region != {z} -> region' != {z}", ""]
            rule = random.choice(heard)
            safety += [rule] if rule else []
            liveness += [] if rule else [f"alarm -> region = {z}"]
        return made | {"liveness": liveness} | ({"safety": safety} if safety else {})

    def _track(self) -> None:
        robots = self.robots
        quick = [name for name in robots if self.models[robots[name]["model"]]["timing"] == 1]
        for name in quick if len(quick) > 1 else ():
            others = [other for other in quick if other != name]
            tracks = self.random.sample(others, self.random.randint(0, min(2, len(others))))
            robots[name] |= {"tracks": tracks, "vision": self.random.randint(1, 4)}

    def _measure(self) -> None:
        """Metres: all kinds of motion and sizes, regions of many sizes, some maps turned."""
        random, side, world = self.random, self.random.choice(SIDES), self.data["map"]
        for model in self.models.values():
            walks = model["mobility"] == "heading" and side >= 1.8
            kind = "walker" if walks else random.choice(["rover", "disc"])
            kind = "flyer" if model["layer"] == "air" else kind
            most = min(0.6, side / 3) if kind == "walker" else min(1.2, side * 0.85)
            model["size"] = round(random.uniform(0.2, most), 2)
            model["speed"] = round(random.uniform(0.4, 1.5), 2)
            model["motion"] = kind
        if self.chance(0.8):
            world["resolution"] = side
            world["origin"] = [random.uniform(-20, 20), 3.5, random.choice([0.0, 0.5, -1.2, 3.0])]
        elif side < 2.7:
            world["resolution"] = 2.7
        if self.chance(0.5):
            self.data["clock"] = "live"


def mission(family: str, seed: int) -> Data:
    """The mission of a family with this seed, as a scenario's data."""
    random = Random(f"{family} {seed}")
    for _ in range(200):
        data = Drawn(FAMILIES[family], random, f"{family} {seed}").made()
        if data is not None:
            return data
    raise AssertionError(f"no mission of {family} with seed {seed}")


def _line(least: int, most: int) -> Floor:
    return lambda random: open_floor(1, random.randint(least, most))


def _room(rows: tuple[int, int], cols: tuple[int, int], walls: float) -> Floor:
    return lambda random: scattered(random, random.randint(*rows), random.randint(*cols), walls)


def _bays(random: Random) -> list[str]:
    """A corridor one region wide, with one or two bays."""
    length = random.randint(3, 8)
    bays = random.sample(range(length), random.randint(1, 2))
    side = "".join("." if k in bays else "#" for k in range(length))
    return ["#" * (length + 2), f"#{'.' * length}#", f"#{side}#", "#" * (length + 2)]


def _small_rooms(random: Random) -> list[str]:
    return rooms(random, 1, random.randint(2, 3), random.randint(1, 2), random.randint(1, 3))


def _large_rooms(random: Random) -> list[str]:
    return rooms(random, random.randint(1, 2), random.randint(1, 4), 2, random.randint(2, 3))


def _hall(random: Random) -> list[str]:
    down, across, height = random.randint(1, 2), random.randint(2, 3), random.randint(2, 4)
    return rooms(random, down, across, height, random.randint(3, 5))


_APART = Family(
    (_line(4, 12), _room((2, 6), (3, 8), 0.3), _large_rooms, _small_rooms),
    robots=(1, 2, 3, 4),
    kinds=(*OBJECTIVES, "ltl"),
    apart=1.0,
    hidden=(0, 5),
)
"""Robots that never hinder each other in rooms and corridors, obstacles of all types."""
_TIGHT = Family((_line(4, 8), *[_room((1, 3), (3, 4), 0.15)] * 3), heading=0.75)
"""Robots with headings in little space, without hidden obstacles."""
_PARKING = Family(
    (_line(3, 8), _bays, _small_rooms, *[_room((2, 3), (2, 4), 0.2)] * 2),
    (2, 2, 3, 3, 4),
    ("hold", "hold", "once", "once", "once", "visit", "cover"),
    heading=0.3,
)
"""Robots that end at their last targets, where they may be in each other's way."""
_MIXED = Family(
    (_line(4, 5), *[_room((2, 3), (3, 5), 0.15)] * 3),
    (1, 2, 2, 2, 3),
    (*OBJECTIVES, "once"),
    hidden=(0, 2),
    needs=0.35,
    passing=0.15,
    ticks=300,
    keys=(0, 1, 2, 3),
    more=0.12,
)
"""Many keys together, as users combine them."""
FAMILIES = {
    "mixed": _MIXED,
    "halls": replace(_MIXED, floors=(_hall,), robots=(2, 3, 3, 4), scale=5),
    "tracked": replace(_MIXED, tracks=True),
    "wild": replace(_MIXED, keys=range(4, 10)),
    "spoken": replace(_MIXED, formulas=0.6),
    "metric": replace(_MIXED, metric=True),
    "apart": _APART,
    "apart_needs": replace(_APART, needs=0.6, passing=0.25),
    # One-way choices: obstacles that are resolved from where not all robots can return.
    "traps": Family(
        (_room((3, 4), (3, 5), 0.3),), (2,), apart=1.0, heading=0.9, hidden=(2, 4), needs=0.3
    ),
    # Needs performed elsewhere, obstacles that come and go.
    "labs": Family(
        (_line(5, 9), _bays, _small_rooms, _room((3, 3), (3, 4), 0.2)),
        (1, 2, 2, 3),
        apart=0.4,
        heading=0.15,
        hidden=(1, 3),
        needs=0.55,
        passing=0.15,
        ticks=600,
    ),
    "tight": _TIGHT,
    "tight_hidden": replace(_TIGHT, hidden=(1, 2)),
    "tight_needs": replace(_TIGHT, hidden=(1, 2), needs=0.7),
    # Formulas, some about single steps.
    "formulas": Family(
        (_bays, _room((1, 4), (3, 5), 0.25)),
        kinds=("ltl", "ltl_steps", "ltl_steps", "visit"),
        heading=0.3,
        hidden=(0, 2),
        needs=0.2,
        ticks=1000,
    ),
    "parking": _PARKING,
    "parking_hidden": replace(_PARKING, hidden=(1, 2)),
    # Two to ten robots in rooms with doors one region wide.
    "crowd_hidden": Family((_hall,), range(2, 11), heading=0.5, hidden=(1, 3), ticks=5000),
}
