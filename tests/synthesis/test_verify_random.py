"""The check against the brute-force oracle: random games, and systematic damage. Its reader of
formulas against that of slugs.

Failures that the check reports are confirmed here with the plain evaluator: the path exists, the
constraint is violated, the cycle misses the goal.
"""

import json
import os
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from random import Random
from subprocess import run

import numpy as np
import pytest

from once import beside, from_yaml
from oracle.automata import (
    DAMAGES,
    Automaton,
    Damage,
    check_counterstrategy,
    check_strategy,
    damaged,
    from_json,
    no_memory,
    to_json,
    without_unreachable,
)
from oracle.game import Solution, build_game, extract, solve
from oracle.generator import random_specification
from oracle.text import inputs_first, read_slugsin, to_structuredslugs, truth
from safenav import (
    ResourceLimitError,
    Specification,
    Strategy,
    Synthesizer,
    Verdict,
    read_specification,
)
from safenav.formula.syntax import predicate
from safenav.spec.specification import Section, formula_of
from safenav.synthesis.program import find_binary
from safenav.synthesis.strategy import bit_names
from safenav.verify.verification import Failure, Fault, Verification, verify

GAMES = int(os.environ.get("SAFENAV_RANDOM_GAMES", "400"))
BATCH, AT_LEAST = 100, 5
"""Games of one test, and the least refusals of each damage among them."""


@dataclass(frozen=True)
class Sample:
    """A random game with an automaton that wins it for one of the players."""

    seed: int
    solution: Solution
    spec: Specification
    automaton: Automaton
    counter: bool

    def parsed(self, automaton: Automaton) -> Strategy:
        return Strategy.parse(to_json(automaton).encode(), self.spec)

    def verify(self, strategy: Strategy) -> Verification:
        return verify(self.spec, strategy, self.counter)

    @cached_property
    def strategy(self) -> Strategy:
        return self.parsed(self.automaton)

    @cached_property
    def starts(self) -> list[int]:
        return [*self.strategy.initial(self.counter)]

    def begins(self) -> set[int]:
        """The states of its initial nodes: all from which the system wins; of a counterstrategy
        those with the inputs that it has chosen."""
        game = self.solution.game
        possible = game.env_init & game.sys_init
        if not self.counter:
            return {*np.flatnonzero(possible & self.solution.winning).tolist()}
        chosen = [game.place[node.state][0] for node in self.automaton.nodes[:1]]
        return {s for s in np.flatnonzero(possible).tolist() if game.place[s][0] in chosen}

    def complaints(self, automaton: Automaton, strategy: Strategy) -> list[str]:
        """What the oracle's own checker says about the reachable part: it looks at all nodes."""
        reachable = without_unreachable(automaton, [*strategy.initial(self.counter)])
        return (check_counterstrategy if self.counter else check_strategy)(
            self.solution.game, reachable
        )


def samples(seeds: range, synthesizer: Synthesizer) -> list[Sample]:
    """The oracle's strategies of the realizable ones among random games, and what slugs answers to
    the others."""
    found = list[Sample]()
    for seed in seeds:
        source = Random(seed)
        drawn = random_specification(
            source, integers=seed % 2 == 0, bits=3 + seed % 4, many_goals=seed % 3 != 1
        )
        reference = inputs_first(drawn)
        solution = solve(build_game(reference))
        spec = read_specification(to_structuredslugs(reference, source))
        if counter := not solution.realizable():
            result = synthesizer.counterstrategy(spec)
            assert result.verdict is Verdict.UNREALIZABLE and result.strategy_json is not None
            automaton = from_json(reference, result.strategy_json.decode())
        else:
            automaton = extract(solution)
        found.append(Sample(seed, solution, spec, automaton, counter))
    return found


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Edges are evaluated in blocks: also those of small automata in several."""
    monkeypatch.setattr("safenav.verify.automaton._BLOCK_EDGES", 16)


@pytest.fixture
def synthesizer(slugs: Path, monkeypatch: pytest.MonkeyPatch) -> Synthesizer:
    monkeypatch.setenv("SAFENAV_CACHE", "off")
    return Synthesizer(slugs)


@pytest.mark.parametrize("first", range(0, GAMES, BATCH))
def test_automata_of_oracle_and_slugs_are_accepted_and_damage_is_refused_for_the_right_reason(
    first: int, synthesizer: Synthesizer
) -> None:
    """Each proves its verdict, and not the other one. Damage may do no harm; but what the oracle
    refuses is refused, and each complaint is true."""
    batch = samples(range(first, min(first + BATCH, GAMES)), synthesizer)
    tally = Counter[tuple[bool, str]]()
    for sample in batch:
        verification = sample.verify(sample.strategy)
        assert verification.ok, f"seed {sample.seed}: {verification.failures[0]}"
        starts = [sample.automaton.nodes[n].state for n in sample.starts]
        assert sorted(starts) == sorted(sample.begins()), sample.seed
        if sample.seed % 2:
            assert not verify(sample.spec, sample.strategy, not sample.counter).ok, sample.seed
        tally[sample.counter, "sound"] += 1
        for damage in DAMAGES if sample.automaton.edges else ():
            tally[sample.counter, damage.__name__] += refusals(sample, damage)
    if len(batch) == BATCH:
        assert all(tally[counter, "sound"] > BATCH // 4 for counter in (False, True)), tally
        for damage in DAMAGES:
            assert all(tally[counter, damage.__name__] >= AT_LEAST for counter in (False, True)), (
                tally
            )


def refusals(sample: Sample, damage: Damage) -> int:
    """How often damage to a sound automaton is refused."""
    source, sound, count = Random(f"{sample.seed} {damage.__name__}"), sample.automaton, 0
    for _ in range(6 if damage is no_memory else 2):  # few games have memory to confuse
        automaton = damaged(sound, damage, sample.starts, source)
        if automaton == sound:
            continue
        strategy = sample.parsed(automaton)
        verification = sample.verify(strategy)
        if verification.ok:
            assert sample.complaints(automaton, strategy) == [], f"seed {sample.seed}"
            continue
        count += 1
        for failure in verification.failures:
            _confirm(sample, strategy, failure)
    return count


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
        missed = {
            section: {
                c.formula for c in spec.section(section) if not _met(strategy, steps, c.formula)
            }
            for section in (Section.ENV_LIVENESS, Section.SYS_LIVENESS)
        }
        if failure.fault is Fault.GOALS_MET:
            assert not missed[Section.SYS_LIVENESS], words
            return
        assert failure.constraint is not None
        assert failure.constraint.formula in missed[failure.constraint.section], words
        assert failure.fault is Fault.STARVED_ASSUMPTION or not missed[Section.ENV_LIVENESS], words
    elif failure.fault in (Fault.FORBIDDEN_INPUT, Fault.BROKEN_GUARANTEE):
        assert failure.constraint is not None, words
        assert failure.successor in strategy.transitions[node], words
        assert not _met(strategy, [(node, failure.successor)], failure.constraint.formula), words


def _met(strategy: Strategy, steps: list[tuple[int, int]], formula: str) -> bool:
    holds = truth(formula)
    return any(holds(strategy.values(a), strategy.values(b)) for a, b in steps)


def test_a_value_outside_the_range_of_its_variable_is_a_failure(
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


PAIRS = [f"b{i} != b{59 - i}" for i in range(30)]
"""Of 2^30 beginnings of a move, tied last, all but two are alike."""
FIRST = " ".join([f"!b{i}" for i in range(30)] + [f"b{i}" for i in range(30, 60)])


@pytest.mark.parametrize(
    ("assumed", "promised", "counter", "missing"),
    [
        pytest.param(PAIRS, [], False, FIRST, id="the first of 2^30 is missing"),
        pytest.param([*PAIRS, "b58 & b59 & b0"], [], False, None, id="no input is possible"),
        pytest.param(["b0 -> b3", "b1 | b2"], [], False, "!b0 !b1 b2 !b3", id="unconnected"),
        pytest.param(PAIRS, ["done & (b59 | b0)"], True, "", id="each of 2^30 has an answer"),
        pytest.param([], ["done & (b59 | b0)"], True, None, id="some of 2^60 have none"),
    ],
)
def test_huge_sets_of_moves_are_never_enumerated(
    assumed: list[str], promised: list[str], counter: bool, missing: str | None
) -> None:
    """Sixty Boolean inputs have 2^60 valuations; an automaton without nodes lacks some of them."""
    inputs = [f"b{i}" for i in range(60)]
    lines = ["[INPUT]", *inputs, "[OUTPUT]", "done", "[ENV_INIT]", *assumed]
    spec = read_specification("\n".join([*lines, "[SYS_INIT]", *promised]) + "\n")
    empty = json.dumps({"variables": [*inputs, "done"], "nodes": {}}).encode()
    found = verify(spec, Strategy.parse(empty, spec), counter).failures
    assert [each.fault for each in found] == [Fault.NO_START] * (missing is not None)
    assert all((missing or "") in each.detail for each in found)


@pytest.mark.parametrize(
    "inputs",
    [["x:0...70000"], [f"x{i}:0...9999" for i in range(4)]],
    ids=["of one variable", "of four tied ones"],
)
def test_constraints_on_too_many_values_exceed_a_limit(inputs: list[str]) -> None:
    names = " + ".join(each.partition(":")[0] for each in inputs)
    lines = ["[INPUT]", *inputs, "[ENV_INIT]", f"{names} != 3"]
    spec = read_specification("\n".join(lines) + "\n")
    bits = [bit for variable in spec.variables for bit in bit_names(variable)]
    empty = Strategy.parse(json.dumps({"variables": bits, "nodes": {}}).encode(), spec)
    with pytest.raises(ResourceLimitError, match="constraints tie too many values"):
        verify(spec, empty)


@pytest.mark.parametrize(
    ("last", "faults"), [("z' = 7", []), ("(z' = 7 | z' = 511)", [Fault.MISSING_SUCCESSOR])]
)
def test_inputs_tied_by_equations_are_not_enumerated(last: str, faults: list[Fault]) -> None:
    """2^27 values of three tied inputs, of which one or two are possible; one has a successor."""
    inputs = "[INPUT]\nx:0...511\ny:0...511\nz:0...511\n"
    text = f"{inputs}[ENV_TRANS]\nx' = y'\ny' = z' & {last}\n"
    node = {"rank": 0, "state": [1, 1, 1, *[0] * 6] * 3, "trans": [0]}
    names = [f"{n}@{k}" if k else f"{n}@0.0.511" for n in "xyz" for k in range(9)]
    spec = read_specification(text + "[ENV_INIT]\nx + y + z = 21\nx = 7\ny = 7\n")
    strategy = Strategy.parse(json.dumps({"variables": names, "nodes": {"0": node}}).encode(), spec)
    assert [failure.fault for failure in verify(spec, strategy).failures] == faults


GRAMMAR = from_yaml(beside(__file__, "grammar.yaml"))
DECLARED = "[INPUT]\ni\nF\nn:0...1\nX:1...4\n[OUTPUT]\nm:0...3\nnext:0...2\nU\nor\n[SYS_LIVENESS]\n"


def written(source: Random, word: str, depth: int = 4) -> str:
    """Return a random line, or a part of it that this ``word`` of the grammar stands for."""
    form = source.choice([form for form in GRAMMAR[word] if depth or "<" not in form])
    return re.sub(r"<(\w+)>", lambda part: written(source, part[1], max(0, depth - 1)), form)


@pytest.mark.parametrize("seed", range(20))
def test_a_line_that_slugs_reads_is_read_with_its_meaning(
    seed: int, played: Callable[[], None]
) -> None:
    source, done = Random(seed), None
    lines = [written(source, "line") for _ in range(100)]
    while done is None or done.returncode:
        text = DECLARED + "\n".join(lines)
        done = run([find_binary(), "--translate", "-"], input=text, capture_output=True, text=True)
        wrong = {int(row) - 12 for row in re.findall(r"(?m)^-:(\d+):\d+: error", done.stderr)}
        lines = [line for number, line in enumerate(lines) if number not in wrong]
    spec = read_specification(text)
    translated = read_slugsin(done.stdout).sys_liveness
    for constraint, meant in zip(spec.constraints, translated, strict=True):
        one, other = predicate(formula_of(constraint)), truth(meant)
        for _ in range(8):
            now, then = (drawn_values(spec, source) for _ in range(2))
            assert one(now, then) == other(now, then), constraint.formula
    if len(lines) >= 50:
        played()


def drawn_values(spec: Specification, source: Random) -> dict[str, int]:
    """Values of all variables, and of the bits of numbers."""
    found = {variable.name: source.choice(variable.range) for variable in spec.variables}
    bits = ((v, k, bit) for v in spec.variables for k, bit in enumerate(bit_names(v)))
    return found | {bit: found[v.name] - v.range[0] >> k & 1 for v, k, bit in bits}
