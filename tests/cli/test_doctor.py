"""``safenav doctor``: what is installed, and whether it works."""

import json
import re
import sys
import tomllib
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest

import safenav as package
from children import ran
from cli.conftest import Command
from once import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS: dict[str, list[str]] = PROJECT["optional-dependencies"]
REQUIRED = [
    re.split("[<>=]", entry)[0]
    for extra, entries in {"": PROJECT["dependencies"], **EXTRAS}.items()
    for entry in entries
    if extra not in ("dev", "docs") and not entry.startswith("safenav[")
]
"""The packages that commands need, those of each extra; some extras include others."""


def test_doctor_accepts_a_working_installation(safenav: Command, tmp_path: Path) -> None:
    found = safenav("doctor", "--json")
    assert found.returncode == 0, found.stdout
    data = json.loads(found.stdout)
    assert data["usable"] is True
    texts = {entry["subject"]: entry["text"] for entry in data["findings"]}
    assert texts["safenav"].startswith(f"{package.__version__} in ")
    assert texts["click"] == metadata.version("click")
    assert set(texts) == {*REQUIRED, "safenav", "Python", "slugs", "cache"}
    assert "its strategy passes the check" in texts["slugs"]
    assert texts["cache"].startswith(f"{tmp_path / 'cache'} (writable")
    assert list((tmp_path / "cache").iterdir()) == [], "the questions are not cached"


LIAR = 'cat >/dev/null; echo "RESULT: Specification is unrealizable." >&2; exit 10\n'


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
def test_doctor_reports_defects(
    variables: Any, code: int, subject: str, words: str, safenav: Command, tmp_path: Path
) -> None:
    for name, body in (("refusing", "exit 5\n"), ("liar", LIAR)):
        (tmp_path / name).write_text(f"#!/bin/sh\n{body}", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    found, shown = safenav("doctor", "--json", **variables), safenav("doctor", **variables)
    assert (found.returncode, found.stderr) == (code, "")
    data = json.loads(found.stdout)
    assert data["usable"] is (code == 0)
    told = [each for each in data["findings"] if each["subject"] == subject][-1]
    assert words in told["text"] and told["good"] is (False if code else None)
    assert words in shown.stdout and shown.stdout.count("wrong ") == (code != 0)


MISSING = """
from importlib import metadata
def missing(name):
    raise metadata.PackageNotFoundError(name)
metadata.version = missing
from safenav.cli import main; main()"""


def test_hints_install_only_the_missing_package() -> None:
    """safenav is on no index: a command that names it would install a foreign package."""
    done = ran([sys.executable, "-c", MISSING, "doctor", "--json"])
    assert done.returncode == 4, done.stderr
    findings = json.loads(done.stdout)["findings"]
    told = {each["subject"]: each for each in findings if "pip install" in each["text"]}
    assert told.keys() == {*REQUIRED}
    commands = {name: each["text"].partition("pip install ")[2] for name, each in told.items()}
    assert commands["cyclonedds"] == "'cyclonedds>=11,<12'"
    assert commands["resvg-py"] == f"{commands['pillow']} 'resvg-py>=0.5,<1'"
    for name, each in told.items():
        needed = any(entry.startswith(name) for entry in PROJECT["dependencies"])
        assert each["good"] is (False if needed else None) and f"'{name}>" in commands[name]
    assert "safenav" not in " ".join(commands.values())
    pages = [*(ROOT / "docs").glob("*.md"), ROOT / "README.md"]
    written = "".join(page.read_text(encoding="utf-8") for page in pages)
    shown = {found.strip() for found in re.findall(r"pip install ((?:'[^']+' ?)+)", written)}
    some = {commands[name] for name in ("distributed", "pillow", "daqp")}
    assert some <= shown <= {*commands.values()}
