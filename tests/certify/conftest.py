"""Shared fixtures of the tests of certificates."""

from pathlib import Path

import pytest

from oracle.duel import Duel
from safenav.synthesis.binary import find_own_binary


@pytest.fixture
def duel(tmp_path: Path) -> Duel:
    """The own build of slugs, for counterstrategies."""
    own = find_own_binary()
    assert own is not None
    return Duel(own.path, tmp_path)
