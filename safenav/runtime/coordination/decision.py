"""Decisions on requests, duties, objectives and synthesis tasks after an event: a pure function.

``coordinate`` reads the team and changes nothing. ``apply`` puts its decision in force
(``safenav.runtime.algorithm``). Source: paper, Section V and Algorithm 1; docs/coordination.md.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination import coordination_recorder as lines
from safenav.runtime.coordination.assignable_goals import own_objective
from safenav.runtime.coordination.assignment import Assigner
from safenav.runtime.coordination.events import (
    Astray,
    BatteryFlat,
    Event,
    HelpRequested,
    HopeReturned,
    ObstacleChanged,
    ObstacleEncountered,
    ObstacleSealed,
    ObstaclesResolved,
    RequestsSetAside,
    Started,
    Unsettled,
)
from safenav.runtime.coordination.infeasibility import (
    no_strategy,
    nobody_goes_on,
    recorded_closure,
    spent,
)
from safenav.runtime.coordination.ladder import Ladder, TaskDraft, ladder
from safenav.runtime.coordination.snapshot import floor_of
from safenav.runtime.coordination.strategies import outdated
from safenav.runtime.coordination.strategy_search import TaskResult, failed
from safenav.runtime.coordination.synthesis_recorder import synthesis_record
from safenav.runtime.deadlines.choice import InTime, after, choose
from safenav.runtime.duties.reasons import Shortfall, shortfall_words, shortfalls
from safenav.runtime.duties.requests import OpenRequest, Requests
from safenav.runtime.duties.settlement import Settled, settle
from safenav.runtime.knowledge import PERMANENT, UNTRAVERSABLE, Knowledge
from safenav.runtime.resolution.problem import Floor, SpentError
from safenav.runtime.resolution.proofs import TeamClosure, closure_of
from safenav.runtime.resolution.solve import Plan, Solver
from safenav.runtime.team import Role, TeamState
from safenav.runtime.termination import Conclusion
from safenav.scenario.model import Obstacle
from safenav.scenario.settings import Coordination
from safenav.trace.records import Appeared, Record, Reopened, Service
from safenav.trace.vocabulary import BlockReason, ChangeCause, Reason


class Decision(Struct, frozen=True):
    """The consequences of ``event``. All of it is put in force, or nothing.

    ``knowledge``, ``requests``, ``lacks`` and ``settled``: those of the team from now on.
    ``records``: its trace records. ``recount``: the rounds are reset. ``drafts``: the task of each
    robot; ``tasks``: those of them for which a strategy must be found, with ``reason``. ``next``:
    the event that follows; ``end``: the conclusion, if the run ends.
    """

    event: Event
    knowledge: Knowledge
    requests: Requests
    lacks: Mapping[str, Shortfall]
    settled: Settled | None
    records: tuple[Record, ...] = ()
    recount: bool = False
    drafts: Mapping[str, TaskDraft] = field(default_factory=dict)
    tasks: Mapping[str, Ladder] = field(default_factory=dict)
    reason: Reason = Reason.INITIAL
    next: Event | None = None
    end: Conclusion | None = None


Stopping = Callable[[], None]


def coordinate(team: TeamState, event: Event, stopping: Stopping) -> Decision:
    """Decide what follows from an event. ``stopping`` raises to end a search from outside."""
    try:
        return _decided(team, event, stopping)
    except SpentError:
        return _unchanged(team, event, end=spent("resolutions"))


def _decided(team: TeamState, event: Event, stopping: Stopping) -> Decision:
    match event:
        case Started():
            return _assigned(team, event, _settled(team, (), stopping))
        case ObstacleEncountered(violation):
            return _encountered(team, event, violation)
        case HelpRequested(violation):
            return _requested(team, event, violation)
        case ObstaclesResolved():
            return _resolved(team, event)
        case ObstacleChanged():
            return _changed(team, event)
        case ObstacleSealed(obstacle):
            return _sealed(team, event, obstacle)
        case RequestsSetAside(names):
            kept = replace(team.requests, aside=team.requests.aside | names)
            decision = _unchanged(team, event, next=Unsettled(Reason.BLOCKED))
            return replace(decision, requests=kept)
        case HopeReturned(reason):
            return _reopened(team, event, reason)
        case BatteryFlat():
            return _ran_flat(team, event)
        case Astray(name):
            assert team.settled is not None
            return _assigned(team, event, team.settled, only=name)
        case Unsettled(Reason.SERVICE | Reason.OBJECTIVE) if team.requests.aside:
            kept = replace(team.requests, aside=frozenset())
            return replace(_unchanged(team, event, next=event), requests=kept)
        case Unsettled():
            return _never_resolved(team, event, stopping) or _duties(team, event, stopping)


def reconsider(team: TeamState, decision: Decision, results: Mapping[str, TaskResult]) -> Decision:
    """Decide what follows if some robots have no strategy for their tasks: another robot helps; or
    a robot waits while anything may change; or the run ends."""
    names = failed(results)
    match decision.event:
        case Astray(end=end):
            return _unchanged(team, decision.event, end=end)
        case Unsettled(reason, refused, idle):
            refused, waiting = dict(refused), set(idle)
            for name in names:
                assignment = decision.drafts[name].assignment
                own = assignment.role is not Role.HELPS and name not in waiting
                if assignment.role is Role.HELPS and assignment.obstacle is not None:
                    refused[name, assignment.obstacle] = results[name]
                elif own and decision.settled is not None and decision.settled.found.duties:
                    waiting.add(name)
                else:
                    break
            else:
                again = Unsettled(reason, refused, frozenset(waiting))
                return _unchanged(team, decision.event, next=again)
            outcome, said = Outcome.OPERATOR_NEEDED, Reason.BLOCKED
        case _:
            outcome, said = Outcome.UNREALIZABLE, Reason.INITIAL
    told = tuple(synthesis_record(team, results[name], said) for name in names)
    end = no_strategy(team, results, outcome)
    return _unchanged(team, decision.event, records=told, end=end)


def _unchanged(
    team: TeamState,
    event: Event,
    *,
    records: tuple[Record, ...] = (),
    next: Event | None = None,
    end: Conclusion | None = None,
) -> Decision:
    """A decision that leaves the team as it is."""
    kept = team.knowledge, team.requests, team.lacks, team.settled
    return Decision(event, *kept, records=records, next=next, end=end)


def _encountered(team: TeamState, event: Event, violation: ForbiddenMove) -> Decision:
    """Algorithm 1, line 7: r is encountered; what was in force is pushed with the request. An
    obstacle in O stays there."""
    before = _unchanged(team, event)
    if violation.obstacle.name in team.knowledge.joined:
        return before
    knowledge = team.knowledge.copy()
    knowledge.meet(violation.obstacle)
    here = team.robots[violation.robot.name].next_pose.region
    requests = team.requests.opened(violation.obstacle, violation.robot.name, here)
    return replace(before, knowledge=knowledge, requests=requests)


def _requested(team: TeamState, event: Event, violation: ForbiddenMove) -> Decision:
    """The request, from where the robot has backed up to."""
    robot = team.robots[violation.robot.name]
    requests = team.requests.waiting(violation.obstacle.name, robot.name, robot.next_pose.region)
    return replace(_unchanged(team, event), requests=requests, next=Unsettled(Reason.REQUEST))


def _resolved(team: TeamState, event: ObstaclesResolved) -> Decision:
    """Algorithm 1, lines 18 to 21: r is resolved, its request is popped; counts begin again."""
    knowledge, requests = team.knowledge.copy(), team.requests
    said: list[Record] = []
    for obstacle, traversable in event.found:
        said.append(lines.resolved(team, event.robot.name, obstacle, traversable))
        knowledge.forget(obstacle)
        if traversable is False:
            knowledge.join(obstacle, UNTRAVERSABLE)
            said.append(lines.blocked(team, obstacle, BlockReason.UNTRAVERSABLE))
        requests = requests.without(obstacle.name)
    return replace(
        _unchanged(team, event, records=tuple(said), next=Unsettled(Reason.RESOLVED)),
        knowledge=knowledge,
        requests=requests,
        recount=True,
    )


def _changed(team: TeamState, event: ObstacleChanged) -> Decision:
    """An obstacle has appeared, where no robot knows it yet, or has disappeared."""
    obstacle, knowledge = event.change.obstacle, team.knowledge.copy()
    said = tuple(lines.changed(team, event.change))
    if event.change.appeared:
        knowledge.appear(obstacle)
        requests = replace(team.requests, aside=frozenset())
        if not obstacle.ordered:
            decision = _unchanged(team, event, records=said)
            return replace(decision, knowledge=knowledge, requests=requests)
        knowledge.meet(obstacle)
        decision = _unchanged(team, event, records=said, next=Unsettled(Reason.REQUEST))
        return replace(decision, knowledge=knowledge, requests=requests.ordered(obstacle))
    after = Unsettled(Reason.GONE) if knowledge.forget(obstacle) else None
    requests = replace(team.requests.without(obstacle.name), aside=frozenset())
    decision = _unchanged(team, event, records=said, next=after)
    return replace(decision, knowledge=knowledge, requests=requests)


def _sealed(team: TeamState, event: Event, obstacle: Obstacle) -> Decision:
    """An operator knows that an obstacle stays: it joins O."""
    knowledge = team.knowledge.copy()
    knowledge.join(obstacle, PERMANENT)
    said: tuple[Record, ...] = ()
    if obstacle.name not in team.knowledge.joined:
        said = (lines.blocked(team, obstacle, BlockReason.OPERATOR),)
    decision = _unchanged(team, event, records=said, next=Unsettled(Reason.BLOCKED))
    requests = team.requests.without(obstacle.name).decided(obstacle.name)
    return replace(decision, knowledge=knowledge, requests=requests)


def _reopened(team: TeamState, event: Event, reason: Reason) -> Decision:
    """Obstacles that were given up are requested again, before anything else is decided."""
    knowledge, requests, said = team.knowledge.copy(), team.requests, list[Record]()
    for request in requests.given_up:
        name = request.obstacle.name
        if name in knowledge.given_up():
            knowledge.meet(request.obstacle)
            requests = requests.reopened(request)
            said.append(Reopened(team.tick, name))
    decision = _unchanged(team, event, records=tuple(said), next=Unsettled(reason))
    return replace(decision, knowledge=knowledge, requests=requests)


def _ran_flat(team: TeamState, event: BatteryFlat) -> Decision:
    """An obstacle appears at a robot, which is out of service and the requester."""
    knowledge, region = team.knowledge.copy(), team.robots[event.robot].pose.region
    knowledge.appear(event.obstacle)
    knowledge.meet(event.obstacle)
    cause = ChangeCause.BATTERY
    said = (
        Appeared(team.tick, event.obstacle.name, cause),
        Service(team.tick, event.robot, active=False, cause=cause),
    )
    requests = team.requests.opened(event.obstacle, event.robot, region)
    after = _unchanged(team, event, records=said, next=Unsettled(Reason.REQUEST))
    return replace(after, knowledge=knowledge, requests=requests)


def _never_resolved(team: TeamState, event: Unsettled, stopping: Stopping) -> Decision | None:
    """Obstacles that can never be brought any further join O, with the proof; None if there are
    none."""
    floor, closure = closed(team, stopping)
    lacks = {each.obstacle: each for each in shortfalls(floor, closure, (), team.failures.barred)}
    lacks = {**team.lacks, **lacks}
    if not closure.stuck and team.lacks == lacks:
        return None
    knowledge, requests, said = team.knowledge.copy(), team.requests, list[Record]()
    for gate in closure.stuck:
        request = requests.of(floor.gates[gate])
        assert request is not None
        reason = BlockReason.UNRESOLVABLE if _enough(team, request) else NO_CAPABLE_ROBOT
        because = shortfall_words(lacks[floor.gates[gate]], team.scenario.map.word, "it")
        if request.recorded is None or reason is NO_CAPABLE_ROBOT:
            said.append(lines.requested(team, request, floor, (), because))
        known = reason is NO_CAPABLE_ROBOT
        knowledge.join(
            request.obstacle,
            "too few robots can remove it" if known else "no robot can ever resolve it",
        )
        proof = recorded_closure(floor, closure)
        said.append(lines.blocked(team, request.obstacle, reason, proof, because))
        requests = requests.without(request.obstacle.name, given_up=True)
    return replace(
        _unchanged(team, event, records=tuple(said), next=event),
        knowledge=knowledge,
        requests=requests,
        lacks=lacks,
    )


NO_CAPABLE_ROBOT = BlockReason.NO_CAPABLE_ROBOT


def closed(team: TeamState, stopping: Stopping = lambda: None) -> tuple[Floor, TeamClosure]:
    """Return which obstacles can ever be resolved, and where each robot gets by that. Robots out of
    service may come back."""
    floor = floor_of(team, hopeful=True)
    solver = Solver(floor.problem, stopping)
    return floor, closure_of(solver, solver.sets(floor.poses, floor.stages), floor.stages)


def _enough(team: TeamState, request: OpenRequest) -> bool:
    """Whether for each need as many robots have the action as it takes."""
    robots = [robot.robot for robot in team.robots.values()]
    kind = request.obstacle.type
    return all(
        sum(kind.actions(number) <= robot.capabilities for robot in robots) >= need.robots
        for number, need in enumerate(kind.needs)
    )


def _duties(team: TeamState, event: Unsettled, stopping: Stopping) -> Decision:
    """Algorithm 1, lines 9 to 16: the requester's objective becomes safe behaviour, a state of S_r
    is added to that of a robot with c_r; all of it follows from one plan for all requests."""
    settled = _settled(team, event.refused, stopping)
    floor, found = settled.floor, settled.found
    if found.proof is not None:
        end = nobody_goes_on(team, floor, found.proof, event.refused, team.lacks)
        return _unchanged(team, event, end=end)
    decision = _assigned(team, event, settled)
    requests, said = lines.stack(team, floor, found, decision.drafts, event.refused)
    return replace(decision, requests=requests, records=(*lines.acts(team, settled), *said))


def _settled(team: TeamState, refused: Collection[tuple[str, str]], stopping: Stopping) -> Settled:
    """Return the current duties. Raises SpentError."""
    floor = floor_of(team, refused)
    solver = Solver(floor.problem, stopping)
    order = [gate for gate, name in enumerate(floor.gates) if name not in team.requests.aside]
    dues = team.dues(floor)
    present, in_time = _present(team, floor), list[InTime]()

    def planning(served: frozenset[int]) -> Plan | None:
        if dues is None or not served:
            return None
        chosen = choose(solver, floor, served, dues)
        in_time.append(chosen)
        if not chosen.steps:
            return None
        poses, stages = after(floor, chosen.acts)
        rest = solver.plan(poses, stages, served, present)
        assert rest is not None, "the team can continue after each act"
        return (*chosen.steps, *rest)

    found = settle(solver, floor.poses, floor.stages, order, present, planning)
    if dues is not None and any(chosen.around for chosen in in_time):
        careful = {i: replace(d, around=dues.suspected[i]) for i, d in found.duties.items()}
        found = replace(found, duties=careful)
    return Settled(floor, solver, found, *in_time)


def _present(team: TeamState, floor: Floor) -> dict[int, tuple[int, ...]]:
    """Return the robots that already serve each obstacle."""
    found: dict[int, tuple[int, ...]] = {}
    for index, robot in enumerate(team.robots.values()):
        obstacle = robot.assignment.obstacle
        if obstacle in floor.gates:
            gate = floor.gates.index(obstacle)
            found[gate] = (*found.get(gate, ()), index)
    return found


def _assigned(
    team: TeamState, event: Event, settled: Settled, *, only: str | None = None
) -> Decision:
    """The tasks of all robots, or of one, and those for which a strategy must be found: where the
    one in force does not suffice, and always of ``only``."""
    idle = event.idle if isinstance(event, Unsettled) else ()
    drafts = Assigner(team, settled.floor, settled.found, idle).drafts()
    if only is not None:
        drafts = {only: drafts[only]}
    assigned = team.scenario.coordination is Coordination.ASSIGNABLE
    wanted = {
        name: own_objective(team.robots[name], draft) if assigned else draft
        for name, draft in drafts.items()
    }
    reason = getattr(event, "reason", Reason.INITIAL)
    if assigned and reason in (Reason.REQUEST, Reason.RESOLVED, Reason.GONE):
        reason = Reason.BLOCKED  # whatever gave the occasion, the known map has changed
    return replace(
        _unchanged(team, event),
        settled=settled,
        drafts=drafts,
        tasks={
            name: ladder(team, name, draft)
            for name, draft in wanted.items()
            if only is not None or outdated(team, name, draft)
        },
        reason=reason,
    )
