"""What ``safenav explain`` and ``synth`` claim about random specifications, checked by brute force.
``SAFENAV_FUZZ=500`` tries so many."""

import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import networkx
import pytest

from explain.conftest import Invoke
from explain.sentences.judge import (
    Judge,
    Line,
    lines_of,
    never,
    realizable,
    realizable_together,
    with_lines,
)
from explain.sentences.specifications import drawn
from oracle.automata import check_strategy, from_json
from oracle.game import build_game
from oracle.specification import Atom, Specification, apply
from oracle.text import to_plain
from safenav.cli.synth import explain
from safenav.explain.play import Cause, vacuities
from safenav.spec.specification import read_specification
from safenav.synthesis.slugs import Synthesizer

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 24
SEEDS = range(COUNT)


def _drawn(source: Random, wanted: Callable[[Specification], bool]) -> Specification:
    while not wanted(spec := drawn(source)):
        pass
    return spec


@pytest.mark.parametrize("seed", SEEDS)
def test_every_claim_about_a_specification_is_true(
    seed: int, tmp_path: Path, invoke: Invoke
) -> None:
    source = Random(seed)
    spec = _drawn(source, lambda one: not realizable(one))
    text, places = to_plain(spec, source)
    file = tmp_path / "s.structuredslugs"
    file.write_text(text)
    answer = invoke(explain, file, "--json")
    assert answer.status == 1, answer.error + text
    print(text, answer.output, sep="\n")
    data = json.loads(answer.output)["unrealizable"]

    def place(constraint: dict[str, Any]) -> Line:
        return places[int(constraint["origin"]["item"].rpartition(":")[2])]

    core = data["core"]
    members = [constraint for member in core["members"] for constraint in member["constraints"]]
    judge = Judge(spec, [*map(place, members)])
    assert judge.fails()
    assert core["minimal"] and judge.minimal()
    omitted = [judge.suffices_to_omit(k) for k in range(len(judge.core))]
    assert core["decisive"] == all(omitted)
    assert len(core["vain"]) == omitted.count(False)
    together = realizable_together(judge.part)
    assert core["together"] == together
    said, whole = invoke(explain, file).output, realizable_together(spec)
    assert ("the rest is realizable:" in said) == all(omitted)
    assert ("(realizable if the environment cooperated)" in said) == whole
    assert ("(these alone are realizable if" in said) == (together and not whole)
    play = data["play"]
    goal = play["goal"] and place(play["goal"])[1]
    judge.check_play(play["ending"], play["walk"], play["cycle"], dict(play["pressure"]), goal)
    for assumption in data["assumptions"]:
        negated, name = re.fullmatch(r"(!?)(\w+)'", assumption).groups()  # type: ignore[union-attr]
        fair = apply("!", Atom(name, True)) if negated else Atom(name, True)
        more = with_lines(spec, [*lines_of(spec), ("env_liveness", fair)])
        assert realizable(more) and not realizable(never(more))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_win_is_vacuous_exactly_if_the_environment_cannot_keep_its_assumptions(
    seed: int,
) -> None:
    source = Random(10_000 + seed)
    spec = _drawn(source, realizable)
    text, _ = to_plain(spec, source)
    result = Synthesizer().synthesize(read_specification(text))
    assert result.strategy is not None and result.strategy_json is not None
    automaton, game = from_json(spec, result.strategy_json.decode()), build_game(spec)
    assert not check_strategy(game, automaton)
    print(text)
    found = {each.cause: each.path for each in vacuities(result.strategy)}
    if not game.env_init.any():
        assert [*found] == [Cause.NO_BEGINNING]
        return
    graph = networkx.DiGraph(automaton.edges)
    graph.add_nodes_from(range(len(automaton.nodes)))
    starts = result.strategy.initial()
    reached = {*starts}.union(*(networkx.descendants(graph, start) for start in starts))
    stuck = {node for node in reached if not graph.adj[node]}
    alive = set(stuck)
    for part in networkx.strongly_connected_components(graph):
        steps = [
            (automaton.nodes[a].state, automaton.nodes[b].state)
            for a, b in graph.subgraph(part).edges
        ]
        if steps and all(any(game.has(fair, *step) for step in steps) for fair in game.assumptions):
            alive |= part
    unfair = {node for node in reached if not alive & {node, *networkx.descendants(graph, node)}}
    for cause, nodes in ((Cause.DEAD_END, stuck), (Cause.UNFAIR, unfair)):
        assert (cause in found) == bool(nodes)
        assert not nodes or (found[cause][0] in starts and found[cause][-1] in nodes)
