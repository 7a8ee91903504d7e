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
    "parking": 20,
    "parking_hidden": 12,
    "crowd": 3,
    "crowd_hidden": 3,
}
LONG = ("crowd", "crowd_hidden")
WANTED = int(os.environ.get("SAFENAV_FUZZ", "0"))
PART = 100


def parts(family: str, count: int) -> list[tuple[str, str]]:
    """Return the family with ranges of seeds, each for one process."""
    return [(family, f"{k}:{min(k + PART, count)}") for k in range(0, count, PART)]


def play(tmp_path: Path, family: str, seeds: str, *options: str) -> None:
    """One campaign in a process of its own: 1 is a finding, told on its output."""
    which = ("--family", family, "--seeds", seeds)
    done = warm.program("campaigns.__main__", *which, "--out", tmp_path, *options)
    found = "".join(file.read_text(encoding="utf-8") for file in sorted(tmp_path.iterdir()))
    assert done.returncode == 0, done.stdout + done.stderr + found


ALL = [
    part
    for family, bounded in BOUNDED.items()
    for part in parts(family, max(WANTED // 5 if family in LONG else WANTED, bounded))
]


@pytest.mark.slow
@pytest.mark.parametrize(("family", "seeds"), ALL)
def test_every_mission_is_completed_or_proven_impossible(
    family: str, seeds: str, tmp_path: Path
) -> None:
    play(tmp_path, family, seeds, "--seconds", "120")


@pytest.mark.slow
@pytest.mark.parametrize("family", ["apart", "tight_hidden", "crowd_hidden"])
def test_an_interrupted_mission_ends_with_a_sound_trace(family: str, tmp_path: Path) -> None:
    play(tmp_path, family, "0:8", "--interrupt", "1.0")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("family", "seeds"),
    [
        part
        for family in ("apart", "formulas", "tight_hidden")
        for part in parts(family, max(WANTED // 10, 8))
    ],
)
def test_every_mission_with_assignable_goals_is_completed_or_proven_impossible(
    family: str, seeds: str, tmp_path: Path
) -> None:
    play(tmp_path, family, seeds, "--assignable", "--seconds", "120")


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [seeds for _, seeds in parts("parking", WANTED // 10 or 10)])
def test_every_live_mission_is_completed_or_proven_impossible(seeds: str, tmp_path: Path) -> None:
    play(tmp_path, "parking", seeds, "--live", "--seconds", "120")
