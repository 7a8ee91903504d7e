"""Interventions at random; the others are ``cases/operator`` and ``cases/service``."""

import os
from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Any

import pytest

from once import SCENARIOS
from runtime.played import begin
from safenav import Mission, built_in, load_scenario
from safenav.errors import UsageError
from safenav.runtime.interventions import read_intervention
from safenav.runtime.worlds.simulation import SimulatedWorld


def test_a_robot_with_a_battery_refuses_an_objective_without_an_order_of_targets() -> None:
    """It would forget at each charge which targets it has met."""
    scenario = load_scenario(SCENARIOS / "battery_delivery.yaml")
    (robot, *_) = (each.name for each in scenario.robots if each.model.battery)
    with pytest.raises(UsageError, match="without an order of its targets"):
        read_intervention(f"objective {robot} {{cover: {[*scenario.map.free[:2]]}}}", scenario)


FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 50 or 3


def whatever(mission: Mission, world: SimulatedWorld, chance: Random) -> str | dict[str, Any]:
    """A change of a running world, possible or not."""
    kind = chance.choice(list(built_in().obstacles))
    one, other = chance.sample(sorted(mission.scenario.map.free), 2)
    there = [obstacle.name for obstacle in world.standing().values()] or ["door@1"]
    robot, obstacle = chance.choice(mission.scenario.robots).name, chance.choice(there)
    truth = chance.random() < 0.5
    objective = chance.choice(
        [f"hold: {one}", f"visit: [[{one}, {other}]]", f"visit: {[one, other]}"]
    )
    new = {"kind": "close", "type": kind, "region": one, "truth": truth}
    return chance.choice(
        [
            {"kind": "open", "obstacle": obstacle},
            {"kind": "truth", "obstacle": obstacle, "traversable": truth},
            *(new, new),
            f"objective {robot} {{{objective}}}",
            f"service {robot} {'back' if chance.random() < 0.6 else 'out'}",
        ]
    )


@pytest.mark.parametrize("seed", range(FIRST, FIRST + SEQUENCES))
@pytest.mark.parametrize("name", ["case_study_1", "case_study_3", "two_digits"])
def test_a_run_that_is_changed_at_random_is_sound(
    name: str, seed: int, played: Callable[[], None]
) -> None:
    chance = Random(f"{name}/{seed}")
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    world = SimulatedWorld(scenario)
    mission, run = begin(scenario, world=world)
    while mission.result is None and mission.tick < 60:
        for _ in range(chance.choice((0, 0, 0, 0, 1, 2))):
            with suppress(UsageError):
                mission.intervene(whatever(mission, world, chance))
                played()
        mission.step()
    mission.give_up()
    assert not run.findings, run.findings
