"""Commands without a process, and a cache of their own."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from safenav.errors import SafenavError


@dataclass(frozen=True)
class Answer:
    """What a command printed and how it ended (errors as ``safenav`` would end with them)."""

    status: int
    output: str
    error: str


Invoke = Callable[..., Answer]


@pytest.fixture
def invoke() -> Invoke:
    def run(command: click.Command, *arguments: object, stdin: bytes | None = None) -> Answer:
        words = [str(argument) for argument in arguments]
        result = CliRunner().invoke(command, words, input=stdin, standalone_mode=False)
        match result.exception:
            case None:
                status = result.return_value
                assert isinstance(status, int)
                return Answer(int(status), result.stdout, result.stderr)
            case SafenavError() as error:
                return Answer(int(error.exit_code), result.stdout, result.stderr + str(error))
            case click.ClickException() as error:
                return Answer(error.exit_code, result.stdout, result.stderr + error.message)
            case error:
                raise error

    return run


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, patient: None) -> None:  # noqa: ARG001
    """No test sees or fills the user's cache."""
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))
