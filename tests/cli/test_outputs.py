"""No command writes over what it reads, or twice into one file."""

from pathlib import Path
from shutil import copy

import pytest
from click.testing import CliRunner, Result

from safenav.cli import command_of
from safenav.errors import UsageError

HELLO = Path(__file__).parents[2] / "scenarios" / "hello.yaml"


def given(line: str) -> Result:
    name, *arguments = line.split()
    return CliRunner().invoke(command_of(name), arguments)


@pytest.mark.parametrize(
    "line",
    [
        "run s.yaml --trace s.yaml",
        "run s.yaml --live --trace s.yaml",
        "run s.yaml --operator f.yaml --trace f.yaml",
        "run s.yaml --trace out --html ./out",
        "run s.yaml --output out.html --html out.html",
        "resume t.jsonl --trace t.jsonl",
        "drive s.yaml --fleet f.yaml --trace f.yaml",
        "drive s.yaml --fleet f.yaml --resume t.jsonl --trace t.jsonl",
        "draw s.yaml -o s.yaml",
        "export t.jsonl --motion t.jsonl",
        "replay -o t.jsonl t.jsonl",
        "export t.jsonl --mcap t.jsonl",
        "export t.jsonl --mcap out --waypoints out",
        "batch f.yaml s.yaml --junit s.yaml",
        "batch s.yaml --baseline f.yaml --results f.yaml",
    ],
)
def test_a_file_is_not_overwritten(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("s.yaml", "f.yaml", "t.jsonl"):
        (tmp_path / name).write_text("kept")
    found = given(line).exception
    assert isinstance(found, UsageError) and "would overwrite" in str(found)
    assert [file.read_text() for file in tmp_path.iterdir()] == ["kept"] * 3


def test_a_motion_is_not_written_over_the_trace_in_a_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    copy(HELLO, "s.yaml")
    found = given("run s.yaml --output out --motion out/s.jsonl").exception
    assert isinstance(found, UsageError) and "would overwrite --output" in str(found)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("synth s.yaml -o out.pdf", "out.pdf: expected a folder"),
        ("batch s.yaml --out r.json", "r.json: expected a folder"),
        ("run s.yaml -o out.pdf", "expected a folder or a name in .jsonl or a name in .html"),
        ("certify s.yaml -o b.pdf", "expected a folder or a name in .zip"),
        ("run s.yaml --trace x.html", "x.html: expected a name in .jsonl"),
        ("replay t.jsonl -o x.json", "the replay is HTML; choose a name such as x.html"),
        ("export t.jsonl --mcap a.pdf", "a.pdf: expected a name in .mcap"),
        ("new x.pdf", "ends in .yaml"),
    ],
)
def test_a_name_of_another_kind_is_refused(
    line: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder of that name was made, or a file that no program opens."""
    monkeypatch.chdir(tmp_path)
    for name in ("s.yaml", "t.jsonl"):
        (tmp_path / name).write_text("kept")
    done = given(line)
    assert expected in f"{done.output}{done.exception}"
    assert {file.name for file in tmp_path.iterdir()} == {"s.yaml", "t.jsonl"}
