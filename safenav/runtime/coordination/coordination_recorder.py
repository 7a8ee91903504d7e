"""The longer trace lines of a decision: requests and bids, the stack, syntheses. They are
pure functions of the decision."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from msgspec.structs import replace

from safenav.bounds import Place
from safenav.runtime.coordination.strategy_search import TaskResult
from safenav.runtime.coordination.task_candidates import TaskDraft
from safenav.runtime.duties.reasons import shortfall_words, why_nobody
from safenav.runtime.duties.requests import OpenRequest, Requests
from safenav.runtime.duties.settlement import Settled, Settlement
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import Role, TeamState
from safenav.scenario.model import Obstacle, Tracking
from safenav.scenario.objective import Ltl
from safenav.scenario.settings import Coordination
from safenav.spec.assignable import neutral
from safenav.spec.assignable_regions import AssignableRegions, assignable_regions
from safenav.spec.compile import assumption_names
from safenav.spec.other_robots.belief import models
from safenav.spec.task import Fairness, Task
from safenav.trace import records, vocabulary
from safenav.trace.objective import Objective
from safenav.trace.proofs import Proof
from safenav.trace.told_objective import objective_in_trace
from safenav.trace.words import listed, obstacle_words
from safenav.world.moves import Pose


def blocked(
    team: TeamState,
    obstacle: Obstacle,
    reason: vocabulary.BlockReason,
    proof: Proof | None = None,
    because: str | None = None,
) -> records.Record:
    """The line of an obstacle that joins O."""
    robots = frozenset(n for n, robot in team.robots.items() if obstacle.blocks(robot.robot))
    may_end = proof is not None and team.changes_to_come()
    goes = reason is vocabulary.BlockReason.UNTRAVERSABLE and obstacle.goes is not None
    for_now = may_end or goes or None
    return records.KnownObstacle(team.tick, obstacle.name, robots, reason, proof, because, for_now)


class _StackLines:
    """The pushes and pops of a decision that gives all robots these objectives; ``depth``: that of
    the stack after them."""

    def __init__(self, team: TeamState, objectives: Mapping[str, Objective]) -> None:
        self.team, self.objectives = team, objectives
        self.lines: list[records.Record] = []
        over = team.requests.closed
        self.depth = team.requests.depth + sum(len(request.entries) for request in over)

    def pop(self, request: OpenRequest) -> None:
        """Drop all entries of a request."""
        for pair in reversed(request.entries):
            self.depth -= 1
            self._entry(records.Pop, request, *pair)

    def push(self, request: OpenRequest, helpers: tuple[str, ...]) -> OpenRequest:
        """Push an entry for each requester that has none."""
        pushed = [(requester, helpers) for requester in request.unpushed]
        for pair in pushed:
            self.depth += 1
            self._entry(records.Push, request, *pair)
        saved = request.saved
        if pushed and not request.entries:
            now = {name: robot.assignment for name, robot in self.team.robots.items()}
            helping = {n: a for n, a in now.items() if a.role is Role.HELPS}
            saved = {n: (a.obstacle, a.objective) for n, a in helping.items()}
        return replace(request, entries=(*request.entries, *pushed), saved=saved)

    def _entry(
        self,
        kind: type[records.Push] | type[records.Pop],
        request: OpenRequest,
        requester: str | None,
        helpers: tuple[str, ...],
    ) -> None:
        who = requester, helpers[0] if helpers else None
        several = helpers if len(helpers) > 1 else None
        about = self.depth, self.objectives, request.obstacle.name, *who
        self.lines.append(kind(self.team.tick, *about, helpers=several))


def stack(
    team: TeamState,
    settled: Settled,
    drafts: Mapping[str, TaskDraft],
    refused: Mapping[tuple[str, str], TaskResult],
) -> tuple[Requests, tuple[records.Record, ...]]:
    """The lines about a decision once every robot has its task, and the requests after them: the
    pops of closed requests, then each open request with new helpers, and its pushes. If
    there are any such lines, requests for which a robot has no strategy are recorded again, since
    the lines depend on them.
    """
    floor, found = settled.floor, settled.found
    objectives = {
        name: objective_in_trace(draft.assignment.objective) for name, draft in drafts.items()
    }
    entries = _StackLines(team, objectives)
    for request in team.requests.closed:
        entries.pop(request)
    active = {n: d.assignment.obstacle for n, d in drafts.items() if team.robots[n].active}
    helping = {
        name: tuple(robot for robot, obstacle in active.items() if obstacle == name)
        for name in (request.obstacle.name for request in team.requests)
    }
    news = {r.obstacle.name for r in team.requests if _is_news(r, helping, team.requests.aside)}
    if news or entries.lines or any(request.unpushed for request in team.requests):
        news |= {obstacle for _, obstacle in refused}
    after = []
    for request in team.requests:
        name = request.obstacle.name
        helpers, aside = helping[name], name in team.requests.aside
        if name in news:
            because = _because(team, floor, found, request, helpers)
            line = requested(team, request, floor, helpers, because)
            entries.lines += [
                replace(line, aside=True) if aside and not request.aside else line,
                *(
                    synthesis_record(team, result, vocabulary.Reason.REQUEST)
                    for (_, obstacle), result in refused.items()
                    if obstacle == name
                ),
            ]
            request = replace(request, recorded=helpers)
        request = entries.push(request, helpers)
        after.append(replace(request, helpers=helpers, aside=aside))
    changed = any(isinstance(line, records.Push | records.Pop) for line in entries.lines)
    if team.scenario.coordination is Coordination.ASSIGNABLE and not changed:
        entries.lines += [  # otherwise synthesis lines record them
            records.Told(team.tick, name, objective)
            for name, objective in objectives.items()
            if objective != team.recorded[name]
        ]
    given_up, set_aside = team.requests.given_up, team.requests.aside
    return Requests(tuple(after), given_up=given_up, aside=set_aside), tuple(entries.lines)


def _is_news(
    request: OpenRequest, helping: Mapping[str, tuple[str, ...]], aside: Collection[str]
) -> bool:
    """Whether the trace lacks the request, its helpers, or that it is set aside."""
    name = request.obstacle.name
    listed_acts = request.recorded is not None and helping[name] in ((), request.recorded)
    return not listed_acts or (name in aside and not request.aside)


def _because(
    team: TeamState,
    floor: Floor,
    found: Settlement,
    request: OpenRequest,
    helpers: tuple[str, ...],
) -> str | None:
    """Why a request has no helpers, or others than expected."""
    name = request.obstacle.name
    gate = floor.gates.index(name)
    if name in team.requests.aside and not request.aside:
        return "no order of moves lets them resolve it now"
    if not helpers:
        return why_nobody(floor, found, gate, team.scenario.map.word, team.out_of_service)
    return _why_others(team, floor, found, gate, request, helpers)


def _why_others(
    team: TeamState,
    floor: Floor,
    found: Settlement,
    gate: int,
    request: OpenRequest,
    helpers: tuple[str, ...],
) -> str | None:
    """Why robots that fail, are out of service, or are nearer than the helpers do not help; None
    where the bids show it."""
    word, bids = team.scenario.map.word, bids_for(floor, gate)
    last = max((bids[helper] or 0 for helper in helpers if helper in bids), default=0)
    reasons: dict[str, list[str]] = {}
    for robot, ticks in bids.items():
        index, why = floor.index(robot), ""
        duty = found.duties.get(index)
        if robot in helpers:
            continue
        if (robot, floor.gates[gate]) in team.failures.barred:
            why = "has failed"
        elif not team.robots[robot].active:
            why = "is out of service"
        elif ticks is None or ticks >= last:
            continue
        elif duty is not None and duty.gate != gate:
            why = f"is to help with {obstacle_words(floor.gates[duty.gate], word)}"
        elif not _could_return(floor, gate, index):
            why = "could not return from there"
        elif {*helpers} <= {*request.helpers}:
            why = f"is nearer, but {listed(helpers)} helps already"
        reasons.setdefault(why, []).append(robot)
    reasons.pop("", None)
    plural = {"has failed": "have failed", "is out of service": "are out of service"}
    parts = [
        f"{listed(robots)} {plural.get(why, why) if len(robots) > 1 else why}"
        for why, robots in reasons.items()
    ]
    return "; ".join(parts) or None


def _could_return(floor: Floor, gate: int, robot: int) -> bool:
    """Whether a robot could return to its pose after it has fulfilled an obstacle's next need."""
    problem, stages = floor.problem, floor.stages
    graph, pose = problem.members[robot].graph, 1 << floor.poses[robot]
    there = graph.poses_on(problem.next_need(gate, stages).regions) & floor.reach(robot)
    then = problem.allowed(robot, problem.advanced(gate, stages, (robot,)))
    return bool(graph.closure(there, then) & pose)


def left_words(team: TeamState, name: str) -> str:
    """Describe an order that is still open when the mission is completed, and why."""
    word, settled = team.scenario.map.word, team.last_settled
    if name in team.knowledge.given_up() and name in team.lacks:
        why: str | None = shortfall_words(team.lacks[name], word, "it")
    elif name not in settled.floor.gates:  # it appeared when the run was about to end
        why = "the team could not continue when it arrived"
    else:
        gate = settled.floor.gates.index(name)
        why = why_nobody(settled.floor, settled.found, gate, word, team.out_of_service)
    return f"{name} ({why})" if why else name


def requested(
    team: TeamState,
    request: OpenRequest,
    floor: Floor,
    helpers: tuple[str, ...],
    because: str | None,
) -> records.Request:
    """The request with its bids: ticks to the nearest region of the next need."""
    gate = floor.gates.index(request.obstacle.name)
    need = floor.stages[gate].need
    bids = {  # a robot out of service stays, although it may come back
        name: ticks if team.robots[name].active or ticks == 0 else None
        for name, ticks in bids_for(floor, gate).items()
    }
    return records.Request(
        team.tick,
        request.obstacle.name,
        next(reversed([*request.requesters]), None),
        bids,
        helpers[0] if helpers else None,
        request.obstacle.resolution_regions(team.scenario.map, need),
        helpers=helpers if len(helpers) > 1 else None,
        need=need if len(request.obstacle.needs) > 1 else None,
        because=because,
    )


def bids_for(floor: Floor, gate: int) -> dict[str, int | None]:
    """Return the ticks that each robot with the action needs to the next need's regions; None if it
    cannot get there while the open obstacles are walls."""
    problem, stages = floor.problem, floor.stages
    need = problem.next_need(gate, stages)
    found: dict[str, int | None] = {}
    for index in problem.skilled(gate, stages):
        member = problem.members[index]
        steps = member.graph.steps_between(
            1 << floor.poses[index],
            member.graph.poses_on(need.regions),
            problem.allowed(index, stages),
        )
        found[member.name] = None if steps is None else steps * member.ticks
    return found


def synthesis_record(
    team: TeamState, found: TaskResult, reason: vocabulary.Reason, node: int | None = None
) -> records.Synthesis:
    """The line of a trace about a synthesis: its result, and all inputs of its specification;
    ``node``: where its strategy begins."""
    task, result = found.task, found.result
    world = team.scenario.map
    possible = assignable_regions(task, world) if task.assignable else None
    believed = task.tracking is Tracking.BELIEF and bool(task.observed)
    return records.Synthesis(
        team.tick,
        task.robot.name,
        reason,
        result.verdict,
        round(result.seconds, 6),
        result.states,
        result.cached,
        result.verified,
        result.spec_sha256,
        result.strategy_sha256,
        objective_in_trace(found.asked),
        tuple(assumption_names(task, world)),
        node=node,
        region=task.pose.region,
        heading=task.pose.facing,
        memory=_memory(task),
        inputs={each.name: on for each, on in task.inputs} or None,
        again={each.name: each.again for each, _ in task.inputs if each.again} or None,
        closed=tuple((known.region, known.item) for known in task.blocked),
        moving=tuple(other.name for other in task.observed if other.danger),
        tracked=tuple(other.name for other in task.observed if not other.danger),
        tracking=task.tracking.value,
        fairness=task.fairness.value,
        others_targets={
            other.name: tuple(tuple(sorted(target)) for target in other.targets)
            for other in task.observed
            if task.fairness is Fairness.AT_ITS_TARGETS
        },
        knowledge={
            other.name: other.region if other.belief is None else tuple(sorted(other.belief))
            for other in task.observed
        },
        beliefs={
            model.other.name: tuple(tuple(sorted(b)) for b in model.beliefs)
            for model in models(task, world)
        }
        if believed
        else None,
        sight_closed=tuple(sorted(task.closed)) if believed else None,
        places=tuple(sorted(possible.places)) if possible is not None else None,
        neutral=neutral(possible) if possible is not None else None,
        places_from=_places_from(possible) if possible is not None else None,
        forbidden=_places(task.forbidden) or None,
        form=found.form,
        allows=found.allows(world.word),
        tried=found.tried or None,
    )


def _places_from(possible: AssignableRegions) -> tuple[records.PlacesFrom, ...] | None:
    found = (
        records.PlacesFrom(tuple(sorted(part.regions)), _places(poses), dict(memory) or None)
        for part in possible.parts
        for memory, poses in part.poses().items()
    )
    return tuple(found) or None


def _memory(task: Task) -> dict[str, int] | None:
    """The memory variables, and their values at the start."""
    objective = task.objective
    if isinstance(objective, Ltl):
        return dict(task.memory.values)
    if not objective.remembers:
        return None
    return {objective.turn: objective.begin(task.pose.region, task.memory.index)}


def _places(poses: frozenset[Pose]) -> tuple[Place, ...]:
    """Return poses in the form of a trace."""
    ordered = sorted(poses, key=lambda pose: (pose.region, pose.heading or 0))
    return tuple(pose.place for pose in ordered)
