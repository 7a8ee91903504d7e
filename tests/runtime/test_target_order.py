"""Targets in strict order, forever or once; others are ``cases/objectives``."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

from certify.making import THREE, bundle_at, certified, files_of, judged, rewrite, shipped
from once import SCENARIOS
from runtime.facts import case
from runtime.played import Run, completed, play
from safenav.plan import search

SHARED = """
map: {grid: ["########", "#......#", "#......#", "#......#", "########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}
robots:
  a: {model: cart, start: [1, 1], objective: {patrol: [[1, 6], [3, 6], [3, 1]]}}
  b: {model: cart, start: [3, 6], objective: {patrol: [[1, 1], [2, 3]]}}
until: {rounds: 3}
"""
ALONE = """
map: {grid: ["########", "#......#", "#......#", "#......#", "########"]}
catalogue:
  robots:
    cart:
      {mobility: free, layer: ground, capabilities: [], motion: disc, speed: 1,
       battery: {capacity: 20, move: 1, stay: 0, charge: 4}}
robots:
  a: {model: cart, start: [1, 1], objective: {patrol: [[1, 6], [3, 6], [3, 1]], within: 14}}
chargers: [[2, 1]]
"""
CHARGER = 17


def strict(path: list[int], targets: list[int]) -> bool:
    """Whether a walk touches the targets one after the other, each for one tick only."""
    met = [(tick, targets.index(r)) for tick, r in enumerate(path) if r in targets]
    return all(after[1] == (before[1] + 1) % len(targets) for before, after in pairwise(met))


def test_targets_of_a_patrol_are_met_in_strict_order_also_after_helping() -> None:
    trace = completed(THREE)
    begun = {name: trace.all("synthesis", robot=name)[-1]["tick"] for name in ("quad", "digit")}
    for robot, targets in (("quad", [54, 49, 37]), ("digit", [58, 28, 20])):
        assert strict(trace.path(robot)[begun[robot] :], targets)
        assert trace.all("synthesis", robot=robot)[-1].get("form") in (None, "literal")


def met_in_order(trace: Run, robot: str, count: int) -> bool:
    """Whether its goals follow each other; a charger is not a target."""
    met = (goal for goal in trace.all("goal", robot=robot) if goal["region"] != CHARGER)
    return all(b == (a + 1) % count for a, b in pairwise(goal["goal"] for goal in met))


@pytest.mark.parametrize(
    ("text", "more"),
    [
        (SHARED, ""),
        (SHARED, "clock: live\n"),
        (SHARED, "coordination: assignable\n"),
        (ALONE, ""),
    ],
    ids=["shared", "live", "assignable", "energy and deadlines"],
)
def test_targets_are_met_in_order_among_others_live_and_with_deadlines(
    text: str, more: str
) -> None:
    trace = completed(text + more)
    assert met_in_order(trace, "a", 3)
    if text == SHARED:
        assert {s["form"] for s in trace.all("synthesis", robot="a")} == {"alternation"}


def test_a_bundle_proves_that_no_target_is_crossed_out_of_turn() -> None:
    status, said = judged(shipped("three"))
    assert status == 0, said
    claims = re.findall(r"keeps-\d+: Tick 0: (.*)", said)
    assert len(claims) == 2 and all("without crossing" in claim for claim in claims)


@pytest.mark.parametrize(
    ("kind", "before", "after"),
    [
        ("patrol", r"patrol(\W+)54,(\s*)49,(\s*)37", r"patrol\g<1>54,\g<2>37,\g<3>49"),
        ("visit", r"visit(\W+54,\s*49,\s*37)", r"patrol\1"),
        ("patrol", r"patrol(\W+58,\s*28,\s*20)", r"round\1"),
    ],
    ids=["another order", "strategies that may cross", "an unknown kind"],
)
def test_a_bundle_whose_strategies_guarantee_less_is_refused(
    kind: str, before: str, after: str, tmp_path: Path
) -> None:
    text = THREE.replace("patrol: [54", f"{kind}: [54")
    bundle = shipped("three") if kind == "patrol" else bundle_at("visiting", text)
    files = files_of(bundle)
    told, changes = re.subn(before, after, files["trace.jsonl"].decode())
    assert changes
    files["trace.jsonl"] = told.encode()
    assert judged(rewrite(bundle, files, tmp_path))[0] == 1


CASE_STUDY_1 = (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0]
ROOMS = CASE_STUDY_1.replace("patrol: [54, 49]", "once: [54, 49, 37]").replace("patrol", "once")


@pytest.mark.parametrize("coordination", ["resynthesis", "assignable"])
def test_targets_are_met_once_in_order_also_after_helping(coordination: str) -> None:
    trace = completed(f"{ROOMS}coordination: {coordination}\n")
    for robot, targets in (("quad", [54, 49, 37]), ("digit", [58, 28])):
        path = trace.path(robot)
        assert path[-1] == targets[-1]
        met = [path.index(target) for target in targets[:-1]]
        assert met == sorted(met)
    assert [g["goal"] for g in trace.all("goal", robot="quad") if g["region"] != 46] == [0, 1, 2]


def test_a_bundle_proves_that_targets_are_met_once_in_order() -> None:
    assert "once, in this order, and stay at the last' obeys the scenario" in certified(ROOMS)


def test_a_proof_that_exceeds_its_budget_is_not_a_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "PROOF", 1)
    monkeypatch.setattr(search, "SINGLES", 1)
    assert play(case("objectives/once_with_a_trapped_helper")).outcome["outcome"] == "search_limit"
