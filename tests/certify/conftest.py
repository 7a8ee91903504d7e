"""Shared fixtures of the tests of certificates."""

from pathlib import Path

import pytest

from certify.making import checked
from oracle.duel import Abilities, Duel
from safenav.certify import bundle as writing
from safenav.synthesis.binary import find_own_binary


@pytest.fixture(autouse=True)
def checked_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bundles are checked in this process when they are made; the commands start a process."""
    monkeypatch.setattr(writing, "check_bundle", checked)


@pytest.fixture
def duel(tmp_path: Path) -> Duel:
    """The own build of slugs, for counterstrategies."""
    own = find_own_binary()
    assert own is not None
    return Duel(own.path, tmp_path, Abilities())
