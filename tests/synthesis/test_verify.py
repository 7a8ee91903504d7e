"""The independent check on hand-written automata: how it names what is wrong. That it finds all of
that, and nothing else: ``test_verify_random``."""

import json
from typing import Any

import pytest

from safenav.outcome import Verdict
from safenav.spec.specification import Specification
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.verification import (
    first_failure,
)


def test_a_wrong_strategy_is_an_error_of_the_synthesizer(
    answering: Any, patrol: Specification, patrol_json: bytes
) -> None:
    """With ``verify``, what the binary says is not believed: and not kept in the cache."""
    from safenav.errors import SynthesizerError

    document = json.loads(patrol_json)
    document["nodes"]["1"]["trans"] = [1, 2]
    liar = answering("realizable", json.dumps(document).encode())
    with pytest.raises(SynthesizerError, match=r"wrong result(.|\n)*region = 5"):
        Synthesizer(liar, verifier=first_failure).synthesize(patrol)
    believed = Synthesizer(liar).synthesize(patrol)
    assert (believed.verdict, believed.cached, believed.verified) == (
        Verdict.REALIZABLE,
        False,
        None,
    )
    with pytest.raises(SynthesizerError, match="wrong result"):
        Synthesizer(liar, verifier=first_failure).synthesize(patrol)
    honest = answering("realizable", patrol_json)
    for cached in (False, True):
        result = Synthesizer(honest, verifier=first_failure).synthesize(patrol)
        assert (result.verified, result.cached) == (True, cached)
