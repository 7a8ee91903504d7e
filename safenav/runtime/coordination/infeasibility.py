"""Negative verdicts of the coordination layer: why no robot can continue, in words and as data."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.coordination.snapshot import poses_in
from safenav.runtime.coordination.strategy_search import TaskResult, failed
from safenav.runtime.duties import reasons
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.resolution.proofs import Refutation, TeamClosure
from safenav.runtime.team import TeamState
from safenav.runtime.termination import Conclusion
from safenav.scenario.objective import Ltl, describe
from safenav.spec.task import Task
from safenav.trace import vocabulary
from safenav.trace.proofs import Choice, Closure, Option, Proof, Reach, Tree
from safenav.trace.words import obstacle_words

_TRAPPED = "every remaining option traps a robot needed elsewhere"


def recorded(floor: Floor, refutation: Refutation) -> Proof:
    """A proof as it stands in a trace (docs/trace.md)."""
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
    """A closure table as it stands in a trace."""
    graphs = [member.graph for member in floor.problem.members]
    there = zip(floor.names, graphs, closure.reach, closure.live, strict=True)
    return Closure(
        tuple(floor.gates[gate] for gate in closure.resolved),
        (*(floor.gates[gate] for gate in closure.never), *floor.given_up),
        {name: Reach(poses_in(graph, poses), live) for name, graph, poses, live in there},
    )


def nobody_goes_on(
    state: TeamState,
    floor: Floor,
    proof: Refutation,
    refused: Mapping[tuple[str, str], TaskResult],
    lacks: Mapping[str, reasons.Shortfall],
) -> Conclusion:
    """Return the end of a run in which the closure, or every choice, leaves a robot stuck.
    ``lacks``: the shortfalls of obstacles that are never resolved."""
    word = state.scenario.map.word
    said = []
    closure, after = proof, floor
    lossless = True  # so far
    while isinstance(closure, tuple):
        if not closure:
            said += (reasons.without_room(after, word) if lossless else []) or [_TRAPPED]
            break
        first = closure[0]
        lossless = lossless and first.lossless
        if lossless:  # from where it is, each robot still reaches what it could reach
            step = first.step
            stages = floor.problem.advanced(step.gate, after.stages, step.group)
            after = replace(after, stages=stages)
        else:
            said.append(_TRAPPED)
        closure = first.because
    stuck: list[str] = []
    if isinstance(closure, TeamClosure):
        stuck = [name for name, live in zip(floor.names, closure.live, strict=True) if not live]
    for name in stuck:
        robot = state.robots[name]
        if closure is not proof and not isinstance(robot.robot.objective, Ltl):
            objective = describe(robot.robot.objective, word)  # from where it is, it still could
            said.append(f"{name} could no longer {objective} after that")
            continue
        task = Task(
            robot.robot,
            robot.next_pose,
            robot.robot.objective,
            robot.memory,
            state.knowledge.walls_for(robot.robot, state.knowledge.pending),
        )
        if isinstance(robot.robot.objective, Ltl):
            said.append(f"{name} cannot meet its formulas with what it can reach")
        else:
            said.append(_why_not(state, name, task))
    out = [name for name, robot in state.robots.items() if not robot.active]
    vain = state.failures.barred
    open_ = (
        reasons.shortfalls(floor, closure, out, vain) if isinstance(closure, TeamClosure) else ()
    )
    missed = [*(lacks[name] for name in state.knowledge.given_up()), *open_]
    said += [reasons.shortfall_words(each, word) for each in missed]
    for name, obstacle in refused:
        said.append(f"{name} has no strategy for going to {obstacle_words(obstacle, word)}")
    known = missed and isinstance(proof, TeamClosure)
    cause = reasons.cause_of(missed).value if known else vocabulary.OperatorCause.UNREALIZABLE.value
    links = tuple(dict.fromkeys(said))
    return Conclusion(
        Outcome.OPERATOR_NEEDED,
        "; ".join(links),
        cause,
        recorded(floor, proof),
        links=links,
        stuck=tuple(stuck),
    )


def unserved(end: Conclusion, refused: Mapping[tuple[str, str], TaskResult]) -> Conclusion:
    """The end of a run in which robots could get to where an obstacle is resolved, but have no
    strategy for that: their syntheses are its proof."""
    specs = {name: result.result.spec_sha256 for (name, _), result in refused.items()}
    cause = vocabulary.OperatorCause.UNREALIZABLE.value
    return replace(end, cause=cause, proof=None, unrealizable=specs)


def no_strategy(
    state: TeamState, results: Mapping[str, TaskResult], outcome: Outcome
) -> Conclusion:
    """The end of a run in which a robot has no strategy: ``unrealizable`` before the start, else
    ``operator_needed``, whichever robot helps."""
    said = {name: _why_not(state, name, results[name].task) for name in failed(results)}
    specs = {name: results[name].result.spec_sha256 for name in said}
    links, stuck = tuple(said.values()), tuple(specs)
    if outcome is Outcome.UNREALIZABLE:
        return Conclusion(outcome, "; ".join(links), unrealizable=specs)
    cause = "unrealizable"
    return Conclusion(
        outcome, "; ".join(links), cause, unrealizable=specs, links=links, stuck=stuck
    )


def _why_not(state: TeamState, name: str, task: Task) -> str:
    # Imported where it is needed: most runs have nothing to explain.
    from safenav.explain.summary import explain_unrealizable

    return explain_unrealizable(state.robots[name].robot, task, state.scenario.map)


def spent(question: str) -> Conclusion:
    """The end of a run in which a search has used up its budget."""
    said = f"search budget exhausted while planning {question}; no verdict"
    return Conclusion(Outcome.SEARCH_LIMIT, said)
