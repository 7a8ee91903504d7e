"""Reading structured-slugs text back: sections, ranges, comments."""

from random import Random

from oracle import inputs_first, random_specification, to_structuredslugs
from safenav.outcome import Verdict
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Specification
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import first_failure


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
