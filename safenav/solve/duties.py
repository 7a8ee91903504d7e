"""Current duties: the served requests, the plan for all of them, and the duties that follow."""

from __future__ import annotations

from msgspec import Struct, field

from safenav.solve.proof import Refutation, refute
from safenav.solve.solve import Present, Sets, Solver, Step, around
from safenav.team.floor import Stages
from safenav.world.poses import Mask, bits


class Duty(Struct, frozen=True):
    """``goal``: the poses where a robot can meet the next need of gate ``g`` and all can
    continue."""

    g: int
    need: int
    group: tuple[int, ...]
    goal: Mask
    stays: bool


class Settlement(Struct, frozen=True):
    """``served`` gates in order; the others are walls for now. ``safe``: where each robot may go
    (None: it was not asked). ``plan``: the steps of which the duties are the first. ``proof``: that
    some robot can never continue; the rest is void then."""

    served: tuple[int, ...] = ()
    duties: dict[int, Duty] = field(default_factory=dict)
    safe: tuple[Mask | None, ...] = ()
    plan: tuple[Step, ...] = ()
    proof: Refutation | None = None


def settle(
    solver: Solver,
    poses: tuple[int, ...],
    stages: Stages,
    aside: frozenset[int],
    present: Present,
    careful: frozenset[int],
) -> Settlement:
    """The duties at these poses. ``aside``: gates that no joint plan serves; ``careful``: the
    robots whose strategies must know which poses are safe."""
    floor, now = solver.floor, around(solver.floor, poses, stages)
    if not solver.feasible(now):
        return Settlement(proof=refute(now))
    served: list[int] = []
    for g in floor.open(stages):
        if g not in aside and solver.feasible(now, frozenset({*served, g})):
            served.append(g)
    wanted = frozenset(served)
    plan = solver.plan(poses, stages, wanted, present)
    assert plan is not None, "what can be done can be planned"
    duties = _present_duties(solver, plan, now, wanted)
    safe = tuple(
        _safe(solver, i, now, wanted) | (duties[i].goal if i in duties else 0)
        if i in careful
        else None
        for i in range(len(poses))
    )
    return Settlement(tuple(served), duties, safe, plan)


def _present_duties(
    solver: Solver, plan: tuple[Step, ...], now: Sets, wanted: frozenset[int]
) -> dict[int, Duty]:
    """A step is a duty now if no earlier one is about its obstacle or its robots, and all can get
    there."""
    duties: dict[int, Duty] = {}
    begun: set[int] = set()
    busy: set[int] = set()
    for step in plan:
        ready = step.g not in begun and not busy & {*step.group}
        begun.add(step.g)
        busy.update(step.group)
        need = now.floor.need(step.g, now.stages)
        at = tuple(
            now.spots(i, need.regions) & there for i, there in zip(step.group, step.at, strict=True)
        )
        if not ready or not all(at):
            continue
        after = now.after(Step(step.g, step.need, step.group, at))
        for i, there in zip(step.group, at, strict=True):
            goal = _lasting(solver, i, there, after, wanted) or there
            duties[i] = Duty(
                step.g, step.need, step.group, goal, need.together or len(step.group) > 1
            )
    return duties


def _safe(solver: Solver, i: int, now: Sets, wanted: frozenset[int]) -> Mask:
    """The poses to which a robot may go: it can come back, or the team can continue."""
    here = now.sets[i]
    return here | _lasting(solver, i, now.reach(i, here) & ~here, now, wanted)


def _lasting(solver: Solver, i: int, candidates: Mask, now: Sets, wanted: frozenset[int]) -> Mask:
    """The candidates from which ``wanted`` can be served and all can continue. One answer decides
    many poses: all from which a good one is reachable are good; all that are reachable from a bad
    one are bad."""
    graph, allowed = now.floor.graphs[i], now.floor.allowed(i, now.stages)
    good, left = 0, candidates
    while left:
        pose = 1 << next(bits(left))
        if solver.feasible(now.placed(i, graph.around(pose, allowed)), wanted):
            found = graph.back(pose, allowed | pose) & left | pose
            good |= found
            left &= ~found
        else:
            left &= ~(graph.closure(pose, allowed) | pose)
    return good & candidates
