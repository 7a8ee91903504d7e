"""A robot alone on the map: can it meet its objective if nobody interferes?

The one-player game is explicit and small (poses times the objective's memory), so this takes
milliseconds where a synthesis would have to be asked. It follows the objectives' encoding in
``spec.objective`` rule by rule; an objective in raw formulas (``ltl``) is beyond it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from safenav.scenario.objective import Cover, Hold, Objective, Patrol, Visit, targets_of
from safenav.spec.objective import Memory, patrol_starts_with_second
from safenav.verify.cycles import cyclic_parts
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose, moves


@dataclass(frozen=True)
class State:
    """Where the robot is and what it remembers of its objective."""

    pose: Pose
    memory: int = 0


@dataclass(frozen=True)
class Solo:
    """What a robot can do by itself. ``regions`` that it can get to without breaking a rule;
    ``winnable``: whether it can meet all goals again and again."""

    regions: frozenset[Region]
    winnable: bool


def play(
    mobility: Mobility,
    pose: Pose,
    objective: Objective,
    memory: Memory,
    world: RegionMap,
    blocked: frozenset[Region] = frozenset(),
) -> Solo:
    """Explore everything that the robot can do. ``objective`` must not be ``Ltl``."""
    first = State(pose, _first_memory(objective, pose.region, memory))
    number = {first: 0}
    states = [first]
    edges = []
    for state in states:  # grows while it is gone through
        source = number[state]
        for after in _steps(mobility, state, objective, world, blocked):
            target = number.setdefault(after, len(states))
            if target == len(states):
                states.append(after)
            edges.append((source, target))
    parts = cyclic_parts(edges)
    met: dict[int, set[int]] = {}
    for index, part in parts.items():
        met.setdefault(part, set()).update(_goals_at(objective, states[index]))
    wanted = len(targets_of(objective))
    return Solo(
        frozenset(state.pose.region for state in states),
        any(len(goals) == wanted for goals in met.values()),
    )


def _first_memory(objective: Objective, region: Region, memory: Memory) -> int:
    match objective:
        case Patrol():
            return int(patrol_starts_with_second(objective, region, memory))
        case Visit():
            return memory.index
        case _:
            return 0


def _steps(
    mobility: Mobility,
    state: State,
    objective: Objective,
    world: RegionMap,
    blocked: frozenset[Region],
) -> Iterator[State]:
    here = state.pose.region
    memory = state.memory
    leave: frozenset[Region] = frozenset()
    match objective:
        case Patrol(first, second):
            if memory == 0 and here in first:
                memory, leave = 1, first
            elif memory == 1 and here in second:
                memory, leave = 0, second
            forbidden = leave | (first if memory else second)
        case Visit(targets):
            forbidden = leave
            if here in targets[memory]:
                memory = (memory + 1) % len(targets)
        case _:
            forbidden = leave
    held = isinstance(objective, Hold) and here in objective.target
    for pose in moves(mobility, state.pose, world, blocked):
        region = pose.region
        if region not in forbidden and not (held and region != here):
            if region in blocked:
                continue  # it may not even stay
            yield State(pose, memory)


def _goals_at(objective: Objective, state: State) -> Iterator[int]:
    """The goals that are met by being in ``state`` after a step."""
    region = state.pose.region
    match objective:
        case Patrol(first, second):
            if state.memory == 0 and region in first:
                yield 0
            if state.memory == 1 and region in second:
                yield 1
        case Visit(targets):
            if region in targets[state.memory]:
                yield state.memory
        case Cover(targets):
            yield from (i for i, target in enumerate(targets) if region in target)
        case Hold(target):
            if region in target:
                yield 0
