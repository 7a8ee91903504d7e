"""Drives of random missions in the physics simulation with late messages, judged by the physics
alone: sightings, ends of steps, contacts and regions.

``SAFENAV_FUZZ=500`` tries 500 seeds, from ``SAFENAV_FUZZ_FIRST`` on.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from random import Random
from typing import Any

import pytest
import yaml

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from campaigns.late import Listening, Moment
from drawn import tried
from fleet.lab import drive_in
from safenav import Diagnostic, InputError, Scenario, UsageError, check_trace, load_scenario_text
from support.draft import SIDES, Data
from support.floors import free_in, rooms
from support.missions import mission

FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
COUNT = int(os.environ.get("SAFENAV_FUZZ", "5"))
TOUCH = 0.02
"""Metres by which a body may reach into a region that its robot does not have."""


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_drives_with_late_messages_agree_with_the_physics(
    seed: int, played: Callable[[], None]
) -> None:
    defects = tried(late_drive, seed)
    assert defects == []
    played()


def late_drive(seed: int) -> list[str]:
    """Drive a random mission; return the violated requirements. Raises InputError for a mission
    that is refused."""
    random, data = Random(f"drive {seed}"), late_mission(seed)
    hidden = data["obstacles"]
    if not any("from" in one for one in hidden):
        data["obstacles"] = []  # unknown to the team
    scenario = load_scenario_text(yaml.safe_dump(data, sort_keys=False), "late.yaml")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fleet.yaml"
        file.write_text(yaml.safe_dump(fleet_of(random, hidden, scenario)))
        try:
            world = Listening(scenario, file, random)
        except UsageError as error:
            raise InputError([Diagnostic("late.yaml", 0, 0, str(error))]) from error
        trace = Path(folder) / "trace.jsonl"
        texts, began = drive_in(world, scenario, trace)
    lines = [json.loads(line) for line in texts]
    defects = Judge(world, lines, began).defects
    return defects + [f"trace: {finding}" for finding in check_trace(texts).findings]


# Random small scenarios for drives, and their fleets.


def late_mission(seed: int) -> Data:
    """A mixed mission for a drive: on a real clock, all obstacles with bodies of one type, which
    the lidars see."""
    random = Random(f"late {seed}")
    limits = {"ticks": 300, "synthesis_seconds": 20, "seconds": 240}
    if random.random() < 0.5:
        return _rooms(random) | {"limits": limits, "clock": "live"}
    data = mission("metric", seed) | {"limits": limits, "clock": "live"}
    data["until"].pop("by", None)
    data.pop("late", None)
    for robot in data["robots"].values():
        robot["objective"].pop("within", None)
        robot.pop("avoids", None)  # bodies do not share a region
    types, solid = data["catalogue"]["obstacles"].items(), None
    seen = {"uncertainty", *(name for name, kind in types if kind.get("has_truth"))}
    for obstacle in data["obstacles"]:
        obstacle.pop("resolve_within", None)
        if obstacle["type"] not in seen:
            solid = solid or obstacle["type"]
            obstacle["type"] = solid
    data["map"].setdefault("resolution", random.choice(SIDES))
    return data


def _rooms(random: Random) -> Data:
    """Two or three rooms with doors between them, and robots that cross them."""
    width = random.choice([1, 2, 3])
    grid = rooms(random, 1, random.choice([2, 2, 3]), random.choice([1, 2, 2, 3]), width)
    free = free_in(grid)
    places = [region for region in free if region % len(grid[0]) % (width + 1) == 0]
    inside = [region for region in free if region not in places]
    robots: Data = {}
    many = min(random.choice([1, 2, 2, 3]), len(inside) - 1)
    for k, start in enumerate(random.sample(inside, many)):
        aims = random.sample(inside, 2)
        robots[f"r{k}"] = {
            "model": random.choice(["jackal", "mir250", "spot", "digit", "quadcopter", "tugger"]),
            "start": start,
            "objective": random.choice([{"visit": aims}, {"visit": aims[:1]}, {"cover": aims}]),
        }
        if robots[f"r{k}"]["model"] == "digit":
            robots[f"r{k}"]["heading"] = random.choice(["north", "east", "south", "west"])
    tugger = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
    kind, doors = random.choice(["door", "door", "door", "debris"]), random.choice([1, 2])
    hidden = [{"type": kind, "region": p} for p in places if random.random() < 0.8]
    return {
        "safenav": 1,
        "map": {"grid": grid, "resolution": random.choice([1.8, 2.0, 2.4])},
        "catalogue": {"robots": {"tugger": tugger | {"size": 0.5, "speed": 0.8}}},
        "robots": robots,
        "obstacles": hidden[:doors],
        "until": {"rounds": random.choice([1, 1, 2])},
    }


def fleet_of(random: Random, hidden: list[Data], scenario: Scenario) -> Data:
    """The fleet of a scenario's robots in simulation. ``hidden``: the obstacles that are there."""
    side = scenario.map.frame.resolution if scenario.map.frame is not None else 1.0
    kinds = scenario.catalogue.obstacles
    solid = [one["type"] for one in hidden if not kinds[one["type"]].has_truth]
    robots, follow = dict[str, Data](), random.random() < 0.2
    for robot in scenario.robots:
        figures = robot.model.figures
        size = figures.values["size"] if figures else robot.model.size or 0.5
        robots[robot.name] = {
            "act": {action: action for action in sorted(robot.capabilities)},
            "speed": robot.model.speed or 0.5,
            "tolerance": round(min(0.3, max(0.06, (side - size) / 2)), 3),
            **({"scan": {"obstacle": solid[0]}} if solid else {}),
            **({"follow": {}} if follow and figures and figures.kind != "walker" else {}),
        }
    defaults: Data = {"timeout": random.choice([3, 6]), "report": "obstacles"}
    return {
        "safenav-fleet": 1,
        "transport": "simulation",
        "simulation": {"pace": 1e9} | ({} if scenario.obstacles else {"obstacles": hidden}),
        "defaults": defaults,
        "robots": robots,
    }


class Judge:
    """Comparison of a trace with the log of the physics. ``zero``: the start of the run."""

    def __init__(self, world: Listening, lines: Sequence[Data], zero: float) -> None:
        self._team, self._stations, self._places = world.team, world.stations, world.goals.places
        self._bodies: Any = world.late.physics._bodies
        self._moments, self._sensed, self._zero = world.late.moments, world.sensed, zero
        self.defects: list[str] = []
        self._sightings()
        for line in lines:
            if line["type"] == "arrive" and not self._bumped(line["robot"], line["t"]):
                self._end(line, line["robot"], line["t"])
        self._contacts()
        self._rooms(lines)

    def _wrong(self, t: float, what: str) -> None:
        self.defects.append(f"{t:.2f} s: {what}")

    def _around(self, t: float, before: float, after: float = 0.05) -> Iterator[Moment]:
        at = t + self._zero
        return (one for one in self._moments if at - before <= one.t <= at + after)

    def _sightings(self) -> None:
        """Check that what is seen was there, and what is gone was not, within the last 3 s."""
        for event in self._sensed:
            t, name = event.at - self._zero, event.obstacle.name
            if name.startswith(("lost_", "unknown_")):
                continue
            stood = [name in one.stands for one in self._around(t, 3.0)]
            if event.there and not any(stood):
                self._wrong(t, f"{event.by} has not seen {name}")
            elif not event.there and all(stood):
                self._wrong(t, f"{event.by} tells that {name} is gone")

    def _end(self, line: Data, name: str, t: float) -> None:
        """Check that a step ends where the trace says."""
        x, y, yaw = [*self._around(t, 0.05)][-1].at[name]
        here, station = self._places.region(x, y), self._stations[name]
        result, told = line["result"], line["at"]
        if result == "lost":
            if here not in line["regions"]:
                self._wrong(t, f"{name} is in {here}, not lost in {line['regions']}")
            return
        half = self._places.frame.resolution / 2
        limit = (station.tolerance if station.follow is None else half) + 0.05
        far = self._places.distance(told, x, y)
        if here != told or far > limit:
            self._wrong(t, f"{name} {result} {far:.2f} m from the centre of {told}")
        facing = self._places.heading(yaw).label
        if line.get("heading") not in (None, facing):
            self._wrong(t, f"{name} {result}: faces {facing}, not {line['heading']}")

    def _contacts(self) -> None:
        """Check that no robot touches another one, or an obstacle on which it does not act and that
        no robot knew: only a robot that resolves a known one may enter it."""
        for one in self._moments:
            t, found = one.t - self._zero, list[str]()
            for pair in one.touches if t >= 0 else ():
                robots = [name for name in pair if name in one.at]
                if len(robots) == 2 and self._team[robots[0]].conflicts(self._team[robots[1]]):
                    found.append(f"{pair[0]} touches {pair[1]}")
                for thing in {*pair} - {*robots} - {"wall"}:
                    told = (e for e in self._sensed if e.there and e.obstacle.name == thing)
                    known = any(event.at < one.t for event in told)
                    acts = any(robots[0] in m.acting for m in (one, *self._around(t, 1.0)))
                    if thing in one.stands and not acts and not known:
                        found.append(f"{robots[0]} touches {thing}")
            for what in found:
                if not any(what in told for told in self.defects):
                    self._wrong(t, what)

    def _rooms(self, lines: Sequence[Data]) -> None:
        """Check that each body stays in the regions that its robot has. One that acts may reach
        beyond them."""
        side, end = self._places.frame.resolution, lines[-1].get("t", 0.0)
        for name, robot in self._team.items():
            radius, held = self._bodies[name].kind.radius, {robot.start.region: 1}
            if 2 * radius + TOUCH > side:
                continue
            changes, acts = list[tuple[float, int, int]](), list[tuple[float, float]]()
            for line in lines:
                if line["type"] == "depart" and line["robot"] == name:
                    changes.append((line["t"], line["to"], 1))
                    ends = {line["from"], line["to"]}
                elif line["type"] == "arrive" and line["robot"] == name:
                    if line["result"] != "lost":
                        changes += [(line["t"], region, -1) for region in ends - {line["at"]}]
                elif line["type"] == "act" and name in line["robots"]:
                    acts.append((line["t"], end))
                elif line["type"] == "acted" and acts and line["robot"] == name:
                    acts[-1] = acts[-1][0], line["t"]
            for one in self._moments:
                t, (x, y, _) = one.t - self._zero, one.at[name]
                while changes and changes[0][0] <= t:
                    _, region, more = changes.pop(0)
                    held[region] = held.get(region, 0) + more
                if not 0 <= t <= end or any(since <= t <= until + 0.1 for since, until in acts):
                    continue
                for region in self._near(x, y):
                    into = radius - self._places.outside(region, x, y)
                    if into > TOUCH and held.get(region, 0) < 1 and not self._bumped(name, t):
                        self._wrong(t, f"{name} reaches {into:.3f} m into {region}")
                        return

    def _near(self, x: float, y: float) -> Iterable[int]:
        """The regions that a body of at most their width can touch; all if it is off the map."""
        world, here = self._places.world, self._places.region(x, y)
        if here is None:
            return range(world.rows * world.cols)
        row, col = world.position(here)
        rows = range(max(row - 1, 0), min(row + 2, world.rows))
        cols = range(max(col - 1, 0), min(col + 2, world.cols))
        return (world.region(r, c) for r in rows for c in cols)

    def _bumped(self, name: str, t: float) -> bool:
        """Whether a robot touches another one, which the scenario lets share its regions."""
        pairs = (pair for one in self._around(t, 0.5) for pair in one.touches)
        return any(name in pair and {*pair} <= self._team.keys() for pair in pairs)
