"""Reading a strategy: what is none is refused. Its nodes and how it is followed:
``test_verify_random``."""

import json
from typing import Any

import pytest
import yaml

from once import beside
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


def test_an_unknown_variable_is_an_error(strategy: Strategy) -> None:
    with pytest.raises(KeyError):
        strategy.find_initial({"nowhere": 4})


def _changed(data: bytes, *path: Any, value: Any) -> bytes:
    document = json.loads(data)
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return json.dumps(document).encode()


MALFORMED = yaml.safe_load(beside(__file__, "malformed.yaml"))


@pytest.mark.parametrize(("path", "value", "complaint"), MALFORMED)
def test_a_malformed_strategy_is_refused_with_the_reason(
    patrol: Specification, patrol_json: bytes, path: list[Any], value: Any, complaint: str
) -> None:
    with pytest.raises(SynthesizerError, match=complaint):
        Strategy.parse(_changed(patrol_json, *path, value=value), patrol)
