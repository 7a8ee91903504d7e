"""The check against the brute-force oracle: random games, and systematic damage.

Every failure that the check reports is confirmed here with the plain evaluator: the path exists,
the constraint is violated, the cycle misses the goal.
"""

import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise, product
from random import Random

import pytest

import oracle
from oracle.damage import DAMAGES, Damage, no_memory, without_unreachable
from safenav.formula.evaluator import evaluate
from safenav.formula.parser import parse
from safenav.outcome import Verdict
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Owner, Section, Specification
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy
from safenav.verify.verification import (
    Failure,
    Fault,
    Verification,
    counterstrategy_starts,
    verify_counterstrategy,
    verify_strategy,
)

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
        check = verify_counterstrategy if self.counter else verify_strategy
        return check(self.spec, self.parsed(automaton))

    def starts(self, automaton: oracle.Automaton) -> list[int]:
        strategy = self.parsed(automaton)
        if self.counter:
            return [*counterstrategy_starts(self.spec, strategy)]
        return [*strategy.initial()]

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
    synthesizer = Synthesizer(slugs, cache=Cache.off())
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
        assert not verify_counterstrategy(sample.spec, sample.parsed(sample.automaton)).ok, (
            sample.seed
        )
    for sample in counterstrategies[:100]:
        strategy = sample.parsed(sample.automaton)
        assert not verify_strategy(sample.spec, strategy).ok, sample.seed


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
        for _ in range(8 if damage is no_memory else 2):  # few games have memory to confuse
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
    words = f"seed {sample.seed}: {failure}"
    spec, node = sample.spec, failure.node
    if node is None:
        assert failure.fault is Fault.NO_START, words
        return
    assert failure.path[-1] == node, words
    assert all(b in strategy.transitions[a] for a, b in pairwise(failure.path)), words
    assert failure.path[0] < len(strategy.states), words
    here = strategy.values(node)
    targets = strategy.transitions[node]
    match failure.fault:
        case Fault.RANGE:
            assert any(
                v.bounds and not v.bounds[0] <= here[v.name] <= v.bounds[1] for v in spec.variables
            ), words
        case Fault.FORBIDDEN_INPUT | Fault.BROKEN_GUARANTEE:
            assert failure.constraint is not None and failure.successor in targets, words
            there = strategy.values(failure.successor)
            assert not evaluate(parse(failure.constraint.formula), here, there), words
        case Fault.SEVERAL_SUCCESSORS:
            owner = Owner.OUTPUT if sample.counter else Owner.INPUT
            moves = [_part(spec, strategy.values(t), owner) for t in targets]
            assert len(set(moves)) < len(moves), words
        case Fault.SEVERAL_INPUTS:
            inputs = {_part(spec, strategy.values(t), Owner.INPUT) for t in targets}
            assert len(inputs) > 1, words
        case Fault.MISSING_SUCCESSOR:
            assert _something_is_missing(sample, strategy, node), words
        case Fault.STARVED_GOAL | Fault.STARVED_ASSUMPTION | Fault.GOALS_MET:
            _confirm_cycle(sample, strategy, failure, words)
        case _:
            pytest.fail(words)


def _part(spec: Specification, values: dict[str, int], owner: Owner) -> tuple[int, ...]:
    return tuple(values[v.name] for v in spec.owned(owner))


def _something_is_missing(sample: Sample, strategy: Strategy, node: int) -> bool:
    """Some move of the other player has no successor, by trying all of them."""
    spec, here = sample.spec, strategy.values(node)
    assumed = [parse(c.formula) for c in spec.section(Section.ENV_TRANS)]
    promised = [parse(c.formula) for c in spec.section(Section.SYS_TRANS)]
    present = [strategy.values(t) for t in strategy.transitions[node]]
    for inputs in _valuations(spec, Owner.INPUT):
        allowed = all(evaluate(f, here, inputs) for f in assumed)
        if not sample.counter:
            covered = {_part(spec, there, Owner.INPUT) for there in present}
            if allowed and _part(spec, inputs, Owner.INPUT) not in covered:
                return True
            continue
        if present and _part(spec, inputs, Owner.INPUT) != _part(spec, present[0], Owner.INPUT):
            continue
        answers = [
            {**inputs, **outputs}
            for outputs in _valuations(spec, Owner.OUTPUT)
            if all(evaluate(f, here, {**inputs, **outputs}) for f in promised)
        ]
        if not present and allowed and not answers:
            return False  # the system has no move after this input: no successor is needed
        if present and any(answer not in present for answer in answers):
            return True
    return sample.counter and not present


def _valuations(spec: Specification, owner: Owner) -> Iterator[dict[str, int]]:
    owned = spec.owned(owner)
    for values in product(*(v.range for v in owned)):
        yield dict(zip((v.name for v in owned), values, strict=True))


def _confirm_cycle(sample: Sample, strategy: Strategy, failure: Failure, words: str) -> None:
    assert failure.cycle and failure.cycle[0] == failure.node, words
    steps = list(pairwise((*failure.cycle, failure.cycle[0])))
    assert all(b in strategy.transitions[a] for a, b in steps), words

    def met(formula: str) -> bool:
        parsed = parse(formula)
        return any(evaluate(parsed, strategy.values(a), strategy.values(b)) for a, b in steps)

    fair = [c.formula for c in sample.spec.section(Section.ENV_LIVENESS)]
    goals = [c.formula for c in sample.spec.section(Section.SYS_LIVENESS)]
    if failure.fault is Fault.GOALS_MET:
        assert all(map(met, goals)), words
        return
    assert failure.constraint is not None
    assert not met(failure.constraint.formula), words
    if failure.fault is Fault.STARVED_GOAL:
        assert failure.constraint.formula in goals
        assert all(map(met, fair)), words
    else:
        assert failure.constraint.formula in fair
