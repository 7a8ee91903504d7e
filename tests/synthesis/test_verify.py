"""The independent check on hand-written automata: how it names what is wrong. That it finds all of
that, and nothing else: ``test_verify_random``."""

import json
from typing import Any

import pytest

from safenav.errors import InputError
from safenav.outcome import Verdict
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.verify.verification import (
    Failure,
    Fault,
    first_failure,
    verify_counterstrategy,
    verify_strategy,
)

Nodes = dict[str, dict[str, Any]]

DOOR = """\
# a robot in a corridor whose door is in the hands of another

[INPUT]
open

[OUTPUT]
region:0...2

[SYS_INIT]
region = 0

[ENV_TRANS]
# door: does not shut on the robot
region = 1 -> open'

[SYS_TRANS]
# robot: one region a tick
region' <= region + 1 & region <= region' + 1
# door: no way through while it is shut
region' = 1 -> open'

[ENV_LIVENESS]
# door: opens again and again
open'

[SYS_LIVENESS]
# robot: patrol
region = 2
region = 0
"""


@pytest.fixture
def door() -> Specification:
    return read_specification(DOOR, "door.structuredslugs", "robot")


def _strategy(spec: Specification, data: bytes, **changes: Any) -> Strategy:
    """The automaton with some nodes' fields replaced: ``_3={"trans": [..]}``."""
    document = json.loads(data)
    for number, fields in changes.items():
        document["nodes"].setdefault(number.lstrip("_"), {}).update(fields)
    return Strategy.parse(json.dumps(document).encode(), spec)


def _only(spec: Specification, strategy: Strategy, fault: Fault) -> Failure:
    failures = verify_strategy(spec, strategy).failures
    assert [f.fault for f in failures] == [fault], "\n".join(map(str, failures))
    return failures[0]


def test_a_right_strategy_is_accepted(patrol: Specification, patrol_json: bytes) -> None:
    verification = verify_strategy(patrol, _strategy(patrol, patrol_json))
    assert verification.ok
    assert (verification.nodes, verification.edges) == (9, 18)


def test_a_missing_successor_is_named_by_its_input(
    patrol: Specification, patrol_json: bytes
) -> None:
    failure = _only(
        patrol, _strategy(patrol, patrol_json, _3={"trans": [5]}), Fault.MISSING_SUCCESSOR
    )
    assert failure.node == 3
    assert failure.detail == "for request"
    assert failure.path == (0, 1, 3)
    assert failure.state == "region=5 !request"


def test_a_wrong_bit_breaks_the_guarantee_that_it_breaks(
    patrol: Specification, patrol_json: bytes
) -> None:
    """Nodes 5 and 6 are at region 4 on the way back from 5 to 3; now they are at 3."""
    changes = {"_5": {"state": [0, 0, 0]}, "_6": {"state": [1, 0, 0]}}
    failure = _only(patrol, _strategy(patrol, patrol_json, **changes), Fault.BROKEN_GUARANTEE)
    assert (failure.node, failure.successor) == (3, 5)
    assert failure.constraint is not None
    assert failure.constraint.formula == "region <= region' + 1"
    assert failure.constraint.origin.rule == "robots.carrier: one region a tick"
    assert failure.path == (0, 1, 3)
    for words in ("node 3 (region=5 !request)", "to region=3", "robots.carrier", "0 -> 1 -> 3"):
        assert words in str(failure)


def test_a_value_outside_its_range_is_refused(patrol: Specification, patrol_json: bytes) -> None:
    """Two bits could hold 6, where the range ends at 5."""
    changed = _strategy(patrol, patrol_json, _3={"state": [0, 1, 1]})
    failures = verify_strategy(patrol, changed).failures
    assert failures[0].fault is Fault.RANGE
    assert failures[0].node == 3
    assert failures[0].detail == "region:3...5, found 6"


def test_a_wrong_initial_node_is_no_start(patrol: Specification, patrol_json: bytes) -> None:
    elsewhere = _only(
        patrol, _strategy(patrol, patrol_json, _0={"state": [0, 1, 0]}), Fault.NO_START
    )
    assert elsewhere.constraint is not None
    assert elsewhere.constraint.formula == "region = 3"
    assert elsewhere.detail == "for the initial input !request"
    requested = _only(
        patrol, _strategy(patrol, patrol_json, _0={"state": [1, 0, 0]}), Fault.NO_START
    )
    assert requested.constraint is not None
    assert requested.constraint.section is Section.ENV_INIT


def test_a_starved_goal_is_shown_by_its_cycle(patrol: Specification, patrol_json: bytes) -> None:
    """Nodes 1 and 2 wait at region 4 for ever."""
    changes = {"_1": {"trans": [1, 2]}, "_2": {"trans": [1, 2]}}
    verification = verify_strategy(patrol, _strategy(patrol, patrol_json, **changes))
    assert {f.fault for f in verification.failures} == {Fault.STARVED_GOAL}
    goals = [f.constraint.formula for f in verification.failures if f.constraint]
    assert goals == ["region = 5", "region = 3"]
    failure = verification.failures[0]
    assert set(failure.cycle) <= {1, 2} and failure.node == failure.cycle[0]
    assert failure.path in ((0, 1), (0, 2))


def test_an_input_that_the_assumptions_exclude_is_refused(
    door: Specification, slugs: Binary
) -> None:
    """A strategy for a freer environment has successors where the door would have to stay open."""
    freer = door.without(door.section(Section.ENV_TRANS))
    harder = freer.without(c for c in freer.constraints if "region' = 1" in c.formula)
    strategy = Synthesizer(slugs, cache=Cache.off()).synthesize(harder).strategy
    assert strategy is not None and verify_strategy(harder, strategy).ok
    shut = harder.with_more(*door.section(Section.ENV_TRANS))
    failures = verify_strategy(shut, strategy).failures
    assert [f.fault for f in failures] == [Fault.FORBIDDEN_INPUT]
    assert failures[0].constraint is not None
    assert failures[0].constraint.origin.rule == "door: does not shut on the robot"


@pytest.fixture
def shut(door: Specification) -> Specification:
    """The door need not open."""
    return door.without(door.section(Section.ENV_LIVENESS))


@pytest.fixture
def proof() -> bytes:
    """The environment keeps the door shut; the robot can only stay (nodes of one input)."""
    return json.dumps(
        {
            "variables": ["open", "region@0.0.2", "region@1"],
            "nodes": {"0": {"rank": 0, "state": [0, 0, 0], "trans": [0]}},
        }
    ).encode()


def test_a_counterstrategy_may_end_only_where_the_system_is_stuck(
    shut: Specification, proof: bytes
) -> None:
    ended = _strategy(shut, proof, _0={"trans": []})
    failures = verify_counterstrategy(shut, ended).failures
    assert [f.fault for f in failures] == [Fault.MISSING_SUCCESSOR]
    trap = Constraint(Section.SYS_TRANS, "!open' -> region' = 2", Origin("trap", "jump"))
    stuck = shut.with_more(trap)
    assert verify_counterstrategy(stuck, _strategy(stuck, proof, _0={"trans": []})).ok


def test_no_counterstrategy_is_needed_where_the_system_cannot_begin(shut: Specification) -> None:
    empty = b'{"variables": ["open", "region@0.0.2", "region@1"], "nodes": {}}'
    strategy = Strategy.parse(empty, shut)
    assert verify_counterstrategy(shut, strategy).failures[0].fault is Fault.NO_START
    wall = Constraint(Section.SYS_INIT, "open -> region != 0", Origin("wall", "at the start"))
    blocked = shut.with_more(wall)
    assert verify_counterstrategy(blocked, Strategy.parse(empty, blocked)).ok


@pytest.mark.parametrize(
    ("formula", "complaint"),
    [("region' = ", "unexpected"), ("regoin = 3", "'regoin' is not declared")],
)
def test_a_constraint_that_cannot_be_read_is_bad_input(
    patrol: Specification, patrol_json: bytes, formula: str, complaint: str
) -> None:
    wrong = Constraint(Section.SYS_TRANS, formula, Origin("robots.carrier.objective", "ltl"))
    spec = patrol.with_more(wrong)
    with pytest.raises(InputError, match=complaint) as raised:
        verify_strategy(spec, _strategy(patrol, patrol_json))
    assert "robots.carrier.objective" in str(raised.value)


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
