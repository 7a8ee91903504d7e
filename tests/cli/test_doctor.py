"""``safenav doctor``: what is installed, and whether it works."""

import json
import re
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

import safenav as package
from cli.conftest import Command
from once import ROOT
from safenav.doctor import PURPOSES, project
from safenav.errors import install_command, missing_package, requirements


def test_doctor_accepts_a_working_installation(safenav: Command, tmp_path: Path) -> None:
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


LIAR = """\
case "$*" in *version*) exit 1;; esac
cat >/dev/null; echo "RESULT: Specification is unrealizable." >&2
"""


@pytest.mark.parametrize(
    ("variables", "code", "subject", "words"),
    [
        ({"SAFENAV_SLUGS": "./refusing"}, 4, "slugs", "exit"),
        ({"SAFENAV_SLUGS": "./liar"}, 4, "slugs", "unrealizable"),
        ({"SAFENAV_SLUGS": "./nothing"}, 4, "slugs", "does not exist"),
        ({"SAFENAV_CACHE": "liar/cache"}, 0, "cache", "not writable"),
        ({"SAFENAV_CACHE": "off"}, 0, "cache", "off (SAFENAV_CACHE)"),
    ],
    ids=["refuses", "always unrealizable", "missing", "cache in the way", "no cache"],
)
def test_doctor_reports_what_does_not_work(
    variables: Any, code: int, subject: str, words: str, safenav: Command, tmp_path: Path
) -> None:
    for name, body in (("refusing", "exit 3\n"), ("liar", LIAR)):
        (tmp_path / name).write_text(f"#!/bin/sh\n{body}", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    found, shown = safenav("doctor", "--json", **variables), safenav("doctor", **variables)
    assert (found.returncode, found.stderr) == (code, "")
    data = json.loads(found.stdout)
    assert data["usable"] is (code == 0)
    told = [each for each in data["findings"] if each["subject"] == subject][-1]
    assert words in told["text"] and told["good"] is (False if code else None)
    assert words in shown.stdout and shown.stdout.count("wrong ") == (code != 0)


def test_requirements_are_those_of_the_project() -> None:
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
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
    known = {extra: install_command(extra).split(" install ")[1] for extra in PURPOSES}
    assert "safenav" not in " ".join(known.values())
    pages = [*(ROOT / "docs").glob("*.md"), ROOT / "README.md"]
    written = "".join(page.read_text(encoding="utf-8") for page in pages)
    told = {found.strip() for found in re.findall(r"pip install ((?:'[^']+' ?)+)", written)}
    assert {known[extra] for extra in ("dask", "maps", "motion")} <= told <= {*known.values()}
