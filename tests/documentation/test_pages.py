"""Every fenced block of every page: the pages are followed word for word in an empty folder.

Blocks with a title are files. In a console block each line after ``$`` is typed; the lines after it
must be the beginnings of output lines, in order; ``...`` stands for any lines in between. Pages of
``FOLLOWED`` have their ``sh`` blocks run as well; of all others, each command and each option must
exist. Whole scenarios load, and imports of Python blocks are there. What else a page shows (its
fragments, patterns, formats) is tested beside the package that it describes.
"""

import ast
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import warnings
from importlib import import_module
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest

import warm
from once import from_yaml
from safenav.cli import group
from safenav.scenario.reading.loader import load_scenario_text

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
FOLLOWED = ("tutorial",)
MADE = {"tutorial": ("lab.html", "stuck.html", "report.xml", "lab.motion.jsonl", "real.jsonl")}
"""Files that a page has made at its end."""
BLOCK = re.compile(r'^```(\w*)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """``safenav`` and ``python`` are those of the tests."""
    programs = tmp_path / "programs"
    programs.mkdir()
    main = "from safenav.cli import main; main()"
    for name, words in (("safenav", f'-c "{main}"'), ("python", "")):
        script = programs / name
        script.write_text(f'#!/bin/sh\nexec {sys.executable} {words} "$@"\n')
        script.chmod(0o755)
    own = {"SAFENAV_CACHE": str(tmp_path / "cache"), "NO_COLOR": "1", "COLUMNS": "100"}
    return {**os.environ, "PATH": f"{programs}:/usr/bin:/bin", **own}


def typed(command: str, folder: Path, environment: dict[str, str]) -> list[str]:
    """What a command writes, checked for the exit code that its comment names."""
    wanted = re.search(r"# exit code (\d+)", command)
    name, *words = shlex.split(command, comments=True)
    if name == "safenav" and not re.search(r"[|&;<>$*]", command):  # else for a shell
        done = warm.safenav(*words, cwd=folder, env=environment, together=True)
    else:
        both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        shell = ["sh", "-c", command]
        done = subprocess.run(shell, cwd=folder, env=environment, timeout=300, check=False, **both)  # type: ignore[call-overload]
    assert done.returncode == (int(wanted[1]) if wanted else 0), f"{command}\n{done.stdout}"
    return str(done.stdout).splitlines()


def compare(command: str, shown: list[str], output: list[str]) -> None:
    """Check that the output has the lines shown, consecutively except at ``...``."""
    place, anywhere = 0, False
    for line in shown:
        if line == "...":
            anywhere = True
            continue
        found = next((i for i in range(place, len(output)) if output[i].startswith(line)), None)
        assert found is not None, f"{command}\nno line begins with {line!r}:\n" + "\n".join(output)
        assert anywhere or found == place, f"{command}\n{output[place]!r} is not shown"
        place, anywhere = found + 1, False


def known(shown: str) -> None:
    """Check that the commands shown and their options exist."""
    context = click.Context(group)
    for name, words in re.findall(r"(?:^|&& )safenav ([a-z]+)([^#&|;]*)", shown, re.MULTILINE):
        found = group.get_command(context, name)
        assert found is not None, shown
        options = {
            o for each in found.get_params(context) for o in (*each.opts, *each.secondary_opts)
        }
        unknown = {*re.findall(r"(?<= )--?[a-z][\w-]*", words)} - options
        assert not unknown, f"{shown}: {unknown}"


def read(language: str, text: str) -> None:
    """Check a block that is not run."""
    match language:
        case "sh" | "":
            for line in text.splitlines():
                known(line)
        case "yaml":
            data = from_yaml(text)
            if isinstance(data, dict) and {"safenav", "map", "robots"} <= data.keys():
                load_scenario_text(text)
        case "json" if "..." not in text:
            json.loads(text)
        case "toml":
            tomllib.loads(text)
        case "python":
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.ImportFrom) and str(node.module).startswith("safenav"):
                    module = import_module(str(node.module))
                    assert all(hasattr(module, alias.name) for alias in node.names), node.module


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_can_be_followed(page: Path, tmp_path: Path, environment: dict[str, str]) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    (folder / "scenarios").symlink_to(ROOT / "scenarios")
    for language, title, text in BLOCK.findall(page.read_text(encoding="utf-8")):
        if title:
            (folder / title).write_text(text, encoding="utf-8")
        elif language == "sh" and page.stem in FOLLOWED:
            typed(text, folder, environment)
        elif language == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, *shown = part.splitlines()
                compare(command, shown, typed(command, folder, environment))
        else:
            read(language, text)
    for made in MADE.get(page.stem, ()):
        assert (folder / made).stat().st_size > 100
    assert page.parent != DOCS or page.name in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_the_notebook_draws_a_scenario_and_a_run(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # those of Jupyter's packages are not ours
        import nbclient
        import nbformat

        notebook = nbformat.read(DOCS / "notebook.ipynb", as_version=4)
        assert not [cell for cell in notebook.cells if cell.get("outputs")]
        (tmp_path / "docs").mkdir()
        shutil.copytree(ROOT / "scenarios", tmp_path / "scenarios")
        where = {"metadata": {"path": str(tmp_path / "docs")}}
        nbclient.NotebookClient(notebook, timeout=300, resources=where).execute()
    outputs = [o["data"] for cell in notebook.cells for o in cell.get("outputs", []) if "data" in o]
    (drawing,) = [data["image/svg+xml"] for data in outputs if "image/svg+xml" in data]
    assert ElementTree.fromstring(drawing).tag.endswith("svg")
    result, page = [data["text/html"] for data in outputs if "text/html" in data]
    assert "<th>outcome</th><td>completed</td>" in result
    assert page.startswith("<iframe srcdoc=")
    assert "requests help with door@47" in outputs[-1]["text/plain"]


@pytest.mark.slow
def test_one_command_makes_the_figures_and_the_table_of_the_paper(tmp_path: Path) -> None:
    script = ROOT / "packaging" / "paper.py"
    subprocess.run([sys.executable, script, tmp_path, "--repeat", "1"], check=True, timeout=300)
    figures = sorted(tmp_path.glob("*.svg"))
    names = [f"case_study_{k}_{at}.svg" for k in (1, 2, 3) for at in ("end", "request", "start")]
    assert [figure.name for figure in figures] == names
    assert all(ElementTree.parse(figure).getroot().tag.endswith("svg") for figure in figures)
    assert (tmp_path / "times.md").read_text().count("\n") == 8
