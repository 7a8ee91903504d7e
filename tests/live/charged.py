"""Missions of robots with batteries in time."""

from random import Random

import yaml

from campaigns.generate.build import Data
from live.missions import former, timed
from runtime.energy.test_battery_runs import stop


def alone(seed: int) -> Data:
    """A cart among walls, whose charge suffices or not."""
    data: Data = yaml.safe_load(stop(seed))
    return data


def team(seed: int) -> Data:
    """A mission in time in which the robots of some models have batteries."""
    if (found := former(f"charged_{seed}")) is not None:
        return found
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
