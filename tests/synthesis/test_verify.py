"""The independent check: how it names what is wrong, and large sets that it counts without going
through them. That it finds all that is wrong, and nothing else: ``test_verify_random``."""

import json
from typing import Any

import pytest

from safenav.errors import SynthesizerError
from safenav.formula.parser import parse
from safenav.spec.specification import Constraint, Origin, Owner, Section, Specification, Variable
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.completions import Clause, Completions, Slot
from safenav.verify.cycles import cyclic_parts
from safenav.verify.verification import first_failure


def test_a_wrong_strategy_is_an_error_of_the_synthesizer(
    answering: Any, patrol: Specification, patrol_json: bytes
) -> None:
    """With ``verify``, what the binary says is not believed: and not kept in the cache."""
    document = json.loads(patrol_json)
    document["nodes"]["1"]["trans"] = [1, 2]
    liar = answering("realizable", json.dumps(document).encode())
    with pytest.raises(SynthesizerError, match=r"wrong result(.|\n)*region = 5"):
        Synthesizer(liar, verifier=first_failure).synthesize(patrol)
    believed = Synthesizer(liar).synthesize(patrol)
    assert (believed.cached, believed.verified) == (False, None)
    honest = answering("realizable", patrol_json)
    for cached in (False, True):
        result = Synthesizer(honest, verifier=first_failure).synthesize(patrol)
        assert (result.verified, result.cached) == (True, cached)


ANY = Constraint(Section.ENV_TRANS, "", Origin("", ""))


def test_unconnected_variables_are_not_multiplied_out() -> None:
    """Sixty Boolean inputs have 2^60 valuations; counting them takes no time."""
    inputs = [Variable(f"b{i}", Owner.INPUT) for i in range(60)]
    unknown = [Slot(variable, True) for variable in inputs]
    formulas = [Clause(ANY, parse("b0 -> b0'")), Clause(ANY, parse("b1' | b2'"))]
    counter = Completions([Slot(inputs[0], False)], unknown, formulas)
    assert counter.count([(0,), (1,)]) == [3 * 2**58, 3 * 2**57]


def test_a_long_cycle_needs_no_recursion() -> None:
    count = 100_000
    edges = [(n, (n + 1) % count) for n in range(count)]
    assert set(cyclic_parts(edges).values()) == {0}
    assert cyclic_parts(edges[:-1]) == {}
    assert cyclic_parts([(0, 0), (0, 1), (1, 2), (2, 2)]).keys() == {0, 2}
