"""An operator in a live run: the run waits, proposes repairs, and continues after interventions."""

from itertools import pairwise
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from msgspec.structs import replace

import warm
from runtime.facts import case
from runtime.played import Run, begin, end, loaded, whole
from runtime.worlds import Clocked, Remote
from safenav.errors import Outcome, UsageError
from safenav.runtime.interventions import read_intervention
from safenav.runtime.run.mission import Mission
from safenav.runtime.worlds.protocol import Sensed
from safenav.scenario.model import Obstacle, Robot
from safenav.synthesis.slugs import SynthesisResult, Synthesizer
from safenav.team.apply import rounds

GATE = case("operator/gate")
NAMED = GATE.replace("]}\ncatalogue", "], names: {doorway: [2, 5]}}\ncatalogue")


def test_a_request_given_up_and_resolved_is_not_reopened_when_its_obstacle_is_back() -> None:
    """The cart met the gate the first time, the bee the second time: the cart waits for nothing."""
    east = GATE.replace("air", "ground").replace("[[2, 8], [2, 1]]", "[[2, 8], [3, 8]]")
    mission, run = begin(east, attended=True)
    while not (mission.waiting is not None and mission.still):
        mission.step()
    mission.intervene("resolved gate@27")
    while not run.all("goal", robot="bee"):
        mission.step()
    mission.intervene({"kind": "close", "type": "gate", "region": 27})
    while not (mission.waiting is not None and mission.still):
        mission.step()
    mission.intervene("service cart out")
    mission.step()
    mission.intervene("give_up")
    end(mission, run)
    assert run.one("reopened")["obstacle"] == "gate@27"
    assert [line["requester"] for line in run.all("request")] == ["cart", "bee", "bee"]
    assert not run.findings


@pytest.mark.parametrize(
    ("objective", "message"),
    [
        ("{a: " * 3000, "nested more than 50 deep"),
        (
            "{a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"
            + "".join(f", {n}: &{n} [{', '.join([f'*{b}'] * 10)}]" for b, n in pairwise("abcdefgh"))
            + "}",
            "more than 100000 values",
        ),
    ],
)
def test_an_intervention_that_expands_is_refused(objective: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        read_intervention(f"objective cart {objective}", loaded(GATE))


def test_a_proof_holds_after_moves_during_the_wait() -> None:
    """A robot that pursues its own objective continues, and the run is given up."""
    mission, run = begin(GATE, attended=True)
    while not run.all("waiting") or len(run.all("goal", robot="bee")) < 5:
        mission.step()
    mission.intervene("give_up")
    end(mission, run)
    assert run.outcome["outcome"] == "operator_needed"
    assert run.outcome["rounds"]["bee"] > 1
    assert not run.broken
    run.outcome["cause"] = "deadlock"
    assert "negative" in run.broken


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
    assert "because gate@doorway needs a robot with 'push'" in done.stderr
    assert all(words in done.stderr for words in told.values()), done.stderr
    assert "an operator intervenes: resolved gate@doorway" in done.stdout
    done = warm.safenav("certify", "--trace", trace, "-o", tmp_path / "bundle")
    assert done.returncode == 0, done.stderr


def test_a_report_of_absence_changes_no_wait() -> None:
    """A sensor that looks often would have it decided again as often."""
    scenario = loaded(GATE)
    mission, run = begin(scenario, world=Remote(scenario), attended=True)
    while mission.waiting is None or not mission.still:
        mission.step()
    elsewhere = replace(scenario.obstacles[0], region=23)
    mission.post(Sensed(mission._world.commands.now(), elsewhere, there=False))
    mission.step()
    assert len(run.all("waiting")) == 1 and not run.all("reopened")


class Gated(Synthesizer):
    """One that can be kept from answering."""

    def __init__(self) -> None:
        super().__init__()
        self.answers = Event()
        self.answers.set()

    def synthesize_all(self, *given: Any, **more: Any) -> list[SynthesisResult]:
        self.answers.wait()
        return super().synthesize_all(*given, **more)


def _rounds(mission: Mission) -> int:
    """The rounds that the cart has completed."""
    run = mission._run
    return rounds(run.team.members[0].objective, run.state.robots[0].own)


class Sudden(Clocked):
    """One in which a gate appears before the cart, which has done a round."""

    pauses = False
    gate: Obstacle
    mission: Mission

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        done = robot.name == "cart" and _rounds(self.mission)
        return replace(self.gate, region=24) if done and region == 24 else None


def test_a_run_that_is_completed_waits_for_no_strategy() -> None:
    """The cart has done its round, and is to go around a gate; the bee does its own meanwhile."""
    text = GATE.replace("[[2, 8]", "[[2, 3]")
    scenario = loaded(text.replace("[[1, 9], [1, 1]]", "[[1, 1], [1, 3]]"))
    world, run, synthesizer = Sudden(scenario), Run(), Gated()
    (world.gate,) = scenario.obstacles
    mission = world.mission = Mission(scenario, synthesizer, world=world, listeners=[run])
    mission.start()
    for _ in range(1000):
        if _rounds(mission):
            synthesizer.answers.clear()
        if mission.result is None:
            mission.step()
    synthesizer.answers.set()
    assert mission.result is not None and mission.result.outcome is Outcome.COMPLETED
    assert run.all("violation") and not run.findings
