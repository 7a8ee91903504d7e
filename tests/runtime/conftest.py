"""Tests that name ``clock`` run once in lockstep and once live."""

import pytest

from safenav.scenario.model import Clock


@pytest.fixture(params=Clock)
def clock(request: pytest.FixtureRequest) -> Clock:
    return Clock(request.param)
