"""The real slugs binary: SAFENAV_SLUGS names one, else the one that `make slugs` leaves."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def slugs_binary() -> Path:
    """The binary under test; without one the test is skipped, unless one was asked for."""
    named = os.environ.get("SAFENAV_SLUGS")
    binary = Path(named) if named else ROOT / "slugs" / "build" / "slugs"
    if binary.is_file() and os.access(binary, os.X_OK):
        return binary.resolve()
    if named:
        pytest.fail(f"SAFENAV_SLUGS names no program: {named}")
    pytest.skip(f"no slugs binary at {binary}: run `make slugs` or set SAFENAV_SLUGS")


@pytest.fixture(scope="session")
def own_slugs(slugs_binary: Path) -> Path:
    """The binary, for tests of what upstream's does not have."""
    said = subprocess.run([slugs_binary, "--version"], capture_output=True, text=True, check=False)
    if said.returncode != 0 or not said.stdout.startswith("slugs "):
        pytest.skip(f"{slugs_binary} is not the slugs of this repository")
    return slugs_binary
