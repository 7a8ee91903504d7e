"""Unrealizable tasks with assignable goals: the proof also defeats a robot that leaves the poses to
which it must be able to return. Its specification forbids that, the scenario does not."""

import json
from collections.abc import Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from certify.tasks import Circumstances, scenario_of, verdict_of
from safenav.certify import bundle
from safenav.certify.checker.check_run import Evidence
from safenav.certify.checker.check_strategies import (
    RefusedError,
    Strategy,
    check_counterstrategy,
)
from safenav.scenario.model import Scenario
from safenav.spec.task import Fairness

HOLDS = (
    scenario_of(
        "#####\n#.#.#\n#...#\n#...#\n#####",
        "r0: {model: walker, tracking: belief, vision: 2, start: [2, 3], heading: south, "
        "objective: {hold: [2, 3]}}\n"
        "r1: {model: walker, tracking: belief, vision: 2, start: [2, 1], heading: south, "
        "objective: {hold: [3, 2]}}",
    ),
    Circumstances(fairness=Fairness.OFF_MY_TARGETS, assignable=True),
)
REMEMBERS = (
    scenario_of(
        "#..\n...\n#..\n...",
        "r0: {model: walker, start: [3, 1], heading: west, objective: {ltl: {memory: {seen: bool}, "
        "init: '!seen', safety: \"seen' <-> seen | region = 1\", "
        "liveness: [\"region' = 1 & seen'\"]}}}\n"
        "r1: {model: rover, start: [0, 2], objective: {hold: [2, 2]}}\n"
        "r2: {model: rover, start: [2, 2], objective: {hold: [1, 1]}}",
        "obstacles: [{type: door, region: 5}]\n",
    ),
    Circumstances(closed=(5,), assignable=True),
)
CASES = pytest.mark.parametrize(("scenario", "about"), [HOLDS, REMEMBERS])


@CASES
def test_the_checker_accepts_a_proof_that_also_defeats_leaving_permanently(
    scenario: Scenario, about: Circumstances, tmp_path: Path
) -> None:
    assert verdict_of(scenario, tmp_path, about) == ""


def proof_of(folder: Path) -> tuple[Path, str, Any]:
    """The file of the only counterstrategy, its specification, and the proof in it."""
    (path,) = (folder / "counterstrategies").iterdir()
    text = (folder / "specs" / f"{path.stem}.structuredslugs").read_text()
    return path, text, json.loads(path.read_text())


def judged(folder: Path) -> str:
    """Why the checker of bundles refuses the files, or ''."""
    files = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    try:
        Evidence(files).replay(rules=())
    except RefusedError as error:
        return str(error)
    return ""


def without_leaving(text: str, proof: Any) -> Iterator[Any]:
    """The proof without one of the replies that the specification forbids."""
    graph = Strategy(proof["automaton"], text)
    for node in graph.reach(graph.begin):
        edges = [node] * len(graph.next[node]), graph.next[node]
        for target, allowed in zip(edges[1], graph.allowed(edges), strict=True):
            if not allowed:
                mutant = deepcopy(proof)
                mutant["automaton"]["nodes"][str(node)]["trans"].remove(target)
                yield mutant


def test_a_proof_without_such_a_reply_is_refused(tmp_path: Path) -> None:
    """The text alone accepts it: it forbids the reply."""
    assert verdict_of(HOLDS[0], tmp_path, HOLDS[1]) == ""
    path, text, proof = proof_of(tmp_path)
    mutants = [*without_leaving(text, proof)]
    assert mutants
    for mutant in mutants:
        path.write_text(json.dumps(mutant))
        graph = Strategy(mutant["automaton"], text)
        check_counterstrategy(graph, graph, mutant, mutant["measures"])
        assert "the robot could continue to" in judged(tmp_path)


@CASES
def test_a_proof_of_the_specification_alone_is_refused(
    scenario: Scenario, about: Circumstances, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bundle, "may_leave", lambda spec: spec)
    assert "the robot could continue to" in verdict_of(scenario, tmp_path, about)
