"""Each sentence that ``safenav explain`` prints about a random specification is checked by brute
force; a sentence without a check fails the test. ``SAFENAV_FUZZ=500`` tries so many."""

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from random import Random

import networkx
import pytest

from explain.conftest import Answer, Invoke
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
from oracle.automaton import Automaton, from_json
from oracle.checker import check_strategy
from oracle.formula import Atom, Not
from oracle.game import Game, build_game
from oracle.rendering import to_plain
from oracle.specification import Specification
from safenav.cli.synth import explain, synth

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 24
SEEDS = range(COUNT)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_sentence_about_a_specification_is_true(
    seed: int, tmp_path: Path, invoke: Invoke
) -> None:
    source = Random(seed)
    spec = drawn(source)
    while realizable(spec):
        spec = drawn(source)
    text, places = to_plain(spec, source)
    file = tmp_path / "s.structuredslugs"
    file.write_text(text)
    answer = invoke(explain, file)
    assert answer.status == 1, answer.error + text
    data = json.loads(invoke(explain, file, "--json").output)["unrealizable"]
    judge = Judge(spec, [places[int(c["item"].rpartition(":")[2])] for c in data["core"]])
    print(text, answer.output, sep="\n")
    check_text(answer, spec, judge, places)
    check_data(data, judge, places)


def check_data(data: dict, judge: Judge, places: dict[int, Line]) -> None:  # type: ignore[type-arg]
    """Check the same as data, and the whole play."""
    assert judge.fails()
    assert data["minimal"] and judge.minimal()
    omitted = [judge.suffices_to_omit(k) for k in range(len(judge.core))]
    assert data["rest_realizable_without_any_one"] == all(omitted)
    assert len(data["still_unrealizable_without"]) == omitted.count(False)
    together = realizable_together(judge.part)
    assert data["realizable_with_a_cooperating_environment"] == together
    play = data["play"]
    assert play is not None
    goal = play["goal"] and places[int(play["goal"]["item"].rpartition(":")[2])][1]
    judge.check_play(play["ending"], play["moments"], play["cycle"], play["inputs"], goal)


def check_text(answer: Answer, spec: Specification, judge: Judge, places: dict[int, Line]) -> None:
    """Check each printed line by its words."""
    lines = iter(answer.output.splitlines())
    assert re.fullmatch(r".*: unrealizable", next(lines))
    heading = next(lines)
    listed, line = _listed(lines)
    core = [places[number] for number in listed]
    assert core == list(judge.core)
    every = range(len(core))
    match heading:
        case "These guarantees conflict; without any one of them, the rest is realizable:":
            assert len(core) > 1 and all(map(judge.suffices_to_omit, every))
        case "This guarantee cannot be kept; without it, the rest is realizable:":
            assert len(core) == 1 and judge.suffices_to_omit(0)
        case "These guarantees conflict; without any one of them, the others do not:":
            assert len(core) > 1 and judge.minimal()
        case "This guarantee cannot be kept:":
            assert len(core) == 1
        case _:
            raise AssertionError(heading)
    if line == "  (realizable if the environment cooperated)":
        assert realizable_together(spec)
        line = next(lines, "")
    elif line == "  (these alone are realizable if the environment cooperated)":
        assert realizable_together(judge.part) and not realizable_together(spec)
        line = next(lines, "")
    else:
        assert not realizable_together(judge.part)
    if line.startswith("  (another conflict remains: still unrealizable without "):
        words = line.split(" without ", 1)[1].rstrip(")")
        if found := re.findall(r"line (\d+)", words):
            kept = [listed.index(int(number)) for number in found]
            assert not any(map(judge.suffices_to_omit, kept))
        else:
            count = int((re.findall(r"of (\d+) of them", words) or [len(core)])[0])
            assert sum(not judge.suffices_to_omit(k) for k in every) == count
        line = next(lines, "")
    if line == "even under these assumptions:":
        numbers, line = _listed(lines)
        fair = [places[number] for number in numbers]
        assert fair == [each for each in lines_of(spec) if each[0] == "env_liveness"]
    assert (line, next(lines)) == ("", "What happens:")
    for line in lines:
        if not line:
            break
        check_play_line(line.strip(), judge, places)
    if rest := list(lines):
        assert rest[0] == "Any one of these assumptions suffices (each was tried):"
        for line in rest[1:]:
            negated, name = re.fullmatch(r"  - \[ENV_LIVENESS\] (!?)(\w+)'", line).groups()  # type: ignore[union-attr]
            fair_line = Not(Atom(name, True)) if negated else Atom(name, True)
            more = with_lines(spec, [*lines_of(spec), ("env_liveness", fair_line)])
            assert realizable(more) and not realizable(never(more))


def check_play_line(line: str, judge: Judge, places: dict[int, Line]) -> None:
    """Check that a line of a play is one of the known ones; the data has the play itself."""
    if found := re.fullmatch(r"and never line (\d+) \[SYS_LIVENESS\] .*", line):
        assert places[int(found[1])] in judge.core
    elif found := re.fullmatch(r"the initial inputs (.*) leave no output .*", line):
        values = {n: int(v) for n, v in (pair.split("=") for pair in found[1].split())}
        allowed = judge.inputs(values) & judge.game.env_init
        assert allowed and not allowed & judge.game.sys_init
    elif line == "no initial output satisfies the guarantees":
        assert not judge.game.env_init & judge.game.sys_init
    else:
        assert re.fullmatch(
            r"then (the inputs (\w+=\d+ ?)+|the environment's move) leaves? "
            r"no reply that keeps all guarantees|then forever (this|these \d+) again:|"
            r"(!?\w+(=\d+)? ?)+|\.\.\. \d+ more|\(no variables\)",
            line,
        ), line


def _listed(lines: Iterator[str]) -> tuple[list[int], str]:
    """Return the numbers of the listed lines, and the first line that is not listed."""
    numbers = list[int]()
    for line in lines:
        found = re.match(r"  - line (\d+) \[", line)
        if found is None:
            return numbers, line
        numbers.append(int(found[1]))
    return numbers, ""


@pytest.mark.parametrize("seed", SEEDS)
def test_every_warning_about_a_realizable_specification_is_true(
    seed: int, tmp_path: Path, invoke: Invoke
) -> None:
    source = Random(10_000 + seed)
    spec = drawn(source)
    while not realizable(spec):
        spec = drawn(source)
    text, places = to_plain(spec, source)
    file = tmp_path / "s.structuredslugs"
    file.write_text(text)
    answer = invoke(explain, file)
    assert answer.status == 0 and answer.output.endswith("is realizable: nothing to explain\n")
    print(text, answer.error, sep="\n")
    assert invoke(synth, file, "-o", tmp_path).status == 0
    strategy = from_json(spec, (tmp_path / "s.json").read_text())
    assert not check_strategy(build_game(spec), strategy)
    for warning in answer.error.split("warning: ")[1:]:
        check_warning(warning.splitlines(), Judge(spec, []), strategy, places)


def check_warning(
    lines: list[str], judge: Judge, strategy: Automaton, places: dict[int, Line]
) -> None:
    """Check a warning about the strategy that ``safenav synth`` writes."""
    game, spec = build_game(judge.spec), judge.spec
    verb, cause = lines[0].split(" by breaking its own assumptions: ")
    named = [re.match(r"  assumption: line (\d+)", line) for line in lines[1:]]
    failing = [places[int(found[1])] for found in named if found is not None]
    path = [line.strip() for line in lines if line.startswith("    ")]
    if cause == "it could make the environment break an assumption from the start":
        assert verb == "the system could win" and realizable(never(spec))
        return
    assert verb == "the system may win"
    if cause == "no initial state satisfies the assumptions, so nothing is guaranteed":
        assert not game.env_init and {section for section, _ in failing} == {"env_init"}
        return
    states = [judge.state(values_in(words, spec)) for words in path if words[:3] != "..."]
    graph = networkx.DiGraph(
        (n, t) for n, node in enumerate(strategy.nodes) for t in node.successors
    )
    graph.add_nodes_from(range(len(strategy.nodes)))
    ends = [n for n, node in enumerate(strategy.nodes) if node.state == states[-1]]
    if cause == "a state can occur in which the assumptions allow no move":
        assert ends and not game.moves[states[-1]]
        return
    assert cause == "a state can occur from which these assumptions cannot all be met"
    fair = [spec.env_liveness.index(formula) for _, formula in failing]
    assert any(never_fair(game, graph, strategy, node, fair) for node in ends)


def never_fair(
    game: Game, graph: networkx.DiGraph, strategy: Automaton, node: int, fair: list[int]
) -> bool:
    """Whether no cycle that can be reached from a node meets all these assumptions, and no state
    without a move."""
    within = {node, *networkx.descendants(graph, node)}
    if any(not game.moves[strategy.nodes[n].state] for n in within):
        return False
    for part in networkx.strongly_connected_components(graph.subgraph(within)):
        steps = [
            (strategy.nodes[a].state, strategy.nodes[b].state)
            for a in part
            for b in strategy.nodes[a].successors
            if b in part
        ]
        if steps and all(any(game.assumptions[k][a] >> b & 1 for a, b in steps) for k in fair):
            return False
    return True


def values_in(words: str, spec: Specification) -> dict[str, int]:
    """Read the values of a state as they are printed."""
    values = {variable.name: 0 for variable in spec.variables}
    for word in [] if words == "(no variables)" else words.split():
        name, _, number = word.lstrip("!").partition("=")
        values[name] = int(number or word[0] != "!")
    return values
