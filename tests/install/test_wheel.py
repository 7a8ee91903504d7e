"""The wheel for users: one for every Python, which needs no compiler, cache or checkout."""

import json
import os
import runpy
import shutil
import struct
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
import yaml

import safenav
import warm
from children import ran
from once import ROOT, made_once

SCRIPT = ROOT / "packaging" / "wheel.py"
MAKER: dict[str, Any] = runpy.run_path(str(SCRIPT))


def elf(machine: int = 62, headers: tuple[int, ...] = (1,)) -> bytes:
    """The beginning of a 64 bit program with these program headers."""
    head = struct.pack("<6s12xH12xQ14xHH6x", b"\x7fELF\x02\x01", machine, 64, 56, len(headers))
    return head + b"".join(struct.pack("<I52x", kind) for kind in headers)


@pytest.mark.parametrize(
    ("program", "found"),
    [
        (elf(), "x86_64"),
        (elf(machine=183), "aarch64"),
        (b"#!/bin/sh\n", "is no 64 bit"),
        (elf(headers=(1, 2)), "needs shared libraries"),
        (elf(headers=(3, 1)), "needs shared libraries"),
        (elf(machine=243), "is for the processor 243"),
    ],
    ids=["x86", "arm", "a script", "dynamic", "with an interpreter", "another processor"],
)
def test_only_a_static_program_of_a_known_machine_gets_a_wheel(program: bytes, found: str) -> None:
    if " " not in found:
        assert MAKER["machine_of"](program) == found
        return
    with pytest.raises(ValueError, match=found):
        MAKER["machine_of"](program)


@pytest.fixture(scope="module")
def wheel() -> Path:
    """Return the wheel, with the installed program, which no test needs to compile again."""
    told = json.loads(warm.safenav("doctor", "--json").stdout)["findings"]
    slugs = next(each["text"] for each in told if each["subject"] == "slugs")
    own = Path(slugs.rpartition(" (")[0].rpartition(", ")[2])
    try:
        MAKER["machine_of"](own.read_bytes())
    except ValueError as error:
        pytest.skip(f"the installed {error}")

    def make(folder: Path) -> None:
        subprocess.run([sys.executable, SCRIPT, folder, own], check=True, timeout=900)

    (found,) = made_once("dist", make).glob("*.whl")
    return found


@pytest.mark.slow
def test_one_wheel_serves_every_python_and_is_complete(wheel: Path) -> None:
    assert "-py3-none-" in wheel.name
    assert "-linux_" not in wheel.name, "pip takes no such wheel from an index"
    names = zipfile.ZipFile(wheel).namelist()
    for needed in (
        "safenav/_bin/slugs",
        "safenav/py.typed",
        "safenav/__init__.pyi",
        "safenav/scenario/templates/door.yaml",
        "safenav/report/page/assets/page.js",
        "safenav/report/page/assets/studio.js",
        "safenav/report/picture/fonts/DejaVuSans.ttf",
    ):
        assert needed in names
    assert not [name for name in names if "/front/" in name or name.startswith("tests/")]
    assert not [name for name in names if name.startswith("proof/")]


def test_only_commands_that_need_numpy_load_it(tmp_path: Path) -> None:
    """The processes of a batch do not load it either."""
    (tmp_path / "numpy.py").write_text("raise ImportError('no numpy here')")
    main = [sys.executable, "-c", "from safenav.cli import main; main()"]
    for words in ("batch x.yaml --certify bundles", "run x.yaml --html x.html"):
        shutil.copy(ROOT / "scenarios/hello.yaml", tmp_path / "x.yaml")
        found = {**os.environ, "PYTHONPATH": str(tmp_path)}
        done = ran([*main, *words.split()], cwd=tmp_path, env=found)
        assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_wheel_runs_a_scenario_in_a_new_environment_without_compiler(
    wheel: Path, tmp_path: Path
) -> None:
    fresh, elsewhere = tmp_path / "fresh", tmp_path / "elsewhere"
    elsewhere.mkdir()
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", fresh], check=True)
    environment = {"PATH": str(fresh / "bin"), "HOME": str(tmp_path), "NO_COLOR": "1"}
    assert shutil.which("c++", path=environment["PATH"]) is None

    def say(*words: str, code: int = 0) -> str:
        done = ran(words, cwd=elsewhere, env=environment)
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr

    program, python = (str(fresh / "bin" / name) for name in ("safenav", "python"))
    pip = (sys.executable, "-m", "pip", "--python", python)
    say(*pip, "install", "--no-compile", "--quiet", str(wheel))
    say(program, "new", "x.yaml")
    assert "completed" in say(program, "run", "x.yaml", "--html", "x.html")
    assert "safenav" in (elsewhere / "x.html").read_text(encoding="utf-8")
    assert "came with safenav" in say(program, "doctor")
    assert "1 passed" in say(program, "batch", "x.yaml")
    say(program, "run", "x.yaml", "--trace", "x.jsonl")
    say(program, "check", "x.jsonl")
    hidden = "import importlib.util as util; print(util.find_spec('numpy'))"
    assert say(python, "-c", hidden) == "None\n", "numpy is an extra"
    image = "safenav: 1\nmap: {image: floor.png, rows: 2, cols: 2}\nrobots: {}\n"
    (elsewhere / "s.yaml").write_text(image)
    for words, needs, install in (
        (
            ("export", "x.jsonl", "--motion", "m.jsonl"),
            "safenav export",
            "'numpy>=1.26' 'daqp>=0.7,<1'",
        ),
        (("check", "s.yaml"), "a map file", "'numpy>=1.26' 'pillow>=10'"),
    ):
        said = say(program, *words, code=2)
        assert f"{needs} needs numpy, which is not installed" in said
        assert f"pip install {install}" in said


def test_the_classifiers_name_the_python_versions_that_the_workflows_test() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = {text.rsplit(" ", 1)[1] for text in project["classifiers"] if ":: 3." in text}
    every = (ROOT / ".github/workflows" / f"{name}.yml" for name in ("test", "nightly"))
    test, nightly = (yaml.safe_load(file.read_text(encoding="utf-8"))["jobs"] for file in every)
    setups = [step for step in test["test"]["steps"] if "python-version" in step.get("with", {})]
    others = nightly["pythons"]["strategy"]["matrix"]["python"]
    assert named == {*others, *(step["with"]["python-version"] for step in setups)}


def test_the_citation_names_the_version_and_the_paper() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == safenav.__version__
    assert cited["preferred-citation"]["title"].startswith("Leveraging Heterogeneous")
