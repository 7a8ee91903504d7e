"""Drives of random missions with late messages, judged by the physics alone.

``SAFENAV_FUZZ=500`` tries 500 other seeds.
"""

import os
from collections.abc import Callable
from random import SystemRandom

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from campaigns.drives.drive import late_drive
from drawn import tried

SEEDS = tuple(range(5))


def seeds() -> tuple[int, ...]:
    wanted = os.environ.get("SAFENAV_FUZZ")
    begin = SystemRandom().randrange(10**6)
    return SEEDS if wanted is None else tuple(range(begin, begin + int(wanted)))


@pytest.mark.parametrize("seed", seeds())
def test_drives_with_late_messages_agree_with_the_physics(
    seed: int, played: Callable[[], None]
) -> None:
    drive, _ = tried(late_drive, seed)
    assert drive.defects == []
    played()
