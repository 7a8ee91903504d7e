"""Proofs that a mission cannot be completed, as data that others can check.

A closure table: the poses that each robot can reach when everything is resolved that can be at
all, and the obstacles that can never be. Where irreversible choices matter, a tree: every possible
choice, and a proof after each. Collisions are ignored here, so the proofs also hold with them; the
joint search has a proof of its own (``safenav.runtime.traffic``).
"""

from __future__ import annotations

from msgspec import Struct

from safenav.runtime.resolution.problem import Stage, Stages
from safenav.runtime.resolution.solve import Sets, Solver, Step
from safenav.world.poses import Mask


class TeamClosure(Struct, frozen=True):
    """The obstacles that can be resolved and that never can; with the former resolved, the poses
    that each robot can reach (``reach``), and whether it can continue forever there (``live``).
    ``stuck``: those of ``never`` whose next need can never be fulfilled. ``left``: how far each
    obstacle is brought."""

    resolved: tuple[int, ...]
    never: tuple[int, ...]
    reach: tuple[Mask, ...]
    live: tuple[bool, ...]
    stuck: tuple[int, ...] = ()
    left: Stages = ()


class Refuted(Struct, frozen=True):
    """A step that could come next, and why it does not help. ``lossless``: no other step need be
    examined, because this one loses nothing."""

    step: Step
    lossless: bool
    because: Refutation


Refutation = TeamClosure | tuple[Refuted, ...]
"""A closure that leaves a robot stuck, or all steps that there are, each refuted."""


def closure_of(solver: Solver, sets: Sets, stages: Stages) -> TeamClosure:
    """The least fixpoint over open obstacles: one can be resolved if for each of its needs enough
    capable robots can get to its regions, all that can be resolved being out of the way.

    Optimistic: robots do not collide, and no robot is lost by an irreversible choice. An obstacle
    that is ``never`` resolved here cannot be resolved at all.
    """
    problem = solver.problem
    given = stages
    grown = True
    while grown:
        grown = False
        for gate in problem.open(stages):
            if _enough(solver, gate, sets, stages, given[gate]):
                stages = problem.advanced(gate, stages)
                grown = True
    never = tuple(problem.open(stages))
    resolved = tuple(gate for gate in problem.open(given) if gate not in never)
    reach = tuple(solver.reach(i, poses, stages) for i, poses in enumerate(sets))
    live = tuple(solver.goes_on(i, poses, stages) for i, poses in enumerate(sets))
    stuck = tuple(gate for gate in never if stages[gate].need == given[gate].need)
    return TeamClosure(resolved, never, reach, live, stuck, stages)


def _enough(solver: Solver, gate: int, sets: Sets, stages: Stages, given: Stage) -> bool:
    """Whether enough robots can get to where the next need of an obstacle is met, and to where
    those before it were met (from the ``given`` one on) by the same robots."""
    problem = solver.problem
    needs, number = problem.gates[gate].needs, stages[gate].need
    begin = number
    while begin > given.need and needs[begin].same:
        begin -= 1
    able = []
    for i in problem.able(gate, stages):
        reach = solver.reach(i, sets[i], stages)
        graph = problem.members[i].graph
        there = [bool(reach & graph.poses_on(need.regions)) for need in needs[begin : number + 1]]
        if begin == given.need < number and i in given.done:
            there[0] = True
        if all(there):
            able.append(i)
    return len(able) >= problem.missing(gate, stages)


def refute(solver: Solver, sets: Sets, stages: Stages) -> Refutation:
    """Return the proof that ``solver.feasible(sets, stages)`` is False."""
    closure = closure_of(solver, sets, stages)
    if not all(closure.live):
        return closure
    steps = [option.step for option in solver.options(sets, None, stages, {}, every=True)]
    safe = [
        step
        for step in steps
        if not solver.problem.commits(step.gate, stages)
        and _loses_nothing(solver, step, sets, stages)
    ]
    return tuple(
        Refuted(step, bool(safe), refute(solver, *solver.after(step, sets, stages)))
        for step in safe[:1] or steps
    )


def _loses_nothing(solver: Solver, step: Step, sets: Sets, stages: Stages) -> bool:
    """Whether each robot of a group gets from the step to all that it could get to before, even
    if the step changes nothing."""
    return all(
        not solver.reach(i, sets[i], stages) & ~solver.reach(i, at, stages)
        for i, at in zip(step.group, step.at, strict=True)
    )
