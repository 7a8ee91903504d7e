"""Which slugs binary safenav uses, and its message when there is none."""

from collections.abc import Callable
from pathlib import Path

import pytest

from safenav.errors import ExitCode, SynthesizerError
from safenav.synthesis import program as module
from safenav.synthesis.program import VARIABLE, Binary, find_binary


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package directory of our own, installed nowhere."""
    directory = tmp_path / "tree" / "safenav"
    directory.mkdir(parents=True)
    monkeypatch.setattr(module, "_PACKAGE", directory)
    monkeypatch.setattr("sysconfig.get_path", lambda _: str(tmp_path / "site-packages"))
    monkeypatch.delenv(VARIABLE, raising=False)
    return directory


def _program(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_the_environment_variable_wins(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _program(package / "_bin" / "slugs")
    other = _program(tmp_path / "with space ü" / "slugs")
    monkeypatch.setenv(VARIABLE, str(other))
    assert find_binary().path == other


def test_the_binary_inside_the_package_comes_before_the_source_tree(package: Path) -> None:
    built = _program(package.parent / "slugs" / "build" / "slugs")
    assert find_binary().path == built
    inside = _program(package / "_bin" / "slugs")
    assert find_binary().path == inside


def test_an_editable_installation_keeps_it_in_site_packages(package: Path, tmp_path: Path) -> None:
    _program(package.parent / "slugs" / "build" / "slugs")
    installed = _program(tmp_path / "site-packages" / "safenav" / "_bin" / "slugs")
    assert find_binary().path == installed


def test_a_missing_binary_is_reported_with_a_hint(package: Path) -> None:  # noqa: ARG001
    with pytest.raises(SynthesizerError, match="make slugs") as raised:
        find_binary()
    assert raised.value.exit_code is ExitCode.INTERNAL
    assert VARIABLE in str(raised.value)


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda _: None, "does not exist"),
        (lambda path: path.mkdir(), "is a directory"),
        (lambda path: path.write_text("no program"), "is not executable"),
    ],
    ids=["missing", "directory", "not executable"],
)
def test_a_useless_environment_variable_is_named_not_ignored(
    package: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[Path], object],
    complaint: str,
) -> None:
    _program(package / "_bin" / "slugs")
    make(tmp_path / "slugs")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "slugs"))
    with pytest.raises(SynthesizerError, match=complaint) as raised:
        find_binary()
    assert VARIABLE in str(raised.value)


def test_our_binary_is_recognized_by_its_version(script: Callable[[str], Binary]) -> None:
    ours = script('echo "slugs 1.2.3 (safenav)"')
    assert (ours.native, ours.version) == (True, "1.2.3")
    assert not script('echo "slugs 1.2.3"; exit 1').native
    assert not script('echo "RESULT: Specification is realizable." >&2').native
    assert not script("kill -9 $$").native


def test_a_binary_that_hangs_when_queried_is_foreign(
    script: Callable[[str], Binary], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_VERSION_SECONDS", 0.1)
    assert not script("sleep 60; echo 'slugs 1.2.3'").native
