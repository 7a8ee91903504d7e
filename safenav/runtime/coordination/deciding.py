"""From a running mission to a decision: the problem as it stands, and what follows from it."""

from __future__ import annotations

from collections.abc import Collection

from safenav.runtime.coordination.duties import Settlement, settle
from safenav.runtime.coordination.floor import Floor, floor_of
from safenav.runtime.coordination.negatives import spent
from safenav.runtime.coordination.problem import SpentError
from safenav.runtime.coordination.proofs import Closure, closure_of
from safenav.runtime.coordination.requests import Requests
from safenav.runtime.coordination.solve import Solver
from safenav.runtime.over import Stop
from safenav.runtime.team import TeamState


def decided(
    state: TeamState, requests: Requests, stop: Stop, refused: Collection[tuple[str, str]]
) -> tuple[Floor, Solver, Settlement]:
    """Who does what, as things stand. ``refused``: (robot, obstacle) where no strategy was found.
    Raises RunOver if a budget is spent."""
    floor = floor_of(state, requests, refused)
    solver = Solver(floor.problem, stop.check)
    order = range(len(floor.gates))
    try:
        found = settle(solver, floor.poses, floor.stages, order, _present(state, floor))
    except SpentError:
        raise spent("who could resolve what in which order") from None
    return floor, solver, found


def closed(state: TeamState, requests: Requests, stop: Stop) -> tuple[Floor, Closure]:
    """What can ever be resolved, as things stand, and where everybody gets by that; who is out of
    service may come back."""
    floor = floor_of(state, requests, hopeful=True)
    solver = Solver(floor.problem, stop.check)
    return floor, closure_of(solver, solver.sets(floor.poses, floor.stages), floor.stages)


def _present(state: TeamState, floor: Floor) -> dict[int, tuple[int, ...]]:
    """Who serves which obstacle already."""
    found: dict[int, tuple[int, ...]] = {}
    for index, robot in enumerate(state.robots.values()):
        obstacle = robot.assignment.obstacle
        if obstacle in floor.gates:
            gate = floor.gates.index(obstacle)
            found[gate] = (*found.get(gate, ()), index)
    return found
