"""Decisions on requests, duties, objectives and synthesis tasks after an event: a pure function.

``coordinate`` reads the team and changes nothing. ``apply`` puts its decision in force
(``safenav.runtime.algorithm``). Source: paper, Section V and Algorithm 1; docs/coordination.md.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination import events, infeasibility
from safenav.runtime.coordination.assignable_goals import own_objective
from safenav.runtime.coordination.assignment import Assigner
from safenav.runtime.coordination.coordination_recorder import (
    blocked,
    requested,
    stack,
    synthesis_record,
)
from safenav.runtime.coordination.events import Event, Unsettled
from safenav.runtime.coordination.snapshot import floor_of, moved_on, serving
from safenav.runtime.coordination.strategies import only_off, outdated
from safenav.runtime.coordination.strategy_search import TaskResult, failed
from safenav.runtime.coordination.task_candidates import Candidate, TaskDraft, task_candidates
from safenav.runtime.duties.reasons import Shortfall, shortfall_words, shortfalls
from safenav.runtime.duties.requests import Requests
from safenav.runtime.duties.settlement import Settled, Settlement, settle
from safenav.runtime.knowledge import PERMANENT, UNTRAVERSABLE, Knowledge
from safenav.runtime.resolution.problem import BudgetExhaustedError
from safenav.runtime.resolution.solve import Solver
from safenav.runtime.team import Role, TeamState
from safenav.runtime.termination import Conclusion
from safenav.scenario.model import Obstacle
from safenav.scenario.settings import Coordination
from safenav.trace import records
from safenav.trace.records import Record
from safenav.trace.vocabulary import BlockReason, ChangeCause, Reason
from safenav.trace.words import obstacle_words


class Decision(Struct, frozen=True):
    """The consequences of ``event``. All of them take effect, or none.

    ``knowledge``, ``requests``, ``lacks`` and ``settled``: the team's new ones (None: unchanged).
    ``records``: its trace records. ``recount``: the rounds are reset. ``drafts``: the task of each
    robot; ``tasks``: those of them for which a strategy must be found, with ``reason``. ``next``:
    the event that follows; ``end``: the conclusion, if the run ends.
    """

    event: Event
    knowledge: Knowledge | None = None
    requests: Requests | None = None
    lacks: Mapping[str, Shortfall] | None = None
    settled: Settled | None = None
    records: tuple[Record, ...] = ()
    recount: bool = False
    drafts: Mapping[str, TaskDraft] = field(default_factory=dict)
    tasks: Mapping[str, Sequence[Candidate]] = field(default_factory=dict)
    reason: Reason = Reason.INITIAL
    next: Event | None = None
    end: Conclusion | None = None


Stopping = Callable[[], None]


def coordinate(team: TeamState, event: Event, stopping: Stopping) -> Decision:
    """Decide what follows from an event. ``stopping`` raises to end a search from outside."""
    try:
        return _decided(team, event, stopping)
    except BudgetExhaustedError:
        return Decision(event, end=infeasibility.spent("resolutions"))


def _decided(team: TeamState, event: Event, stopping: Stopping) -> Decision:
    match event:
        case events.Started():
            return _begun(team, event, _settled(team, (), stopping))
        case events.Continued():
            return _continued(team, event)
        case events.ObstacleEncountered(violation):
            return _encountered(team, event, violation)
        case events.HelpRequested(violation):
            name = violation.robot.name  # it waits in the region to which it has backed up
            here, obstacle = team.robots[name].next_pose.region, violation.obstacle.name
            requests = team.requests.waiting(obstacle, name, here)
            return Decision(event, requests=requests, next=Unsettled(Reason.REQUEST))
        case events.ObstaclesResolved():
            return _resolved(team, event)
        case events.ObstacleChanged():
            return _changed(team, event)
        case events.ObstacleDeclaredPermanent(obstacle):
            return _sealed(team, event, obstacle)
        case events.RequestsSetAside(names):
            left = replace(team.requests, aside=team.requests.aside | names)
            return Decision(event, requests=left, next=Unsettled(Reason.BLOCKED))
        case events.ObstaclesReopened(reason):
            return _reopened(team, event, reason)
        case events.ServiceChanged():
            return _served(team, event)
        case events.ObjectiveGiven(hope=hope):
            then = events.ObstaclesReopened if hope else Unsettled
            return Decision(event, next=then(Reason.OBJECTIVE))
        case events.OutsideStrategy(name, reason, waits=True):
            return _meanwhile(team, event, name, reason)
        case events.OutsideStrategy(name, reason):
            last = team.last_settled
            now = replace(last, floor=moved_on(last.floor, team))
            if Assigner(team, team.robots[name], now.floor, now.found).is_stranded():
                return Decision(event, next=Unsettled(reason))  # duties for a former pose
            return _assigned(team, event, now, only=name)
        case Unsettled(Reason.SERVICE | Reason.OBJECTIVE) if team.requests.aside:
            left = replace(team.requests, aside=frozenset())
            return Decision(event, requests=left, next=event)
        case Unsettled():
            return _never_resolved(team, event) or _duties(team, event, stopping)


def reconsider(team: TeamState, decision: Decision, results: Mapping[str, TaskResult]) -> Decision:
    """Decide what follows if some robots have no strategy for their tasks: another robot helps; or
    a robot waits while anything may change; or the run ends."""
    names, event = failed(results), decision.event
    begun = team.scenario.continues  # the robots have reached this state by themselves
    outcome = Outcome.OPERATOR_NEEDED if begun else Outcome.UNREALIZABLE
    reason = Reason.INITIAL
    match event:
        case events.Started(waits=True, idle=idle) if not idle & {*names}:
            return Decision(event, next=replace(event, idle=idle | {*names}))
        case events.OutsideStrategy(end=end) if (
            end is None or end.outcome is not Outcome.OPERATOR_NEEDED
        ):
            return Decision(event, end=end)
        case events.OutsideStrategy():
            outcome, reason = Outcome.OPERATOR_NEEDED, Reason.BLOCKED
        case Unsettled(cause):
            refused, waiting, off = dict(event.refused), set(event.idle), set(event.off)
            for name in names:
                assignment = decision.drafts[name].assignment
                own = assignment.role is not Role.HELPS and name not in waiting
                if assignment.role is Role.HELPS and assignment.obstacle is not None:
                    refused[name, assignment.obstacle] = results[name]
                elif own and decision.settled is not None and decision.settled.found.duties:
                    waiting.add(name)
                elif only_off(team, name, decision.drafts[name]) and team.frees(name):
                    off.add(name)
                else:
                    break
            else:
                again = Unsettled(cause, refused, frozenset(waiting), frozenset(off))
                return Decision(event, next=again)
            outcome = Outcome.OPERATOR_NEEDED
            reason = Reason.BLOCKED if team.tick else Reason.INITIAL
    lines = tuple(synthesis_record(team, results[name], reason) for name in names)
    return Decision(event, records=lines, end=infeasibility.no_strategy(team, results, outcome))


def _begun(team: TeamState, event: events.Started, settled: Settled) -> Decision:
    """The initial tasks. In a resumed run, an impasse ends the whole run. If the run waits for a
    change, each robot begins as if it were alone."""
    if event.waits:
        everywhere = tuple(member.floor for member in settled.floor.problem.members)
        alone = replace(settled, found=Settlement(safe_poses=everywhere))
        return replace(_assigned(team, event, alone), next=Unsettled(Reason.INITIAL))
    if team.scenario.continues and settled.found.proof is not None:
        end = infeasibility.infeasible_end(team, settled.floor, settled.found.proof, {}, {})
        return Decision(event, settled=settled, end=end)
    return _assigned(team, event, settled)


def _continued(team: TeamState, event: Event) -> Decision:
    """The open requests of the run that this one continues, and the obstacles that an operator has
    declared permanent."""
    knowledge, requests = team.knowledge.copy(), team.requests.continued(team.scenario)
    stays = () if team.scenario.begun is None else team.scenario.begun.stays
    for obstacle in team.scenario.obstacles:
        if obstacle.name in stays and obstacle.appears is None:
            knowledge.join(obstacle, PERMANENT)
    for request in requests:
        knowledge.meet(request.obstacle)
    reason = Reason.REQUEST if requests.stack else Reason.BLOCKED
    return Decision(event, knowledge, requests, next=Unsettled(reason))


def _encountered(team: TeamState, event: Event, violation: ForbiddenMove) -> Decision:
    """Algorithm 1, line 7: r is encountered; the objectives in force are pushed with the request.
    An obstacle in O stays there."""
    if violation.obstacle.name in team.knowledge.permanent:
        return Decision(event)
    knowledge = team.knowledge.copy()
    knowledge.meet(violation.obstacle)
    here = team.robots[violation.robot.name].next_pose.region
    requests = team.requests.opened(violation.obstacle, violation.robot.name, here)
    return Decision(event, knowledge, requests)


def _resolved(team: TeamState, event: events.ObstaclesResolved) -> Decision:
    """Algorithm 1, lines 18 to 21: r is resolved, its request is popped; round counts restart,
    except after bringing a battery."""
    knowledge, requests = team.knowledge.copy(), team.requests
    lines: list[Record] = []
    for obstacle, traversable in event.found:
        request, helped = requests.of(obstacle.name), knowledge.helped(obstacle)
        pops = (each.obstacle.name for each in requests.closed if each.entries)  # to come
        recorded = request is not None and (request.recorded is not None or bool(request.entries))
        asked = recorded or obstacle.name in pops
        who, robots = event.robot.name, helped if len(helped) > 1 else None
        what = who, team.robots[who].pose.region, asked, traversable
        lines.append(records.Resolved(team.tick, obstacle.name, *what, robots=robots))
        knowledge.forget(obstacle)
        if traversable is False:
            knowledge.join(obstacle, UNTRAVERSABLE)
            lines.append(blocked(team, obstacle, BlockReason.UNTRAVERSABLE))
        requests = requests.without(obstacle.name)
    after, made = Unsettled(Reason.RESOLVED), tuple(lines)
    recount = any(team.scenario.restarts_rounds(found.name) for found, _ in event.found)
    return Decision(event, knowledge, requests, records=made, recount=recount, next=after)


def _changed(team: TeamState, event: events.ObstacleChanged) -> Decision:
    """An obstacle has appeared, where no robot knows it yet, or has disappeared."""
    change, obstacle, knowledge = event.change, event.change.obstacle, team.knowledge.copy()
    name, tick, cause = obstacle.name, team.tick, ChangeCause.WORLD
    due = obstacle.appears if change.appeared else obstacle.goes
    if change.by_user:
        cause = ChangeCause.USER
    elif due is not None and obstacle in team.scenario.obstacles:
        cause = ChangeCause.SCENARIO
    lines: list[Record] = [
        (records.Appeared if change.appeared else records.Gone)(tick, name, cause)
    ]
    after: Event | None = None
    requests = replace(team.requests, aside=frozenset())
    if not change.appeared:
        hope = requests.given_up and team.waiting is None  # it may have blocked them
        gone = events.ObstaclesReopened(Reason.GONE) if hope else Unsettled(Reason.GONE)
        after = gone if knowledge.forget(obstacle) else None
        requests = requests.without(name)
    else:
        knowledge.appear(obstacle)
        if obstacle.ordered:
            knowledge.meet(obstacle)
            requests, after = requests.ordered(obstacle), Unsettled(Reason.REQUEST)
            lines.append(records.Ordered(tick, name, cause))
        if change.another and change.truth is not None:
            lines.append(records.Truth(tick, name, change.truth, cause))
    return Decision(event, knowledge, requests, records=tuple(lines), next=after)


def _sealed(team: TeamState, event: Event, obstacle: Obstacle) -> Decision:
    """An operator declares an obstacle permanent: it joins O."""
    knowledge = team.knowledge.copy()
    knowledge.join(obstacle, PERMANENT)
    lines: tuple[Record, ...] = ()
    if obstacle.name not in team.knowledge.permanent:
        lines = (blocked(team, obstacle, BlockReason.OPERATOR),)
    requests = team.requests.without(obstacle.name)
    return Decision(event, knowledge, requests, records=lines, next=Unsettled(Reason.BLOCKED))


def _reopened(team: TeamState, event: Event, reason: Reason) -> Decision:
    """Reopen the requests that were given up, before any other decision."""
    knowledge, requests, lines = team.knowledge.copy(), team.requests, list[Record]()
    for request in requests.given_up:
        name = request.obstacle.name
        if name in knowledge.given_up():
            knowledge.meet(request.obstacle)
            requests = requests.reopened(request)
            lines.append(records.Reopened(team.tick, name))
    return Decision(event, knowledge, requests, records=tuple(lines), next=Unsettled(reason))


def _served(team: TeamState, event: events.ServiceChanged) -> Decision:
    """A robot is out of service or back; it is the requester of an obstacle that appears in its
    region."""
    line = records.Service(team.tick, event.robot, event.active, event.cause)
    if event.obstacle is None:
        return Decision(event, records=(line,), next=Unsettled(Reason.SERVICE))
    knowledge, region = team.knowledge.copy(), team.robots[event.robot].pose.region
    knowledge.appear(event.obstacle)
    knowledge.meet(event.obstacle)
    made = (records.Appeared(team.tick, event.obstacle.name, event.cause), line)
    requests = team.requests.opened(event.obstacle, event.robot, region)
    return Decision(event, knowledge, requests, records=made, next=Unsettled(Reason.REQUEST))


def _never_resolved(team: TeamState, event: Unsettled) -> Decision | None:
    """Obstacles whose next need can never be fulfilled join O, with the proof; None if there are
    none."""
    floor, closure = infeasibility.closed(team)
    lacks = {each.obstacle: each for each in shortfalls(floor, closure, (), team.failures.barred)}
    lacks = {**team.lacks, **lacks}
    if not closure.stuck and team.lacks == lacks:
        return None
    knowledge, requests, lines = team.knowledge.copy(), team.requests, list[Record]()
    for gate in closure.stuck:
        request = requests.of(floor.gates[gate])
        assert request is not None
        enough = infeasibility.enough(team, request.obstacle.type)
        because = shortfall_words(lacks[floor.gates[gate]], team.scenario.map.word, "it")
        if request.recorded is None or not enough:
            lines.append(requested(team, request, floor, (), because))
        what = obstacle_words(request.obstacle.name, team.scenario.map.word)
        ever = "no robot can" if team.changes_to_come() else "no robot can ever"
        why = f"{ever if enough else 'this team cannot'} resolve {what}"
        knowledge.join(request.obstacle, why)
        reason = BlockReason.UNRESOLVABLE if enough else BlockReason.NO_CAPABLE_ROBOT
        proof = infeasibility.recorded_closure(floor, closure)
        lines.append(blocked(team, request.obstacle, reason, proof, because))
        requests = requests.without(request.obstacle.name, given_up=True)
    return Decision(event, knowledge, requests, lacks, records=tuple(lines), next=event)


def _duties(team: TeamState, event: Unsettled, stopping: Stopping) -> Decision:
    """Algorithm 1, lines 9 to 16: the requester's objective becomes safe behaviour, a state in S_r
    is added to that of a robot with c_r; one plan for all requests determines both."""
    settled = _settled(team, event.refused, stopping)
    floor, found = settled.floor, settled.found
    if found.proof is not None:
        end = infeasibility.infeasible_end(team, floor, found.proof, event.refused, team.lacks)
        if event.refused and _settled(team, (), stopping).found.proof is None:
            made = [synthesis_record(team, r, Reason.REQUEST) for r in event.refused.values()]
            return Decision(event, records=(*made,), end=infeasibility.unserved(end, event.refused))
        return Decision(event, end=end)
    decision = _assigned(team, event, settled)
    requests, lines = stack(team, settled, decision.drafts, event.refused)
    return replace(decision, requests=requests, records=lines)


def _settled(team: TeamState, refused: Collection[tuple[str, str]], stopping: Stopping) -> Settled:
    """Return the current duties. Raises BudgetExhaustedError."""
    floor = floor_of(team, refused)
    solver = Solver(floor.problem, stopping)
    order = [gate for gate, name in enumerate(floor.gates) if name not in team.requests.aside]
    found = settle(solver, floor.poses, floor.stages, order, serving(team, floor))
    return Settled(floor, solver, found)


def _meanwhile(team: TeamState, event: Event, name: str, reason: Reason) -> Decision:
    """Give a robot its objective for waiting while the team waits for a change; open and given-up
    requests stay as they are."""
    floor = floor_of(team)
    everywhere = tuple(member.floor for member in floor.problem.members)
    alone = Settlement(safe_poses=everywhere)
    found = Assigner(team, team.robots[name], floor, alone).while_waiting()
    if found is None or team.waiting is None:
        return Decision(event)
    return Decision(
        event, drafts={name: found}, tasks={name: task_candidates(team, name, found)}, reason=reason
    )


def _assigned(
    team: TeamState, event: Event, settled: Settled, *, only: str | None = None
) -> Decision:
    """The tasks of all robots, or of ``only``. A strategy must be found for each task that the one
    in force does not suffice for, and always for ``only``."""
    idle = event.idle if isinstance(event, Unsettled | events.Started) else frozenset()
    off = event.off if isinstance(event, Unsettled) else frozenset()
    drafts = {
        name: Assigner(team, robot, settled.floor, settled.found, name in idle).draft()
        for name, robot in team.robots.items()
        if only in (None, name)
    }
    assigned = team.scenario.coordination is Coordination.ASSIGNABLE
    wanted = {
        name: own_objective(team.robots[name], draft) if assigned else draft
        for name, draft in drafts.items()
    }
    reason = getattr(event, "reason", Reason.INITIAL)
    if assigned and reason in (Reason.REQUEST, Reason.RESOLVED, Reason.GONE):
        reason = Reason.BLOCKED  # in each case the known map has changed
    tasks = {
        name: task_candidates(team, name, draft)
        for name, draft in wanted.items()
        if only is not None or (name not in off and outdated(team, name, draft))
    }
    return Decision(event, settled=settled, drafts=drafts, tasks=tasks, reason=reason)
