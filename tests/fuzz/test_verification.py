"""Every result of slugs is accepted by the check that shares no code with it: 500 random
specifications and 60 random scenarios, strategies and counterstrategies; `make fuzz` tries
thousands."""

import os
from collections import Counter
from random import Random
from typing import Any

import pytest
import yaml
from hypothesis import event, given

import oracle
from fuzz.campaign import campaign, scenarios
from fuzz.test_missions import quiet
from safenav.errors import InputError, ResourceLimitError, UsageError
from safenav.outcome import Verdict
from safenav.runtime.mission import first_results
from safenav.scenario.reading.loader import load_scenario_text
from safenav.spec.compile import compile_task
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure

SPECIFICATIONS = max(500, int(os.environ.get("SAFENAV_FUZZ", "0")))


def _specification(seed: int) -> Specification:
    source = Random(seed)
    random = oracle.random_specification(source, integers=source.random() < 0.5)
    text = oracle.to_structuredslugs(oracle.inputs_first(random), source)
    return read_specification(text)


@pytest.mark.slow
def test_random_specifications_are_answered_with_proofs() -> None:
    ask = Synthesizer(cache=Cache.off(), verifier=first_failure)
    specs = [_specification(seed) for seed in range(SPECIFICATIONS)]
    verdicts: Counter[Verdict] = Counter()
    for spec, result in zip(specs, ask.synthesize_all(specs), strict=True):
        verdicts[result.verdict] += 1
        if result.verdict is Verdict.REALIZABLE:
            assert result.verified is True
        else:
            refuted = ask.counterstrategy(spec)
            assert (refuted.verdict, refuted.verified) == (Verdict.UNREALIZABLE, True)
    assert sum(verdicts.values()) == SPECIFICATIONS
    assert min(verdicts[Verdict.REALIZABLE], verdicts[Verdict.UNREALIZABLE]) > 100


@pytest.mark.slow
@campaign(60)
@given(scenarios(robots=3))
def test_random_scenarios_are_answered_with_proofs(data: dict[str, Any]) -> None:
    try:
        scenario = load_scenario_text(yaml.safe_dump(data), "fuzzed.yaml", reachable=False)
        ask = quiet(scenario)
        answers = first_results(scenario, ask)
    except (InputError, UsageError):
        event("invalid")
        return
    except ResourceLimitError:  # many robots with ``exact``: no verdict, so no proof either
        event("limit")
        return
    for answer in answers.values():
        event(answer.result.verdict.value)
        if answer.realizable:
            assert answer.result.verified is True
        else:
            refuted = ask.counterstrategy(compile_task(answer.task, scenario.map))
            assert (refuted.verdict, refuted.verified) == (Verdict.UNREALIZABLE, True)
