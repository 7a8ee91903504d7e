"""Reading a strategy: what is none is refused. Its nodes and how it is followed:
``test_verify_random``."""

import json
from typing import Any

import pytest

from safenav.errors import SynthesizerError
from safenav.spec.specification import Owner, Specification, Variable
from safenav.synthesis.strategy import Strategy


@pytest.fixture
def strategy(patrol: Specification, patrol_json: bytes) -> Strategy:
    return Strategy.parse(patrol_json, patrol)


def test_a_variable_with_one_value_has_no_bits_but_a_value() -> None:
    spec = Specification("r", "r", (Variable("at", Owner.OUTPUT, (7, 7)),), ())
    data = b'{"variables": [], "nodes": {"0": {"rank": 0, "state": [], "trans": [0]}}}'
    strategy = Strategy.parse(data, spec)
    assert strategy.values(0) == {"at": 7}
    assert strategy.find_initial({"at": 7}) == 0
    assert strategy.find_initial({"at": 8}) is None


def test_stepping_by_something_that_is_no_input_is_a_mistake(strategy: Strategy) -> None:
    with pytest.raises(KeyError):
        strategy.successors_for(0, {"region": 4})
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
        (("variables",), None, "Expected `array`.*variables"),
        (("variables",), ["request", "region@0.3.5"], r"no variable 'region@1'"),
        (("variables",), ["request", "region@0.3.5", "region@1", "door"], "'door' is no"),
        (("variables",), ["request", "region@0.3.5", "region@1", "request"], "duplicate"),
        (("variables", 1), 4, "Expected `str`.*variables"),
        (("nodes",), [], "Expected `object`.*nodes"),
        (("nodes", "12"), {"rank": 0, "state": [0, 0, 0], "trans": [0]}, "none is '9'"),
        (("nodes", "3"), 7, "Expected `object`"),
        (("nodes", "3"), {"rank": 0, "state": [0, 0, 0]}, "missing.*trans"),
        (("nodes", "3", "rank"), "0", "rank"),
        (("nodes", "3", "rank"), -1, "rank"),
        (("nodes", "3", "rank"), True, "rank"),
        (("nodes", "3", "state"), [0, 1], "node 3 has 2 bits"),
        (("nodes", "3", "state"), [0, 1, 2], "bits 0 and 1"),
        (("nodes", "3", "state"), [0, 1, 0.0], "Expected `int`.*state"),
        (("nodes", "3", "state"), {}, "Expected `array`.*state"),
        (("nodes", "3", "trans"), 5, "Expected `array`.*trans"),
        (("nodes", "3", "trans"), [9], "node 3 leads to a node that does not exist"),
        (("nodes", "3", "trans"), [-1], "node 3 leads to a node that does not exist"),
        (("nodes", "3", "trans"), ["5"], "Expected `int`.*trans"),
        (("nodes", "3", "trans"), [None], "Expected `int`.*trans"),
    ],
)
def test_a_malformed_strategy_is_refused_with_the_reason(
    patrol: Specification, patrol_json: bytes, path: tuple[Any, ...], value: Any, complaint: str
) -> None:
    with pytest.raises(SynthesizerError, match=complaint):
        Strategy.parse(_changed(patrol_json, *path, value=value), patrol)
