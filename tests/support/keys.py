"""Further keys of random missions: obstacles, and what others decide."""

from random import Random
from typing import Any

from support.draft import ACTIONS, Data, Draft, Family

KEYS = (
    *("zones", "inputs", "tasks", "changes", "service", "avoids", "waiting", "falling"),
    *("doubts", "returning", "skills", "literal", "flat"),
)


class Keyed(Draft):
    """A scenario of a family, that gets further keys; each is a method."""

    def __init__(self, family: Family, random: Random, name: str) -> None:
        rounds, grid = random.randint(1, family.rounds), random.choice(family.floors)(random)
        super().__init__(random, grid, name, rounds, family.ticks * family.scale)
        self.family = family

    @property
    def types(self) -> Data:
        return self.data["catalogue"]["obstacles"]  # type: ignore[no-any-return]

    @property
    def name(self) -> str:
        """A robot."""
        return self.random.choice(sorted(self.robots))

    def some(self, most: int) -> list[int]:
        return sorted(self.random.sample(self.free, min(most, len(self.free))))

    def at(self, least: int, most: int) -> int:
        return self.random.randint(least, most) * self.family.scale

    def pursuit(self) -> Data:
        """An objective, perhaps with a region that it avoids."""
        kinds = "patrol", "visit", "visit", "cover", "hold", "once"
        found = self.targets(self.random.choice(kinds))
        others = [region for region in self.free if str(region) not in str(found)]
        if others and self.chance(0.25):
            found["avoid"] = [self.random.choice(others)]
        return found

    def taught(self) -> str:
        """An action that most models have."""
        action = self.random.choice(ACTIONS)
        for model in self.models.values():
            if self.chance(0.6):
                model["capabilities"] = sorted({*model["capabilities"], action})
        return action

    # Obstacles.

    def hide(self) -> None:
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
            self.types[own] = self._type(region)

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

    def falling(self) -> None:
        """An obstacle that comes where a robot may stand."""
        region = self.robots[self.name]["start"]
        self.types["falls"] = self._type(region)
        kind = self.random.choice(["door", "falls"])
        self.data["obstacles"].append({"type": kind, "region": region, "from": self.at(2, 12)})

    def doubts(self) -> None:
        region = self.random.choice(self.narrow() or self.free)
        self.types["doubt"] = {**self._type(region), "has_truth": True}
        goes = {"until": self.at(10, 60)} if self.chance(0.3) else {}
        self.obstacle("doubt", region, traversable=self.chance(0.5), **goes)

    def returning(self) -> None:
        """An obstacle that comes again where another one was."""
        if self.data["obstacles"]:
            again = dict(self.random.choice(self.data["obstacles"]))
            again["from"] = again.pop("until", self.at(20, 60)) + self.at(1, 10)
            self.data["obstacles"].append(again)

    def tasks(self) -> None:
        """Orders of one type: by one robot or several, most often of a load."""
        random, kind = self.random, f"task{len(self.types)}"
        share: Data = {"action": self.taught(), "robots": random.choice([1, 1, 1, 2, 3])}
        share |= {"together": self.chance(0.6)} if share["robots"] > 1 else {}
        needs = [share | {"at": random.choice(["self", "neighbours", self.some(2)])}]
        for _ in range(random.choice([0, 1, 1, 2])):
            needs.append(share | {"at": self.some(2), "same": True})
        if self.chance(0.3):
            other = {"action": random.choice(ACTIONS), "at": self.some(1)}
            needs.insert(random.choice([0, len(needs)]), other)
        self.types[kind] = {"needs": needs, "blocks": []}
        for _ in range(random.randint(1, 3)):
            order = {"at": self.at(1, 15), "type": kind, "region": self.some(1)[0]}
            within = {"resolve_within": self.at(3, 40)} if self.chance(0.1) else {}
            self.data["orders"] = [*self.data.get("orders", []), order | within]

    # Changes from outside.

    def _change(self, at: int, robot: str, **what: object) -> None:
        changes = [*self.data.get("changes", []), {"at": at, "robot": robot, **what}]
        self.data["changes"] = sorted(changes, key=lambda change: change["at"])

    def changes(self) -> None:
        for _ in range(self.random.randint(1, 2)):
            self._change(self.at(1, 20), self.name, objective=self.pursuit())

    def service(self) -> None:
        name, at = self.name, self.at(1, 15)
        self._change(at, name, service="out")
        if self.chance(0.75):
            self._change(at + self.at(1, 20), name, service="back")

    def inputs(self) -> None:
        spans = [f"{at}-{at + self.at(0, 9)}" for at in sorted({self.at(1, 20), self.at(21, 40)})]
        self.data["inputs"] |= {"rain": {"at": spans}} if self.chance(0.5) else {}
        for _ in range(self.random.randint(1, 2)):
            heard = self.random.sample(sorted(self.data["inputs"]), len(self.data["inputs"]))
            self.robots[self.name]["when"] = {name: self.pursuit() for name in heard}

    def waiting(self) -> None:
        self.robots[self.name]["while_waiting"] = self.pursuit()

    # Robots.

    def zones(self) -> None:
        names = sorted(self.robots)
        if len(names) > 1:
            who = self.random.sample(names, self.random.randint(2, len(names)))
            self.data.setdefault("never_together", []).append({"robots": who, "in": self.some(3)})

    def avoids(self) -> None:
        others = [name for name in self.robots if name != "r0"]
        self.robots["r0"]["avoids"] = others[: self.chance(0.5)]

    def skills(self) -> None:
        for _ in ACTIONS:
            self.taught()

    def literal(self) -> None:
        objective = self.robots[self.name]["objective"]
        if "patrol" in objective or "once" in objective:
            objective["form"] = "literal"

    def flat(self) -> None:
        """Little charge, and batteries that are brought."""
        if "chargers" not in self.data:
            self.batteries()
        for model in self.models.values():
            if "battery" in model and self.chance(0.6):
                model["battery"]["capacity"] = self.at(3, 9)
        bring: Data = {"action": self.taught(), "at": "neighbours"}
        bring |= {"robots": 2} if self.chance(0.3) else {}
        fetched = [bring | {"at": self.some(1)}, bring | {"same": True}]
        self.types["empty"] = {"needs": self.random.choice([[bring], fetched]), "blocks": []}
        self.data["flat"] = "empty"

    def batteries(self) -> None:
        random, scale = self.random, self.family.scale
        for name in random.sample([*self.models], random.randint(1, len(self.models))):
            self.models[name]["battery"] = {
                "capacity": random.randint(6, 24) * scale,
                "charge": random.choice([1, 3]),
                "stay": random.choice([0, 0, 0, 1]),
            }
        self.data["chargers"] = random.sample(self.free, random.randint(1, 3))

    def promises(self) -> None:
        random, data, scale = self.random, self.data, self.family.scale
        if self.chance(0.5):
            data["until"]["by"] = random.randint(5, 40) * scale
            data["late"] = random.choice(["go_on", "stop"])
        for obstacle in data["obstacles"]:
            if self.chance(0.5):
                obstacle["resolve_within"] = random.randint(3, 20) * scale
