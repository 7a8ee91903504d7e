"""Random missions by family and seed: the same seed always gives the same mission, as plain data.

A mission is made piece by piece. What the loader refuses is drawn again, or left out.
"""

import json
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from random import Random
from typing import Any

from campaigns.judge.mission import Mission, NotJudgedError
from campaigns.judge.search import Poses
from safenav import InputError, load_scenario_text
from support.floors import free_in, open_floor, rooms, scattered

ACTIONS = ("push", "sense", "clear", "lift")
HEADINGS = ("north", "east", "south", "west")
OBJECTIVES = ("patrol", "visit", "visit", "cover", "cover", "hold")
SIDES = (0.8, 1.0, 1.25, 1.5, 1.8, 2.0, 2.4, 2.7, 3.3, 4.0)
"""Metres of a region: a walker needs 1.8."""
KEYS = ("zones", "inputs", "orders", "loads", "changes", "avoids", "waiting")

Data = dict[str, Any]
Floor = Callable[[Random], list[str]]


@dataclass(frozen=True)
class Family:
    """Random missions of a few robots in little space: the choices of floors, numbers of robots and
    objectives, and the chances that robots never hinder each other (``apart``) and have a heading,
    and that an obstacle has several needs (``needs``), or comes late and goes (``passing``).
    ``hidden``: the least and the most obstacles; ``rounds``: the most; ``keys``: choices of how
    many further keys there are; ``more``: the chance of each key that restricts a robot;
    ``formulas``: that its objective is a formula with memory; ``scale``: of times; ``tracks``: all
    are apart, and track each other; ``metric``: in metres, on either clock."""

    floors: Sequence[Floor]
    robots: Sequence[int] = (2, 2, 3)
    kinds: tuple[str, ...] = OBJECTIVES
    apart: float = 0.0
    heading: float = 0.35
    hidden: tuple[int, int] = (0, 0)
    needs: float = 0.0
    passing: float = 0.0
    rounds: int = 2
    ticks: int = 3000
    keys: Sequence[int] = ()
    more: float = 0.0
    formulas: float = 0.0
    scale: int = 1
    tracks: bool = False
    metric: bool = False


class Draft:
    """A scenario in the making, on a grid of rows of text."""

    def __init__(self, random: Random, grid: list[str], name: str, rounds: int, ticks: int) -> None:
        self.random, self.cols, self.free = random, len(grid[0]), free_in(grid)
        self.data: Data = {
            "safenav": 1,
            "name": name,
            "map": {"grid": grid},
            "catalogue": {"robots": {}, "obstacles": {}},
            "robots": {},
            "obstacles": [],
            "until": {"rounds": rounds},
            "limits": {"ticks": ticks, "synthesis_seconds": 20},
            "seed": random.randrange(1000),
        }

    @property
    def robots(self) -> Data:
        return self.data["robots"]  # type: ignore[no-any-return]

    @property
    def models(self) -> Data:
        return self.data["catalogue"]["robots"]  # type: ignore[no-any-return]

    def chance(self, share: float) -> bool:
        return self.random.random() < share

    def accepted(self, **other: Any) -> bool:
        """Whether the loader accepts the scenario, perhaps with ``other`` keys."""
        try:
            load_scenario_text(json.dumps(self.data | other))
        except InputError:
            return False
        return True

    def kept(self, change: Callable[[], object], attempts: int = 4) -> bool:
        """Make a random change, one that the loader accepts; return False if there is none."""
        before = self.data
        for _ in range(attempts):
            self.data = deepcopy(before)
            change()
            if self.data != before and self.accepted():
                return True
        self.data = before
        return False

    def narrow(self) -> list[int]:
        """Regions with walls on two opposite sides: doorways and corridors."""
        free, cols = {*self.free}, self.cols
        beside = ((r, {r - 1, r + 1}, {r - cols, r + cols}) for r in self.free)
        return [r for r, row, col in beside if not (row & free and col & free)]

    def place(self, name: str, model: str, draw: Callable[[int], Data], **more: Any) -> bool:
        """Add a robot at a free start with an objective (``draw``) that it can pursue forever;
        return False if a dozen attempts find none."""
        free = [r for r in self.free if all(r != each["start"] for each in self.robots.values())]

        def add() -> None:
            start = self.random.choice(free)
            self.robots[name] = {"model": model, "start": start, "objective": draw(start), **more}
            turns = self.models[model]["mobility"] == "heading" if model in self.models else True
            if (turns and model != "quadcopter") or self.chance(0.3):
                self.robots[name]["heading"] = self.random.choice(HEADINGS)

        return bool(free) and any(self.kept(add) and self._lasts(name) for _ in range(4))

    def _lasts(self, name: str) -> bool:
        """Whether a robot alone can obey its formulas forever, as far as the judge reads them."""
        if "ltl" not in self.robots[name]["objective"]:
            return True
        try:
            mission = Mission(self.data | {"robots": {name: self.robots[name]}, "obstacles": []})
            robot = mission.robots[name]
        except NotJudgedError:
            return True
        return robot.start in Poses(mission, robot).live(frozenset())

    def targets(self, kind: str) -> Data:
        """An objective of this kind, without rules beside it."""
        random, free = self.random, self.free
        if kind == "hold":
            return {kind: random.choice(free)}
        count = 2 + self.chance(0.2) if kind == "patrol" else random.choice([1, 2, 2, 3])
        found: list[Any] = random.sample(free, min(count, len(free)))
        others = [r for r in free if r not in found]
        if others and kind != "patrol" and self.chance(0.15):
            found[-1] = {"any": [found[-1], random.choice(others)]}
        return {kind: found}

    def obstacle(self, kind: str, region: int, **more: Any) -> bool:
        """Add an obstacle of the type, unless the region has one or is a robot's start."""
        taken = {one["region"] for one in self.data["obstacles"]}
        if region in taken | {robot["start"] for robot in self.robots.values()}:
            return False
        self.data["obstacles"].append({"type": kind, "region": region, **more})
        return True


class Drawn(Draft):
    """A random mission of a family."""

    def __init__(self, family: Family, random: Random, name: str) -> None:
        rounds, grid = random.randint(1, family.rounds), random.choice(family.floors)(random)
        super().__init__(random, grid, name, rounds, family.ticks * family.scale)
        self.family = family

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
            self.kept(self._add_batteries)
        for _ in range(random.randint(*family.hidden)):
            self.kept(self._hide)
        for key in keys:
            self.kept(partial(self._add, key))
        if family.keys and self.chance(0.3):
            self.kept(self._add_promises)
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

    def _hide(self) -> None:
        """A hidden obstacle, most often in a narrow place."""
        random, narrow = self.random, self.narrow()
        region = random.choice(narrow if narrow and self.chance(0.7) else self.free)
        more: Data = {}
        if self.chance(self.family.passing):
            more["from"] = random.randint(1, 40)
        if self.chance(self.family.passing):
            more["until"] = more.get("from", 0) + random.randint(5, 60)
        kind, own = random.choice(["door", "uncertainty", "own", "own", "own"]), f"o{region}"
        if kind == "uncertainty":
            self.obstacle(kind, region, traversable=self.chance(0.75), **more)
        elif self.obstacle(kind if kind == "door" else own, region, **more) and kind == "own":
            self.data["catalogue"]["obstacles"][own] = self._type(region)

    def _type(self, region: int) -> Data:
        random, models = self.random, self.models
        able = sorted({action for model in models.values() for action in model["capabilities"]})
        actions = able if able and self.chance(0.6) else list(ACTIONS)
        found: Data = {"action": random.choice(actions), "resolve_at": self._where(region)}
        if self.chance(self.family.needs):
            count = random.choice([1, 1, 2, 2, 3])
            found = {"needs": [self._need(region, actions) for _ in range(count)]}
        if self.chance(0.3):
            layers = sorted({model["layer"] for model in models.values()})
            stopped = [*layers, *layers, *models, *self.robots]
            found["blocks"] = sorted({*random.sample(stopped, random.choice([0, 1, 1, 2]))})
        return found

    def _need(self, region: int, actions: list[str]) -> Data:
        """Most often elsewhere: only robots that fulfil all remaining needs may enter."""
        need: Data = {"action": self.random.choice(actions), "at": self._where(region)}
        if need["at"] == "self" and self.chance(0.7):
            need["at"] = "neighbours"
        return need | ({"robots": 2, "together": self.chance(0.7)} if self.chance(0.33) else {})

    def _where(self, region: int) -> Any:
        """Where an action is performed."""
        random, others = self.random, [r for r in self.free if r != region]
        there = sorted(random.sample(others, min(len(others), random.randint(1, 3))))
        return random.choice(["self", "neighbours", there])

    def _add(self, key: str) -> None:
        """A further key of the scenario: what others decide, and who may be where."""
        random, data, names, scale = self.random, self.data, sorted(self.robots), self.family.scale
        one, other = places = random.sample(self.free, 2)
        match key:
            case "zones" if len(names) > 1:
                zone = {"robots": names[:2], "in": random.sample(self.free, 3)}
                data["never_together"] = [zone]
            case "inputs":
                self.robots["r0"]["when"] = {"alarm": {"visit": places}}
            case "orders" | "loads":
                fetch = {"action": "lift", "at": [one]}
                bring = {"action": "lift", "at": [other], "same": True}
                done = {"action": random.choice(ACTIONS), "at": [one]}
                kind = {"needs": [fetch, bring] if key == "loads" else [done], "blocks": []}
                data["catalogue"]["obstacles"][key] = kind
                times = (random.randint(1, 8) * scale for _ in range(random.choice([1, 2, 3])))
                orders = [{"at": at, "type": key, "region": one} for at in sorted(times)]
                data["orders"] = data.get("orders", []) + orders
            case "changes":
                at, back = random.randint(1, 10) * scale, "battery" in self.models["m0"]
                objective = {"visit" if back else "cover": places}
                data["changes"] = [{"at": at, "robot": "r0", "objective": objective}]
                for later, service in ((2, "out"), (9, "back")) if self.chance(0.3) else ():
                    change = {"at": at + later, "robot": names[-1], "service": service}
                    data["changes"].append(change)
            case "waiting":
                self.robots["r0"]["while_waiting"] = {"hold": one}
            case "avoids" if len(names) > 1:
                self.robots["r0"]["avoids"] = random.choice([[], ["r1"]])

    def _add_batteries(self) -> None:
        random, scale = self.random, self.family.scale
        for name in random.sample([*self.models], random.randint(1, len(self.models))):
            self.models[name]["battery"] = {
                "capacity": random.randint(6, 24) * scale,
                "charge": random.choice([1, 3]),
                "stay": random.choice([0, 0, 0, 1]),
            }
        self.data["chargers"] = random.sample(self.free, random.randint(1, 3))
        if self.chance(0.4):
            swap = {"action": "lift", "at": "neighbours"}
            fetch = {"action": "lift", "at": [random.choice(self.free)]}
            needs = random.choice([[swap], [fetch, {**swap, "same": True}]])
            self.data["catalogue"]["obstacles"]["empty"] = {"needs": needs, "blocks": []}
            self.data["flat"] = "empty"

    def _add_promises(self) -> None:
        random, data, scale = self.random, self.data, self.family.scale
        if self.chance(0.5):
            data["until"]["by"] = random.randint(5, 40) * scale
            data["late"] = random.choice(["go_on", "stop"])
        for obstacle in data["obstacles"]:
            if self.chance(0.5):
                obstacle["resolve_within"] = random.randint(3, 20) * scale

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
            model["speed"] = 0.45 if kind == "walker" else round(random.uniform(0.2, 1.5), 2)
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
