"""The monitors report and survive broken assumptions, and stop wrong strategies."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace
from safenav.runtime.turns.monitor import GuaranteeError

from runtime.played import Run, loaded
from safenav.errors import ExitCode
from safenav.outcome import Outcome
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Scenario
from safenav.spec.specification import Specification
from safenav.synthesis.request import Listener, SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.trace import records
from safenav.world.moves import Pose


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))


ROVERS = "catalogue: {robots: {r: {mobility: free, layer: ground, capabilities: []}}}\n"

HALL = (
    ROVERS
    + """
map: {grid: ["#######", "#.....#", "#.....#", "#.....#", "#######"]}
robots:
  walker: {model: r, start: 8, tracking: exact, objective: {visit: [12, 8]}}
  other: {model: r, start: 26, tracking: exact, objective: {visit: [22, 26]}}
until: {rounds: 2}
"""
)


def _mission(
    text: str, synthesizer: Synthesizer | None = None
) -> tuple[Mission, list[records.Record]]:
    events: list[records.Record] = []
    scenario: Scenario = loaded(text)
    return Mission(scenario, synthesizer, listeners=[events.append]), events


def test_a_robot_that_is_carried_away_breaks_an_assumption_and_the_others_continue() -> None:
    mission, events = _mission(HALL)
    run = Run()
    mission.state.listeners += (run,)
    mission.start()
    mission.step()
    mission.state.robots["other"].pose = Pose(22)  # from 26 or beside it: no single step
    while mission.result is None:
        mission.step()
    (broken, *_) = [e for e in events if isinstance(e, records.Assumption)]
    assert (broken.tick, broken.robot) == (2, "walker")
    assert "robots.other.mobility: stay, or step to a neighbouring region" in broken.name
    assert mission.result.outcome is Outcome.COMPLETED
    blamed = {(finding.rule, finding.robot) for finding in run.audit}
    assert blamed == {("continuity", "other"), ("mobility", "other")}


def test_a_run_in_which_all_keep_the_rules_has_no_findings() -> None:
    mission, events = _mission(HALL)
    assert mission.run().outcome is Outcome.COMPLETED
    assert not [e for e in events if isinstance(e, records.Assumption)]


CORNER = (
    ROVERS
    + """
map: {grid: ["########", "####...#", "#......#", "####...#", "########"]}
robots:
  walker:
    model: r
    start: 20
    tracking: exact
    objective: {ltl: {safety: ["region = 17 -> region' != 17"],
                      liveness: ["region = 17", "region = 22"]}}
  other: {model: r, start: 14, tracking: exact, objective: {visit: [30, 14]}}
until: {rounds: 9}
"""
)


def test_where_no_strategy_is_left_the_run_ends_with_the_broken_assumption() -> None:
    """The formulas demand to leave 17 at once; then somebody is put before its only exit."""
    mission, events = _mission(CORNER)
    mission.start()
    while mission.state.robots["walker"].pose.region != 17:
        mission.step()
        assert mission.result is None
    mission.state.robots["other"].pose = Pose(18)
    mission.step()
    result = mission.result
    assert result is not None
    assert result.outcome is Outcome.ASSUMPTION_VIOLATED
    assert "step to a neighbouring region" in result.explanation
    assert mission.state.robots["walker"].pose == Pose(17)
    assert isinstance(events[-1], records.End)


class _BlindToWalls(Synthesizer):
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
map: {grid: ["#######", "#..#..#", "#.....#", "#######"]}
robots: {walker: {model: r, start: 8, objective: {visit: [12, 8]}}}
"""
    mission, events = _mission(ROVERS + text, _BlindToWalls())
    with pytest.raises(GuaranteeError) as caught:
        mission.run()
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert "walker" in str(caught.value)
    assert "walls are never entered" in str(caught.value)
    assert [e.to for e in events if isinstance(e, records.Move)] == [9]
    assert isinstance(events[-1], records.End)
    assert events[-1].outcome == "error"
