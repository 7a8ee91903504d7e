"""Robots whose assumptions do not hold, with no other strategy, and wrong strategies."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from runtime.facts import case
from runtime.played import Run, loaded
from runtime.worlds import Driven
from safenav.errors import ExitCode, Outcome, SynthesizerError, Verdict
from safenav.runtime.run.mission import Mission
from safenav.spec.specification import Specification
from safenav.synthesis.slugs import Listener, SynthesisResult, Synthesizer
from safenav.synthesis.strategy import Strategy


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))


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


def test_without_a_strategy_the_run_ends_with_the_broken_assumption() -> None:
    scenario, run = loaded(case("outside/breaks_an_assumption")), Run()
    world = Driven(scenario, slides={"rover": {2: 22}})
    result = Mission(scenario, Once(), world=world, listeners=[run]).run()
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
