"""Negative verdicts of the coordination layer: why no robot can continue, in words and as data."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.coordination.snapshot import floor_of, poses_in
from safenav.runtime.coordination.strategy_search import TaskResult, failed
from safenav.runtime.duties import reasons
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.resolution.proofs import Refutation, TeamClosure, closure_of
from safenav.runtime.resolution.solve import PoseSets
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion
from safenav.scenario.model import ObstacleType
from safenav.scenario.objective import Ltl, Word
from safenav.scenario.objective_text import describe
from safenav.spec.task import Task
from safenav.trace import vocabulary
from safenav.trace.proofs import Choice, Closure, Option, Proof, Reach, Tree
from safenav.trace.words import MANY, counted, listed, obstacle_words, seconds_words, some

_TRAPPED = "every remaining option traps a robot needed elsewhere"


def closed(team: TeamState) -> tuple[Floor, TeamClosure]:
    """Return the obstacles that can ever be resolved, and the poses that each robot can then reach.
    Robots out of service may return."""
    floor = floor_of(team, hopeful=True)
    return floor, closure_of(PoseSets.around(floor.problem, floor.poses, floor.stages))


def enough(team: TeamState, kind: ObstacleType) -> bool:
    """Whether enough robots have the action of each need of an obstacle."""
    robots = [robot.robot for robot in team.robots.values()]
    return all(
        sum(kind.actions(number) <= robot.capabilities for robot in robots) >= need.robots
        for number, need in enumerate(kind.needs)
    )


def recorded(floor: Floor, refutation: Refutation) -> Proof:
    """A proof in the form of a trace (docs/trace.md)."""
    if isinstance(refutation, TeamClosure):
        return recorded_closure(floor, refutation)
    choices = []
    for refuted in refutation:
        step = refuted.step
        group = tuple(floor.names[i] for i in step.group)
        option = Option(floor.gates[step.gate], step.need, group, refuted.lossless)
        choices.append(Choice(option, recorded(floor, refuted.because)))
    return Tree(tuple(choices))


def recorded_closure(floor: Floor, closure: TeamClosure) -> Closure:
    """A closure table in the form of a trace."""
    graphs = [member.graph for member in floor.problem.members]
    there = zip(floor.names, graphs, closure.reach, closure.live, strict=True)
    return Closure(
        tuple(floor.gates[gate] for gate in closure.resolved),
        (*(floor.gates[gate] for gate in closure.never), *floor.given_up),
        {name: Reach(poses_in(graph, poses), live) for name, graph, poses, live in there},
    )


def infeasible_end(
    state: TeamState,
    floor: Floor,
    proof: Refutation,
    refused: Mapping[tuple[str, str], TaskResult],
    lacks: Mapping[str, reasons.Shortfall],
) -> Conclusion:
    """Return the end of a run in which, by the closure or after every choice, a robot cannot
    continue. ``lacks``: the shortfalls of obstacles that are never resolved."""
    word = state.scenario.map.word
    closure, sentences = _first_dead_end(floor, proof, word)
    stuck, missed = list[str](), [lacks[name] for name in state.knowledge.given_up()]
    if closure is not None:
        stuck = [name for name, live in zip(floor.names, closure.live, strict=True) if not live]
        sentences += [_why_stuck(state, name, chosen=closure is not proof) for name in stuck]
        missed += reasons.shortfalls(floor, closure, state.out_of_service, state.failures.barred)
    sentences += [reasons.shortfall_words(each, word) for each in missed]
    for name, obstacle in refused:
        sentences.append(f"{name} has no strategy for going to {obstacle_words(obstacle, word)}")
    known = missed and closure is proof
    cause = reasons.cause_of(missed).value if known else vocabulary.OperatorCause.UNREALIZABLE.value
    links = tuple(dict.fromkeys(sentences))
    return Conclusion(
        Outcome.OPERATOR_NEEDED,
        "; ".join(links),
        cause,
        recorded(floor, proof),
        links=links,
        stuck=tuple(stuck),
    )


def _first_dead_end(
    floor: Floor, proof: Refutation, word: Word
) -> tuple[TeamClosure | None, list[str]]:
    """Follow the first option of each choice: return the final closure (None: no option is left)
    and the reasons up to it."""
    sentences, lossless = list[str](), True  # whether all steps so far were
    while isinstance(proof, tuple):
        if not proof:
            without_room = reasons.without_room(floor, word) if lossless else []
            return None, sentences + (without_room or [_TRAPPED])
        first = proof[0]
        lossless = lossless and first.lossless
        if lossless:  # each robot still reaches all that it could reach
            step = first.step
            stages = floor.problem.advanced(step.gate, floor.stages, step.group)
            floor = replace(floor, stages=stages)
        else:
            sentences.append(_TRAPPED)
        proof = first.because
    return proof, sentences


def _why_stuck(state: TeamState, name: str, *, chosen: bool) -> str:
    """Why a robot cannot continue. ``chosen``: after an option that was chosen."""
    robot = state.robots[name]
    objective = robot.robot.objective
    if isinstance(objective, Ltl):
        return f"{name} cannot meet its formulas with what it can reach"
    if chosen:  # from its present pose it still could
        return f"{name} could no longer {describe(objective, state.scenario.map.word)} after that"
    around = state.knowledge.around(robot.pose.region, robot.robot)
    if around is not None and state.knowledge.is_left(around, robot.robot):
        words = describe(objective, state.scenario.map.word)
        what = obstacle_words(around.name, state.scenario.map.word)
        return f"{name} cannot {words}: it has entered {what} to resolve it, and can only go back"
    walls = state.knowledge.walls_for(robot.robot, state.knowledge.pending)
    return _why_not(
        state, name, Task(robot.robot, robot.next_pose, objective, robot.next_memory, walls)
    )


def unserved(end: Conclusion, refused: Mapping[tuple[str, str], TaskResult]) -> Conclusion:
    """The end of a run in which robots could reach an obstacle's resolution regions, but have no
    strategy for that: their syntheses are the proof."""
    specs = {name: result.result.spec_sha256 for (name, _), result in refused.items()}
    cause = vocabulary.OperatorCause.UNREALIZABLE.value
    return replace(end, cause=cause, proof=None, unrealizable=specs)


def no_strategy(
    state: TeamState, results: Mapping[str, TaskResult], outcome: Outcome
) -> Conclusion:
    """The end of a run in which a robot has no strategy: ``unrealizable`` before the start,
    otherwise ``operator_needed``."""
    sentences = {name: _why_not(state, name, results[name].task) for name in failed(results)}
    specs = {name: results[name].result.spec_sha256 for name in sentences}
    links, stuck = tuple(sentences.values()), tuple(specs)
    end = Conclusion(outcome, "; ".join(links), unrealizable=specs)
    if outcome is Outcome.UNREALIZABLE:
        return end
    return replace(end, cause="unrealizable", links=links, stuck=stuck)


def _why_not(state: TeamState, name: str, task: Task) -> str:
    # Imported here: most runs have nothing to explain.
    from safenav.explain.summary import explain_unrealizable

    return explain_unrealizable(state.robots[name].robot, task, state.scenario.map)


def spent(question: str) -> Conclusion:
    """The end of a run in which a search has used up its budget."""
    sentences = f"search budget exhausted while planning {question}; no verdict"
    return Conclusion(Outcome.SEARCH_LIMIT, sentences)


def where_out(team: TeamState, robot: RobotState) -> str:
    """Describe a robot out of service, the reason, and the robot whose target it occupies."""
    region = robot.pose.region
    blocked = [
        other.name
        for other in team.in_conflict(robot.robot)
        if other.active and any(target == {region} for target in other.own.objective.targets)
    ]
    sentences = [team.failures.out[robot.name]] if robot.name in team.failures.out else []
    if blocked:
        sentences.append(f"at {team.scenario.map.label(region)}, a target of {listed(blocked)}")
    return f"{robot.name} ({'; '.join(sentences)})" if sentences else robot.name


def what_is_left(team: TeamState) -> str:
    """Return the reasons why the run is not completed yet."""
    word, wanted = team.scenario.map.word, team.scenario.until.rounds
    behind: dict[int, list[str]] = {}
    for name, robot in team.robots.items():
        if robot.own.rounds < wanted:
            behind.setdefault(robot.own.rounds, []).append(name)
    left = [
        f"{listed(names) if len(names) <= MANY else f'{len(names)} robots'} "
        f"{'has' if len(names) == 1 else 'have'} completed {done} of {wanted} rounds"
        for done, names in behind.items()
    ]
    met = [n for n, r in team.robots.items() if r.own.rounds >= wanted and not team.stands(r)]
    if met:
        left.append(f"{some(met)} {'is' if len(met) == 1 else 'are'} not at the last target")
    away = [name for name, robot in team.robots.items() if robot.base is not None]
    left += [f"an input keeps {name} from its own objective" for name in away]
    left += [
        f"{listed(request.requesters)} "
        f"{'waits' if len(request.requesters) == 1 else 'wait'} for "
        f"{listed(request.helpers) if request.helpers else 'help'} to resolve "
        f"{obstacle_words(request.obstacle.name, word)}"
        if request.requesters
        else f"{obstacle_words(request.obstacle.name, word)} is still open"
        for request in team.requests
    ]
    after = counted(team.tick, "tick") if team.now is None else seconds_words(team.now())
    return f"not completed after {after}: {'; '.join(left)}"
