"""Commands without a process, and a cache of their own."""

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from safenav import SafenavError
from safenav.cli.options import group


def invoke(*words: object) -> tuple[int, str, str]:
    """Return the exit status of ``safenav WORDS...``, its output and its errors."""
    result = CliRunner().invoke(group, [*map(str, words)], standalone_mode=False)
    match result.exception:
        case None:
            return int(result.return_value), result.stdout, result.stderr
        case SafenavError() | click.ClickException() as error:
            message = getattr(error, "message", str(error))
            return int(error.exit_code), result.stdout, f"{result.stderr}{message}"
        case error:
            raise error


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, patient: None) -> None:  # noqa: ARG001
    """No test sees or fills the user's cache."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))
