"""Objectives from duties: the assignment of each robot, and constraints on its strategy."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.coordination.task_candidates import TaskDraft
from safenav.runtime.coordination.waiting import clear_region, in_the_way
from safenav.runtime.duties.settlement import Duty, Settlement
from safenav.runtime.resolution.problem import Floor, Member
from safenav.runtime.team import Assignment, RobotState, Role, TeamState
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import (
    ALTERNATING,
    Ltl,
    Objective,
    Target,
    TargetObjective,
    alternation,
    formulas_in,
    ruled,
    station,
    staying,
)
from safenav.scenario.settings import Coordination
from safenav.spec.movement import one_of
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.poses import Mask, PoseGraph, bits


def holding(objective: Objective, region: Region) -> Objective:
    """Return the objective of a waiting requester: stay in ``region``.

    The robot keeps its safety guarantees while it waits.
    """
    if isinstance(objective, Ltl):
        stay = f"region = {region} -> region' = {region}"
        return replace(
            objective, safety=(*objective.safety, stay), liveness=(f"region = {region}",)
        )
    return staying(frozenset({region}), objective)


def helping(objective: Objective, places: Target, own: Target | None, *, stays: bool) -> Objective:
    """Return the objective of a helper: go to ``places`` first, then alternate with its ``own``
    target, or wait there for other robots of the group.

    Plain alternation, not the literal Patrol formula, which would forbid a robot that leaves a
    doorway on the far side to come back through it.
    """
    if isinstance(objective, Ltl):
        there = one_of("region", places)
        stay = (f"{there} -> region' = region",) if stays else ()
        return replace(objective, safety=(*objective.safety, *stay), liveness=(there,))
    if stays:
        return staying(places, objective)
    return alternation((places,) if own is None else (places, own), objective)


class Assigner(Struct, frozen=True, dict=True):
    """Assigns an objective to one robot at one moment. ``idle``: it has no strategy for its own
    objective, and waits while anything may still change."""

    team: TeamState
    robot: RobotState
    floor: Floor
    found: Settlement
    idle: bool = False

    @cached_property
    def index(self) -> int:
        """Number of the robot in the problem."""
        return self.floor.index(self.robot.name)

    @property
    def _member(self) -> Member:
        return self.floor.problem.members[self.index]

    @property
    def _graph(self) -> PoseGraph:
        return self._member.graph

    @property
    def _own_rules(self) -> Objective:
        return self.robot.robot.objective

    @property
    def _safe(self) -> Mask:
        return self.found.safe_poses[self.index]

    @cached_property
    def _allowed(self) -> Mask:
        return self.floor.problem.allowed(self.index, self.floor.stages)

    @cached_property
    def _waits_for_help(self) -> bool:
        served = {self.floor.gates[gate] for gate in self.found.served}
        waits = self.team.requests.waits(self.robot.name)
        return any(request.obstacle.name in served for request in waits)

    def draft(self) -> TaskDraft:
        """The new task; the present one if the settlement is a proof."""
        robot, found = self.robot, self.found
        if found.proof is not None or not (robot.active or robot.assignment.role is Role.HELPS):
            return TaskDraft(robot.assignment, robot.assignment.objective)
        if not robot.active:  # it no longer helps
            return self._wait()
        stop = robot.stop  # if it is blocked, another stop follows after this turn
        if stop is not None and self._alternates((self._stop(stop),)):
            return self._charge(stop)
        if (duty := found.duties.get(self.index)) is not None:
            first = self._own() if self._meets_own_first(duty) else None
            return self._help(duty) if first is None else self._later(first, duty)
        own = None if self.idle or self._waits_for_help else self._own()
        return own or self._wait()

    def is_stranded(self) -> bool:
        """Whether a robot without a reason to wait cannot pursue its own objective: the last
        decision did not expect it in this pose."""
        busy = self.robot.stop is not None or self.index in self.found.duties
        if busy or not self.robot.active or self._waits_for_help:
            return False
        return self._own() is None

    def _charge(self, charger: Pose) -> TaskDraft:
        """Go to the charger and stay there, around the obstacles in its way; if it is there with
        another heading, come back to it."""
        robot, region = self.robot, charger.region
        objective = holding(self._own_rules, region)
        if robot.next_pose.region == region and robot.next_pose != charger:
            objective = alternation((frozenset({region}),), self._own_rules)
        goal = self._graph.on({region})
        role = Role.OWN if objective == robot.own.objective else Role.CHARGES
        duty = self.found.duties.get(self.index)  # the duty after charging
        obstacle = None if duty is None else self.floor.gates[duty.gate]
        draft = self._toward((goal,), Assignment(role, objective, obstacle, goal))
        if role is Role.OWN or charger.heading is None or self.team.rivals(robot.robot):
            return draft
        others = self._graph.poses(goal) - {charger}  # it arrives with the heading of its stop
        return replace(draft, forbidden=draft.forbidden | others)

    def _toward(self, targets: tuple[Mask, ...], assignment: Assignment) -> TaskDraft:
        """The draft of an assignment with these targets, around the obstacles in its way."""
        safe, pending = replace(assignment, safe_poses=self._safe), self._pending()
        return TaskDraft(safe, assignment.objective, pending, pending, self._forbidden(targets))

    def _stop(self, stop: Pose) -> Mask:
        """Return the poses in which a robot meets a stop: with its heading, unless it may have to
        let other robots pass."""
        if stop.heading is None or self.team.rivals(self.robot.robot):
            return self._graph.on({stop.region})
        return 1 << self._graph.number(stop)

    def _help(self, duty: Duty) -> TaskDraft:
        graph, obstacle = self._graph, self.floor.gates[duty.gate]
        places = frozenset(bits(graph.regions_of(duty.goal)))
        own = None if duty.stays else self._own_target(duty.goal)
        stays = duty.stays and self._may_stay_at(graph.poses(duty.goal))
        objective = helping(self._own_rules, places, own, stays=stays)
        for before in () if duty.stays else self._before(obstacle):
            others = graph.on_each(before.targets[1:])
            if before.targets[0] == places and self._alternates((duty.goal, *others)):
                objective = ruled(before, self._own_rules)  # it keeps its former order
                break
        wanted = (duty.goal,) if own is None else (duty.goal, graph.on(own))
        return self._toward(wanted, Assignment(Role.HELPS, objective, obstacle, duty.goal))

    def _meets_own_first(self, duty: Duty) -> bool:
        """Whether a robot can and must meet the next target of its ``once`` before its duty, since
        afterwards it could not meet all remaining ones."""
        problem, member, graph = self.floor.problem, self._member, self._graph
        assigned = self.team.scenario.coordination is Coordination.ASSIGNABLE
        if not (member.settles and member.turns) or assigned:
            return False
        left = member.targets[self.robot.own.memory.index :]
        stages = problem.advanced(duty.gate, self.floor.stages, duty.group)
        after, rest = problem.allowed(self.index, stages), duty.goal
        for target in left:
            rest = graph.closure(rest, after) & target
        here = self.floor.reach(self.index)
        return not rest and bool(graph.closure(here & left[0], self._allowed) & duty.goal)

    def _later(self, draft: TaskDraft, duty: Duty) -> TaskDraft:
        """Return the draft of its own objective for a robot that serves an obstacle afterwards."""
        obstacle = self.floor.gates[duty.gate]
        return replace(draft, assignment=replace(draft.assignment, obstacle=obstacle))

    def _own_target(self, goal: Mask) -> Target | None:
        """Return its waiting place, or the first of its own targets, between which and the duty it
        can alternate; None if there is none."""
        waiting = [frozenset({place}) for place in self._waiting_places()]
        for target in (*waiting, *self._own_rules.targets):
            if self._alternates((goal, self._graph.on(target))):
                return target
        return None

    def _before(self, obstacle: str) -> list[TargetObjective]:
        """The objectives with which a robot has served an obstacle: the present one, and those
        pushed with the requests that are popped now, the last first."""
        name, present = self.robot.name, self.robot.assignment
        popped = reversed(self.team.requests.closed)
        found = [(present.obstacle, present.objective)]
        found += [request.saved[name] for request in popped if name in request.saved]
        return [o for served, o in found if served == obstacle and isinstance(o, ALTERNATING)]

    def _alternates(self, targets: tuple[Mask, ...], closed: Mask = 0) -> bool:
        graph, allowed = self._graph, self._allowed & ~closed & self._safe
        here = 1 << self.floor.poses[self.index]
        return bool(graph.closure(here, allowed) & graph.live(targets, allowed))

    def _wait(self) -> TaskDraft:
        """Pursue the objective for waiting, if there is one; else hold where it encountered the
        obstacle or held before, or nearby if it would block a helper there; if it cannot get there
        now, hold where it stands."""
        pose, rules = self.robot.next_pose, self._own_rules
        if not self.idle and self._waits_for_help:
            meanwhile = self.while_waiting()
            if meanwhile is not None:
                return meanwhile
        there = self._waiting_place()
        targets = (self._graph.on({there}),)
        if there != pose.region and self._alternates(targets):
            return self._toward(targets, Assignment(Role.WAITS, holding(rules, there)))
        if not self._may_stay_at([pose]):  # it leaves and returns
            here = frozenset({pose.region})
            objective = helping(rules, here, None, stays=False)
            return self._toward((self._graph.on(here),), Assignment(Role.WAITS, objective))
        objective = holding(rules, pose.region)
        return TaskDraft(Assignment(Role.WAITS, objective, safe_poses=self._safe), objective)

    def while_waiting(self) -> TaskDraft | None:
        """The task with the objective for waiting; None if the robot has none, or cannot pursue
        it."""
        other = self.robot.robot.while_waiting
        if other is None:
            return None
        if not isinstance(other, Ltl):
            other = ruled(other, self._own_rules)  # its rules may have changed
        targets = self._graph.on_each(other.targets)
        if not self._alternates(targets):
            return None
        return self._toward(targets, Assignment(Role.WAITS, other))

    def _may_stay_at(self, poses: Iterable[Pose]) -> bool:
        """Whether its formulas allow a robot to stay in each of these poses."""
        formulas = formulas_in(self._own_rules)
        guarantees = None if formulas is None else guarantees_of(formulas)
        return guarantees is None or all(guarantees.allows(pose, pose) for pose in poses)

    def _waiting_place(self) -> Region:
        """Return the region where a robot waits, whether or not it can get there."""
        place = next(iter(self._waiting_places()), self.robot.next_pose.region)
        floor, duties = self.floor, self.found.duties
        if not self._waits_for_help or not in_the_way(floor, duties, self.index, place):
            return place
        others = (self.team.robots[floor.names[i]] for i in floor.problem.conflicts[self.index])
        waiting = (other for other in others if other.assignment.role is Role.WAITS)
        taken = {region for other in waiting for region in other.occupied}
        clear = clear_region(floor, duties, self.index, self._safe, taken)
        return place if clear is None else clear

    def _waiting_places(self) -> list[Region]:
        waits = reversed(self.team.requests.waits(self.robot.name))
        places = [request.requesters[self.robot.name] for request in waits]
        before = self.robot.assignment
        if before.role is Role.WAITS:
            places += station(before.objective) or ()
        return places[:1]

    def _own(self) -> TaskDraft | None:
        """Return its own objective, around the obstacles in its way; None if it cannot pursue it
        now."""
        member, floor, objective = self._member, self.floor, self._own_rules
        waits = self.team.requests.waits(self.robot.name)
        must = frozenset(request.obstacle.name for request in waits)
        lost = floor.reach(self.index) & ~self._safe
        assignment = Assignment(Role.OWN, objective, safe_poses=self._safe)
        for avoid in (self._pending() | must, must):
            walls = self._graph.on(g.region for g in floor.problem.gates if g.name in avoid)
            allowed = member.floor & ~walls & ~lost
            reach = self._graph.closure(1 << floor.poses[self.index], allowed)
            if reach & member.live(allowed):
                forbidden = self._forbidden(member.targets)
                return TaskDraft(assignment, objective, avoid, must, forbidden)
        if not self.found.served and isinstance(objective, Ltl):
            return TaskDraft(assignment, objective, must, must)
        return None

    def _pending(self) -> frozenset[str]:
        """The open obstacles that block a robot now."""
        problem, stages = self.floor.problem, self.floor.stages
        return frozenset(
            self.floor.gates[gate]
            for gate in problem.open(stages)
            if self.index in problem.gates[gate].closed_to[stages[gate].need]
        )

    def _forbidden(self, targets: tuple[Mask, ...]) -> frozenset[Pose]:
        """The poses next to the safe ones from which it could still meet ``targets``; a strategy
        avoids the others by itself."""
        lost = self._graph.forward(self._safe) & self._allowed & ~self._safe
        if lost and not isinstance(self._own_rules, Ltl):
            own = targets == self._member.targets
            lost &= (
                self._member.live(self._allowed)
                if own
                else self._graph.live(targets, self._allowed)
            )
        return self._graph.poses(lost)
