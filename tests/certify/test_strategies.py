"""Strategies as graphs, and progress measures, as the checker of bundles reads them."""

from typing import Any

import pytest

from safenav.components import components
from safenav.judge.bundle import strategies as checker
from safenav.verify.automaton import NoMeasureError, measure

FALLS = "the measure does not decrease from node"
UNKNOWN = "a negative value or names an unknown assumption"


@pytest.mark.parametrize(
    ("numbers", "excuses", "told"),
    [
        ([1, 0, 0], [None, 0, 0], None),
        ([9, 7, 7], [1, 0, 0], None),
        ([0, 0, 0], [0, 0, 0], None),
        ([0, 0, 0], [None, 0, 0], f"{FALLS} 0 to node 1"),
        ([1, 2, 2], [None, 0, 0], f"{FALLS} 0 to node 1"),
        ([9, 1, 0], [None, 0, 0], f"{FALLS} 2 to node 1"),
        ([1, 0, 0], [None, 0, None], f"{FALLS} 1 to node 2"),
        ([1, 0, 0], [None, 1, 1], f"{FALLS} 1 to node 2"),
        ([0, -1, -1], [None, 0, 0], UNKNOWN),
        ([0.5, 0, 0], [None, 0, 0], UNKNOWN),
        ([1, 0, 0], [None, 2, 2], UNKNOWN),
        ([1, 0], [None, 0], "list index out of range"),
    ],
)
def test_any_progress_measure_that_decreases_or_has_a_violated_assumption_is_a_proof(
    numbers: list[int], excuses: list[int | None], told: str | None
) -> None:
    """The robot arrives (node 0) unless the input keeps it (nodes 1 and 2 in turn); one assumption
    is that the input is off again and again, the other that it is on."""
    edges = [0, 0, 1, 1, 2, 2], [0, 1, 0, 2, 0, 1]
    arrives = [target == 0 for target in edges[1]]
    assumed = [arrives, [not there for there in arrives]]
    given: Any = edges, "goal 0", arrives, assumed, {"n": numbers, "a": excuses}
    if told is None:
        checker.check_measure(*given)
        return
    with pytest.raises((checker.RefusedError, LookupError), match=told):
        checker.check_measure(*given)


def document(variables: list[str], states: list[list[int]], after: list[list[int]]) -> Any:
    each = enumerate(zip(states, after, strict=True))
    nodes = {str(k): {"state": state, "trans": trans} for k, (state, trans) in each}
    return {"variables": variables, "nodes": nodes}


def test_a_strategy_of_many_edges_is_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    given = document(["y", "x"], [[0, 0], [1, 0], [0, 1]], [[1, 2], [1, 2], [0]])
    graph = checker.Strategy(given, ["y"])
    assert (graph.reach([1]), graph.edges([0, 2])) == ([0, 1, 2], ([0, 0, 2], [1, 2, 0]))
    monkeypatch.setattr(checker, "MOST_EDGES", 4)
    with pytest.raises(checker.BundleTooLargeError, match="5 edges"):
        checker.Strategy(given, ["y"])


def test_the_bits_of_a_number_have_its_range_in_their_names() -> None:
    graph = checker.Strategy(document(["n@0.5.7", "n@1"], [[0, 0], [0, 1]], [[], []]), [])
    assert graph.columns == {"n": [5, 7]}


@pytest.mark.parametrize(
    ("variables", "told"),
    [
        (["x", "x"], "not the next one"),
        (["n@0.0.3", "n@2"], "not the next one"),
        (["n@1", "n@0.0.3"], "not the next one"),
        (["n@0", "n@1"], "not a bit of a variable"),
        (["n@0.0.3", "n@1.0.3"], "not a bit of a variable"),
        (["n@0.0.2", "n@1"], "out of its range"),
        (["lambda x", "x"], "not a bit of a variable"),
        (["\uff58", "x"], "not a bit of a variable"),  # to Python the same name as x
        (["x"], "does not hold 1 bits"),
    ],
)
def test_bits_that_are_not_understood_are_refused(variables: list[str], told: str) -> None:
    with pytest.raises(checker.RefusedError, match=told):
        checker.Strategy(document(variables, [[1, 1]], [[0]]), [])


@pytest.mark.parametrize(("state", "trans"), [([2], [0]), ([1], [1]), ([1], [-1])])
def test_nodes_that_lead_nowhere_are_refused(state: list[int], trans: list[int]) -> None:
    with pytest.raises(checker.RefusedError, match="or leads nowhere"):
        checker.Strategy(document(["x"], [state], [trans]), [])


def test_components_follow_their_successors() -> None:
    assert components([[1], [2], [1, 3], []]) == [[3], [2, 1], [0]]


def test_a_cycle_that_meets_every_assumption_and_no_goal_has_no_measure() -> None:
    edges, never = ([0, 1], [1, 0]), [False, False]
    assert measure(2, edges, never, [[True, False], never])["a"] == [1, 1]
    with pytest.raises(NoMeasureError):
        measure(2, edges, never, [[True, False], [False, True]])
