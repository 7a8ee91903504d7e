"""Goals that are assigned at runtime: coordination without resynthesis (paper, Section V-D).

Three inputs let the coordination layer steer a robot whose strategy is never changed: ``wait``
keeps it where it is; ``request`` sends it to the region ``assigned``, and excuses its own goals
meanwhile. What it can be sent to is limited to regions from which it can go on with its own
objective, and obstacles that turn out to be there for good still need a new strategy.

Told to wait while a request is open, a robot is not told its place: that would be a bit beside
every pair of a place and a request, and so twice the nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from safenav.dataclass import dataclass
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl, Objective, Patrol, Visit
from safenav.spec.movement import one_of
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Pose, moves

SOURCE = "paper, Section V-D, the runtime-assignable goal"


@dataclass(frozen=True)
class Signal:
    """What the coordination layer tells a robot: go to ``place``, and ``wait`` there or not."""

    place: Region
    wait: bool


class Switch:
    """Turns signals into inputs that respect what the specification assumes of them: the
    assigned region does not change while a request is open."""

    def __init__(self, places: frozenset[Region]) -> None:
        self.places = places
        self._neutral = min(places)
        self._sent: Region | None = None

    def inputs(self, signal: Signal | None, region: Region) -> dict[str, int]:
        """The inputs for a robot in ``region`` under ``signal``."""
        if signal is None:
            self._sent = None
            return self._values(False, self._neutral, False)
        if signal.wait and region == signal.place:
            self._sent = None
            return self._values(False, self._neutral, True)
        if self._sent not in (None, signal.place):  # a moment's rest between two requests
            self._sent = None
            return self._values(False, self._neutral, True)
        self._sent = signal.place
        return self._values(True, signal.place, False)

    def stop(self) -> dict[str, int]:
        """The inputs that keep the robot where it is; a request stays open."""
        return self._values(self._sent is not None, self._neutral, True)

    def forget(self) -> None:
        """No request is open in the strategy's memory any more."""
        self._sent = None

    @staticmethod
    def _values(request: bool, assigned: Region, wait: bool) -> dict[str, int]:
        return {"request": int(request), "assigned": assigned, "wait": int(wait)}


def places(task: Task, world: RegionMap) -> frozenset[Region]:
    """The regions that the robot can be sent to and come back from: those in which it has a
    pose that lies on a way from its start to itself and back to where it has been."""
    blocked = {known.region for known in task.blocked}
    mobility = task.robot.model.mobility
    formulas = guarantees_of(task.objective) if isinstance(task.objective, Ltl) else None
    after: dict[Pose, tuple[Pose, ...]] = {}
    queue = [task.pose]
    while queue:
        pose = queue.pop()
        if pose not in after:
            steps = moves(mobility, pose, world, blocked)
            if formulas is not None:
                steps = tuple(to for to in steps if to == pose or formulas.allows(pose, to))
            after[pose] = steps
            queue += steps
    before: dict[Pose, list[Pose]] = {pose: [] for pose in after}
    for pose, following in after.items():
        for nxt in following:
            before[nxt].append(pose)
    home = _returning(task, after, before)
    return frozenset(pose.region for pose in home) or frozenset({task.pose.region})


def _returning(
    task: Task, after: dict[Pose, tuple[Pose, ...]], before: dict[Pose, list[Pose]]
) -> set[Pose]:
    """The poses between which the robot can go back and forth, the objective's among them."""
    wanted = [region for target in task.targets for region in target]
    if isinstance(task.objective, Ltl):
        formulas = guarantees_of(task.objective)
        goals = range(formulas.goals)
        wanted = [p.region for p in after if any(formulas.meets(g, p, p) for g in goals)]
    best: set[Pose] = set()
    for pose in after:
        if pose in best or (wanted and pose.region not in wanted):
            continue
        loop = _closure(pose, after) & _closure(pose, before)
        met = {region for p in loop if (region := p.region) in wanted}
        if (len(met), len(loop)) > (len({p.region for p in best} & set(wanted)), len(best)):
            best = loop
    return best


def _closure(pose: Pose, steps: dict[Pose, tuple[Pose, ...]] | dict[Pose, list[Pose]]) -> set[Pose]:
    found = {pose}
    queue = [pose]
    while queue:
        for nxt in steps[queue.pop()]:
            if nxt not in found:
                found.add(nxt)
                queue.append(nxt)
    return found


def own_objective(objective: Objective) -> Objective:
    """The objective as it stands in a specification with assignable goals: a patrol is plain
    alternation, since the literal formula forbids ways on which a helper may have to come back
    (DESIGN section 5, rule 5)."""
    if isinstance(objective, Patrol):
        return Visit((objective.first, objective.second))
    return objective


def inputs(task: Task, world: RegionMap) -> tuple[Variable, ...]:
    del task
    return (
        Variable("request", Owner.INPUT, None, "the robot is asked to go somewhere"),
        Variable("wait", Owner.INPUT, None, "the robot shall stay where it is"),
        Variable("assigned", Owner.INPUT, (0, world.size - 1), "where it is asked to go"),
    )


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Requests are to places that it can come back from, and keep still while they are open."""
    allowed = places(task, world)
    neutral = min(allowed)
    begin = Origin("coordination", "nothing is asked before the first move", SOURCE)
    for formula in ("!request", "!wait", f"assigned = {neutral}"):
        yield Constraint(Section.ENV_INIT, formula, begin)
    where = Origin("coordination", "it is sent only where it can come back from", SOURCE)
    allowed_next = one_of("assigned", allowed, "'")
    yield Constraint(Section.ENV_TRANS, f"request' & !wait' -> {allowed_next}", where)
    yield Constraint(Section.ENV_TRANS, f"!request' | wait' -> assigned' = {neutral}", where)
    still = Origin("coordination", "an open request keeps its place until it has to wait", SOURCE)
    kept = "request & !wait & request' & !wait' -> assigned' = assigned"
    yield Constraint(Section.ENV_TRANS, kept, still)
    fair = Origin("coordination", "it is infinitely often not told to wait", SOURCE)
    yield Constraint(Section.ENV_LIVENESS, "!wait'", fair)


def at_leisure(constraint: Constraint) -> Constraint:
    """What is assumed of the others again and again, assumed of moments in which the robot is not
    told to wait: it might be in nobody's way whenever it must not move, and then only."""
    if constraint.section is not Section.ENV_LIVENESS:
        return constraint
    wait = "wait'" if "'" in constraint.formula else "wait"  # of the same moment
    return replace(constraint, formula=f"!{wait} & ({constraint.formula})")


def guarantees() -> Iterator[Constraint]:
    """It waits when told, and goes where it is asked to."""
    stay = Origin("coordination", "told to wait, it stays", SOURCE)
    yield Constraint(Section.SYS_TRANS, "wait' -> region' = region", stay)
    go = Origin("coordination", "an open request is answered", SOURCE)
    yield Constraint(Section.SYS_LIVENESS, "request' & !wait' -> region' = assigned'", go)


def excused(constraint: Constraint, holds: bool = False) -> Constraint:
    """A goal of its own, excused while a request is open; one that ``holds`` may also leave the
    place where it stays."""
    stays = holds and constraint.section is Section.SYS_TRANS
    if constraint.section is not Section.SYS_LIVENESS and not stays:
        return constraint
    origin = replace(constraint.origin, rule=f"{constraint.origin.rule}, unless it is asked to go")
    return replace(constraint, formula=f"request' | ({constraint.formula})", origin=origin)
