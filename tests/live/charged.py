"""Missions of robots with batteries in time, and who has what charge by the log of the world alone.

A step takes ``move`` when it ends, a second without one ``stay``, or gives ``charge`` on a charger.
A robot stands from the moment on at which the team is told of the end of its step.
"""

from collections.abc import Mapping, Sequence
from random import Random
from typing import Any

import yaml

from campaigns.generate.build import Data
from campaigns.judge.mission import read_mission
from live.missions import timed
from runtime.energy.test_battery_runs import stop

Line = Mapping[str, Any]
CLOSE = 1e-5
"""Of a charge: seconds of a log are not rounded."""


def alone(seed: int) -> Data:
    """A cart among walls, whose charge suffices or not."""
    data: Data = yaml.safe_load(stop(seed))
    return data


def team(seed: int) -> Data:
    """A mission in time in which the robots of some models have batteries."""
    for again in range(100):
        data, random = timed(7919 * again + seed), Random(f"charged {seed} {again}")
        models = (data.get("catalogue") or {}).get("robots") or {}
        robots = [r for r in data["robots"].values() if r["model"] in models]
        if (
            not robots
            or len(data["robots"]) > 6
            or any("cover" in r["objective"] or "ltl" in r["objective"] for r in robots)
        ):
            continue
        grid = "".join(data["map"]["grid"])
        free = [region for region, cell in enumerate(grid) if cell == "."]
        data["chargers"] = random.sample(free, min(len(free), random.randint(3, 6)))
        data.pop("coordination", None)
        for model in models.values():
            capacity, stay = random.randint(40, 120), random.choice((0, 0, 1))
            model["battery"] = {"capacity": capacity, "charge": random.randint(1, 8), "stay": stay}
        return data
    raise AssertionError(f"no mission with batteries for {seed}")


class Charges:
    """The charges of a mission's robots along a log. ``defects``: steps without charge; ``flat``:
    robots that could take no step at some time."""

    def __init__(self, data: Data, log: Sequence[Line]) -> None:
        models = (data.get("catalogue") or {}).get("robots") or {}
        robots = data["robots"].items()
        self.batteries = {n: models.get(r["model"], {}).get("battery") for n, r in robots}
        self.batteries = {n: b for n, b in self.batteries.items() if b}
        self.chargers = {*data.get("chargers", ())}
        self.charge = {n: float(b.get("start", b["capacity"])) for n, b in self.batteries.items()}
        self.at = {robot.name: robot.start[0] for robot in read_mission(data).robots}
        self.since: dict[str, float | None] = dict.fromkeys(self.batteries, 0.0)
        self.under_way: dict[str, int] = {}
        self.defects: list[str] = []
        self.flat: set[str] = set()
        self.charged = 0
        for line in log:
            if line.get("robot") in self.batteries:
                self._follow(line, line["robot"])
        for name in self.batteries:
            self._pass(name, log[-1]["t"] if log else 0.0)

    def _pass(self, name: str, t: float) -> None:
        """Let a robot that stands have stood until then."""
        battery, since = self.batteries[name], self.since[name]
        if since is None:
            return
        there = self.at[name] in self.chargers
        rate = battery["charge"] if there else -battery.get("stay", 0)
        charge = self.charge[name] + rate * (t - since)
        self.charged += there and self.charge[name] < battery["capacity"] and t > since
        self.charge[name] = min(battery["capacity"], max(0.0, charge))
        self.since[name] = t
        if self.charge[name] < battery.get("move", 1) - CLOSE and not there:
            self.flat.add(name)

    def _follow(self, line: Line, name: str) -> None:
        move = self.batteries[name].get("move", 1)
        match line["log"]:
            case "start":
                self._pass(name, line["t"])
                self.since[name], self.under_way[name] = None, line["command"]
                if self.charge[name] < move - CLOSE:
                    told = f"{name} sets out with a charge of {self.charge[name]:g}"
                    self.defects.append(f"{line['t']:.2f} s: {told}")
            case "end":
                self.charge[name] = max(0.0, self.charge[name] - move)
                self.at[name] = line["at"]
            case "told" if line["command"] == self.under_way.get(name):
                del self.under_way[name]
                self.since[name] = line["t"]
                self._pass(name, line["t"])
            case "put":
                self._pass(name, line["t"])
                self.at[name] = line["at"]
            case _:
                pass
