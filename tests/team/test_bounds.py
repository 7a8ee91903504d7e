"""Lower bounds on the times of resolutions and rounds, against every behaviour of a small team: by
a program that shares nothing with safenav. It is compiled once from ``every_behaviour.cpp``, and
reads its questions as numbers."""

import os
import subprocess
from collections.abc import Callable, Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path
from random import Random
from tempfile import gettempdir
from typing import NamedTuple

import pytest
from msgspec.structs import replace

from drawn import loads
from safenav import Scenario
from safenav.team.apply import initial
from safenav.team.bound import NEVER, Bound
from safenav.team.state import Is, ObstacleNow, Stage, State
from safenav.team.team import Team, team_of
from safenav.world.poses import region_mask
from support.draft import Data
from support.floors import free_in, walled

FUZZ = int(os.environ.get("SAFENAV_FUZZ", "0"))
BATCHES, IN_BATCH = (FUZZ // 50, 100) if FUZZ else (1, 80)
"""``SAFENAV_FUZZ=5000`` asks about 10,000 moments."""
SOURCE = Path(__file__).with_name("every_behaviour.cpp")
MOST = 30_000_000
"""States of one question."""
HEADINGS = ("north", "east", "south", "west")
NOBODY = 1 << 7
"""A skill that no robot has."""

Pose = tuple[int, int]
"""Heading (0 for robots without one) and region."""


class Walker(NamedTuple):
    """``here``: where it is, or departed; ``to``: its step; ``due``: the tick when that ends."""

    here: Pose
    to: Pose | None
    due: int


class Moment(NamedTuple):
    """``begun``: of the robots, how many have had their turns of tick 1. ``stages``: by obstacle
    the need, who has done its part, and who met the need before; None: it is permanent.
    ``targets``: what one of the robots, ``walker``, is to meet, one after the other."""

    data: Data
    scenario: Scenario
    begun: int
    robots: list[Walker]
    stages: list[tuple[int, frozenset[int], frozenset[int] | None] | None]
    walker: int
    targets: list[list[int]]


def drawn(seed: int) -> Data:
    """One to three robots and up to three obstacles on a small board."""
    random = Random(f"bounds {seed}")
    free: list[int] = []
    while len(free) < 6:
        grid = walled(random, *random.choice(((2, 3), (2, 4), (2, 5), (3, 3), (3, 4))), 0.15)
        free = free_in(grid)
    count, slow = random.choice((1, 2, 2, 2, 3, 3)), random.random() < 0.6
    places = random.sample(free, count + random.choice((0, 1, 2, 2, 3)[: 5 if count < 3 else 3]))
    starts, closed = places[:count], places[count:]
    models, types = {}, {}
    for name in "xyz"[:count]:
        models[name] = {
            "mobility": "heading" if random.random() < 0.3 else "free",
            "layer": random.choice(("ground", "ground", "air")),
            "capabilities": [action for action in ("lift", "push") if random.random() < 0.75],
            "timing": random.choice((1, 1, 2, 3)) if slow else 1,
        }
    for kind in "abc"[: len(closed)]:
        needs: list[Data] = []
        for k in range(random.choice((1, 2, 2))):
            same = k > 0 and random.random() < 0.6
            robots = needs[-1].get("robots", 1) if same else random.choice((1, 1, 2))
            where = sorted({*random.choices([*free, *starts, *starts], k=random.choice((1, 2, 2)))})
            needs.append({"action": random.choice(("lift", "push")), "at": where})
            needs[-1] |= {"same": True} if same else {}
            needs[-1] |= {"robots": 2, "together": random.random() < 0.5} if robots > 1 else {}
        stopped = [name for name in "xyz"[:count] if random.random() < 0.7]
        types[kind] = {"needs": needs, "blocks": stopped}
    return {
        "safenav": 1,
        "map": {"grid": grid},
        "catalogue": {"robots": models, "obstacles": types},
        "robots": {
            name: {"model": name, "start": start, "objective": {"hold": start}}
            | ({"heading": random.choice(HEADINGS)} if models[name]["mobility"] != "free" else {})
            for name, start in zip(models, starts, strict=True)
        },
        "obstacles": [
            {"type": kind, "region": region} | ({"until": 99} if random.random() < 0.1 else {})
            for kind, region in zip(types, closed, strict=True)
        ],
        "until": {"rounds": 1},
    }


def moment(seed: int) -> Moment:
    """The middle of a run: some robots have had their turns of the present tick, some are in
    transit, some needs are fulfilled."""
    (data, scenario), random = loads(drawn, seed), Random(f"moment {seed}")
    robots, free = list[Walker](), free_in(data["map"]["grid"])
    begun, under_way = random.choice((0, 0, random.randrange(len(data["robots"])))), random.random()
    for i, robot in enumerate(data["robots"].values()):
        model = data["catalogue"]["robots"][robot["model"]]
        here = HEADINGS.index(robot.get("heading", "north")), robot["start"]
        steps = [*sides(data, here, turns="heading" in robot)]
        moves = model["timing"] > 1 and under_way < 0.7 and steps
        due = int(i < begun) + random.randint(1, max(1, model["timing"] - 1))
        robots.append(Walker(here, random.choice(steps) if moves else None, due))
    stages: list[tuple[int, frozenset[int], frozenset[int] | None] | None] = []
    for obstacle in data["obstacles"]:
        needs = data["catalogue"]["obstacles"][obstacle["type"]]["needs"]
        if random.random() < 0.25:
            stages.append(None)
            continue
        k, done, group = random.choice((0, 0, 0, len(needs) - 1)), frozenset[int](), None
        can = [able(data, skills(needs, n)) for n in range(len(needs))]
        if k and needs[k].get("same"):
            most = min(needs[k - 1].get("robots", 1), len(can[k - 1]))
            group = frozenset(random.sample(can[k - 1], most))
        mine = [i for i in can[k] if group is None or i in group]
        shared = needs[k].get("robots", 1) > 1 and not needs[k]["together"]
        if shared and mine and random.random() < 0.5:
            done = frozenset([random.choice(mine)])
        stages.append((k, done, group))
    targets = [random.sample(free, random.choice((1, 1, 2))) for _ in range(random.randint(1, 3))]
    return Moment(data, scenario, begun, robots, stages, random.randrange(len(robots)), targets)


def sides(data: Data, here: Pose, *, turns: bool) -> Iterator[Pose]:
    grid, cols = data["map"]["grid"], len(data["map"]["grid"][0])
    for way, step in enumerate((-cols, 1, cols, -1)):
        there = here[1] + step
        if grid[there // cols][there % cols] == "." and not (turns and way == (here[0] + 2) % 4):
            yield (way if turns else 0), there


def skills(needs: list[Data], k: int) -> set[str]:
    """The actions of a need and of those after it that the same robots are to meet."""
    last = k + 1
    while last < len(needs) and needs[last].get("same"):
        last += 1
    return {need["action"] for need in needs[k:last]}


def able(data: Data, actions: set[str]) -> list[int]:
    models = data["catalogue"]["robots"].values()
    return [i for i, model in enumerate(models) if actions <= {*model["capabilities"]}]


def numbers(asked: Moment) -> Iterator[int]:
    """The question of a moment, in the program's format."""
    data, count = asked.data, len(asked.robots)
    grid, begin = data["map"]["grid"], count + asked.begun
    kept = [k for k, each in enumerate(data["obstacles"]) if "until" not in each]
    yield from (len(grid), len(grid[0]), *(int(cell == "#") for cell in "".join(grid)))
    yield from (count, len(kept), begin, MOST)
    for i, (robot, model) in enumerate(
        zip(asked.robots, data["catalogue"]["robots"].values(), strict=True)
    ):
        left = 0 if robot.to is None else max(1, robot.due - int(i < asked.begun))
        own = sum(1 << k for k, act in enumerate(("lift", "push")) if act in model["capabilities"])
        yield from (int(model["mobility"] == "heading"), model["timing"])
        for face, region in (robot.here, robot.to or robot.here):
            yield from (region, face)
        yield from (left, own)
    for k in kept:
        obstacle, stage = data["obstacles"][k], asked.stages[k]
        kind, names = data["catalogue"]["obstacles"][obstacle["type"]], [*data["robots"]]
        needs, stopped = kind["needs"], {names.index(name) for name in kind["blocks"]}
        met, done, group = stage or (0, frozenset(), None)
        yield from (obstacle["region"], met, mask(done), mask(group or ()), len(needs))
        for n, need in enumerate(needs):
            actions = skills(needs, n)
            enters = n == len(needs) - 1 and not {"robots", "same"} & need.keys()
            opened = able(data, actions) if enters and obstacle["region"] in need["at"] else []
            yield mask(stopped - {*opened}) if stage else mask(stopped)
            yield (
                sum(1 << k for k, a in enumerate(("lift", "push")) if a in actions)
                if stage
                else NOBODY
            )
            yield from (need.get("robots", 1), int(need.get("together", False)))
            yield from (int(need.get("same", False)), len(need["at"]), *need["at"])
    yield from (asked.walker, len(asked.targets))
    for target in asked.targets:
        yield from (len(target), *target)


def mask(members: object) -> int:
    return sum(1 << i for i in members)  # type: ignore[attr-defined]


@cache
def program() -> subprocess.Popen[str]:
    source = SOURCE.read_bytes()
    built = Path(gettempdir()) / f"every_behaviour_{os.getuid()}_{sha256(source).hexdigest()[:16]}"
    if not built.exists():
        mine = built.with_name(f"{built.name}.{os.getpid()}")
        compiler = os.environ.get("CXX", "c++")
        subprocess.run([compiler, "-O2", "-o", str(mine), str(SOURCE)], check=True)
        mine.replace(built)
    return subprocess.Popen([built], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def every_behaviour(asked: Moment) -> tuple[list[int], int]:
    """The turns in which each obstacle is resolved at the earliest, and the tick in which all
    targets can be met; NEVER if they cannot."""
    talk = program()
    assert talk.stdin is not None and talk.stdout is not None
    talk.stdin.write(" ".join(map(str, numbers(asked))) + "\n")
    talk.stdin.flush()
    states, *turns = map(int, talk.stdout.readline().split())
    assert states >= 0, "too many states"
    *found, last = [NEVER if turn < 0 else turn for turn in turns]
    return found, last // len(asked.robots) if last < NEVER else last


def as_state(asked: Moment) -> tuple[Team, State]:
    team = team_of(asked.scenario)
    state = initial(team)
    robots = tuple(
        replace(now, to=one.to[0] * team.size + one.to[1], due=one.due) if one.to else now
        for now, one in zip(state.robots, asked.robots, strict=True)
    )
    there = tuple(
        ObstacleNow(Is.SEALED) if one is None else ObstacleNow(Is.OPEN, Stage(*one))
        for one in asked.stages
    )
    requests = tuple(k for k, one in enumerate(there) if one.state is Is.OPEN)
    return team, replace(state, time=1, robots=robots, obstacles=there, requests=requests)


@pytest.mark.parametrize("number", range(BATCHES))
def test_a_bound_never_exceeds_the_earliest_possible_turn(
    number: int, played: Callable[[], None]
) -> None:
    """It is exact for a round of which nothing is in the way, and nearly always for obstacles."""
    exact, all_ = 0, 0
    for seed in range(number * IN_BATCH, (number + 1) * IN_BATCH):
        asked = moment(seed)
        team, state = as_state(asked)
        found = Bound(team, state, asked.begun)
        graph = team.members[asked.walker].graph
        goals = [graph.poses_on(region_mask(target)) for target in asked.targets]
        met = found.rounds_done(asked.walker, goals)
        truth, tick = every_behaviour(asked)
        kept = [k for k, each in enumerate(asked.data["obstacles"]) if "until" not in each]
        turns = [turn for turn, k in zip(truth, kept, strict=True) if asked.stages[k] is not None]
        for bounded, turn in zip(found.times.values(), turns, strict=True):
            assert bounded[-1] <= turn, seed
            exact, all_ = exact + (bounded[-1] == turn), all_ + 1
        assert met <= tick, seed
        if None not in asked.stages:
            _, tick = every_behaviour(asked._replace(data=asked.data | {"obstacles": []}))
            empty = Bound(team, replace(state, requests=()), asked.begun)
            met = empty.rounds_done(asked.walker, goals)
            assert met == tick, seed
        played()
    assert exact > 0.85 * all_
