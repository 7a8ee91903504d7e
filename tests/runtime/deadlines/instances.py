"""Random moments of small teams, for tests of lower bounds."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import takewhile
from random import Random

from safenav.scenario import model
from safenav.team.bound import BoundMoment, BoundObstacle, BoundRobot
from safenav.team.state import Stage
from safenav.team.team import Need, Obstacle
from safenav.world.map import RegionMap
from safenav.world.poses import Mobility, PoseGraph, bits, region_mask
from support.floors import walled

FUZZ = int(os.environ.get("SAFENAV_FUZZ", "0"))
BATCHES, IN_BATCH = (FUZZ // 50 or 1, 100) if FUZZ else (1, 40)
"""``SAFENAV_FUZZ=5000`` asks about 10,000 moments."""


def batch(number: int) -> Iterator[Instance]:
    """Some of the random moments, none of them in two batches."""
    return map(instance, range(number * IN_BATCH, (number + 1) * IN_BATCH))


@dataclass(frozen=True)
class Instance:
    """``targets``: what one of the robots, ``walker``, is to meet, one after the other."""

    moment: BoundMoment
    walker: int
    targets: tuple[tuple[int, ...], ...]


def instance(seed: int) -> Instance:
    """One to three robots and obstacles, in the middle of a run: some robots have had their turns
    of the present tick, some are in transit, some needs are fulfilled."""
    random = Random(f"deadlines {seed}")
    world = _map(random)
    size, count = world.size, random.choice((1, 2, 2, 2, 3, 3))
    begun = random.choice((0, 0, random.randrange(count)))  # have had their turns of this tick
    slow, under_way = random.random() < 0.6, random.random() < 0.5
    floors = [random.choice((0, 0, 1)) for _ in range(count)]
    taken: list[set[int]] = [set() for _ in range(count)]
    walkers: list[BoundRobot] = []
    for i in range(count):
        turns = Mobility.HEADING if random.random() < 0.3 else Mobility.FREE
        graph = PoseGraph(world, turns)
        ticks = random.choice((1, 1, 2, 3)) if slow else 1
        skills = frozenset(action for action in "ab" if random.random() < 0.75)
        used = set().union(*(taken[j] for j in range(i) if floors[j] == floors[i]))
        free = [pose for pose in bits(graph.everywhere) if pose % size not in used]
        pose, leaves, ready = random.choice(free), None, int(i < begun)
        sides = [step for step in graph.steps(pose) if step % size not in used]
        if ticks > 1 and under_way and sides:
            leaves, pose = pose, random.choice(sides)
            ready += random.randint(1, ticks - 1)
            taken[i].add(leaves % size)
        taken[i].add(pose % size)
        walkers.append(BoundRobot(graph, pose, ready, ticks, skills, 0, leaves, ready))
    opens = [
        _obstacle(random, world, walkers, used=set().union(*taken))
        for _ in range(random.choice((1, 2, 2, 3) if count < 3 or not slow else (1, 2, 2)))
    ]
    free = sorted(world.free)
    targets = [tuple(random.sample(free, random.choice((1, 1, 2)))) for _ in range(3)]
    moment = BoundMoment(tuple(walkers), tuple(opens), count + begun - 1)
    return Instance(moment, random.randrange(count), tuple(targets[: random.randint(1, 3)]))


def _map(random: Random) -> RegionMap:
    while True:
        rows, cols = random.choice(((2, 3), (2, 4), (2, 5), (3, 3), (3, 4)))
        world = RegionMap.from_grid(walled(random, rows, cols, 0.15))
        if len(world.free) > 5:
            return world


def _obstacle(
    random: Random, world: RegionMap, walkers: list[BoundRobot], used: set[int]
) -> BoundObstacle:
    free, count = sorted(world.free), len(walkers)
    parts: list[Drawn] = []
    for k in range(random.choice((1, 1, 2))):
        same = k > 0 and random.random() < 0.3
        robots = parts[-1][2][0] if same else random.choice((1, 1, 2))
        where = region_mask(random.sample(free, random.choice((1, 2, 2))))
        together = robots > 1 and random.random() < 0.5
        parts.append((random.choice("ab"), where, (robots, together, same)))
    needs = _needs(parts)
    skills = [need.skills for need in needs]
    stage = random.choice((0, 0, 0, len(parts) - 1))
    able = [
        [i for i, walker in enumerate(walkers) if actions <= walker.capabilities]
        for actions in skills
    ]
    group = None
    if stage:
        most = min(needs[stage - 1].robots, len(able[stage - 1]))
        former = frozenset(random.sample(able[stage - 1], most))
        group = former if needs[stage].same else None
    done = frozenset[int]()
    part = needs[stage]
    mine = [i for i in able[stage] if group is None or i in group]
    if part.robots > 1 and not part.together and mine and random.random() < 0.3:
        done = frozenset([random.choice(mine)])
    stopped = frozenset(i for i in range(count) if random.random() < 0.7)
    enters = bool(needs[-1].robots == 1)  # who can meet the last need there opens it by entering
    places = [region for region in free if region not in used] or free
    region = random.choice(places)
    last = stopped
    if enters and needs[-1].regions >> region & 1:
        last = stopped - {
            i for i, walker in enumerate(walkers) if skills[-1] <= walker.capabilities
        }
    closed = (*[stopped] * (len(parts) - 1), last)
    return BoundObstacle(_gate(region, closed, needs), Stage(stage, done, group))


Drawn = tuple[str, int, tuple[int, bool, bool]]
"""The action of a need, its regions, and how many robots meet it, whether together, and whether
those of the need before."""


def _needs(parts: Sequence[Drawn]) -> tuple[Need, ...]:
    found = []
    for k, (action, where, (robots, together, same)) in enumerate(parts):
        chain = takewhile(lambda part: part[2][2], parts[k + 1 :])
        skills = frozenset([action, *(part[0] for part in chain)])
        found.append(Need(action, robots, where, together, same, skills, takes=False))
    return tuple(found)


def _gate(region: int, closed: tuple[frozenset[int], ...], needs: tuple[Need, ...]) -> Obstacle:
    source = model.Obstacle(model.ObstacleType("gate", needs[0].action), region)
    blocks = frozenset[int]().union(*closed)
    return Obstacle("gate", region, needs, blocks, closed, (frozenset[int](),) * len(needs), source)
