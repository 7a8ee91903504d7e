"""Goals that are assigned at runtime: where a robot can be sent, what it assumes of others."""

from __future__ import annotations

import pytest

from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Hold, Ltl, Objective, Visit
from safenav.spec.assignable import at_leisure, places
from safenav.spec.specification import Constraint, Origin, Section
from safenav.spec.task import Task
from safenav.world.map import RegionMap
from safenav.world.moves import Mobility, Pose

WORLD = RegionMap.from_grid(["#######", "#.....#", "#######"])  # regions 8 to 12


def task(objective: Objective) -> Task:
    model = RobotModel("rover", Mobility.FREE, "ground", frozenset())
    robot = Robot("rover", model, Pose(9), objective)
    return Task(robot, robot.start, objective, assignable=True)


@pytest.mark.parametrize(
    ("objective", "regions"),
    [
        pytest.param(Visit((frozenset({10}),)), {8, 9, 10, 11, 12}, id="everywhere"),
        pytest.param(Hold(frozenset({8})), {8, 9, 10, 11, 12}, id="holds"),
        pytest.param(
            Ltl(safety=("region' != 11",), liveness=("region = 8",)), {8, 9, 10}, id="a zone"
        ),
        pytest.param(
            Ltl(safety=("region = 10 -> region' != 9",), liveness=("region = 8",)),
            {8, 9},
            id="no way back to its goal",
        ),
        pytest.param(
            Ltl(safety=("region = 10 -> region' != 9",), liveness=("region = 12",)),
            {10, 11, 12},
            id="its goal beyond a step that is one-way",
        ),
    ],
)
def test_it_is_sent_only_where_it_can_come_back_from(
    objective: Objective, regions: set[int]
) -> None:
    assert places(task(objective), WORLD) == regions


@pytest.mark.parametrize(
    ("section", "formula", "joined"),
    [
        (Section.ENV_LIVENESS, "!busy_north'", "!wait' & (!busy_north')"),
        (Section.ENV_LIVENESS, "at_b >= 20", "!wait & (at_b >= 20)"),
        (Section.ENV_TRANS, "!busy_north'", "!busy_north'"),
    ],
)
def test_others_are_out_of_the_way_when_it_may_move(
    section: Section, formula: str, joined: str
) -> None:
    constraint = Constraint(section, formula, Origin("robots", "somewhere else"))
    assert at_leisure(constraint).formula == joined
