"""A stand-in for slugs, a place to write scenarios, and no process left behind."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from batch.made_scenarios import SLUGS, SlugsLog, Write, scenario
from children import none_left


@pytest.fixture
def slugs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SlugsLog:
    log = tmp_path / "slugs.log"
    binary = tmp_path / "slugs"
    binary.write_text(SLUGS.format(log=log))
    binary.chmod(0o755)
    monkeypatch.setenv("SAFENAV_SLUGS", str(binary))
    monkeypatch.setenv("SAFENAV_CACHE", "off")
    return SlugsLog(log)


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a scenario (of a robot of that name) into an empty working directory."""
    home = tmp_path / "work"
    home.mkdir()
    monkeypatch.chdir(home)

    def write(name: str, robot: str = "quick", text: str | None = None, **options: str) -> Path:
        path = home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(scenario(robot, **options) if text is None else text)
        return path

    return write


@pytest.fixture(autouse=True)
def no_children() -> Iterator[None]:
    """Every test leaves no child process behind, neither running nor as a zombie."""
    with none_left():
        yield
