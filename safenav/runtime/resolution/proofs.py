"""Proofs that a mission cannot be completed, as data that others can check.

A closure table: the poses that each robot can reach once every resolvable obstacle is resolved, and
the obstacles that never can be. Where irreversible choices matter, a tree: every possible choice,
with a proof after each. Collisions are ignored here, so the proofs also hold with them; the joint
search has a proof of its own (``safenav.runtime.traffic``).
"""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.resolution.problem import Stage, Stages
from safenav.runtime.resolution.solve import PoseSets, Step, options
from safenav.world.poses import Mask


class TeamClosure(Struct, frozen=True):
    """The obstacles that can be resolved and those that never can; with the former resolved, the
    poses that each robot can reach (``reach``), and whether it can continue forever there
    (``live``). ``stuck``: those of ``never`` whose next need can never be fulfilled. ``left``: the
    final stage of each obstacle."""

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
"""A closure in which a robot cannot continue, or all possible steps, each refuted."""


def closure_of(now: PoseSets) -> TeamClosure:
    """The least fixpoint over open obstacles: one can be resolved if for each of its needs enough
    capable robots can reach its regions once all resolvable obstacles are gone.

    Optimistic: robots do not collide, and no robot is lost by an irreversible choice. An obstacle
    that is ``never`` resolved here cannot be resolved at all.
    """
    problem, given = now.problem, now.stages
    grown = True
    while grown:
        grown = False
        for gate in problem.open(now.stages):
            if _enough(gate, now, given[gate]):
                now = replace(now, stages=problem.advanced(gate, now.stages))
                grown = True
    never = tuple(problem.open(now.stages))
    resolved = tuple(gate for gate in problem.open(given) if gate not in never)
    reach = tuple(map(now.reach, range(len(now.sets)), now.sets))
    live = tuple(map(now.can_continue, range(len(now.sets))))
    stuck = tuple(gate for gate in never if now.stages[gate].need == given[gate].need)
    return TeamClosure(resolved, never, reach, live, stuck, now.stages)


def _enough(gate: int, now: PoseSets, given: Stage) -> bool:
    """Whether enough robots can reach the regions of an obstacle's next need, and those of the
    needs before it (from the ``given`` one on) that the same robots fulfil."""
    problem, stages = now.problem, now.stages
    needs, number = problem.gates[gate].needs, stages[gate].need
    begin = number
    while begin > given.need and needs[begin].same:
        begin -= 1
    able = []
    for i in problem.able(gate, stages):
        there = [bool(now.spots(i, need.regions)) for need in needs[begin : number + 1]]
        if begin == given.need < number and i in given.done:
            there[0] = True
        elif i in problem.gates[gate].cut_off_at(begin):
            continue  # it does not take the load
        if all(there):
            able.append(i)
    return len(able) >= problem.missing(gate, stages)


def refute(now: PoseSets) -> Refutation:
    """Return the proof that ``Solver.feasible`` is False there."""
    closure = closure_of(now)
    if not all(closure.live):
        return closure
    steps = [option.step for option in options(now, None, {}, every=True)]
    safe = [
        step
        for step in steps
        if not now.problem.commits(step.gate, now.stages) and _loses_nothing(step, now)
    ]
    return tuple(Refuted(step, bool(safe), refute(now.after(step))) for step in safe[:1] or steps)


def _loses_nothing(step: Step, now: PoseSets) -> bool:
    """Whether each robot of a group can reach, from the step, all poses that it could before, even
    if the step changes nothing."""
    return all(
        not now.reach(i, now.sets[i]) & ~now.reach(i, at)
        for i, at in zip(step.group, step.at, strict=True)
    )
