"""Operators of runs: what they type, intervene at random, or see meanwhile; ``cases/operator``."""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from threading import Timer
from typing import Any

import pytest
from msgspec.structs import replace

import warm
from once import SCENARIOS
from runtime.facts import case
from runtime.played import begin, loaded, whole
from runtime.worlds import Remote
from safenav import Mission, Sensed, SimulatedWorld, UsageError, built_in, load_scenario

GATE = case("operator/gate")
NAMED = GATE.replace("]}\ncatalogue", "], names: {doorway: [2, 5]}}\ncatalogue")
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 50 or 3


def test_the_terminal_prints_the_reason_of_a_wait_and_of_refusals(tmp_path: Path) -> None:
    scenario, trace = tmp_path / "gate.yaml", tmp_path / "t.jsonl"
    scenario.write_text(whole(NAMED))
    told = {
        "open it": "unknown intervention 'open'",
        "push\x1b[31m it": "unknown intervention 'push'",
        "resolved gaet@doorway": "the team knows no obstacle 'gaet@doorway'; known: gate@doorway",
        "put_back cart [0, 0]": "'region': region 0 [0, 0] is a wall",
        "resolved gate@doorway": "",
    }
    typed = "\n".join(told)
    run = ("run", scenario, "--operator", "--no-map", "--trace", trace)
    done = warm.safenav(*run, text=f"{typed}\n\nmore than needed\n")
    assert done.returncode == 0, done.stderr
    assert "gate@doorway needs a robot with 'push'" in done.stdout
    assert all(words in done.stderr for words in told.values()), done.stderr
    assert "an operator intervenes: resolved gate@doorway" in done.stdout
    done = warm.safenav("certify", trace, "-o", tmp_path / "bundle")
    assert done.returncode == 0, done.stderr


def test_a_report_that_an_unrelated_obstacle_is_gone_does_not_end_a_wait() -> None:
    """A sensor that looks often would have it decided again as often."""
    scenario = loaded(GATE)
    world = Remote(scenario)
    mission, run = begin(scenario, world=world, attended=True)
    while mission.waiting is None or not mission.still:
        mission.step()
    elsewhere = replace(scenario.obstacles[0], region=23)
    mission.post(Sensed(world.now(), elsewhere, there=False))
    mission.step()
    assert len(run.all("waiting")) == 1 and not run.all("reopened")


def test_a_run_waits_for_an_operator_in_another_thread() -> None:
    def helps(record: Any) -> None:
        if record.type == "waiting":
            Timer(0.2, mission.intervene, ["resolved gate@27"]).start()

    mission = Mission(loaded(GATE), attended=True, listeners=[helps])
    assert mission.run().outcome == "completed"


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
