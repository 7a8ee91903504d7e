"""Reading structured-slugs text back: sections, ranges, comments."""

import os
from pathlib import Path
from random import Random

import pytest

from once import CORPUS
from oracle import inputs_first, random_specification, to_structuredslugs
from safenav.outcome import Verdict
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Specification
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure, verify_counterstrategy, verify_strategy


def test_a_printed_specification_reads_back(patrol: Specification) -> None:
    again = read_specification(patrol.to_structuredslugs(), "again", "carrier")
    assert again.variables == patrol.variables
    assert [(c.section, c.formula) for c in again.constraints] == [
        (c.section, c.formula) for c in patrol.constraints
    ]
    assert again.title == patrol.title


def test_a_random_file_reads_as_the_synthesizer_reads_it(slugs: Binary) -> None:
    """All spellings: what is read back gives the strategy that the file itself gives."""
    synthesizer = Synthesizer(slugs, cache=Cache(None), verifier=first_failure)
    for seed in range(60):
        source = Random(seed)
        reference = inputs_first(random_specification(source, integers=True, bits=4))
        spec = read_specification(to_structuredslugs(reference, source))
        result = synthesizer.synthesize(spec)
        if result.verdict is Verdict.UNREALIZABLE:
            assert synthesizer.counterstrategy(spec).verified
        else:
            assert result.verified


FILES = sorted(CORPUS.glob("*/*.structuredslugs"))
LARGE = ("basicEvasion", "Belief_Evasion_fine")
if "SAFENAV_FUZZ" not in os.environ:  # among the tests, slugs alone checks these two strategies
    LARGE = (*LARGE, "coop_0_quad", "Belief_Evasion_coarse")


@pytest.mark.skipif(not FILES, reason="no corpus of specifications; set SAFENAV_CORPUS")
@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, id=file.stem, marks=[pytest.mark.slow] * (file.stat().st_size > 20_000))
        for file in FILES
        if not file.stem.startswith(LARGE)
    ],
)
def test_published_specifications_are_verified(slugs: Binary, file: Path) -> None:
    spec = read_specification(file.read_text(), file.name)
    synthesizer = Synthesizer(slugs, cache=Cache(None))
    result = synthesizer.synthesize(spec)
    if result.verdict is Verdict.UNREALIZABLE:
        counterstrategy = synthesizer.counterstrategy(spec).strategy
        assert counterstrategy is not None
        verification = verify_counterstrategy(spec, counterstrategy)
    else:
        assert result.strategy is not None
        verification = verify_strategy(spec, result.strategy)
    assert verification.ok, str(verification.failures[0])
