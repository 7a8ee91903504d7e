"""Transcripts of the synthesizer: see ``support.transcripts``."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from children import ran
from support.transcripts import check

TRANSCRIPTS = Path(__file__).with_name("transcripts")


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_the_synthesizer_prints_what_its_transcript_says(
    own_slugs: Path, folder: Path, file: Path
) -> None:
    def run(words: list[str], variables: Mapping[str, str]) -> tuple[int, str]:
        del variables
        before = sorted(folder.iterdir())
        done = ran(["sh", "-c", '"$0" "$@" 2>&1', own_slugs, *words[1:]], cwd=folder)
        assert sorted(folder.iterdir()) == before, "a command without OUTFILE writes nothing"
        return done.returncode, done.stdout

    check(file, folder, run)
