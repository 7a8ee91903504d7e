"""Evidence for a strategy or a counterstrategy: its measures and choices.

The formulas are evaluated by the checker's own code: evidence need not be independent, because it
is checked.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from safenav.audit.language import RefusedError, Row, TooLargeError
from safenav.audit.world import World
from safenav.certify.checker.check_strategies import Edges, Met, Strategy
from safenav.certify.checker.check_tasks import Task, circumstances
from safenav.certify.measures import Measure, NoMeasureError, measure
from safenav.errors import ResourceLimitError


def strategy_measures(text: str, strategy_json: bytes) -> list[Measure]:
    """Return a measure for each goal of a specification's text under its strategy.

    Raises NoMeasureError if the strategy starves a goal."""
    strategy = _read(strategy_json, text)
    edges = strategy.edges([*dict.fromkeys(strategy.first)])
    goals, fair = strategy.met(edges)
    return [_measure(strategy, edges, met, fair) for met in goals]


def counter_evidence(text: str, strategy_json: bytes, replies: str | None = None) -> dict[str, Any]:
    """Return the evidence that the synthesizer's counterstrategy omits: the environment's initial
    input (``start``) and choices (``chosen``), and the ``measures`` that prove that it wins.
    ``replies``: a text that allows the robot more, and that the counterstrategy defeats, too.

    Raises NoMeasureError if it does not beat the robot, LookupError if no input begins it."""
    strategy = _read(strategy_json, text)
    wider = strategy if replies in (None, text) else _read(strategy_json, replies)
    edges = strategy.edges([*dict.fromkeys(strategy.first)])
    goals, fair = strategy.met(edges)
    never = [False] * len(edges[0])
    measures = [_measure(strategy, edges, met, ()) for met in fair]
    measures.append(_measure(strategy, edges, never, goals))
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
            edges = strategy.edges(strategy.reach(begin))
            wishes, assumed = task.met(edges)
        except (RefusedError, LookupError):  # or the line lacks what the format leaves open
            return None
        if counter is None:
            return [_best(strategy, edges, met, assumed) for met in wishes]
        found = [_best(strategy, edges, met, ()) for met in assumed]
        return [*found, _best(strategy, edges, [False] * len(edges[0]), wishes)]


def _measure(strategy: Strategy, edges: Edges, met: Met, excuses: Sequence[Met]) -> Measure:
    """Return a measure for these edges, each as if it led to the first of equivalent nodes."""
    targets = [strategy.first[target] for target in edges[1]]
    return measure(strategy.count, (edges[0], targets), met, excuses)


def _best(strategy: Strategy, edges: Edges, met: Met, excuses: Sequence[Met]) -> Measure:
    try:
        return _measure(strategy, edges, met, excuses)
    except NoMeasureError:
        return {"n": [0] * strategy.count, "a": [None] * strategy.count}


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
