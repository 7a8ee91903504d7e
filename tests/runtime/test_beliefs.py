"""Robots with limited sight: runs with beliefs, judged by the audit of their traces."""

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from runtime import teams
from runtime.played import completed, play

CASE_STUDY_3 = Path(__file__).parents[2] / "scenarios" / "case_study_3.yaml"
SEEDS = [2, 4, 8, 11, 13, 17, 21, 23, 26, 29]
LONG = [14, 20] if "SAFENAV_FUZZ" in os.environ else []
"""Half of the time of all; `make fuzz` plays them."""
ENDINGS = ("completed", "operator_needed", "unrealizable", "tick_limit")


def test_case_study_3_with_a_digit_that_sees_four_regions() -> None:
    """The paper's own belief tracking: nothing depends on where the quadcopter is, so the
    robots do what they do without it."""
    text = CASE_STUDY_3.read_text()
    usual = play(text)
    told = "digit: {model: digit, vision: 4, tracks: [quad],"
    trace = completed(text.replace("digit: {model: digit,", told))
    kinds = ("violation", "request", "push", "resolved", "pop")
    assert trace.order(*kinds) == usual.order(*kinds)
    beliefs = trace.all("belief", robot="digit", of="quad")
    assert any(b["seen"] for b in beliefs) and not all(b["seen"] for b in beliefs)
    assert not usual.all("belief")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [*SEEDS, *LONG])
def test_random_teams_with_beliefs_pass_the_audit(
    seed: int, monkeypatch: pytest.MonkeyPatch, played: Callable[[], None]
) -> None:
    """The audit knows when somebody collides and when a belief misses the truth. Teams of two
    or three whose targets can be reached."""
    monkeypatch.setattr(teams, "MODELS", ("rover", "digit", "drone"))
    text = _with_beliefs(teams.team_scenario(seed), radius=1 + seed % 4)
    trace = play(text)
    assert trace.outcome["outcome"] in ENDINGS
    played()


def _with_beliefs(text: str, radius: int) -> str:
    """Robots that share no floor, each of which tracks the next one."""
    names = re.findall(r"^  (r\d+): \{model", text, re.MULTILINE)
    assert len(names) >= 2
    for name, other in zip(names, names[1:] + names[:1], strict=True):
        seeing = f"avoids: [], vision: {radius}, tracks: [{other}]"
        text = re.sub(rf"(  {name}: \{{model: \w+, )", rf"\1{seeing}, ", text)
    return text
