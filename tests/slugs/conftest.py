"""The programs under test, and a folder of specifications."""

import os
from pathlib import Path

import pytest

from children import ran
from slugs.commands import CROWDED, ENDLESS, FOLLOW, STUCK, binary_under_test

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def slugs_binary() -> Path:
    return binary_under_test()


@pytest.fixture(scope="session")
def own_slugs(slugs_binary: Path) -> Path:
    """The binary, for tests of what upstream's does not have."""
    said = ran([slugs_binary, "--version"])
    if said.returncode != 0 or not said.stdout.startswith("slugs "):
        pytest.skip(f"{slugs_binary} is not the slugs of this repository")
    return slugs_binary


@pytest.fixture(scope="session")
def sanitized() -> Path:
    """The binary with assertions and sanitizers: SAFENAV_SLUGS_SANITIZED names another build."""
    named = os.environ.get("SAFENAV_SLUGS_SANITIZED")
    binary = (Path(named) if named else ROOT / "slugs" / "build-sanitized") / "slugs"
    if not binary.is_file():
        pytest.skip(f"no {binary}: run `make slugs-test`")
    return binary.resolve()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with specifications to try commands on."""
    for name, text in (
        ("follow", FOLLOW),
        ("stuck", STUCK),
        ("endless", ENDLESS),
        ("crowded", CROWDED),
        ("broken", "[INPUT]\nx: 0...\n"),
    ):
        (tmp_path / f"{name}.structuredslugs").write_text(text)
    return tmp_path
