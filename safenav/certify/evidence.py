"""The evidence that goes with a strategy or a counterstrategy: its measures and choices.

The formulas are evaluated by the checker's own code: evidence needs no second opinion, it is
checked.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from safenav.certify.checker.check import circumstances
from safenav.certify.checker.check_strategies import (
    RefusedError,
    Row,
    Specification,
    Strategy,
    Task,
    TooLargeError,
    World,
    complete,
    count_completions,
    primed,
    read_specification,
)
from safenav.certify.measures import Measure, NoMeasureError, measure
from safenav.errors import ResourceLimitError


@dataclass(frozen=True)
class CounterEvidence:
    """How the environment begins and goes on, and the measures that it wins."""

    start: list[int]
    chosen: list[list[int]]
    measures: list[dict[str, Any]]

    def to_data(self) -> dict[str, Any]:
        return {"start": self.start, "chosen": self.chosen, "measures": self.measures}


def strategy_measures(text: str, strategy_json: bytes) -> list[dict[str, Any]]:
    """A measure for each goal of a specification's text under its strategy.

    Raises NoMeasureError if the strategy starves a goal.
    """
    strategy = _read(strategy_json, text)
    spec = strategy.spec
    cases = strategy.edge_cases()
    fair = [cases.digits(c) for c in spec.sections["ENV_LIVENESS"]]
    return [
        measure(_edges(strategy), cases.digits(goal), fair).to_data()
        for goal in spec.sections["SYS_LIVENESS"]
    ]


def counter_evidence(text: str, strategy_json: bytes) -> CounterEvidence:
    """What a counterstrategy as the synthesizer prints it leaves unsaid.

    Raises NoMeasureError if it does not beat the robot, LookupError if no input begins it.
    """
    strategy = _read(strategy_json, text)
    spec = strategy.spec
    cases = strategy.edge_cases()
    fair = [cases.digits(c) for c in spec.sections["ENV_LIVENESS"]]
    goals = [cases.digits(c) for c in spec.sections["SYS_LIVENESS"]]
    edges = _edges(strategy)
    measures = [measure(edges, met, ()).to_data() for met in fair]
    measures.append(measure(edges, "0" * cases.count, goals).to_data())
    chosen = [
        list(strategy.inputs[targets[0]]) if targets else _killing(spec, strategy, node)
        for node, targets in enumerate(strategy.next)
    ]
    start = list(strategy.inputs[0]) if strategy.count else _opening(spec)
    return CounterEvidence(start, chosen, measures)


class RulesEvidence:
    """Measures under the rules of the scenario itself, for ``synthesis`` lines of one run."""

    def __init__(self, header: Mapping[str, Any]) -> None:
        """``header``: the first line of the trace."""
        self._scenario = header["scenario"]
        self._world = World(self._scenario["map"])

    def name(self, line: Mapping[str, Any]) -> str:
        """The file for a line; lines about the same circumstances share one."""
        return f"rules/{circumstances(line)}.json"

    def measures(
        self, line: Mapping[str, Any], text: str, strategy_json: bytes, counter: Any = None
    ) -> list[dict[str, Any]] | None:
        """A measure for each wish of the robot; with the evidence of a counterstrategy
        (``counter``) one for each assumption, and one that a wish is missed for ever.

        Where there is no measure, one that shows nothing; None where the strategy breaks another
        rule. The checker says what is wrong.
        """
        strategy = _read(strategy_json, text)
        robot, cells = self._scenario["robots"][line["robot"]], self._scenario.get("partition")
        try:
            task = Task(self._world, robot, line, cells, strategy)
            if counter is None:
                # What else the strategy has to keep is for the checker to see.
                _, wishes, assumed = task.explore(task.begins(line["node"]), lambda _: None)
                return [_measure(strategy, met, assumed) for met in wishes]
            there, wishes, assumed = task.explore_counterstrategy(counter)
        except RefusedError:
            return None
        found = [_measure(strategy, met, ()) for met in assumed]
        return [*found, _measure(strategy, there, wishes)]


def _measure(strategy: Strategy, met: str, excuses: Sequence[str]) -> dict[str, Any]:
    """A measure about the edges that runs take; the others have ``-`` for a digit."""
    try:
        return measure(_edges(strategy), met.replace("-", "1"), excuses).to_data()
    except NoMeasureError:
        return Measure([0] * strategy.count, [None] * strategy.count).to_data()


@lru_cache(maxsize=2)
def _edges(strategy: Strategy) -> list[list[int]]:
    """The edges that the checker looks at: of each node's twins only those of the first."""
    edges: list[list[int]] = [[] for _ in range(strategy.count)]
    for node in strategy.sources:
        edges[node] = [strategy.first[after] for after in strategy.next[node]]
    return edges


@lru_cache(maxsize=2)
def _read(strategy_json: bytes, text: str) -> Strategy:
    """A strategy as the checker reads it, kept for the next question about it.

    Raises ResourceLimitError if that is too much for the checker.
    """
    try:
        return Strategy(json.loads(strategy_json), read_specification(text))
    except TooLargeError as error:
        raise ResourceLimitError(f"a strategy is too large to be certified: {error}") from error


def _killing(spec: Specification, strategy: Strategy, node: int) -> list[int]:
    """A next input to which the robot has no answer."""
    keys, wanted = [*spec.variables], primed(spec.inputs)
    row = (*strategy.inputs[node], *strategy.outputs[node])
    found = complete(spec.variables, wanted, spec.sections["ENV_TRANS"], keys, [row])
    rows = [(*row, *values) for _, values in found]
    after, limits = primed(spec.outputs), spec.sections["SYS_TRANS"]
    counts = count_completions(spec.variables, after, limits, [*keys, *wanted], rows)
    return _without_answer(rows, counts, len(keys))


def _opening(spec: Specification) -> list[int]:
    """An initial input to which the robot has no answer."""
    inputs, outputs = [*spec.inputs], [*spec.outputs]
    rows = [v for _, v in complete(spec.variables, inputs, spec.sections["ENV_INIT"], (), [()])]
    counts = count_completions(spec.variables, outputs, spec.sections["SYS_INIT"], inputs, rows)
    return _without_answer(rows, counts, 0)


def _without_answer(rows: list[Row], counts: list[int], skip: int) -> list[int]:
    for row, count in zip(rows, counts, strict=True):
        if not count:
            return list(row[skip:])
    raise LookupError("the robot has an answer to each input")
