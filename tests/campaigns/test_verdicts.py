"""Verdicts on random scenarios, also with targets out of reach, and their explanations.

``SAFENAV_FUZZ=5000`` judges as many.
"""

import json
import os
from collections.abc import Callable
from itertools import chain

import pytest

from safenav.errors import UsageError
from safenav.explain.explanation import Explanation, with_guarantees
from safenav.outcome import Verdict
from safenav.report.terminal.explanation_text import explanation_data, explanation_lines
from safenav.review.team import explain_team
from safenav.runtime.run.mission import first_results
from safenav.scenario.model import Scenario
from safenav.spec.compile import compile_task
from safenav.spec.specification import Specification
from support.examples import quiet, small

COUNT = int(os.environ.get("SAFENAV_FUZZ", "60"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "9000")) if "SAFENAV_FUZZ" in os.environ else 0


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_every_verdict_has_a_proof_and_every_failure_its_reasons(
    seed: int, played: Callable[[], None]
) -> None:
    """Strategies and counterstrategies are accepted by the check
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
