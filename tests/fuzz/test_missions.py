"""Whole missions on random scenarios: typed endings, clean audits, no broken assumption.

The robots' guarantees are each other's assumptions, so in a simulation no monitor may ever find a
violation; the trace is checked by rules that are independent of the runtime.
"""

import json
import os
from collections.abc import Callable
from itertools import chain

import pytest

from drawn import loads
from fuzz.campaign import small
from fuzz.mixed import tracked_mission
from runtime.played import Run
from safenav.errors import InputError, ResourceLimitError, UsageError
from safenav.explain.explanation import Explanation, with_guarantees
from safenav.outcome import Outcome, Verdict
from safenav.report.terminal.explanation_text import explanation_data, explanation_lines
from safenav.review.team import explain_team
from safenav.runtime.run.mission import Mission, default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.spec.compile import compile_task
from safenav.spec.specification import Specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records
from safenav.verify.verification import first_failure


def load(text: str) -> Scenario:
    """A refusal says of each problem what was found."""
    try:
        return load_scenario_text(text, "fuzzed.yaml")
    except InputError as error:
        assert all(diagnostic.found for diagnostic in error.diagnostics)
        raise


def play(seed: int) -> tuple[Scenario, list[records.Record], Outcome]:
    """Run a scenario and audit its trace."""
    data, scenario = loads(tracked_mission, seed, load)
    events, run = list[records.Record](), Run()
    result = Mission(scenario, quiet(scenario), listeners=[events.append, run]).run()
    assert not run.findings, f"{data}\n{run.findings}"
    return scenario, events, result.outcome


def quiet(scenario: Scenario) -> Synthesizer:
    """Return a synthesizer that runs one synthesis at a time, without a cache."""
    usual = default_synthesizer(scenario)
    return Synthesizer(
        usual.binary, seconds=usual.seconds, cache=Cache.off(), verifier=first_failure, at_once=1
    )


COUNT = int(os.environ.get("SAFENAV_FUZZ", "160"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "9000")) if "SAFENAV_FUZZ" in os.environ else 0


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_no_robot_breaks_an_assumption_in_a_simulated_mission(
    seed: int, played: Callable[[], None]
) -> None:
    try:
        scenario, events, outcome = play(seed)
    except UsageError as error:
        assert "'partition' of larger tiles" in str(error)
        return
    except ResourceLimitError:
        pytest.skip("too large for its limits")
    broken = [e for e in events if isinstance(e, records.Assumption)]
    assert not broken, broken
    assert outcome is not Outcome.ASSUMPTION_VIOLATED
    assert scenario.robots
    played()


@pytest.mark.parametrize("seed", range(FIRST, FIRST + (COUNT if FIRST else 60)))
def test_every_verdict_has_a_proof_and_every_failure_its_reasons(
    seed: int, played: Callable[[], None]
) -> None:
    """Also with targets out of reach: strategies and counterstrategies are accepted by the check
    that shares no code with slugs, the core fails and needs each member, and each repair repairs.
    """
    _, scenario = small(seed, robots=2)
    ask = quiet(scenario)
    try:
        answers = first_results(scenario, ask)
        found = list(explain_team(scenario, ask))
    except UsageError:
        return
    assert all(answer.result.verified for answer in answers.values() if answer.realizable)
    for explanation in found:
        judge_explanation(explanation, scenario)
    played()


def judge_explanation(found: Explanation, scenario: Scenario) -> None:
    ask = quiet(scenario)

    def realizable(spec: Specification) -> bool:
        return ask.synthesize(spec, strategy=False).verdict is Verdict.REALIZABLE

    whole = compile_task(found.task, scenario.map)
    refuted = ask.counterstrategy(whole)
    assert (refuted.verdict, refuted.verified) == (Verdict.UNREALIZABLE, True)
    assert found.core.minimal
    parts = [member.constraints for member in found.core.members]
    assert not realizable(with_guarantees(whole, chain(*parts)))
    for k, member in enumerate(found.core.members):
        fewer = chain(*parts[:k], *parts[k + 1 :])
        assert realizable(with_guarantees(whole, fewer)), member.origin
    for repair in found.repairs:
        answers = first_results(repair.scenario, ask, names=[found.robot])
        assert answers[found.robot].realizable, repair.change
    assert found.play is not None
    assert found.cause.value in json.dumps(explanation_data(found, scenario))
    assert len(list(explanation_lines(found, scenario))) > 5
