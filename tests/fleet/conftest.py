"""Fixtures for tests of fleets."""

from collections.abc import Iterator

import pytest

from safenav.fleet import goals
from safenav.fleet import world as fleet


@pytest.fixture
def short_limits(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Time limits of hundredths of seconds."""
    limits = {
        "SETTLING": 0.05,
        "STOPPING": 0.05,
        "FRESH": 0.05,
        "LATE": 0.05,
        "STALE": 0.2,
        "PAUSE": 0.02,
        "RETURNING": 0.05,
    }
    for name, seconds in limits.items():
        monkeypatch.setattr(goals, name, seconds)
    monkeypatch.setattr(fleet, "FRESH", 0.05)
    yield
