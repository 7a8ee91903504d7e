"""`safenav replay` and `safenav draw` as their users call them."""

import os
from pathlib import Path
from xml.etree import ElementTree

import pytest

import warm
from report import made_traces

ROOT = Path(__file__).parents[2]


def safenav(*words: str | Path, cwd: Path | None = None) -> warm.Done:
    return warm.safenav(*words, cwd=cwd, env={**os.environ, "COLUMNS": "120"})


def test_the_page_is_written_beside_the_trace(traces: dict[str, Path], tmp_path: Path) -> None:
    trace = tmp_path / "door.jsonl"
    trace.write_bytes(traces["door"].read_bytes())
    done = safenav("replay", "door.jsonl", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "door.html").read_text().startswith("<!doctype html>")
    assert {path.name for path in tmp_path.iterdir()} == {"door.jsonl", "door.html"}


@pytest.mark.parametrize(("word", "tick"), [("0", 0), ("last", 46), ("request", 11), ("16", 16)])
def test_a_moment_is_named_by_number_or_event(
    traces: dict[str, Path], word: str, tick: int
) -> None:
    done = safenav("replay", traces["door"], "--at", word, "-o", "-")
    assert done.returncode == 0, done.stderr
    root = ElementTree.fromstring(done.stdout)
    assert f"tick {tick} of 46" in "".join(root.itertext())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--at", "47", "-o", "-"], "ticks 0 to 46"),
        (["--at", "blocked", "-o", "x.SVG"], "'last', or the kind of an event"),
        (["--at", "-1", "-o", "-"], "no tick '-1'"),
        (["--at", "1"], "--at requires -o FILE in .svg or .png"),
        (["--speed", "3"], "--speed requires -o FILE in .gif"),
        (["--3d", "-o", "x.gif"], "--3d is a page: choose a name such as x.html"),
        (["-o", "x.pdf"], "expected a name in .html, .svg, .png or .gif"),
        (["-o", "x"], "expected a name in .html, .svg, .png or .gif"),
        (["-o", "x.gif", "--ticks", "9-3"], "in order"),
        (["-o", "x.gif", "--ticks", "0-47"], "two ticks such as 0-46"),
        (["-o", "/nowhere/at/all.svg"], "cannot write"),
    ],
)
def test_invalid_options_are_refused(
    traces: dict[str, Path], words: list[str], message: str
) -> None:
    done = safenav("replay", traces["door"], *words)
    assert done.returncode == 2
    assert message in done.stderr and "Traceback" not in done.stderr


def test_a_bad_trace_is_refused_with_its_line(tmp_path: Path) -> None:
    lines = made_traces.door()
    lines[7]["to"] = 4711
    trace = made_traces.write(lines, tmp_path / "bad.jsonl")
    done = safenav("replay", trace)
    assert done.returncode == 2
    assert "bad.jsonl:8:" in done.stderr and "4711" in done.stderr
    assert not (tmp_path / "bad.html").exists()


def test_draw_knows_two_forms_of_picture(tmp_path: Path) -> None:
    scenario = ROOT / "scenarios" / "case_study_1.yaml"
    done = safenav("draw", scenario, "-o", tmp_path / "map.pdf")
    assert done.returncode == 2 and "a name in .svg or .png" in done.stderr
