"""Drives of random missions with late messages, judged by the physics alone.

``SAFENAV_FUZZ=500`` tries 500 seeds, from ``SAFENAV_FUZZ_FIRST`` on.
"""

import os
from collections.abc import Callable

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from campaigns.drives.drive import late_drive
from drawn import tried

FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
COUNT = int(os.environ.get("SAFENAV_FUZZ", "5"))


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_drives_with_late_messages_agree_with_the_physics(
    seed: int, played: Callable[[], None]
) -> None:
    defects = tried(late_drive, seed)
    assert defects == []
    played()
