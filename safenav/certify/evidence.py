"""The proofs of a bundle: measures of strategies, and counterstrategies, under the scenario.

The demands are evaluated by the checker's own code: a proof need not be independent, because it is
checked.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from safenav.errors import NotCertifiedError, ResourceLimitError
from safenav.judge.bundle.evidence import proof_file
from safenav.judge.bundle.strategies import BundleTooLargeError, Met, RefusedError
from safenav.judge.bundle.tasks import Task
from safenav.judge.engine import judge
from safenav.judge.lines import Line, NotATraceError
from safenav.judge.rule import Rule
from safenav.judge.state import State
from safenav.lines import json_line
from safenav.verify.measures import Measure, NoMeasureError, measure

Counters = Callable[[str, str], Iterable[bytes]]
"""Yields the counterstrategies of a robot to a specification (its sha256), the best one first."""


def proofs_of(
    trace: bytes, strategies: Mapping[str, bytes], counters: Counters
) -> dict[str, bytes]:
    """Return the proofs of all ``synthesis`` lines of a trace, and their strategies, as files.

    A line without a proof gets no file, or a measure that does not fall: the checker reports why.
    Raises ResourceLimitError if a strategy is too large for it, NotCertifiedError for other data
    than a trace."""
    found: dict[str, bytes] = {}

    def prove(e: Line, s: State) -> Iterator[str]:
        name = proof_file(e)
        if name not in found:
            proof = _proof(e, s, strategies, counters)
            found.update({} if proof is None else {name: json_line(proof).encode()})
            if e.verdict == "realizable" and e.strategy in strategies and not s.rivals[e.robot]:
                found[f"strategies/{e.strategy}.json"] = strategies[e.strategy]
        return iter(())

    try:
        judge(trace.splitlines(keepends=True), [Rule("proofs", ("synthesis",), prove, "")])
    except BundleTooLargeError as error:
        raise ResourceLimitError(f"a strategy is too large to be certified: {error}") from error
    except NotATraceError as error:
        raise NotCertifiedError(str(error)) from error
    return found


def _proof(
    e: Line, s: State, strategies: Mapping[str, bytes], counters: Counters
) -> dict[str, Any] | None:
    try:
        if e.verdict == "realizable" and e.node is not None and not s.rivals[e.robot]:
            task = Task(json.loads(strategies[e.strategy]), e, s)
            return {"measures": _measures(task, task.graph.reach(task.begin(e.node)))}
        for automaton in counters(e.spec, e.robot) if e.verdict == "unrealizable" else ():
            try:
                return counter_proof(json.loads(automaton), e, s)
            except (NoMeasureError, LookupError):
                continue
    except (RefusedError, LookupError):  # the circumstances do not fit the strategy
        return None
    return None


def counter_proof(automaton: Any, e: Line, s: State) -> dict[str, Any]:
    """Return a counterstrategy with what the synthesizer omits: the environment's initial input and
    choices, and the measures that prove that it wins.

    Raises NoMeasureError if it does not, LookupError if the robot could answer each input."""
    task = Task(automaton, e, s)
    nodes = task.graph.reach(task.answered(task.opening))
    chosen: list[Any] = [None] * task.graph.count
    for node in nodes:
        targets = task.graph.next[node]
        chosen[node] = task.graph.inputs[targets[0]] if targets else _unanswered(task, node)
    measures = _measures(task, nodes, counter=True)
    about = {"start": task.opening, "chosen": [row or () for row in chosen]}
    return {"automaton": automaton, **about, "measures": measures}


def _measures(task: Task, nodes: Sequence[int], *, counter: bool = False) -> list[Measure]:
    """Return the measures for the edges of nodes. For a strategy a constant one stands for a
    measure that does not exist."""
    graph = task.graph
    edges = graph.edges(nodes)
    goals, assumed = task.met(edges)
    wanted: list[tuple[Met, list[Met]]] = [(met, assumed) for met in goals]
    if counter:
        wanted = [*((met, []) for met in assumed), ([False] * len(edges[0]), goals)]
    found = list[Measure]()
    for met, excuses in wanted:
        try:
            found.append(measure(graph.count, edges, met, excuses))
        except NoMeasureError:
            if counter:
                raise
            found.append({"n": [0] * graph.count, "a": [None] * graph.count})
    return found


def _unanswered(task: Task, node: int) -> Sequence[int]:
    """Return a next input to which the robot has no reply. Raises LookupError."""
    rows = sorted(task.expected(task.asked[node]))
    found = next((row for row in rows if not task.replies(node, row)), None)
    if found is None:
        raise LookupError("the robot has a successor for each input")
    return found
