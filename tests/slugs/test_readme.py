"""The example in slugs/README.md is what a reader would see."""

import re
import subprocess
from pathlib import Path

README = Path(__file__).resolve().parents[2] / "slugs" / "README.md"


def test_the_example_runs_as_shown(own_slugs: Path, tmp_path: Path) -> None:
    """The specification, the command, and all that it says."""
    block = re.search(r"```\n(\$ cat lift\.structuredslugs\n.*?)```", README.read_text(), re.DOTALL)
    assert block is not None
    commands = [part.partition("\n") for part in block[1].split("$ ")[1:]]
    show, *runs = commands
    name = show[0].split()[1]
    (tmp_path / name).write_text(show[2])
    assert len(runs) == 1
    for command, _, expected in runs:
        words = command.split()
        assert words[0] == "slugs"
        done = subprocess.run(
            [own_slugs, *words[1:]],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stdout) == (0, expected)
