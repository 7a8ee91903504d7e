"""The tutorial and the how-to pages with commands, followed word for word in an empty folder.

Blocks with a title are files. In a console block each line after ``$`` is typed; the lines after it
must be the beginnings of output lines, in order; ``...`` stands for any lines in between.
"""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import warm

ROOT = Path(__file__).parents[2]
PAGES = {"tutorial": 12, "objectives": 4, "recipes": 9, "specifications": 5, "drive": 3}
PAGES |= {"deadlines": 1, "batteries": 1}
"""Pages to follow, each with the number of commands that it has at least."""
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)


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
    return {
        **os.environ,
        "PATH": f"{programs}:/usr/bin:/bin",
        "SAFENAV_CACHE": str(tmp_path / "cache"),
        "NO_COLOR": "1",
        "COLUMNS": "100",
    }


def typed(command: str, folder: Path, environment: dict[str, str]) -> list[str]:
    """What a command writes, checked for the exit code that its comment names."""
    wanted = re.search(r"# exit code (\d+)", command)
    name, *words = shlex.split(command, comments=True)
    if name == "safenav" and not re.search(r"[|&;<>$*]", command):  # else for a shell
        done = warm.safenav(*words, cwd=folder, env=environment, together=True)
    else:
        done = subprocess.run(
            ["sh", "-c", command],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=300,
            check=False,
        )
    assert done.returncode == (int(wanted[1]) if wanted else 0), f"{command}\n{done.stdout}"
    return done.stdout.splitlines()


def compare(command: str, shown: list[str], output: list[str]) -> None:
    """Check that the output has the lines shown, consecutively except at ``...``."""
    place, anywhere = 0, False
    for line in shown:
        if line == "...":
            anywhere = True
            continue
        found = next(
            (i for i in range(place, len(output)) if output[i].startswith(line)),
            None,
        )
        assert found is not None, f"{command}\nno line begins with {line!r}:\n" + "\n".join(output)
        assert anywhere or found == place, f"{command}\n{output[place]!r} is not shown"
        place, anywhere = found + 1, False


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_commands_print_what_their_page_shows(
    page: str, tmp_path: Path, environment: dict[str, str]
) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    commands = 0
    for language, title, text in BLOCK.findall((ROOT / "docs" / f"{page}.md").read_text("utf-8")):
        if title:
            (folder / title).write_text(text, encoding="utf-8")
        elif language == "sh":
            typed(text, folder, environment)
        elif language == "console":
            for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, *shown = part.splitlines()
                compare(command, shown, typed(command, folder, environment))
                commands += 1
    assert commands >= PAGES[page]
    if page != "tutorial":
        return
    for made in ("lab.html", "stuck.html", "report.xml", "lab.motion.jsonl", "real.jsonl"):
        assert (folder / made).stat().st_size > 100


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda p: p.stem)
def test_every_page_of_the_documentation_is_in_the_site(page: Path) -> None:
    assert page.name in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
