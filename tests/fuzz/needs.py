"""Random teams, each robot on its own floor, with orders that several robots must fulfil in time,
judged by every move of all of them (``runtime.deadlines.every_behaviour``).

``python -m fuzz.needs --seeds 0:1000`` (in ``tests/``) is a campaign.
"""

from __future__ import annotations

import argparse
import json
from random import Random
from typing import Any

from campaigns.seeds import Judged, campaign
from runtime.deadlines.every_behaviour import every_behaviour
from runtime.played import Line, Run, loaded, play
from safenav.errors import InputError
from safenav.runtime.deadlines.bound import BoundMoment, BoundObstacle, BoundRobot
from safenav.runtime.resolution.problem import OpenNeed, OpenObstacle, Stage
from safenav.scenario.model import Need, Robot, Scenario
from safenav.world.map import HEADINGS, Heading, RegionMap
from safenav.world.moves import Pose
from safenav.world.poses import PoseGraph, region_mask

Data = dict[str, Any]


def mission(seed: int) -> Data:
    """Two or three robots, none of which is in the way of another, and one or two orders."""
    random = Random(f"several needs {seed}")
    rows, cols = random.choice(((1, 6), (1, 8), (2, 4), (2, 5), (3, 4)))
    inside = ["".join("#" if random.random() < 0.1 else "." for _ in range(cols))] * rows
    inside = ["".join("#" if random.random() < 0.12 else "." for _ in range(cols)) for _ in inside]
    headings = rows > 1 and random.random() < 0.4  # on open floors, which trap none of them
    if rows == 1 or headings:
        inside = ["." * cols] * rows
    free = [[r + 1, c + 1] for r in range(rows) for c in range(cols) if inside[r][c] == "."]
    count = random.choice((2, 2, 2, 3)) if len(free) < 10 else 2
    models, robots = dict[str, Any](), dict[str, Any]()
    skills = ["abc"[k] for k in range(count)]
    for k in range(count):
        turns = headings and random.random() < 0.6
        can = sorted({skills[k], *random.sample("abc", random.choice((0, 0, 0, 1, 2)))})
        models[f"m{k}"] = {
            "mobility": "heading" if turns else "free",
            "layer": f"floor{k}",
            "capabilities": can,
            "timing": random.choice((1, 1, 1, 2)),
        }
        start, away = random.choice(free), random.choice(free)
        robots[f"r{k}"] = {
            "model": f"m{k}",
            "start": start,
            "objective": {"visit": [start, away] if start != away else [start]},
        }
        if turns:
            robots[f"r{k}"]["heading"] = random.choice([*HEADINGS])
    kinds, orders = dict[str, Any](), []
    for k in range(random.choice((1, 1, 2))):
        needs = [_need(random, skills[:count], free) for _ in range(random.choice((2, 2, 3)))]
        kinds[f"job{k}"] = {"needs": needs, "blocks": []}
        orders.append(
            {
                "at": random.choice((1, 1, 2, 4)),
                "type": f"job{k}",
                "region": random.choice(free),
                "resolve_within": random.randint(1, 12),
            }
        )
    wall = "#" * (cols + 2)
    return {
        "safenav": 1,
        "map": {"grid": [wall, *(f"#{row}#" for row in inside), wall]},
        "catalogue": {"robots": models, "obstacles": kinds},
        "robots": robots,
        "orders": orders,
        "until": {"rounds": 1},
        "limits": {"ticks": 80},
    }


def _need(random: Random, skills: list[str], free: list[list[int]]) -> Data:
    need: Data = {"action": random.choice(skills), "at": random.sample(free, random.choice((1, 2)))}
    if random.random() < 0.1:
        need |= {"robots": 2, "together": random.random() < 0.5}
    return need


def defects(data: Data) -> list[str] | None:
    """Return the defects of the run of a mission; None if it has too many states."""
    try:
        run = play(data)
    except InputError:
        return []
    found = []
    for due in run.all("deadline", verdict="set"):
        job, planned = due["of"], due.get("planned")
        news = [line for line in run.all("order") if line["tick"] > due["tick"]]
        resolved = [x["tick"] for x in run.all("resolved", obstacle=job)]
        if planned is not None and not news and min(resolved, default=planned + 1) > planned:
            found.append(f"{job} is planned for tick {planned}, resolved in {resolved}")
    last = max((line["tick"] for line in run.all("order")), default=0)
    cols = len(data["map"]["grid"][0])
    jobs = [o for o in data["orders"] if o["at"] <= last <= o["at"] + o["resolve_within"]]
    if run.outcome["outcome"] != "completed" or not jobs:
        return found
    names = [f"{o['type']}@{o['region'][0] * cols + o['region'][1]}" for o in jobs]
    before = Run([line for line in run.records if line.get("tick", 0) < last])
    moment = _moment(loaded(json.dumps(data)), before, jobs, names, last)
    if any(one.over for one in moment.opens):
        return found
    ends = [order["at"] + order["resolve_within"] + 1 for order in jobs]
    late = [name for name in run.outcome["late"] if name in names]
    kept = not late and all(run.all("resolved", obstacle=name) for name in names)
    due = {k: moment.count * end - 1 for k, end in enumerate(ends)}
    truth = every_behaviour(moment, due, waits=not kept)  # no robot departs before it has acted
    if truth is None:
        return found or None
    if truth.kept is not kept:
        possible = "possible" if truth.kept else "not possible"
        found.append(f"{late or 'nothing'} is late; in time is {possible}")
    return found


def _moment(
    scenario: Scenario, before: Run, jobs: list[Data], names: list[str], tick: int
) -> BoundMoment:
    """The team as it begins a tick, and the needs that are left. No step takes more than two."""
    world, opens, walkers = scenario.map, [], []
    for job, name in zip(jobs, names, strict=True):
        told = scenario.catalogue.obstacles[job["type"]].needs
        needs = tuple(
            OpenNeed(need.action, need.robots, region_mask(_regions(need)), need.together)
            for need in told
        )
        met = [line["need"] for line in before.all("met", obstacle=name)]
        gate = OpenObstacle(name, 0, (frozenset(),) * len(needs), needs)
        opens.append(BoundObstacle(gate, Stage(max(met, default=-1) + 1)))
    for robot in scenario.robots:
        moves = before.all("move", robot=robot.name)
        walkers.append(_walker(robot, world, moves[-1:], tick))
    return BoundMoment(tuple(walkers), tuple(opens), tick * len(walkers) - 1)


def _walker(robot: Robot, world: RegionMap, last: list[Line], tick: int) -> BoundRobot:
    """A robot after its last move, if it has made one; of a step under way one turn is left."""
    graph, pose, leaves, ready = PoseGraph(world, robot.model.mobility), robot.start, None, tick - 1
    for line in last:
        to, faces = line["to"], None if line["heading"] is None else HEADINGS[line["heading"]]
        pose = Pose(to, faces)
        if (toward := line.get("toward")) is not None:
            side = next(heading for heading in Heading if world.step(to, heading) == toward)
            leaves, ready = graph.number(pose), tick
            pose = Pose(toward, None if faces is None else side)
    number, ticks = graph.number(pose), robot.model.timing.least
    return BoundRobot(graph, number, ready, ticks, robot.capabilities, leaves=leaves)


def _regions(need: Need) -> frozenset[int]:
    assert isinstance(need.at, frozenset)
    return need.at


def judged(seed: int, _: argparse.Namespace) -> Judged:
    """The run of one seed."""
    try:
        found = defects(mission(seed))
    except Exception as error:  # of the run, the scenario or the audit
        found = [f"{type(error).__name__}: {error}"]
    return Judged(found or (), {"too large": found is None})


if __name__ == "__main__":
    raise SystemExit(campaign(judged, __doc__))
