"""The checker of strategies against an oracle of its own: random games, sound and damaged."""

import json
import re
from random import Random

import pytest

from oracle import (
    Specification,
    build_game,
    check_counterstrategy,
    check_strategy,
    counterstrategy_from_parity,
    extract,
    initial_states,
    inputs_first,
    is_realizable,
    losing_inputs,
    random_specification,
    solve,
    solve_parity,
    to_json,
)
from oracle.automaton import Automaton
from oracle.damage import DAMAGES
from oracle.rendering import infix
from oracle.specification import SECTIONS
from safenav.certify.checker import check_strategies as checker
from safenav.certify.evidence import counter_evidence, strategy_measures
from safenav.certify.measures import NoMeasureError, components, measure

BATCH = 25


def random_game(seed: int) -> Specification:
    source = Random(seed)
    return inputs_first(random_specification(source, integers=seed % 3 == 0, bits=3 + seed % 4))


def text_of(specification: Specification, source: Random) -> str:
    """A specification as structured slugs, in infix notation."""
    lines = []
    for owner in ("input", "output"):
        lines.append(f"[{owner.upper()}]")
        for variable in specification.variables:
            bounds = "" if variable.range is None else ":{}...{}".format(*variable.range)
            lines += [f"{variable.name}{bounds}"] * (variable.owner == owner)
    for section in SECTIONS:
        lines.append(f"[{section.upper()}]")
        lines += [infix(formula, source) for formula in specification.section(section)]
    return "\n".join(lines) + "\n"


def refused(text: str, strategy: str) -> str:
    """Why the checker refuses a strategy with the best measures that there are, or ''."""
    spec = checker.read_specification(text)
    try:
        measures = strategy_measures(text, strategy.encode())
        checker.check_strategy(spec, checker.Strategy(json.loads(strategy), spec), measures)
    except (checker.RefusedError, NoMeasureError) as reason:
        return str(reason)
    return ""


def counter_refused(text: str, strategy: str) -> str:
    spec = checker.read_specification(text)
    try:
        evidence = counter_evidence(text, strategy.encode())
        graph = checker.Strategy(json.loads(strategy), spec)
        checker.check_counterstrategy(spec, graph, evidence.to_data())
    except (checker.RefusedError, NoMeasureError, LookupError) as reason:
        return str(reason) or "refused"
    return ""


@pytest.fixture
def twins(batch: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In every other batch all inputs may make twins, whatever their names."""
    if batch % 2:
        monkeypatch.setattr(checker, "PASSING", re.compile(r"\w+"))


@pytest.mark.usefixtures("twins")
@pytest.mark.parametrize("batch", range(12))
def test_the_checker_and_the_oracle_agree_on_sound_and_damaged_strategies(batch: int) -> None:
    for seed in range(batch * BATCH, (batch + 1) * BATCH):
        source = Random(seed)
        specification = random_game(seed)
        game, text = build_game(specification), text_of(specification, source)
        winning = solve(game).winning
        if not is_realizable(game, winning):
            parity = solve_parity(game)
            starts = losing_inputs(game, winning)[0] & initial_states(game)
            counter = counterstrategy_from_parity(parity, starts)
            if counter.nodes:
                assert counter_refused(text, to_json(specification, counter)) == "", seed
            continue
        automaton = extract(solve(game))
        assert refused(text, to_json(specification, automaton)) == "", seed
        if any(node.successors for node in automaton.nodes):
            for damage in DAMAGES:
                broken = damage(automaton, [0], source)
                verdict = refused(text, to_json(specification, broken))
                if "beyond its range" in verdict:  # also in a node that nothing leads to
                    continue
                assert bool(verdict) == bool(check_strategy(game, broken)), (seed, damage.__name__)


@pytest.mark.usefixtures("twins")
@pytest.mark.parametrize("batch", range(6))
def test_a_counterstrategy_that_the_oracle_rejects_is_refused(batch: int) -> None:
    judged = 0
    for seed in range(1000 + batch * BATCH, 1000 + (batch + 1) * BATCH):
        source = Random(seed)
        specification = random_game(seed)
        game, text = build_game(specification), text_of(specification, source)
        winning = solve(game).winning
        if is_realizable(game, winning):
            continue
        starts = losing_inputs(game, winning)[0] & initial_states(game)
        counter = counterstrategy_from_parity(solve_parity(game), starts)
        if not any(node.successors for node in counter.nodes):
            continue
        for damage in DAMAGES:
            broken: Automaton = damage(counter, [0], source)
            if check_counterstrategy(game, broken):
                judged += 1
                assert counter_refused(text, to_json(specification, broken)), (
                    seed,
                    damage.__name__,
                )
    assert judged


def test_a_measure_that_does_not_fall_is_refused() -> None:
    text = "[INPUT]\n[OUTPUT]\nx\n[SYS_LIVENESS]\nx'\n"
    nodes = {"0": {"state": [0], "trans": [1]}, "1": {"state": [1], "trans": [0]}}
    spec = checker.read_specification(text)
    strategy = checker.Strategy({"variables": ["x"], "nodes": nodes}, spec)
    good = [{"n": [0, 1], "a": [None, None]}]
    checker.check_strategy(spec, strategy, good)
    for numbers in ([0, 0], [1, 0], [1, 1]):
        with pytest.raises(checker.RefusedError, match="does not fall from node 1 to node 0"):
            checker.check_strategy(spec, strategy, [{"n": numbers, "a": [None, None]}])
    for wrong in ([], [{"n": [0], "a": [None]}], [{"n": [0, -1], "a": [None, None]}]):
        with pytest.raises((checker.RefusedError, ValueError, LookupError)):
            checker.check_strategy(spec, strategy, wrong)


def test_twins_are_looked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes 0 and 1 differ in what was observed alone, 2 and 3 in what they lead to as well."""
    text = "[INPUT]\nbusy_east\n[OUTPUT]\nx\n[SYS_LIVENESS]\nx'\n"
    states, after = [[0, 0], [1, 0], [0, 1], [1, 1]], [[2, 3], [2, 3], [0, 1], [2, 3]]
    nodes = {str(k): {"state": states[k], "trans": after[k]} for k in range(4)}
    document = {"variables": ["busy_east", "x"], "nodes": nodes}
    graph = checker.Strategy(document, checker.read_specification(text))
    assert graph.first == [0, 0, 2, 3]
    assert list(graph.pairs()) == [(0, 2), (0, 3), (2, 0), (2, 0), (3, 2), (3, 3)]
    read = text.replace("x'\n", "x' | busy_east\n")
    assert checker.Strategy(document, checker.read_specification(read)).first == [0, 1, 2, 3]
    monkeypatch.setattr(checker, "MOST_EDGES", 5)
    with pytest.raises(checker.TooLargeError, match="6 edges"):
        checker.Strategy(document, checker.read_specification(text))


def test_components_come_after_what_they_lead_to() -> None:
    assert components([[1], [2], [1, 3], []]) == [[3], [2, 1], [0]]


def test_a_cycle_that_meets_every_assumption_and_no_goal_has_no_measure() -> None:
    graph = [[1], [0]]
    assert measure(graph, "00", ["10", "00"]).assumptions == [1, 1]
    with pytest.raises(NoMeasureError):
        measure(graph, "00", ["10", "01"])


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("x = ", "is not expected in"),
        ("y", "y must not stand here"),
        ("(x", "a bracket is open"),
        ("next(x')", "x'' must not stand here"),
        ("x ? y", "cannot read"),
        ("| x x", "is not expected in"),
    ],
)
def test_a_line_that_is_not_understood_is_refused(line: str, reason: str) -> None:
    with pytest.raises(checker.RefusedError, match=reason):
        checker.read_specification(f"[INPUT]\n[OUTPUT]\nx\n[SYS_TRANS]\n{line}\n")


def test_a_guarantee_may_not_be_an_assumption() -> None:
    with pytest.raises(checker.RefusedError, match="x' must not stand here"):
        checker.read_specification("[INPUT]\ni\n[OUTPUT]\nx\n[ENV_TRANS]\nx'\n")
