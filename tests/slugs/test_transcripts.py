"""Transcripts of the synthesizer (see ``support.transcripts``), and the example of its README."""

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from children import ran
from support.transcripts import check

TRANSCRIPTS = Path(__file__).with_name("transcripts")


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_the_synthesizer_prints_its_transcript(own_slugs: Path, folder: Path, file: Path) -> None:
    def run(words: list[str], variables: Mapping[str, str]) -> tuple[int, str]:
        del variables
        before = sorted(folder.iterdir())
        done = ran(["sh", "-c", '"$0" "$@" 2>&1', own_slugs, *words[1:]], cwd=folder)
        assert sorted(folder.iterdir()) == before, "a command without OUTFILE writes nothing"
        return done.returncode, done.stdout

    check(file, folder, run)


README = Path(__file__).resolve().parents[2] / "slugs" / "README.md"


def test_the_example_runs_as_shown(own_slugs: Path, tmp_path: Path) -> None:
    """The specification, the command, and all that it says."""
    pattern = r"```\n\$ cat (\S+)\n(.*?)\$ slugs (.*?)\n(.*?)```"
    example = re.search(pattern, README.read_text(), re.DOTALL)
    assert example is not None
    name, text, words, expected = example.groups()
    (tmp_path / name).write_text(text)
    done = ran(["sh", "-c", f'"$0" {words} 2>&1', own_slugs], cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, expected)
