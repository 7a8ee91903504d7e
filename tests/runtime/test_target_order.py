"""Bundles about targets in strict order, forever or once; runs are ``cases/objectives``."""

import re
from pathlib import Path

import pytest

from certify.making import bundle_at, certified, files_of, judged, rewrite
from once import SCENARIOS
from runtime.facts import case
from runtime.played import play
from safenav.plan import search

CASE_STUDY_1 = (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0]
THREE = CASE_STUDY_1.replace("patrol: [54, 49]", "patrol: [54, 49, 37]").replace(
    "patrol: [58, 28]", "patrol: [58, 28, 20], form: literal"
)
"""Patrols between three targets, and a detour."""


def test_a_bundle_proves_that_no_target_is_crossed_out_of_turn() -> None:
    status, said = judged(bundle_at("three", THREE))
    assert status == 0, said
    claims = re.findall(r"keeps-\d+: Tick 0: (.*)", said)
    assert len(claims) == 2 and all("for 'patrol " in claim for claim in claims)


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
    files = files_of(bundle_at("three" if kind == "patrol" else "visiting", text))
    told, changes = re.subn(before, after, files["trace.jsonl"].decode())
    assert changes
    files["trace.jsonl"] = told.encode()
    assert judged(rewrite(files, tmp_path))[0] == 1


ROOMS = CASE_STUDY_1.replace("patrol: [54, 49]", "once: [54, 49, 37]").replace("patrol", "once")


def test_a_bundle_proves_that_targets_are_met_once_in_order() -> None:
    assert "for 'once " in certified(ROOMS)


def test_a_proof_that_exceeds_its_budget_is_not_a_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "PROOF", 1)
    monkeypatch.setattr(search, "SINGLES", 1)
    assert play(case("objectives/once_with_a_trapped_helper")).outcome["outcome"] == "search_limit"
