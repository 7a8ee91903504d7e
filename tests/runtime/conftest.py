import pytest

from runtime.played import Runner, play


@pytest.fixture
def run() -> Runner:
    return play
