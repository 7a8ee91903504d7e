from __future__ import annotations

import pytest

from runtime.played import Runner, play


@pytest.fixture
def run() -> Runner:
    return play
