"""Campaigns: random missions by seed, in all ways; each is completed or proven to be impossible.

A bounded number by default; ``SAFENAV_FUZZ=5000`` plays as many seeds of each row (of crowds, which
take longer, a fifth), from ``SAFENAV_FUZZ_FIRST`` on. ``python -m campaigns`` shrinks findings.
"""

import os
from collections.abc import Callable

import pytest

from campaigns.__main__ import drawn

WANTED = int(os.environ.get("SAFENAV_FUZZ", "0"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
BOUNDED: list[tuple[str, str, int]] = [
    ("apart_needs", "", 20),
    ("traps", "", 15),
    ("tight", "", 15),
    ("tight_needs", "", 20),
    ("labs", "", 25),
    ("formulas", "", 12),
    ("parking_hidden", "", 20),
    ("crowd_hidden", "", 4),
    ("mixed", "", 40),
    ("tracked", "", 40),
    ("spoken", "", 12),
    ("apart", "assignable", 8),
    ("formulas", "assignable", 8),
    ("tight_hidden", "assignable", 8),
    ("parking", "live", 10),
    ("mixed", "live", 16),
    ("labs", "live faults", 10),
    ("tight_hidden", "live faults", 8),
    ("crowd_hidden", "live faults", 3),
    ("mixed", "live faults", 12),
    ("mixed", "live faults operator", 12),
    ("spoken", "live faults operator", 4),
    ("mixed", "operator", 6),
    ("labs", "kill", 8),
    ("mixed", "kill", 12),
    ("mixed", "live kill", 6),
    ("mixed", "live certified", 6),
]
ALL = [
    (family, switches, seed)
    for family, switches, bounded in BOUNDED
    for seed in range(FIRST, FIRST + (WANTED // (5 if "crowd" in family else 1) or bounded))
]


@pytest.mark.parametrize(("family", "switches", "seed"), ALL)
def test_a_random_mission_is_completed_or_proven_impossible(
    family: str, switches: str, seed: int, played: Callable[[], None]
) -> None:
    _, one, _ = drawn(family, seed, tuple(switches.split()))
    assert one.found == []
    if one.passes:
        played()
