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
    extract,
    inputs_first,
    is_realizable,
    random_specification,
    solve,
    to_json,
)
from oracle.automaton import Automaton
from oracle.damage import DAMAGES, extra_successor, missing_start
from oracle.duel import Duel
from oracle.rendering import infix
from oracle.specification import SECTIONS
from safenav.certify.checker import check_strategies as checker
from safenav.certify.evidence import counter_evidence, strategy_measures
from safenav.components import components
from safenav.verify.measures import NoMeasureError, measure

BATCH = 25
NOTHING = "no initial input is possible, so nothing is shown"


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
    try:
        measures = strategy_measures(text, strategy.encode())
        checker.check_realizes(checker.Strategy(json.loads(strategy), text), measures)
    except (checker.RefusedError, NoMeasureError, LookupError) as reason:
        return str(reason)
    return ""


def counter_refused(text: str, strategy: str) -> str:
    try:
        proof = counter_evidence(text, strategy.encode())
        graph = checker.Strategy(json.loads(strategy), text)
        checker.check_counterstrategy(graph, graph, proof, proof["measures"])
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
def test_the_checker_and_the_oracle_agree_on_sound_and_damaged_strategies(
    batch: int, duel: Duel
) -> None:
    for seed in range(batch * BATCH, (batch + 1) * BATCH):
        source = Random(seed)
        specification = random_game(seed)
        game, text = build_game(specification), text_of(specification, source)
        winning = solve(game).winning
        if not is_realizable(game, winning):
            counter = duel.counterstrategy(specification)
            if counter.nodes:
                assert counter_refused(text, to_json(specification, counter)) == "", seed
            continue
        automaton = extract(solve(game))
        said = refused(text, to_json(specification, automaton))
        assert said == ("" if automaton.nodes else NOTHING), seed
        if any(node.successors for node in automaton.nodes):
            for damage in DAMAGES:
                broken = damage(automaton, [0], source)
                verdict = refused(text, to_json(specification, broken))
                if "out of range" in verdict:  # also in an unreachable node
                    continue
                assert bool(verdict) == bool(check_strategy(game, broken)), (seed, damage.__name__)


@pytest.mark.usefixtures("twins")
@pytest.mark.parametrize("batch", range(6))
def test_a_counterstrategy_that_the_oracle_rejects_is_refused(batch: int, duel: Duel) -> None:
    judged = 0
    for seed in range(1000 + batch * BATCH, 1000 + (batch + 1) * BATCH):
        source = Random(seed)
        specification = random_game(seed)
        game, text = build_game(specification), text_of(specification, source)
        winning = solve(game).winning
        if is_realizable(game, winning):
            continue
        counter = duel.counterstrategy(specification)
        if not any(node.successors for node in counter.nodes):
            continue
        for damage in DAMAGES:
            if damage in (extra_successor, missing_start):
                continue  # what is left still beats the robot
            broken: Automaton = damage(counter, [0], source)
            if check_counterstrategy(game, broken):
                judged += 1
                assert counter_refused(text, to_json(specification, broken)), (
                    seed,
                    damage.__name__,
                )
    assert judged


FALLS = "the measure does not decrease from node"


@pytest.mark.parametrize(
    ("numbers", "excuses", "told"),
    [
        ([1, 0, 0], [None, 0, 0], None),
        ([9, 7, 7], [1, 0, 0], None),
        ([0, 0, 0], [0, 0, 0], None),
        ([0, 0, 0], [None, 0, 0], f"{FALLS} 0 to node 1"),
        ([1, 2, 2], [None, 0, 0], f"{FALLS} 0 to node 1"),
        ([9, 1, 0], [None, 0, 0], f"{FALLS} 2 to node 1"),
        ([1, 0, 0], [None, 0, None], f"{FALLS} 1 to node 2"),
        ([1, 0, 0], [None, 1, 1], f"{FALLS} 1 to node 2"),
        ([0, -1, -1], [None, 0, 0], "a negative value or names an unknown assumption"),
        ([1, 0, 0], [None, 2, 2], "a negative value or names an unknown assumption"),
        ([1, 0], [None, 0], "list index out of range"),
    ],
)
def test_any_progress_measure_that_decreases_or_has_a_violated_assumption_is_a_proof(
    numbers: list[int], excuses: list[int | None], told: str | None
) -> None:
    """The robot arrives (node 0) unless the input keeps it (nodes 1 and 2 in turn); one assumption
    is that the input is off again and again, the other that it is on."""
    formulas = "[SYS_TRANS]\nx' <-> !i'\n[ENV_LIVENESS]\n!i'\ni'\n[SYS_LIVENESS]\nx'\n"
    text = f"[INPUT]\ni\n[OUTPUT]\nx\ny\n{formulas}[SYS_INIT]\nx <-> !i\n"
    states, after = [[0, 1, 0], [1, 0, 0], [1, 0, 1]], [[0, 1], [0, 2], [0, 1]]
    nodes = {str(k): {"state": states[k], "trans": after[k]} for k in range(3)}
    strategy = checker.Strategy({"variables": ["i", "x", "y"], "nodes": nodes}, text)
    measures = [{"n": numbers, "a": excuses}]
    if told is None:
        checker.check_realizes(strategy, measures)
        return
    with pytest.raises((checker.RefusedError, LookupError), match=told):
        checker.check_realizes(strategy, measures)
    with pytest.raises(ValueError, match="shorter"):
        checker.check_realizes(strategy, [])


def test_the_formula_that_an_edge_violates_is_named() -> None:
    text = "[INPUT]\n[OUTPUT]\nx\n[SYS_TRANS]\nx | x'\nx' -> x\n"
    nodes = {"0": {"state": [0], "trans": [1]}, "1": {"state": [1], "trans": [0]}}
    graph = checker.Strategy({"variables": ["x"], "nodes": nodes}, text)
    with pytest.raises(checker.RefusedError, match=r"node 0 to node 1: x' -> x$"):
        checker.check_realizes(graph, [])


def test_equivalent_nodes_are_examined_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes 0 and 1 differ in what was observed alone, 2 and 3 in what they lead to as well."""
    text = "[INPUT]\nbusy_east\n[OUTPUT]\nx\n[SYS_LIVENESS]\nx'\n"
    states, after = [[0, 0], [1, 0], [0, 1], [1, 1]], [[2, 3], [2, 3], [0, 1], [2, 3]]
    nodes = {str(k): {"state": states[k], "trans": after[k]} for k in range(4)}
    document = {"variables": ["busy_east", "x"], "nodes": nodes}
    graph = checker.Strategy(document, text)
    assert graph.first == [0, 0, 2, 3]
    assert graph.reach([1]) == [0, 2, 3]
    assert graph.edges([0, 2, 3]) == ([0, 0, 2, 2, 3, 3], [2, 3, 0, 1, 2, 3])
    read = text.replace("x'\n", "x' | busy_east\n")
    assert checker.Strategy(document, read).first == [0, 1, 2, 3]
    told = text.replace("busy_east", "wait")  # what it tells matters: where a robot is sent next
    document["variables"] = ["wait", "x"]
    assert checker.Strategy(document, told).first == [0, 1, 2, 3]
    document["variables"] = ["busy_east", "x"]
    monkeypatch.setattr(checker, "MOST_EDGES", 5)
    with pytest.raises(checker.TooLargeError, match="6 edges"):
        checker.Strategy(document, text)


def test_components_come_after_what_they_lead_to() -> None:
    assert components([[1], [2], [1, 3], []]) == [[3], [2, 1], [0]]


def test_a_cycle_that_meets_every_assumption_and_no_goal_has_no_measure() -> None:
    edges, never = ([0, 1], [1, 0]), [False, False]
    assert measure(2, edges, never, [[True, False], never])["a"] == [1, 1]
    with pytest.raises(NoMeasureError):
        measure(2, edges, never, [[True, False], [False, True]])


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("x = ", "unexpected"),
        ("y", "y"),
        ("(x", "is not closed"),
        ("next(x')", "unexpected 'x''"),
        ("x ? y", "cannot read"),
        ("| x x", "unexpected"),
        ("!3", "uses a number as a condition"),
        ("x = 1", "uses a number as a condition"),
        ("1 < 2 < 3", "uses a number as a condition"),
        ("1 + x = 1", "uses a number as a condition"),
        ("3", "uses a number as a condition"),
        ("\uff58", "cannot read"),  # to Python the same name as x
    ],
)
def test_a_line_that_is_not_understood_is_refused(line: str, reason: str) -> None:
    with pytest.raises((checker.RefusedError, LookupError), match=reason):
        realized(f"[INPUT]\n[OUTPUT]\nx\n[SYS_TRANS]\n{line}\n", ["x"])


def test_a_guarantee_may_not_be_an_assumption() -> None:
    with pytest.raises(checker.RefusedError, match="a formula uses unknown variables: x'"):
        realized("[INPUT]\ni\n[OUTPUT]\nx\n[ENV_TRANS]\nx'\n", ["i", "x"])


def test_a_huge_range_is_not_listed() -> None:
    document = {"variables": [], "nodes": {}}
    text = "[INPUT]\ni:0...99999999999\n[ENV_INIT]\ni = 0\n"
    with pytest.raises(checker.TooLargeError, match="cases of i"):
        checker.check_realizes(checker.Strategy(document, text), [])


def realized(text: str, variables: list[str]) -> None:
    """Whether a strategy of one node for each value realizes a text, refused if it is none."""
    count = 1 << len(variables)
    states = [[node >> bit & 1 for bit in range(len(variables))] for node in range(count)]
    nodes = {str(k): {"state": state, "trans": [0]} for k, state in enumerate(states)}
    document = {"variables": variables, "nodes": nodes}
    checker.check_realizes(checker.Strategy(document, text), [])
