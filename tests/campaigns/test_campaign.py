"""Campaigns: random missions by seed, each completed or proven to be impossible.

A bounded number by default; ``SAFENAV_FUZZ=5000`` plays as many seeds of each family (of
crowds, which take longer, a fifth).
"""

import os
from pathlib import Path

import pytest

import warm

BOUNDED = {
    "apart": 20,
    "apart_needs": 20,
    "traps": 15,
    "tight": 20,
    "tight_hidden": 15,
    "tight_needs": 15,
    "labs": 25,
    "formulas": 12,
    "crowd": 3,
    "crowd_hidden": 3,
}
LONG = ("crowd", "crowd_hidden")


def play(tmp_path: Path, family: str, seeds: int, *options: str) -> None:
    """One campaign in a process of its own: 1 is a finding, told on its output."""
    which = ("--family", family, "--seeds", f"0:{seeds}")
    done = warm.program("campaigns.__main__", *which, "--out", tmp_path, *options)
    found = "".join(file.read_text(encoding="utf-8") for file in sorted(tmp_path.iterdir()))
    assert done.returncode == 0, done.stdout + done.stderr + found


@pytest.mark.slow
@pytest.mark.parametrize("family", BOUNDED)
def test_every_mission_is_completed_or_proven_impossible(family: str, tmp_path: Path) -> None:
    wanted = int(os.environ.get("SAFENAV_FUZZ", "0"))
    share = wanted // 5 if family in LONG else wanted
    play(tmp_path, family, max(share, BOUNDED[family]), "--seconds", "120")


@pytest.mark.slow
@pytest.mark.parametrize("family", ["apart", "tight_hidden", "crowd_hidden"])
def test_an_interrupt_ends_every_mission(family: str, tmp_path: Path) -> None:
    play(tmp_path, family, 8, "--interrupt", "1.0")


@pytest.mark.slow
@pytest.mark.parametrize("family", ["apart", "formulas", "tight_hidden"])
def test_teams_told_by_signals_do_as_well(family: str, tmp_path: Path) -> None:
    seeds = max(int(os.environ.get("SAFENAV_FUZZ", "0")) // 10, 8)
    play(tmp_path, family, seeds, "--assignable", "--seconds", "120")
