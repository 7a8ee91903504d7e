"""Which slugs binary safenav uses, and its message when there is none."""

from collections.abc import Callable
from pathlib import Path

import pytest

from safenav import SynthesizerError
from safenav.synthesis import program as module
from safenav.synthesis.program import VARIABLE, Binary, find_binary

# From the first choice to the last: in the package, in an installation of it, in the source tree.
PLACES = ("tree/safenav/_bin/slugs", "site-packages/safenav/_bin/slugs", "tree/slugs/build/slugs")


def _program(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_the_environment_variable_the_package_and_the_source_tree_are_searched_in_turn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any, the message says what to do."""
    monkeypatch.setattr(module, "_PACKAGE", tmp_path / "tree" / "safenav")
    monkeypatch.setattr("sysconfig.get_path", lambda _: str(tmp_path / "site-packages"))
    monkeypatch.delenv(VARIABLE, raising=False)
    with pytest.raises(SynthesizerError, match="make slugs") as raised:
        find_binary()
    assert VARIABLE in str(raised.value)
    for place in reversed(PLACES):
        program = _program(tmp_path / place)
        assert find_binary().path == program
    named = _program(tmp_path / "with space ü" / "slugs")
    monkeypatch.setenv(VARIABLE, str(named))
    assert find_binary().path == named


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
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[Path], object],
    complaint: str,
) -> None:
    make(tmp_path / "slugs")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "slugs"))
    with pytest.raises(SynthesizerError, match=rf"{complaint}(.|\n)*{VARIABLE}"):
        find_binary()


@pytest.mark.parametrize(
    ("body", "version"),
    [
        ('echo "slugs 1.2.3 (safenav)"', "1.2.3"),
        ('echo "slugs 1.2.3"; exit 1', None),
        ('echo "RESULT: Specification is realizable." >&2', None),
        ("kill -9 $$", None),
        ("sleep 60; echo 'slugs 1.2.3'", None),
    ],
)
def test_our_binary_is_recognized_by_its_version(
    script: Callable[[str], Binary],
    monkeypatch: pytest.MonkeyPatch,
    body: str,
    version: str | None,
) -> None:
    if "sleep" in body:
        monkeypatch.setattr(module, "_VERSION_SECONDS", 0.1)
    found = script(body)
    assert (found.native, found.version) == (version is not None, version)
