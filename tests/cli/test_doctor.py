"""``safenav doctor``: what is installed, and whether it works."""

import json
import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import safenav as package
from cli.conftest import Command
from safenav.doctor import PURPOSES, project
from safenav.errors import install_command, missing_package, requirements


def script(path: Path, body: str) -> str:
    """A program that is no synthesizer."""
    path.write_text("#!/bin/sh\n" + body, encoding="utf-8")
    path.chmod(0o755)
    return str(path)


def test_a_working_installation(safenav: Command, tmp_path: Path) -> None:
    found = safenav("doctor", "--json")
    assert found.returncode == 0, found.stdout
    data = json.loads(found.stdout)
    assert data["usable"] is True
    texts = {entry["subject"]: entry["text"] for entry in data["findings"]}
    assert texts["safenav"].startswith(f"{package.__version__} in ")
    assert texts["click"] == metadata.version("click")
    known = [requirement for extra in ("", *PURPOSES) for requirement in requirements(extra)]
    assert set(texts) == {*map(project, known), "safenav", "Python", "slugs", "cache"}
    assert "its strategy passes the check" in texts["slugs"]
    assert texts["cache"].startswith(f"{tmp_path / 'cache'} (writable")
    assert list((tmp_path / "cache").iterdir()) == [], "the questions are not cached"
    people = safenav("doctor", SAFENAV_CACHE="off")
    assert people.returncode == 0
    assert "off (SAFENAV_CACHE)" in people.stdout and "wrong " not in people.stdout


def test_requirements_are_those_of_the_project() -> None:
    file = Path(__file__).parents[2] / "pyproject.toml"
    listed = tomllib.loads(file.read_text(encoding="utf-8"))["project"]
    extras = {"": listed["dependencies"], **listed["optional-dependencies"]}
    assert {"", *PURPOSES} == set(extras) - {"dev", "docs"}
    for name in ("", *PURPOSES):
        own = [project(entry) for entry in extras[name] if not entry.startswith("safenav[")]
        assert set(own) <= set(map(project, requirements(name)))
    assert set(requirements("maps")) < set(requirements("pictures"))


def test_hints_install_the_missing_package_and_nothing_of_another_name() -> None:
    """safenav is on no index: a command that names it would install a foreign package."""
    hint = str(missing_package("this", "cyclonedds", "ros2"))
    assert hint.endswith(" install 'cyclonedds>=11,<12'")
    known = {install_command(extra).split(" install ")[1] for extra in PURPOSES}
    assert "safenav" not in " ".join(known)
    root = Path(__file__).parents[2]
    pages = [*(root / "docs").glob("*.md"), root / "README.md"]
    written = "".join(page.read_text(encoding="utf-8") for page in pages)
    told = re.findall(r"pip install ((?:'[^']+' ?)+)", written)
    with_pages = ("dask", "maps", "motion")
    needed = {install_command(extra).split(" install ")[1] for extra in with_pages}
    assert needed <= {command.strip() for command in told} <= known


LIAR = 'case "$*" in *version*) exit 1;; esac\ncat >/dev/null\n'


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("exit 3\n", "exit"),
        (LIAR + 'echo "RESULT: Specification is unrealizable." >&2\n', "unrealizable"),
    ],
    ids=["refuses", "always unrealizable"],
)
def test_doctor_reports_a_synthesizer_that_does_not_reply(
    body: str, words: str, safenav: Command, tmp_path: Path
) -> None:
    found = safenav("doctor", "--json", SAFENAV_SLUGS=script(tmp_path / "liar", body))
    assert found.returncode == 4, found.stdout + found.stderr
    data = json.loads(found.stdout)
    assert data["usable"] is False
    chosen, problem = (each for each in data["findings"] if each["subject"] == "slugs")
    assert "(SAFENAV_SLUGS)" in chosen["text"]
    assert problem["good"] is False and words in problem["text"]
    assert "Traceback" not in found.stderr


def test_a_synthesizer_that_is_missing(safenav: Command, tmp_path: Path) -> None:
    found = safenav("doctor", SAFENAV_SLUGS=str(tmp_path / "nothing"))
    assert found.returncode == 4
    assert "does not exist" in found.stdout
    assert found.stdout.count("wrong ") == 1


def test_doctor_passes_with_a_cache_that_cannot_be_written(
    safenav: Command, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("in the way")
    found = safenav("doctor", "--json", SAFENAV_CACHE=str(tmp_path / "file" / "cache"))
    assert found.returncode == 0
    assert "not writable" in json.loads(found.stdout)["findings"][-1]["text"]
    assert "not writable" in safenav("doctor", SAFENAV_CACHE=str(tmp_path / "file")).stdout
