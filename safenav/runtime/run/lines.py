"""Trace lines of moves, one per tick in lockstep and one per command in a live run; of joint plans;
and that of a synthesis, with all that its specification was made from."""

from __future__ import annotations

from collections.abc import Callable, Collection

from safenav.data import Place
from safenav.plan.order import surely
from safenav.runtime.control.strategies import Controller
from safenav.spec.assignable import assignable_regions
from safenav.spec.belief import models
from safenav.spec.compile import assumption_names
from safenav.spec.task import Task
from safenav.team import state as now
from safenav.team.floor import driven
from safenav.team.state import State
from safenav.team.team import Team
from safenav.trace import records
from safenav.trace.vocabulary import MovedBy, MoveEnd, PlanEndReason, Reason
from safenav.world.map import RegionMap
from safenav.world.poses import Pose

Emit = Callable[[records.Record], None]


class _Lines:
    """The part of both clocks."""

    def __init__(self, team: Team, emit: Emit) -> None:
        self._team, self._emit = team, emit

    def continued(self, tick: int, i: int, state: State) -> None:
        """A command says nothing until it ends."""

    def resume(self, line: records.Record) -> None:
        """A tick depends on no earlier line."""

    def stayed(self, tick: int, event: now.Stayed, state: State) -> None:
        """A robot that stays has no command."""


class TickLines(_Lines):
    """Lockstep: a ``move`` line for each robot in each tick."""

    def departed(self, tick: int, event: now.Departed, before: State) -> None:
        if event.due is not None:
            start = before.robots[event.robot].pose
            self._move(tick, event.robot, start, start, event.pose, event.by)

    def continued(self, tick: int, i: int, state: State) -> None:
        robot = state.robots[i]
        by = robot.by if robot.by != "plan" else None
        self._move(tick, i, robot.pose, robot.pose, robot.to, by)

    def ended(self, tick: int, i: int, before: State, after: State, end: now.Ended) -> None:
        strayed = None if isinstance(end, now.Arrived) else MoveEnd.ELSEWHERE
        was = before.robots[i]
        self._move(tick, i, was.pose, after.robots[i].pose, None, was.by, strayed)

    def stayed(self, tick: int, event: now.Stayed, state: State) -> None:
        pose = state.robots[event.robot].pose
        self._move(tick, event.robot, pose, pose, None, event.by)

    def _move(
        self,
        tick: int,
        i: int,
        start: int,
        pose: int,
        toward: int | None,
        by: str | None,
        result: MoveEnd | None = None,
    ) -> None:
        size, graph = self._team.size, self._team.members[i].graph
        origin = None if by is None else MovedBy(by)
        goes = None if toward is None else toward % size
        place = start % size, *graph.pose(pose).place
        name = self._team.members[i].name
        self._emit(records.Move(tick, name, *place, goes, origin, result))


class CommandLines(_Lines):
    """Live: a line when a command is given and one when it ends."""

    def __init__(self, team: Team, emit: Emit) -> None:
        super().__init__(team, emit)
        self._commands: dict[int, int] = {}

    def departed(self, tick: int, event: now.Departed, before: State) -> None:
        i, member = event.robot, self._team.members[event.robot]
        self._commands[i] = event.command
        way = before.robots[i].pose % self._team.size, *member.graph.pose(event.pose).place
        node = event.node if event.by == "strategy" else None
        seconds = None if event.seconds is None else round(event.seconds, 3)
        who, by = (tick, event.command, member.name), MovedBy(event.by)
        self._emit(records.Depart(*who, *way, by, node, seconds))

    def ended(
        self,
        tick: int,
        i: int,
        before: State,  # noqa: ARG002
        after: State,
        end: now.Ended,
    ) -> None:
        member, regions, reason = self._team.members[i], None, None
        match end:
            case now.Arrived(_, why):
                result, reason = MoveEnd.ARRIVED, why or None
            case now.Failed(_, _, why):
                result, reason = MoveEnd.FAILED, why
            case now.Lost(_, found, why):
                result, regions, reason = MoveEnd.LOST, tuple(sorted(found)), why or None
            case now.Elsewhere(_, _, blocked):
                result = MoveEnd.BLOCKED if blocked else MoveEnd.ELSEWHERE
        who = tick, self._commands.get(i, 0), member.name
        place = member.graph.pose(after.robots[i].pose).place
        self._emit(records.Arrive(*who, *place, result, reason, regions))

    def resume(self, line: records.Record) -> None:
        """Learn the last command of each robot from the lines of an interrupted run."""
        if isinstance(line, records.Depart | records.Act):
            numbers = {member.name: i for i, member in enumerate(self._team.members)}
            self._commands[numbers.get(line.robot, -1)] = line.command


class PlanLines:
    """The joint plan as far as it needs no further resolution. ``said``: the last place of each
    robot in the recorded part (None: none is in force); ``basis``: for which plan and obstacles."""

    def __init__(self, emit: Emit) -> None:
        self._emit = emit
        self.said: list[int] | None = None
        self.basis: object = None

    def tell(self, tick: int, team: Team, before: State, after: State) -> None:
        """Record the plan when it is new, or more of it is possible."""
        if after.plan is None or self.basis == (after.plan, after.obstacles):
            return
        self.basis, most = (after.plan, after.obstacles), surely(team, after)
        if self.said is not None and (before.plan is not after.plan or most != self.said):
            self.ends(tick, PlanEndReason.CHANGED)
        if self.said is None and any(most[i] > after.robots[i].at for i in team.sharing):
            self._emit(_plan_line(tick, team, after, most))
            self.said = most

    def reached(self, tick: int, team: Team, state: State) -> None:
        """End the plan that was recorded if every robot has gone its way in it."""
        said = self.said
        if said is not None and all(state.robots[i].at >= said[i] for i in team.sharing):
            self.ends(tick, PlanEndReason.REACHED)

    def ends(self, tick: int, reason: PlanEndReason) -> None:
        if self.said is not None:
            self._emit(records.PlanEnd(tick, reason))
            self.said = self.basis = None


def _plan_line(tick: int, team: Team, state: State, most: list[int]) -> records.Plan:
    assert state.plan is not None
    ways, orders = {}, []
    for i in driven(team, state):
        at, member, way = state.robots[i].at, team.members[i], state.plan.ways[i]
        there = (member.graph.pose(visit.pose).place for visit in way[at : most[i] + 1])
        ways[member.name] = tuple(there)
        for place in range(at + 1, most[i] + 1):
            for j, left in way[place].after:
                if (since := left - state.robots[j].at) > 0:
                    orders.append((team.members[j].name, since, member.name, place - at))
    return records.Plan(tick, "the remaining mission", ways, tuple(orders))


def synthesis_line(
    tick: int, reason: Reason, found: Controller, world: RegionMap
) -> records.Synthesis:
    """The line of a synthesis."""
    task, result = found.task, found.result
    hashes = result.spec_sha256, result.strategy_sha256
    possible = assignable_regions(task, world) if task.assignable else None
    return records.Synthesis(
        tick,
        task.robot.name,
        reason,
        result.verdict,
        round(result.seconds, 6),
        result.states,
        result.cached,
        result.verified,
        *hashes,
        found.asked,
        tuple(assumption_names(task, world)),
        node=found.node,
        region=task.pose.region,
        heading=task.pose.facing,
        memory=_memory(task),
        inputs={each.name: on for each, on in task.inputs} or None,
        closed=tuple((known.region, known.item) for known in task.blocked),
        knowledge={
            other.name: other.region if other.belief is None else tuple(sorted(other.belief))
            for other in task.observed
        },
        beliefs={
            model.other.name: tuple(tuple(sorted(belief)) for belief in model.beliefs)
            for model in models(task, world)
        }
        or None,
        sight_closed=tuple(sorted(task.closed)) if task.observed else None,
        places=None if possible is None else tuple(sorted(possible.places)),
        forbidden=_ordered(task.forbidden) or None,
        form=found.form,
        allows=found.allows(world.word),
    )


def _ordered(poses: Collection[Pose]) -> tuple[Place, ...]:
    ordered = sorted(poses, key=lambda pose: (pose.region, pose.heading or 0))
    return tuple(pose.place for pose in ordered)


def _memory(task: Task) -> dict[str, int] | None:
    """The memory variables, and their values at the start."""
    objective, values = task.objective, task.memory.values
    if objective.remembers(task.assignable):
        return {objective.turn: objective.begin(task.pose.region, task.memory.index)}
    return dict(values) or None
