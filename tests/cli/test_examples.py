"""The examples of ``--help``: an installed user runs them in an empty folder."""

import inspect
import os
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

import warm
from children import ran
from safenav.cli import COMMANDS, command_of, group

MAPS = Path(__file__).parents[1] / "maps"
SERVERS = re.compile(r"(safenav studio|--live)")
"""They serve until Ctrl-C: tests/studio starts them."""


def help_of(name: str) -> str:
    command = command_of(name)
    return f"{inspect.cleandoc(str(command.help))}\n{command.epilog}"


def examples(text: str) -> list[str]:
    """The commands of a help text, in order."""
    return re.findall(
        r"^  ((?:safenav|python3|mkdir|head|echo|SAFENAV_\w+=).*)", text, re.MULTILINE
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_the_examples_run_one_after_the_other(name: str, tmp_path: Path) -> None:
    lines = examples(help_of(name))
    assert lines
    script = [line for line in lines if not SERVERS.search(line)]
    assert all("safenav studio" in line or "--live" in line for line in lines if line not in script)
    if "your own map" in help_of(name):
        for there, file in (
            ("rooms.png", "floor.png"),
            ("office.pgm", "office.pgm"),
            ("office.yaml", "office.yaml" if name == "draw" else "office_map.yaml"),
        ):
            shutil.copy(MAPS / there, tmp_path / file)
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "SAFENAV_CACHE": str(tmp_path / ".cache"),
        "NO_COLOR": "1",
    }
    for command in (part.strip() for line in script for part in line.split("&&")):
        name, *words = shlex.split(command, comments=True)
        if name == "safenav" and "<" not in words:
            done = warm.safenav(*words, cwd=tmp_path, env=environment)
        else:
            done = ran(["bash", "-c", command], cwd=tmp_path, env=environment)
        expected = 3 if re.search(r"--(max-ticks|time-limit) 20\b", command) else 0
        assert done.returncode == expected, f"{command}\n{done.stdout}{done.stderr}"


def test_the_first_example_of_all_is_also_an_example() -> None:
    assert (
        examples(inspect.cleandoc(str(group.help)))[0]
        == "safenav new lab.yaml && safenav run lab.yaml"
    )
