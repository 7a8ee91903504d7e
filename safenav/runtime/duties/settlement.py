"""Current duties of the robots, derived afresh from all poses and the team's knowledge.

The rules (docs/coordination.md): requests are served by due time, those without a deadline newest
first, as many as can be served together; one plan for all of them determines the duties: a step is
a duty now if no earlier step concerns its obstacle or its robots. The functions of this module keep
no state.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.resolution.problem import Floor, Stages
from safenav.runtime.resolution.proofs import Refutation, refute
from safenav.runtime.resolution.solve import Plan, PoseSets, Present, Solver
from safenav.world.moves import Pose
from safenav.world.poses import Mask, bits


class Duty(Struct, frozen=True):
    """A duty of a robot to serve ``gate``. ``goal``: the poses where it may do so and the team can
    continue afterwards. ``stays``: it stays there."""

    gate: int
    need: int
    group: tuple[int, ...]
    goal: Mask
    stays: bool = False


class Settlement(Struct, frozen=True):
    """The duties that follow from a state of the team.

    ``served``: the obstacles that will be resolved, in the order of their requests; the other open
    ones are walls for now. ``plan``: the steps to come. ``duties``: duty of each robot.
    ``reserved``: robots of later steps. ``safe_poses``: where each robot may go while the team can
    still complete all that it can now. ``proof``: that not every robot can continue; the other
    fields are unused then.
    """

    served: tuple[int, ...] = ()
    plan: Plan = ()
    duties: dict[int, Duty] = field(default_factory=dict)
    reserved: frozenset[int] = frozenset()
    safe_poses: tuple[Mask, ...] = ()
    proof: Refutation | None = None


class TrafficNotes(Struct):
    """Findings of traffic while a settlement is in force. A plan was requested: ``cleared``, for a
    robot that blocks a helper; ``turned``, with other targets first:
    the robots that need a strategy for that before, each with its target (None: no such plan).
    ``followed``: a plan was begun, at whose end ``followers`` stand behind their helper;
    ``hopeless``: obstacles that no joint state serves; ``hemmed_in``: robots, with their poses,
    that no order of moves brings to their next target; ``impasses``: states in which no plan
    helped."""

    cleared: bool = False
    turned: Mapping[str, int] | None = None
    followed: bool = False
    followers: frozenset[str] = frozenset()
    hopeless: frozenset[str] = frozenset()
    hemmed_in: dict[int, Pose] = field(default_factory=dict)
    impasses: set[Hashable] = field(default_factory=set)


class Settled(Struct, frozen=True):
    """The last settlement of a team: the problem, its solver, and the duties."""

    floor: Floor
    solver: Solver
    found: Settlement
    notes: TrafficNotes = field(default_factory=TrafficNotes)


def settle(
    solver: Solver,
    poses: tuple[int, ...],
    stages: Stages,
    requests: Sequence[int],
    present: Present,
) -> Settlement:
    """Return duties for robots at ``poses``. ``requests``: open obstacles in the order of service;
    ``present``: the robots that already serve an obstacle. Raises BudgetExhaustedError."""
    now = PoseSets.around(solver.problem, poses, stages)
    if not solver.feasible(now):
        return Settlement(proof=refute(now))
    served: list[int] = []
    for gate in requests:
        if solver.feasible(now, frozenset({*served, gate})):
            served.append(gate)
    plan = solver.plan(poses, stages, frozenset(served), present)
    assert plan is not None, "what can be done can be planned"
    duties, reserved = _walk(solver, plan, now, frozenset(served))
    safe_poses = tuple(
        _safe_poses(solver, i, now, frozenset(served)) | (duties[i].goal if i in duties else 0)
        for i in range(len(solver.problem.members))
    )
    return Settlement(tuple(served), plan, duties, reserved, safe_poses)


def _walk(
    solver: Solver, plan: Plan, now: PoseSets, served: frozenset[int]
) -> tuple[dict[int, Duty], frozenset[int]]:
    """The steps that are duties now; the robots of the others are reserved for them."""
    duties: dict[int, Duty] = {}
    begun: set[int] = set()
    busy: set[int] = set()
    for step in plan:
        need = now.problem.next_need(step.gate, now.stages)
        ready = step.gate not in begun and not busy & set(step.group)
        begun.add(step.gate)
        busy.update(step.group)
        if not ready:
            continue
        group = zip(step.group, step.at, strict=True)
        at = tuple(now.spots(i, need.regions) & there for i, there in group)
        if not all(at):
            continue
        for robot, there in zip(step.group, at, strict=True):
            goal = _serving_poses(solver, robot, there, now.after(replace(step, at=at)), served)
            stays = need.together or len(step.group) > 1
            duties[robot] = Duty(step.gate, step.need, step.group, goal or there, stays)
    return duties, frozenset(busy - duties.keys())


def _safe_poses(solver: Solver, robot: int, now: PoseSets, served: frozenset[int]) -> Mask:
    """Return the poses that a robot may go to: it can come back, or the team can continue."""
    here = now.sets[robot]
    return here | _serving_poses(solver, robot, now.reach(robot, here) & ~here, now, served)


def _serving_poses(
    solver: Solver, robot: int, candidates: Mask, now: PoseSets, served: frozenset[int]
) -> Mask:
    """Return the candidate poses where ``served`` can be served and every robot can continue.

    If a pose qualifies, so do all poses from which it is reachable; if it does not, neither does
    any pose reachable from it. So one query decides many poses.
    """
    graph = now.problem.members[robot].graph
    allowed = now.problem.allowed(robot, now.stages)
    good = 0
    left = candidates
    while left:
        pose = 1 << next(bits(left))
        at = graph.around(pose, allowed)
        if solver.feasible(now.placed(robot, at), served):
            found = graph.back(pose, allowed | pose) & left | pose
            good |= found
            left &= ~found
        else:
            left &= ~(graph.closure(pose, allowed) | pose)
    return good & candidates
