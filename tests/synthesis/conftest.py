"""A small patrol whose strategy is written down by hand, and slugs binaries that misbehave."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from children import none_left
from once import beside
from safenav import Specification, read_specification
from slugs.conftest import binary_under_test


@pytest.fixture
def patrol() -> Specification:
    text = beside(__file__, "patrol.structuredslugs")
    return read_specification(text, "patrol.structuredslugs", "carrier")


@pytest.fixture
def patrol_json() -> bytes:
    """The patrol's strategy: from 3 to 5 and back, two nodes for each phase but the first."""
    return beside(__file__, "patrol.json").encode()


@pytest.fixture
def script(tmp_path: Path) -> Callable[[str], Path]:
    """Makes a shell script that stands for a slugs binary."""

    def make(body: str) -> Path:
        path = tmp_path / f"slugs-{len(list(tmp_path.iterdir()))}"
        path.write_text(f"#!/bin/sh\n{body}\n")
        path.chmod(0o755)
        return path

    return make


@pytest.fixture
def answering(script: Callable[[str], Path], tmp_path: Path) -> Callable[[bytes], Path]:
    """Makes a binary that says realizable and prints a strategy; ``calls`` has a line for each."""

    def make(printed: bytes) -> Path:
        output = tmp_path / f"printed-{len(list(tmp_path.iterdir()))}"
        output.write_bytes(printed)
        return script(
            f'echo call >> "{tmp_path}/calls"; cat "{output}"\n'
            "echo 'RESULT: Specification is realizable.' >&2"
        )

    return make


@pytest.fixture(scope="session")
def slugs() -> Path:
    return binary_under_test()


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No test sees or fills the user's cache."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))


@pytest.fixture(autouse=True)
def no_children() -> Iterator[None]:
    """Every test leaves no child process behind, neither running nor as a zombie."""
    with none_left():
        yield
