"""The check against the brute-force oracle: random games, and systematic damage.

Failures that the check reports are confirmed here with the plain evaluator: the path exists, the
constraint is violated, the cycle misses the goal.
"""

import json
import os
from collections import Counter
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from random import Random
from typing import Any

import pytest

import oracle
from oracle.damage import DAMAGES, Damage, no_memory, without_unreachable
from safenav.errors import SynthesizerError, Verdict
from safenav.formula.parser import parse
from safenav.formula.syntax import evaluate
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
    read_specification,
)
from safenav.synthesis.cache import Cache
from safenav.synthesis.program import Binary
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import cyclic_parts
from safenav.verify.completions import Clause, Completions, Slot
from safenav.verify.verification import Failure, Fault, Verification, first_failure, verify

GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "400"))
AT_LEAST = 30


@dataclass(frozen=True)
class Sample:
    """A random game with an automaton that wins it for one of the players."""

    seed: int
    reference: oracle.Specification
    spec: Specification
    automaton: oracle.Automaton
    counter: bool

    def parsed(self, automaton: oracle.Automaton) -> Strategy:
        return Strategy.parse(oracle.to_json(self.reference, automaton).encode(), self.spec)

    def verify(self, automaton: oracle.Automaton) -> Verification:
        return verify(self.spec, self.parsed(automaton), self.counter)

    def starts(self, automaton: oracle.Automaton) -> list[int]:
        return [*self.parsed(automaton).initial(self.counter)]

    def complaints(self, automaton: oracle.Automaton) -> list[str]:
        """What the oracle's own checker says about the reachable part: it looks at all nodes."""
        reachable = without_unreachable(automaton, self.starts(automaton))
        check = oracle.check_counterstrategy if self.counter else oracle.check_strategy
        return check(oracle.build_game(self.reference), reachable)


@cache
def _game(seed: int) -> tuple[oracle.Specification, Specification]:
    source = Random(seed)
    reference = oracle.inputs_first(
        oracle.random_specification(
            source, integers=seed % 2 == 0, bits=3 + seed % 4, many_goals=seed % 3 == 0
        )
    )
    return reference, read_specification(oracle.to_structuredslugs(reference, source))


@cache
def _strategies() -> tuple[Sample, ...]:
    """The strategies of all realizable ones among the games."""
    found = []
    for seed in range(GAMES):
        reference, spec = _game(seed)
        solution = oracle.solve(oracle.build_game(reference))
        if oracle.is_realizable(solution.game, solution.winning):
            found.append(Sample(seed, reference, spec, oracle.extract(solution), False))
    return tuple(found)


@pytest.fixture(scope="module")
def counterstrategies(slugs: Binary) -> tuple[Sample, ...]:
    """What slugs answers to the unrealizable ones."""
    if not slugs.native:
        pytest.skip("the binary of SAFENAV_SLUGS has no counterstrategies as JSON")
    synthesizer = Synthesizer(slugs, cache=Cache(None))
    realizable = {sample.seed for sample in _strategies()}
    found = []
    for seed in range(GAMES):
        if seed not in realizable:
            reference, spec = _game(seed)
            result = synthesizer.counterstrategy(spec)
            assert result.verdict is Verdict.UNREALIZABLE
            assert result.strategy_json is not None
            automaton = oracle.from_json(reference, result.strategy_json.decode())
            found.append(Sample(seed, reference, spec, automaton, True))
    return tuple(found)


def test_every_strategy_of_the_oracle_is_accepted() -> None:
    samples = _strategies()
    assert len(samples) > GAMES // 4
    for sample in samples:
        verification = sample.verify(sample.automaton)
        assert verification.ok, f"seed {sample.seed}: {verification.failures[0]}"


def test_every_counterstrategy_of_slugs_is_accepted(
    counterstrategies: tuple[Sample, ...],
) -> None:
    assert len(counterstrategies) > GAMES // 4
    for sample in counterstrategies:
        verification = sample.verify(sample.automaton)
        assert verification.ok, f"seed {sample.seed}: {verification.failures[0]}"


def test_no_automaton_proves_both_verdicts(counterstrategies: tuple[Sample, ...]) -> None:
    """A strategy is no counterstrategy and the other way round."""
    for sample in _strategies()[:100]:
        assert not verify(sample.spec, sample.parsed(sample.automaton), True).ok, sample.seed
    for sample in counterstrategies[:100]:
        assert not verify(sample.spec, sample.parsed(sample.automaton)).ok, sample.seed


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_damaged_strategies_are_refused_for_the_right_reason(damage: Damage) -> None:
    _judge_damage(_strategies(), damage)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_damaged_counterstrategies_are_refused_for_the_right_reason(
    damage: Damage, counterstrategies: tuple[Sample, ...]
) -> None:
    _judge_damage(counterstrategies, damage)


def _judge_damage(samples: tuple[Sample, ...], damage: Damage) -> None:
    """Damage may do no harm; but what the oracle refuses is refused, and each complaint is true."""
    tally: Counter[str] = Counter()
    for sample in samples:
        source, sound = Random(sample.seed), sample.automaton
        if not any(node.successors for node in sound.nodes):
            continue
        for _ in range(6 if damage is no_memory else 2):  # few games have memory to confuse
            automaton = damage(sound, sample.starts(sound), source)
            verification = sample.verify(automaton)
            if verification.ok:
                assert sample.complaints(automaton) == [], f"seed {sample.seed}"
                continue
            tally["refused"] += 1
            for failure in verification.failures:
                tally[failure.fault] += 1
                _confirm(sample, sample.parsed(automaton), failure)
    assert tally["refused"] >= AT_LEAST, tally


def _confirm(sample: Sample, strategy: Strategy, failure: Failure) -> None:
    """The complaint is true, by going there and looking."""
    words, spec, node = f"seed {sample.seed}: {failure}", sample.spec, failure.node
    if node is None:
        assert failure.fault is Fault.NO_START, words
        return
    assert failure.path[-1] == node, words
    assert all(b in strategy.transitions[a] for a, b in pairwise(failure.path)), words
    if failure.cycle:
        steps = list(pairwise((*failure.cycle, failure.cycle[0])))
        assert failure.cycle[0] == node, words
        assert all(b in strategy.transitions[a] for a, b in steps), words
        fair, goals = (
            {c.formula for c in spec.section(section) if _met(strategy, steps, c.formula)}
            for section in (Section.ENV_LIVENESS, Section.SYS_LIVENESS)
        )
        if failure.fault is Fault.GOALS_MET:
            assert len(goals) == len({c.formula for c in spec.section(Section.SYS_LIVENESS)}), words
            return
        assert failure.constraint is not None
        assert failure.constraint.formula not in fair | goals, words
        if failure.fault is Fault.STARVED_GOAL:
            assert len(fair) == len({c.formula for c in spec.section(Section.ENV_LIVENESS)}), words
    elif failure.fault in (Fault.FORBIDDEN_INPUT, Fault.BROKEN_GUARANTEE):
        assert failure.constraint is not None, words
        assert failure.successor in strategy.transitions[node], words
        assert not _met(strategy, [(node, failure.successor)], failure.constraint.formula), words


def _met(strategy: Strategy, steps: list[tuple[int, int]], formula: str) -> bool:
    parsed = parse(formula)
    return any(evaluate(parsed, strategy.values(a), strategy.values(b)) for a, b in steps)


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


def test_a_value_that_a_variable_does_not_have_is_a_failure(
    patrol: Specification, patrol_json: bytes
) -> None:
    """From 5 to 6 and back: by steps that each guarantee allows."""
    document = json.loads(patrol_json)
    nodes = document["nodes"]
    for number, place, bits, then in ((9, 6, [1, 1], 11), (11, 5, [0, 1], 5)):
        assert 3 + bits[0] + 2 * bits[1] == place
        for request in (0, 1):
            state, after = [request, *bits], [then, then + 1]
            nodes[str(number + request)] = {"rank": 1, "state": state, "trans": after}
    nodes["3"]["trans"] = nodes["4"]["trans"] = [9, 10]
    strategy = Strategy.parse(json.dumps(document).encode(), patrol)
    found = [failure.fault for failure in verify(patrol, strategy).failures]
    assert found == [Fault.RANGE]


ANY = Constraint(Section.ENV_TRANS, "", Origin("", ""))


def test_unconnected_variables_are_not_multiplied_out() -> None:
    """Sixty Boolean inputs have 2^60 valuations; counting them takes no time."""
    inputs = [Variable(f"b{i}", Owner.INPUT) for i in range(60)]
    unknown = [Slot(variable, True) for variable in inputs]
    formulas = [Clause(ANY, parse("b0 -> b0'")), Clause(ANY, parse("b1' | b2'"))]
    counter = Completions([Slot(inputs[0], False)], unknown, formulas)
    assert counter.count([(0,), (1,)]) == [3 * 2**58, 3 * 2**57]


def test_a_move_is_found_without_a_search_among_the_others() -> None:
    """Pairs that are tied last leave 2^30 beginnings; of 2^30 moves all but two are alike."""
    inputs = [Slot(Variable(f"b{i}", Owner.INPUT), True) for i in range(60)]
    pairs = [Clause(ANY, parse(f"b{i}' != b{59 - i}'")) for i in range(30)]
    assert next(Completions((), inputs, pairs).each(())) == (0,) * 30 + (1,) * 30
    impossible = [*pairs, Clause(ANY, parse("b58' & b59' & b0'"))]
    assert list(Completions((), inputs, impossible).each(())) == []
    output = [Slot(Variable("done", Owner.OUTPUT), True)]
    answers = Completions(inputs, output, [Clause(ANY, parse("done' & (b59' | b0')"))])
    assert Completions((), inputs, pairs).unanswered(answers) is None
    moves = Completions((), inputs, [])
    assert moves.unanswered(answers) == (0,) * 60


def test_a_long_cycle_needs_no_recursion() -> None:
    count = 100_000
    edges = [(n, (n + 1) % count) for n in range(count)]
    assert set(cyclic_parts(edges).values()) == {0}
    assert cyclic_parts(edges[:-1]) == {}
    assert cyclic_parts([(0, 0), (0, 1), (1, 2), (2, 2)]).keys() == {0, 2}
