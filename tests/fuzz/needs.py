"""Random teams on floors of their own with orders that several robots must fulfil in time, and a
judge that tries every move of all of them.

``python -m fuzz.needs --seeds 0:1000`` (in ``tests/``) is a campaign.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping
from random import Random
from typing import Any

from msgspec import Struct

from runtime.played import Line, play
from safenav.errors import InputError

Data = dict[str, Any]

SIDES = {"north": (-1, 0), "east": (0, 1), "south": (1, 0), "west": (0, -1)}
MOST_STATES = 60_000
"""States of one tick; missions with more are left out."""


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
            robots[f"r{k}"]["heading"] = random.choice([*SIDES])
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


class Robot(Struct, frozen=True):
    """Where a robot is, its heading, the region that it is on its way to, and the turns of its own
    that are left of that step."""

    region: int
    heading: str | None = None
    toward: int | None = None
    left: int = 0


Team = tuple[Robot, ...]
Stages = tuple[tuple[int, frozenset[int]], ...]
"""For each order its next need, and the robots that have had their part in it."""


class Everything(Struct):
    """Every behaviour of the team of a mission. ``jobs``: the orders that are known."""

    data: Data
    jobs: list[Data]

    def in_time(self, team: Team, stages: Stages, begin: int, due: list[int]) -> bool | None:
        """Whether all jobs can be done by the ends of their ticks from the begin of one on; None:
        too many states."""
        states = {(team, stages)}
        for tick in range(begin, max(due) + 1):
            for index in range(len(team)):
                after = set[tuple[Team, Stages]]()
                for each, open_ in states:
                    after.update(self._turn(each, open_, index))
                states = after
                if any(all(self._done(s, k) for k in range(len(due))) for _, s in states):
                    return True
            if len(states) > MOST_STATES:
                return None
            states = {
                (each, open_)
                for each, open_ in states
                if all(self._done(open_, k) or due[k] > tick for k in range(len(due)))
            }
        return False

    def _done(self, stages: Stages, job: int) -> bool:
        return stages[job][0] >= len(self._needs(job))

    def _needs(self, job: int) -> list[Data]:
        kind = self.data["catalogue"]["obstacles"][self.jobs[job]["type"]]
        needs: list[Data] = kind["needs"]
        return needs

    def _model(self, index: int) -> Data:
        model: Data = self.data["catalogue"]["robots"][f"m{index}"]
        return model

    def _turn(self, team: Team, stages: Stages, index: int) -> Iterator[tuple[Team, Stages]]:
        for moved in self._moves(team[index], self._model(index)):
            after = (*team[:index], moved, *team[index + 1 :])
            yield after, self._acted(after, stages, index)

    def _moves(self, robot: Robot, model: Data) -> Iterator[Robot]:
        if robot.toward is not None:
            there = Robot(robot.toward, robot.heading)
            yield there if robot.left == 1 else Robot(*_head(robot), robot.left - 1)
            return
        yield robot
        grid = self.data["map"]["grid"]
        cols, sides = len(grid[0]), [*SIDES]
        for side, (down, right) in SIDES.items():
            row, col = robot.region // cols + down, robot.region % cols + right
            back = robot.heading is not None and side == sides[sides.index(robot.heading) - 2]
            if grid[row][col] == "#" or back:
                continue
            heading = None if robot.heading is None else side
            to = row * cols + col
            if model["timing"] == 1:
                yield Robot(to, heading)
            else:
                yield Robot(robot.region, heading, to, model["timing"] - 1)

    def _acted(self, team: Team, stages: Stages, index: int) -> Stages:
        """What a robot can do where it is is done: that only ever helps."""
        return tuple(self._acts(team, each, job, index) for job, each in enumerate(stages))

    def _acts(
        self, team: Team, stage: tuple[int, frozenset[int]], job: int, index: int
    ) -> tuple[int, frozenset[int]]:
        number, done = stage
        needs = self._needs(job)
        while number < len(needs):
            need = needs[number]
            there = {i for i in range(len(team)) if self._is_there(team[i], i, need)} - done
            if index not in there:
                break
            done |= there if need.get("together") else {index}
            if len(done) < need.get("robots", 1):
                done = frozenset() if need.get("together") else done
                break
            number, done = number + 1, frozenset()
        return number, done

    def _is_there(self, robot: Robot, index: int, need: Data) -> bool:
        cols = len(self.data["map"]["grid"][0])
        able = need["action"] in self._model(index)["capabilities"]
        return able and [robot.region // cols, robot.region % cols] in need["at"]


def _head(robot: Robot) -> tuple[int, str | None, int | None]:
    return robot.region, robot.heading, robot.toward


def defects(data: Data) -> list[str] | None:
    """What is wrong with the run of a mission; None if it has too many states."""
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
    before = [line for line in run.records if line.get("tick", 0) < last]
    stages = tuple(_stage(before, name) for name in names)
    team = tuple(_robot(data, index, before) for index in range(len(data["robots"])))
    judge = Everything(data, jobs)
    dues = [order["at"] + order["resolve_within"] for order in jobs]
    if any(judge._done(stages, k) for k in range(len(jobs))):
        return found
    truth = judge.in_time(team, stages, last, dues)
    if truth is None:
        return found or None
    late = [name for name in run.outcome["late"] if name in names]
    if truth is bool(late):
        found.append(f"{late or 'nothing'} is late; in time is {'' if truth else 'not '}possible")
    return found


def _stage(lines: Iterable[Line], job: str) -> tuple[int, frozenset[int]]:
    met = [x["need"] for x in lines if x["type"] == "met" and x["obstacle"] == job]
    return max(met, default=-1) + 1, frozenset()


def _robot(data: Data, index: int, before: Iterable[Line]) -> Robot:
    name, cols = f"r{index}", len(data["map"]["grid"][0])
    row, col = data["robots"][name]["start"]
    at = Robot(row * cols + col, data["robots"][name].get("heading"))
    timing = data["catalogue"]["robots"][f"m{index}"]["timing"]
    for line in before:
        if line["type"] != "move" or line["robot"] != name:
            continue
        at = Robot(line["to"], line["heading"])
        if line.get("toward") is not None:
            at = Robot(line["to"], _side(line, cols), line["toward"], timing - 1)
            if at.heading is not None and line["heading"] is None:
                at = Robot(at.region, None, at.toward, at.left)
    return at


def _side(line: Mapping[str, Any], cols: int) -> str:
    step = divmod(line["toward"], cols), divmod(line["to"], cols)
    (row, col), (r, c) = step
    return next(side for side, way in SIDES.items() if way == (row - r, col - c))


def main() -> int:
    """Play the missions of some seeds; 1 if something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="0:100")
    first, behind = map(int, parser.parse_args().seeds.split(":"))
    bad = out = 0
    for seed in range(first, behind):
        try:
            found = defects(mission(seed))
        except Exception as error:  # of the run, the scenario or the audit
            found = [f"{type(error).__name__}: {error}"]
        out += found is None
        for line in found or ():
            print(f"{seed}: {line}", flush=True)
        bad += bool(found)
    print(f"{behind - first} missions, {bad} with a defect, {out} too large")
    return int(bad > 0)


if __name__ == "__main__":
    raise SystemExit(main())
