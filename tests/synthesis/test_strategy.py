"""Reading a strategy, looking at its nodes, and following it."""

import json
from typing import Any

import pytest

from safenav.errors import SynthesizerError
from safenav.spec.specification import Owner, Specification, Variable
from safenav.synthesis.strategy import Strategy, bit_names


@pytest.fixture
def strategy(patrol: Specification, patrol_json: bytes) -> Strategy:
    return Strategy.parse(patrol_json, patrol)


@pytest.mark.parametrize(
    ("bounds", "names"),
    [
        (None, ("x",)),
        ((4, 4), ()),
        ((0, 1), ("x@0.0.1",)),
        ((3, 5), ("x@0.3.5", "x@1")),
        ((0, 90), ("x@0.0.90", *(f"x@{i}" for i in range(1, 7)))),
        ((1, 8), ("x@0.1.8", "x@1", "x@2")),
        ((0, 8), ("x@0.0.8", "x@1", "x@2", "x@3")),
    ],
    ids=str,
)
def test_bits_are_named_as_in_the_specification_language(
    bounds: tuple[int, int] | None, names: tuple[str, ...]
) -> None:
    assert bit_names(Variable("x", Owner.INPUT, bounds)) == names


def test_bits_become_named_values(strategy: Strategy) -> None:
    values = [(strategy.values(n), rank) for n, rank in enumerate(strategy.ranks)]
    assert values[0] == ({"request": 0, "region": 3}, 0)
    assert values[1:3] == [({"request": r, "region": 4}, 0) for r in (0, 1)]
    assert values[3:5] == [({"request": r, "region": 5}, 0) for r in (0, 1)]
    assert values[7:9] == [({"request": r, "region": 3}, 1) for r in (0, 1)]


def test_size_is_told_without_decoding(strategy: Strategy) -> None:
    assert (len(strategy.states), strategy.edges) == (9, 18)


def test_a_variable_with_one_value_has_no_bits_but_a_value() -> None:
    spec = Specification("r", "r", (Variable("at", Owner.OUTPUT, (7, 7)),), ())
    data = b'{"variables": [], "nodes": {"0": {"rank": 0, "state": [], "trans": [0]}}}'
    strategy = Strategy.parse(data, spec)
    assert strategy.values(0) == {"at": 7}
    assert strategy.find_initial({"at": 7}) == 0
    assert strategy.find_initial({"at": 8}) is None


def test_only_the_leading_nodes_that_satisfy_the_initial_conditions_are_initial(
    strategy: Strategy,
) -> None:
    """Nodes 7 and 8 are at region 3 again, without being a start: their rank is 1."""
    assert strategy.initial() == (0,)
    assert strategy.find_initial({"region": 3}) == 0
    assert strategy.find_initial({"region": 3, "request": 0}) == 0
    assert strategy.find_initial({"region": 4}) is None
    assert strategy.find_initial({"region": 99}) is None


def test_following_the_strategy_visits_both_ends_whatever_is_requested(
    strategy: Strategy,
) -> None:
    node: int | None = 0
    seen = []
    for tick in range(12):
        assert node is not None
        node = strategy.step(node, {"request": tick * 7 % 3 == 0})
        assert node is not None
        seen.append(strategy.values(node)["region"])
        assert strategy.values(node)["request"] == (tick * 7 % 3 == 0)
    assert seen == [4, 5, 4, 3] * 3


def test_an_input_that_the_assumptions_exclude_has_no_successor(patrol_json: bytes) -> None:
    spec = Specification(
        "r",
        "r",
        (Variable("request", Owner.INPUT, None), Variable("region", Owner.OUTPUT, (3, 5))),
        (),
    )
    document = json.loads(patrol_json)
    document["nodes"]["0"]["trans"] = [1]
    strategy = Strategy.parse(json.dumps(document).encode(), spec)
    assert strategy.step(0, {"request": 1}) is None
    assert strategy.successors_for(0, {}) == (1,)
    assert strategy.successors_for(0, {"request": 7}) == ()


def test_stepping_by_something_that_is_no_input_is_a_mistake(strategy: Strategy) -> None:
    with pytest.raises(KeyError):
        strategy.step(0, {"region": 4})
    with pytest.raises(KeyError):
        strategy.find_initial({"nowhere": 4})


def _changed(data: bytes, *path: Any, value: Any) -> bytes:
    document = json.loads(data)
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return json.dumps(document).encode()


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        (("variables",), None, "not a list of names"),
        (("variables",), ["request", "region@0.3.5"], r"no variable 'region@1'"),
        (("variables",), ["request", "region@0.3.5", "region@1", "door"], "'door' is no"),
        (("variables",), ["request", "region@0.3.5", "region@1", "request"], "duplicate"),
        (("variables", 1), 4, "not a list of names"),
        (("nodes",), [], "not an object"),
        (("nodes", "12"), {}, "none is '9'"),
        (("nodes", "3"), 7, "lacks"),
        (("nodes", "3"), {"rank": 0, "state": [0, 0, 0]}, "lacks"),
        (("nodes", "3", "rank"), "0", "rank"),
        (("nodes", "3", "rank"), -1, "rank"),
        (("nodes", "3", "rank"), True, "rank"),
        (("nodes", "3", "state"), [0, 1], "node 3 has 2 bits"),
        (("nodes", "3", "state"), [0, 1, 2], "bits 0 and 1"),
        (("nodes", "3", "state"), [0, 1, 0.0], "bits 0 and 1"),
        (("nodes", "3", "state"), {}, "not a list"),
        (("nodes", "3", "trans"), 5, "not a list"),
        (("nodes", "3", "trans"), [9], "node 3 leads to a node that does not exist"),
        (("nodes", "3", "trans"), [-1], "node 3 leads to a node that does not exist"),
        (("nodes", "3", "trans"), ["5"], "node numbers"),
        (("nodes", "3", "trans"), [None], "node numbers"),
    ],
)
def test_a_malformed_strategy_is_refused_with_the_reason(
    patrol: Specification, patrol_json: bytes, path: tuple[Any, ...], value: Any, complaint: str
) -> None:
    with pytest.raises(SynthesizerError, match=complaint):
        Strategy.parse(_changed(patrol_json, *path, value=value), patrol)


@pytest.mark.parametrize("cut", [0, 1, 40, -1])
def test_truncated_json_is_refused(patrol: Specification, patrol_json: bytes, cut: int) -> None:
    with pytest.raises(SynthesizerError, match="not JSON"):
        Strategy.parse(patrol_json[:cut], patrol)


@pytest.mark.parametrize("data", [b"\xff\xfe{", b"[" * 100_000, b"[1]", b"null"])
def test_other_things_than_a_json_object_are_refused(patrol: Specification, data: bytes) -> None:
    with pytest.raises(SynthesizerError):
        Strategy.parse(data, patrol)
