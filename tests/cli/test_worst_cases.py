"""What ``safenav check`` says of the times of resolutions."""

from __future__ import annotations

import json
from pathlib import Path

from cli.conftest import Command

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_case_study_3_can_lock_itself(safenav: Command) -> None:
    found = safenav("check", SCENARIOS / "case_study_3.yaml", "--json")
    cases = {case["obstacle"]: case for case in json.loads(found.stdout)["obstacles"]}
    unclear = cases["uncertainty@43"]
    assert (unclear["alone"]["best"], unclear["alone"]["worst"]) == (4, 8)
    assert unclear["with_others"]["worst"] is None
    assert unclear["with_others"]["moment"]["digit"][0] == 42
    assert cases["door@47"]["alone"]["all_moments"]


def test_a_limit_that_cannot_always_be_kept_is_told(safenav: Command, tmp_path: Path) -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    (tmp_path / "tight.yaml").write_text(text + "resolve_within: 5\n")
    said = safenav("check", tmp_path / "tight.yaml").stdout
    assert "door@47: at best 1, at worst 8 ticks from request to resolution" in said
    assert "resolve_within 5: not with quad at 46, digit at 28 facing west" in said
