"""Pools of processes: scenarios, results and errors are the same in each."""

import pickle

import pytest

from runtime.played import loaded
from safenav import Mission
from safenav.errors import Diagnostic, InputError
from safenav.formula.parser import FormulaError
from safenav.scenario.model import Scenario

ONE = """
map: {grid: ["#####", "#...#", "#####"]}
robots: {drone: {model: quadcopter, start: [1, 1], objective: {patrol: [[1, 1], [1, 3]]}}}
"""


def plan() -> Scenario:
    return loaded(ONE)


@pytest.mark.parametrize(
    "error",
    [
        InputError(
            [Diagnostic("a.yaml", 3, 1, "unknown key", "did you mean"), Diagnostic("", 0, 0, "b")]
        ),
        FormulaError(4, "a number", "write a formula"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_pickled_errors_keep_their_messages(error: Exception) -> None:
    copy = pickle.loads(pickle.dumps(error))
    assert (type(copy), str(copy), vars(copy)) == (type(error), str(error), vars(error))


def test_pickled_scenarios_and_results_are_equal() -> None:
    scenario = plan()
    result = Mission(scenario).run()
    assert pickle.loads(pickle.dumps((scenario, result))) == (scenario, result)


def test_pickling_a_mission_names_the_alternative() -> None:
    with pytest.raises(TypeError, match="pickle its scenario or its result"):
        pickle.dumps(Mission(plan()))
