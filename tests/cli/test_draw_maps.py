"""``safenav draw`` shows what was read from a map file."""

import re
from pathlib import Path

import pytest

from cli.conftest import Command

MAPS = Path(__file__).parents[1] / "maps"
ROWS = (range(14, 21), range(22, 25)), (range(40, 43), range(44, 51))
"""Free regions in rows 1 and 3 of the rooms that all these files show."""


@pytest.mark.parametrize(
    "written",
    [
        f"image: {MAPS / 'rooms.png'}, rows: 7, cols: 13",
        f"ros: {MAPS / 'office.yaml'}, resolution: 0.4",
        f"movingai: {MAPS / 'rooms.map'}",
    ],
    ids=["image", "ros", "movingai"],
)
def test_walls_and_region_numbers_of_a_file_are_drawn(
    written: str, safenav: Command, tmp_path: Path
) -> None:
    (tmp_path / "s.yaml").write_text(
        f"safenav: 1\nmap: {{{written}}}\n"
        "robots: {ann: {model: quadcopter, start: 53, objective: {hold: 53}}}\n",
        encoding="utf-8",
    )
    found = safenav("draw", "s.yaml")
    assert found.returncode == 0, found.stderr
    lines = [line for line in found.stdout.splitlines() if "\u2588" in line]
    assert len(lines) == 7
    assert [line.split()[0] for line in lines] == [str(row) for row in range(7)]
    columns = next(line for line in found.stdout.splitlines() if line.startswith("  0 "))
    assert columns.split() == [str(col) for col in range(13)]
    for line, groups in zip((lines[1], lines[3]), ROWS, strict=True):
        shown = [part.split() for part in line[2:].split("\u2588") if part.strip()]
        assert shown == [[str(region) for region in group] for group in groups]
    drawn = safenav("draw", "s.yaml", "-o", "s.svg")
    assert drawn.returncode == 0, drawn.stderr
    picture = (tmp_path / "s.svg").read_text(encoding="utf-8")
    assert picture.startswith("<svg")
    beside = re.findall(r'text-anchor="end">(\d+)<', picture)
    below = re.findall(r'text-anchor="middle">(\d+)<', picture)
    assert beside == [str(row) for row in range(7)]
    assert below[:13] == [str(col) for col in range(13)]
