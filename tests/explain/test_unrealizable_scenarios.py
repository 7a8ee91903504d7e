"""Every shipped unrealizable scenario: the cause is found, and each proposed repair works. Cores
and plays of random ones: ``sentences``."""

from functools import cache
from pathlib import Path

import pytest

from safenav.errors import InputError
from safenav.explain.explanation import (
    Explanation,
    NoStrategyCause,
    RepairKind,
)
from safenav.review.team import explain_team
from safenav.runtime.run.mission import Mission, default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure

FOLDER = Path(__file__).parents[2] / "scenarios" / "unrealizable"
FILES = sorted(FOLDER.glob("*.yaml"))

CAUSES = {
    "contradictory_objective": ("rover", NoStrategyCause.CONTRADICTION, RepairKind.OBJECTIVE),
    "crossing_a_target": ("rover", NoStrategyCause.CROSSING, RepairKind.OBJECTIVE),
    "dead_end": ("digit", NoStrategyCause.ONE_WAY, RepairKind.MOBILITY),
    "facing_the_wall": ("digit", NoStrategyCause.HEADING, RepairKind.HEADING),
    "forbidden_way": ("rover", NoStrategyCause.FORBIDDEN_WAY, RepairKind.OBJECTIVE),
    "impossible_start": ("rover", NoStrategyCause.IMPOSSIBLE_START, RepairKind.START),
    "no_room_to_turn": ("digit", NoStrategyCause.ONE_WAY, RepairKind.MOBILITY),
    "separate_rooms": ("digit", NoStrategyCause.NO_WAY, RepairKind.OPEN_WALL),
}
"""What each file must be explained by: the robot, the true cause, and a repair that works."""

shipped = pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)


@cache
def _scenario(file: Path) -> Scenario:
    return load_scenario(file, reachable=False)


@cache
def _explained(file: Path) -> Explanation:
    scenario = _scenario(file)
    (found,) = explain_team(scenario, default_synthesizer(scenario))
    return found


def test_every_shipped_file_has_an_expected_cause() -> None:
    assert {file.stem for file in FILES} == set(CAUSES)
    assert len({cause for _, cause, _ in CAUSES.values()}) >= 7


@shipped
def test_the_expected_cause_is_named(file: Path) -> None:
    robot, cause, _ = CAUSES[file.stem]
    found = _explained(file)
    assert (found.robot, found.cause) == (robot, cause)


@shipped
def test_every_repair_makes_it_realizable(file: Path) -> None:
    robot, _, kind = CAUSES[file.stem]
    found = _explained(file)
    assert kind in {repair.kind for repair in found.repairs}
    for repair in found.repairs:
        answers = first_results(repair.scenario, Synthesizer(verifier=first_failure), names=[robot])
        assert answers[robot].realizable, repair.change


def test_the_core_of_separate_rooms_names_the_walls_between_them() -> None:
    found = _explained(FOLDER / "separate_rooms.yaml")
    assert {21, 34, 47, 60, 73} <= set(found.core.walls)
    assert len(found.core.walls) == 7
    assert [sorted(target) for target in found.diagnosis.lost] == [[49]]
    assert found.core.alone


def test_a_robot_that_can_open_the_wall_opens_it_in_a_run() -> None:
    found = _explained(FOLDER / "separate_rooms.yaml")
    repair = found.repairs[0]
    assert (repair.kind, repair.action, repair.helpers) == (
        RepairKind.OPEN_WALL,
        "push",
        ("digit",),
    )
    assert Mission(repair.scenario).run().outcome.value == "completed"


def test_shipped_cores_do_not_depend_on_other_robots() -> None:
    assert all(_explained(file).core.alone for file in FILES)


@shipped
def test_without_permission_unreachable_targets_are_not_a_valid_scenario(file: Path) -> None:
    found = _explained(file)
    lost = bool(found.diagnosis.lost) or found.cause is NoStrategyCause.ONE_WAY
    if not lost or found.cause is NoStrategyCause.CROSSING:
        assert load_scenario(file) == _scenario(file)
        return
    with pytest.raises(InputError):
        load_scenario(file)
