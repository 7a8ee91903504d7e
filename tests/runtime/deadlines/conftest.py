"""Bounds and runs ahead of deadlines do not depend on the load of the machine."""

import pytest


@pytest.fixture(autouse=True)
def _patient(patient: None) -> None:
    """Applies to every test in this folder."""
