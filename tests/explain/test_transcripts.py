"""What ``safenav explain``, ``synth`` and ``verify`` say (see ``support.transcripts``)."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from explain.conftest import Invoke
from safenav.cli import command_of
from support.transcripts import check

TRANSCRIPTS = Path(__file__).with_name("transcripts")


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_commands_print_their_transcript(
    file: Path, tmp_path: Path, invoke: Invoke, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("safenav.review.postmortem.explain_run.__defaults__", (600.0,))

    def run(words: list[str], variables: Mapping[str, str]) -> tuple[int, str]:
        del variables
        answer = invoke(command_of(words[1]), *words[2:])
        error = answer.error and f"{answer.error.rstrip()}\n"
        return answer.status, answer.output + error

    check(file, tmp_path, run)
