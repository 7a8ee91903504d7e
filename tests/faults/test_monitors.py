"""Robots whose assumptions do not hold, and wrong strategies."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from runtime.played import Run, loaded
from runtime.worlds import Driven
from safenav.errors import ExitCode, SynthesizerError
from safenav.outcome import Outcome, Verdict
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Robot
from safenav.spec.specification import Specification
from safenav.synthesis.request import Listener, SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.world.moves import Pose


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))


HALL = """
catalogue:
  robots:
    bee: {mobility: free, layer: air, capabilities: []}
    rover: {mobility: free, layer: ground, capabilities: []}
map: {grid: ["#######", "#.....#", "#.....#", "#.....#", "#######"]}
robots:
  bee: {model: bee, start: 8, tracks: [rover], objective: {visit: [12, 8]}}
  rover: {model: rover, start: 26, objective: {visit: [22, 26]}}
until: {rounds: 2}
"""


class Carried(Driven):
    """Somebody carries the rover to another place in tick 3."""

    carried = False

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        if robot.name == "rover" and pose == Pose(23) and not self.carried:
            self.carried = True
            self.truth.move(robot, Pose(22))
            return Pose(22)
        return super().move(robot, pose)


class Once(Synthesizer):
    """One that finds no other strategy for the bee than the first."""

    def synthesize_all(
        self,
        specs: Sequence[Specification],
        strategy: bool = True,
        progress: Listener | None = None,
    ) -> list[SynthesisResult]:
        found = super().synthesize_all(specs, strategy, progress)
        none = {"verdict": Verdict.UNREALIZABLE, "strategy": None}
        again = [spec.robot for spec in specs] == ["bee"]
        return [replace(result, **none) for result in found] if again else found


def test_a_robot_that_is_carried_away_breaks_an_assumption_and_the_others_continue() -> None:
    scenario, run = loaded(HALL), Run()
    result = Mission(scenario, world=Carried(scenario), listeners=[run]).run()
    broken, found = run.one("assumption"), run.one("synthesis", reason="blocked", robot="bee")
    assert (broken["tick"], broken["robot"], found["tick"]) == (4, "bee", 4)
    assert "stay, or step to a neighbouring region" in broken["name"]
    assert run.one("move", tick=4, robot="bee")["by"] == "strategy"
    assert result.outcome is Outcome.COMPLETED
    assert not run.findings


def test_a_run_in_which_all_keep_the_rules_breaks_no_assumption() -> None:
    run = Run()
    assert Mission(loaded(HALL), listeners=[run]).run().outcome is Outcome.COMPLETED
    assert not run.all("assumption")


def test_without_a_strategy_the_run_ends_with_the_broken_assumption() -> None:
    scenario, run = loaded(HALL), Run()
    result = Mission(scenario, Once(), world=Carried(scenario), listeners=[run]).run()
    assert result.outcome is Outcome.ASSUMPTION_VIOLATED
    assert "stay, or step to a neighbouring region" in result.explanation
    assert run.all("assumption")


class BlindToWalls(Synthesizer):
    """Answers as if there were no wall at 10, and claims that it is the answer."""

    def synthesize_all(
        self,
        specs: Sequence[Specification],
        strategy: bool = True,
        progress: Listener | None = None,
    ) -> list[SynthesisResult]:
        wrong = [spec.without(c for c in spec.constraints if c.regions == (10,)) for spec in specs]
        results = super().synthesize_all(wrong, strategy, progress)
        return [
            replace(result, strategy=Strategy.parse(result.strategy_json or b"", spec))
            for spec, result in zip(specs, results, strict=True)
        ]


def test_a_strategy_through_a_wall_is_stopped_before_the_wall() -> None:
    text = """
catalogue: {robots: {r: {mobility: free, layer: ground, capabilities: []}}}
map: {grid: ["#######", "#..#..#", "#.....#", "#######"]}
robots: {walker: {model: r, start: 8, objective: {visit: [12, 8]}}}
"""
    run = Run()
    with pytest.raises(SynthesizerError, match=r"walker leads from 9 .* to 10 ") as caught:
        Mission(loaded(text), BlindToWalls(), listeners=[run]).run()
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert [line["to"] for line in run.all("move")] == [9]
    assert run.outcome["outcome"] == "error"
