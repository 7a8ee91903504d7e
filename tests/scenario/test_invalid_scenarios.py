"""Every scenario in scenarios/invalid gives exactly the errors that its first lines announce:

``# error: <line>:<column>: <regular expression for message and hint>``
"""

import re
from pathlib import Path

import pytest

from safenav.errors import ExitCode, InputError
from safenav.scenario.reading.loader import load_scenario

FOLDER = Path(__file__).parents[2] / "scenarios" / "invalid"
FILES = sorted(FOLDER.rglob("*.yaml"))
ANNOUNCEMENT = re.compile(r"# error: (\d+):(\d+): (.*)")


def test_there_are_invalid_scenarios() -> None:
    assert len(FILES) >= 25


@pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])
def test_every_error_is_reported_at_its_position(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    announced = [ANNOUNCEMENT.match(line) for line in text.splitlines()]
    expected = [(int(m[1]), int(m[2]), m[3]) for m in announced if m]
    with pytest.raises(InputError) as caught:
        load_scenario(file)
    found = caught.value.diagnostics
    assert [(d.line, d.column) for d in found] == [(line, col) for line, col, _ in expected]
    for diagnostic, (_, _, words) in zip(found, expected, strict=True):
        assert re.search(words, f"{diagnostic.found} {diagnostic.hint}"), diagnostic
        assert diagnostic.file == str(file)
    assert caught.value.exit_code is ExitCode.BAD_INPUT
