"""Every fenced block of every page, and the examples of every ``--help``, are followed in an empty
folder, word for word.

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
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import warm
from children import ran
from once import ROOT, from_yaml
from safenav import load_scenario_text
from support.transcripts import helps

HELP = helps()
COMMANDS = [*HELP][1:]
LISTED = re.compile(r"^  (-.*?)(?:  |$)", re.MULTILINE)
"""The options of a line of help."""
OPTION = re.compile(r"(?<![^ ])--?[a-z0-9][a-z0-9-]*")
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
FOLLOWED = ("tutorial",)
MADE = {"tutorial": ("lab.html", "stuck.html", "report.xml", "lab.motion.jsonl", "real.jsonl")}
"""Files that a page has made at its end."""
BLOCK = re.compile(r'^```(\w*)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)


@pytest.fixture
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """``safenav`` and ``python`` are those of the tests."""
    programs, cache = map(tmp_path_factory.mktemp, ("programs", "cache"))
    for name, words in (("safenav", "-m safenav"), ("python", ""), ("python3", "")):
        script = programs / name
        script.write_text(f'#!/bin/sh\nexec {sys.executable} {words} "$@"\n')
        script.chmod(0o755)
    own = {"SAFENAV_CACHE": str(cache), "NO_COLOR": "1", "COLUMNS": "100"}
    return {**os.environ, "PATH": f"{programs}:/usr/bin:/bin", **own}


def typed(command: str, folder: Path, environment: dict[str, str], code: int = 0) -> list[str]:
    """What a command writes, checked for the exit code, which its comment may name."""
    wanted = re.search(r"# exit code (\d+)", command)
    name, *words = shlex.split(command, comments=True)
    if name == "safenav" and not re.search(r"[|&;<>$*]", command):  # else for a shell
        done = warm.safenav(*words, cwd=folder, env=environment, together=True)
    else:
        done = ran(["sh", "-c", f"{{ {command}\n}} 2>&1"], cwd=folder, env=environment)
    assert done.returncode == (int(wanted[1]) if wanted else code), f"{command}\n{done.stdout}"
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


def check_commands(shown: str) -> None:
    """Check that the options of all commands that a text names exist."""
    for name, rest in re.findall(r"safenav (\w+)((?: [^`|&#;)\n]*)?)", shown):
        if name in COMMANDS:
            known = OPTION.findall(" ".join(LISTED.findall(HELP[name])))
            assert {*OPTION.findall(rest)} <= {*known}, f"safenav {name}{rest}"


def read(language: str, text: str) -> None:
    """Check a block that is not run."""
    match language:
        case "sh" | "":
            names = re.findall(r"(?:^|&& )safenav ([a-z]+)", text, re.MULTILINE)
            assert {*names} <= {*COMMANDS}, text
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
def test_the_commands_of_a_page_print_the_shown_output(
    page: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    whole = page.read_text(encoding="utf-8")
    check_commands(whole)
    for language, title, text in BLOCK.findall(whole):
        if title:
            (tmp_path / title).write_text(text, encoding="utf-8")
        elif language == "sh" and page.stem in FOLLOWED:
            typed(text, tmp_path, environment)
        elif language == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, *shown = part.splitlines()
                compare(command, shown, typed(command, tmp_path, environment))
        else:
            read(language, text)
    for made in MADE.get(page.stem, ()):
        assert (tmp_path / made).stat().st_size > 100
    assert page.parent != DOCS or page.name in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


def test_the_page_of_commands_lists_every_command() -> None:
    text = (DOCS / "commands.md").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if f"`safenav {name}" not in text] == []


SERVERS = re.compile(r"(safenav studio|--live)")
"""They serve until Ctrl-C: tests/studio starts them."""
EXAMPLE = re.compile(r"^    ((?:safenav|python3|mkdir|head|echo|SAFENAV_\w+=).*)", re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("name", HELP)
def test_the_examples_of_help_run_one_after_the_other(
    name: str, tmp_path: Path, environment: dict[str, str]
) -> None:
    if "your own map" in HELP[name]:
        own = "office.yaml" if name == "draw" else "office_map.yaml"
        maps = {"rooms.png": "floor.png", "office.pgm": "office.pgm", "office.yaml": own}
        for there, file in maps.items():
            shutil.copy(ROOT / "tests" / "maps" / there, tmp_path / file)
    lines = EXAMPLE.findall(HELP[name])
    assert lines
    for line in lines:
        for part in () if SERVERS.search(line) else line.split("&&"):
            limited = re.search(r"--(max-ticks|time-limit) 20\b", part)
            typed(part.strip(), tmp_path, environment, code=3 if limited else 0)


@pytest.mark.slow
def test_one_command_makes_the_figures_and_the_table_of_the_paper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The program starts 21 commands, here without their start."""
    script, start = ROOT / "packaging" / "paper.py", subprocess.run

    def run(words: list[str], **options: Any) -> subprocess.CompletedProcess[str]:
        main = "from safenav.cli import main; main()"
        if words[:3] == [sys.executable, "-c", main]:
            return warm.safenav(*words[3:], env=options["env"])
        return start(words, **options)

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path), "--repeat", "1"])
    runpy.run_path(str(script), run_name="__main__")
    figures = sorted(tmp_path.glob("*.svg"))
    names = [f"case_study_{k}_{at}.svg" for k in (1, 2, 3) for at in ("end", "request", "start")]
    assert [figure.name for figure in figures] == names
    assert all(ElementTree.parse(figure).getroot().tag.endswith("svg") for figure in figures)
    assert (tmp_path / "times.md").read_text().count("\n") == 8
