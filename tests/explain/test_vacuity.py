"""Vacuous wins: the robot forces the environment into a dead end, or out of its fairness."""

import pytest

from once import SCENARIOS
from safenav.explain.vacuity import Cause, can_force, vacuities, vacuous_wins
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.spec.parsing import read_specification
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.verify.verification import first_failure

ALLEY = """\
safenav: 1
map: {{grid: ["########", "####...#", "#......#", "####...#", "########"]}}
robots:
  hunter: {{model: r, start: 17, avoids: [], tracks: {tracks}, objective: {{visit: [17, 22]}}}}
  other: {{model: r, start: 14, objective: {{visit: [30, 14]}}}}
catalogue: {{robots: {{r: {{mobility: free, layer: ground, capabilities: []}}}}}}
"""


def _strategy(text: str) -> Strategy:
    strategy = Synthesizer(verifier=first_failure).synthesize(read_specification(text)).strategy
    assert strategy is not None
    return strategy


def test_an_environment_without_a_move_is_a_dead_end() -> None:
    strategy = _strategy(
        "[INPUT]\nask\n[OUTPUT]\nshut\n[ENV_INIT]\n!ask\n[SYS_INIT]\n!shut\n"
        "[ENV_TRANS]\n# visitors: come only while it is open\nshut -> ask' & !ask'\n"
        "[SYS_LIVENESS]\nask & !ask\n"
    )
    (found,) = vacuities(strategy)
    assert found.cause is Cause.DEAD_END
    assert strategy.transitions[found.path[-1]] == []
    assert found.path[0] in strategy.initial()
    assert "come only while it is open" in found.origins[0].rule


@pytest.mark.parametrize(
    ("goal", "cause"), [("ask & !ask", Cause.UNFAIR), ("!shut", Cause.FORCED)], ids=["does", "can"]
)
def test_an_assumption_that_the_robot_can_break(goal: str, cause: Cause) -> None:
    strategy = _strategy(
        "[INPUT]\nask\n[OUTPUT]\nshut\n[ENV_INIT]\n!ask\n[SYS_INIT]\n!shut\n"
        "[ENV_TRANS]\nshut -> !ask'\n"
        f"[ENV_LIVENESS]\n# visitors: ask again and again\nask\n[SYS_LIVENESS]\n{goal}\n"
    )
    (found,) = vacuous_wins(strategy, Synthesizer())
    assert found.cause is cause
    assert any("ask again and again" in origin.rule for origin in found.origins)


def test_no_case_study_is_won_vacuously() -> None:
    for file in sorted(SCENARIOS.glob("case_study_*.yaml")):
        scenario = load_scenario(file)
        synthesizer = default_synthesizer(scenario)
        for answer in first_results(scenario, synthesizer).values():
            assert answer.result.strategy is not None
            assert vacuous_wins(answer.result.strategy, synthesizer) == ()


def test_a_robot_cannot_force_others_that_it_does_not_track() -> None:
    """Whatever the robot does, its specification assumes nothing of the others."""
    scenario = load_scenario_text(ALLEY.format(tracks="[]"))
    synthesizer = default_synthesizer(scenario)
    for answer in first_results(scenario, synthesizer).values():
        strategy = answer.result.strategy
        assert strategy is not None
        assert vacuities(strategy) == ()
        assert can_force(strategy.specification, synthesizer) is None
