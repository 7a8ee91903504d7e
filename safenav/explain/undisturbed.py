"""A robot alone on the map: whether it can meet its objective without interference.

The one-player game is explicit and small (poses times the objective's memory), so this takes
milliseconds and no synthesis. The objective is played by its automaton (``scenario.objective``);
objectives in raw formulas (``ltl``) are not covered."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from safenav.components import explored
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl, Objective, TargetObjective, formulas_in
from safenav.spec.objective import Memory
from safenav.verify.cycles import cyclic_parts
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose, moves


class State(Struct, frozen=True):
    """The robot's pose and its memory of the objective."""

    pose: Pose
    memory: int = 0


class Solo(Struct, frozen=True):
    """Possibilities of a robot without other robots. ``regions``: those that it can reach without
    breaking a rule; ``winnable``: it can meet all goals infinitely often or, if its objective ends
    at the last one, stay there."""

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
    """Explore all moves that the robot can make. ``objective`` must not be ``Ltl``."""
    assert not isinstance(objective, Ltl)
    pursuit = objective
    first = State(pose, pursuit.begin(pose.region, memory.index) if pursuit.in_turn else 0)
    ways = explored([first], lambda state: tuple(_steps(mobility, state, pursuit, world, blocked)))
    number = {state: index for index, state in enumerate(ways)}
    parts = cyclic_parts(
        (number[s], number[to]) for s, following in ways.items() for to in following
    )
    states = list(ways)
    met: dict[int, set[int]] = {}
    for index, part in parts.items():
        state = states[index]
        met.setdefault(part, set()).update(pursuit.met(state.memory, state.pose.region))
    last = len(pursuit.targets) - 1
    again = {last} if pursuit.settles else {*range(last + 1)}
    return Solo(
        frozenset(state.pose.region for state in states),
        any(again <= goals for goals in met.values()),
    )


def _steps(
    mobility: Mobility,
    state: State,
    pursuit: TargetObjective,
    world: RegionMap,
    blocked: frozenset[Region],
) -> Iterator[State]:
    """Yield the robot's possible next states; it may stay in a region that is blocked."""
    here, memory = state.pose.region, state.memory
    after = pursuit.turned(memory, here) if pursuit.in_turn else memory
    rules = formulas_in(pursuit)
    for pose in moves(mobility, state.pose, world, blocked):
        if rules and pose != state.pose and not guarantees_of(rules).allows(state.pose, pose):
            continue
        if not pursuit.forbidden(memory, here, pose.region):
            yield State(pose, after)
