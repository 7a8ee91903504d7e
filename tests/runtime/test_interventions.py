"""Whatever somebody does to the world of a run, the run stays sound and its trace says so."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from safenav import Mission, TraceWriter, built_in, load_scenario
from safenav.audit.check import audit
from safenav.errors import UsageError
from safenav.report.replay.reading import replay_of
from safenav.runtime.interventions import Close, Give, Intervention, Serve, SetTruth, TakeAway
from safenav.runtime.world import SimulatedWorld
from safenav.scenario.objective import Hold, Visit
from safenav.trace.reading import read_trace

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SEEDS = range(int(os.environ.get("SAFENAV_FUZZ", "0")) // 50 or 3)
LAST = 60


def something(mission: Mission, world: SimulatedWorld, chance: random.Random) -> Intervention:
    """A change, sensible or not."""
    free = sorted(mission.scenario.map.free)
    names = [obstacle.name for obstacle in world.standing().values()] or ["door@1"]
    robot = chance.choice(mission.scenario.robots).name
    one, other = (frozenset({region}) for region in chance.sample(free, 2))
    match chance.randrange(6):
        case 0 | 1:
            kind = chance.choice([*built_in().obstacles.values()])
            truth = chance.random() < 0.5 if kind.has_truth else None
            return Close(kind, chance.choice(free), truth)
        case 2:
            return TakeAway(chance.choice(names))
        case 3:
            return SetTruth(chance.choice(names), chance.random() < 0.5)
        case 4:
            return Give(robot, Visit((one, other)) if chance.random() < 0.7 else Hold(one))
        case _:
            return Serve(robot, chance.random() < 0.6)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", ["case_study_1", "case_study_3", "two_digits"])
def test_random_changes_leave_a_sound_trace(name: str, seed: int, tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    world, chance = SimulatedWorld(scenario), random.Random(f"{name}/{seed}")
    file = tmp_path / "run.jsonl"
    with TraceWriter(file) as writer:
        mission = Mission(scenario, world=world, listeners=[writer])
        mission.start()
        while mission.result is None:
            for _ in range(chance.choice([0, 0, 0, 1, 2])):
                try:
                    mission.intervene(something(mission, world, chance))
                except UsageError as refused:
                    assert str(refused)
            mission.step()
            if mission.state.tick >= LAST:
                mission.give_up()
    trace = read_trace(file)
    assert audit(trace).findings == ()
    assert replay_of(trace).ending is not None


def test_a_robot_out_of_service_stands_still_and_goes_on_later(tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    file = tmp_path / "run.jsonl"
    with TraceWriter(file) as writer:
        mission = Mission(scenario, listeners=[writer])
        mission.start()
        mission.step()
        mission.intervene(Serve("quad", False))
        here = mission.state.robots["quad"].pose
        for _ in range(5):
            mission.step()
            assert mission.state.robots["quad"].pose == here
        mission.intervene(Serve("quad", True))
        while mission.result is None:
            mission.step()
    assert mission.result.outcome == "completed"
    assert audit(read_trace(file)).findings == ()


def test_another_objective_is_met_instead_of_the_old_one() -> None:
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    mission = Mission(scenario)
    mission.start()
    mission.step()
    mission.intervene(Give("digit", Hold(frozenset({72}))))
    while mission.result is None:
        mission.step()
    assert mission.result.outcome == "completed"
    assert mission.state.robots["digit"].pose.region == 72
