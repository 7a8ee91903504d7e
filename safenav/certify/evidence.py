"""Evidence for a strategy or a counterstrategy: its measures and choices.

The formulas are evaluated by the checker's own code: evidence need not be independent, because it
is checked.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any

from safenav.audit.language import RefusedError, Row, TooLargeError
from safenav.audit.world import World
from safenav.certify.checker.check_strategies import Met, Strategy
from safenav.certify.checker.check_tasks import Task, circumstances
from safenav.errors import ResourceLimitError
from safenav.verify.measures import Measure, NoMeasureError, measure


def strategy_measures(text: str, strategy_json: bytes) -> list[Measure]:
    """Return a measure for each goal of a specification's text under its strategy.

    Raises NoMeasureError if the strategy starves a goal."""
    strategy = _read(strategy_json, text)
    return _measures(strategy, strategy, [*dict.fromkeys(strategy.first)])


def counter_evidence(text: str, strategy_json: bytes, replies: str | None = None) -> dict[str, Any]:
    """Return the evidence that the synthesizer's counterstrategy omits: the environment's initial
    input (``start``) and choices (``chosen``), and the ``measures`` that prove that it wins.
    ``replies``: a text that allows the robot more, and that the counterstrategy defeats, too.

    Raises NoMeasureError if it does not beat the robot, LookupError if no input begins it."""
    strategy = _read(strategy_json, text)
    wider = strategy if replies in (None, text) else _read(strategy_json, replies)
    nodes = [*dict.fromkeys(strategy.first)]
    measures = _measures(strategy, strategy, nodes, counter=True)
    chosen = [
        strategy.inputs[targets[0]] if targets else _unanswered_input(wider, node)
        for node, targets in enumerate(strategy.next)
    ]
    start = strategy.inputs[0] if strategy.count else _opening(strategy)
    return {"start": start, "chosen": chosen, "measures": measures}


class RulesEvidence:
    """Measures under the rules of the scenario itself, for ``synthesis`` lines of one run."""

    def __init__(self, header: Mapping[str, Any]) -> None:
        """``header``: the first line of the trace."""
        self._scenario = header["scenario"]
        self._world = World.of(self._scenario["map"], live=header.get("clock") == "live")

    def name(self, line: Mapping[str, Any]) -> str:
        """Return the file for a line; lines about the same circumstances share one."""
        return f"rules/{circumstances(line)}.json"

    def measures(
        self, line: Mapping[str, Any], text: str, strategy_json: bytes, counter: Any = None
    ) -> list[Measure] | None:
        """Return a measure for each goal of the robot; for a counterstrategy (``counter``: its
        evidence), one for each assumption and one that shows that a goal is missed forever from
        some point on.

        If a measure does not exist, a constant one takes its place and the checker reports the
        error. None if the circumstances do not fit the strategy.
        """
        strategy = _read(strategy_json, text)
        robot, cells = self._scenario["robots"][line["robot"]], self._scenario.get("partition")
        try:
            task = Task(self._world, robot, line, cells, strategy)
            if counter is None:
                begin = task.begin(line["node"])
            else:
                start = tuple(counter["start"])
                nodes = (node for node in strategy.begin if strategy.inputs[node] == start)
                begin = [node for node in nodes if task.done[node] in task.openings(start)]
            reached, proof = strategy.reach(begin), counter is not None
            return _measures(task, strategy, reached, counter=proof, lenient=True)
        except (RefusedError, LookupError):  # or the line lacks what the format leaves open
            return None


def _measures(
    rules: Any, graph: Strategy, nodes: list[int], *, counter: bool = False, lenient: bool = False
) -> list[Measure]:
    """Return the measures under some rules for the edges of nodes, each as if it led to the first
    of equivalent nodes. ``lenient``: a constant one stands for a measure that does not exist."""
    edges = graph.edges(nodes)
    ends = edges[0], [graph.first[target] for target in edges[1]]
    goals, assumed = rules.met(edges)
    wanted: list[tuple[Met, list[Met]]] = [(met, assumed) for met in goals]
    if counter:
        wanted = [*((met, []) for met in assumed), ([False] * len(edges[0]), goals)]
    found = list[Measure]()
    for met, excuses in wanted:
        try:
            found.append(measure(graph.count, ends, met, excuses))
        except NoMeasureError:
            if not lenient:
                raise
            found.append({"n": [0] * graph.count, "a": [None] * graph.count})
    return found


@lru_cache(maxsize=2)
def _read(strategy_json: bytes, text: str) -> Strategy:
    """Return a strategy as the checker reads it, cached for the next call.

    Raises ResourceLimitError if it is too large for the checker."""
    try:
        return Strategy(json.loads(strategy_json), text)
    except TooLargeError as error:
        raise ResourceLimitError(f"a strategy is too large to be certified: {error}") from error


def _unanswered_input(strategy: Strategy, node: int) -> Row:
    """Return a next input to which the robot has no reply."""
    rows = strategy.expected(strategy.asked[node])
    return _first(row for row in rows if not strategy.replies(node, row))


def _opening(strategy: Strategy) -> Row:
    """Return an initial input to which the robot has no reply."""
    return _first(row for row in strategy.starts() if not strategy.openings(row))


def _first(rows: Iterable[Row]) -> Row:
    for row in sorted(rows):
        return row
    raise LookupError("the robot has a successor for each input")
