"""``safenav resume``."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

import warm
from once import SCENARIOS
from runtime.facts import case
from runtime.played import play, whole
from safenav.errors import InputError, UsageError
from safenav.runtime.analysis.resuming import resumed
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.trace.reading import read_lines, read_trace

HELLO = load_scenario(SCENARIOS / "hello.yaml")


@pytest.mark.parametrize(
    ("scenario", "named"),
    [
        (load_scenario(SCENARIOS / "battery_delivery.yaml"), "batteries"),
        (replace(HELLO, until=replace(HELLO.until, by=99)), "deadlines"),
    ],
    ids=["batteries", "deadlines"],
)
def test_resume_names_what_a_trace_does_not_describe(scenario: Scenario, named: str) -> None:
    first = read_lines(play(scenario).lines[:9])
    said = f"does not fully describe {named}: also name the scenario"
    with pytest.raises(UsageError, match=said):
        resumed(first)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The trace of a run that was cut off."""
    file = tmp_path / "trace.jsonl"
    file.write_text("".join(play(HELLO).lines[:9]))
    return file


def test_a_line_of_another_run_is_refused(path: Path) -> None:
    """Two files written into one: it ended as a defect of safenav."""
    line = {"type": "backtrack", "tick": 1, "robot": "stranger", "to": 9}
    with path.open("a") as file:
        file.write(json.dumps(line) + "\n")
    with pytest.raises(InputError, match=r":10:1: the header has no robot stranger"):
        resumed(read_trace(path))


def test_a_finished_run_is_not_resumed(tmp_path: Path, path: Path) -> None:
    rest, whole = tmp_path / "rest.jsonl", tmp_path / "whole.jsonl"
    whole.write_text(play(HELLO).text)
    with pytest.raises(UsageError, match="nothing to resume"):
        resumed(read_trace(whole))
    assert warm.safenav("resume", whole).returncode == 2
    assert warm.safenav("resume", path, "--trace", rest, "--no-map").returncode == 0
    assert json.loads(rest.read_text().splitlines()[-1])["outcome"] == "completed"


def test_a_resumed_run_has_a_page_a_result_and_limits(tmp_path: Path, path: Path) -> None:
    page, text = tmp_path / "rest.html", path.read_text()
    done = warm.safenav("resume", path, "--json", "--html", page, "--max-ticks", "1")
    assert done.returncode == 3
    assert json.loads(done.stdout)["outcome"] == "tick_limit"
    assert page.read_text().startswith("<!doctype html>")
    refused = warm.safenav("resume", path, "--html", path)
    assert refused.returncode == 2 and "would overwrite" in refused.stderr
    assert path.read_text() == text


def test_a_resumed_run_has_the_outputs_of_a_run(tmp_path: Path, path: Path) -> None:
    """Beside the trace that it continues, in a folder or as motion; ``--seed`` is in its header."""
    motion = tmp_path / "m.jsonl"
    done = warm.safenav("resume", path, "-o", tmp_path, "--motion", motion, "--seed", "3")
    assert done.returncode == 0, done.stderr
    assert {file.name for file in tmp_path.iterdir()} == (
        {"trace.jsonl", "trace-2.jsonl", "trace-2.html", "m.jsonl"}
    )
    rest = read_trace(tmp_path / "trace-2.jsonl")
    assert rest.header.scenario.seed == 3
    assert json.loads(motion.read_text().splitlines()[0])["type"] == "header"


@pytest.mark.parametrize("option", [["--clock", "live"], ["--lockstep"], ["--live"]])
def test_a_resumed_run_keeps_its_clock(option: list[str], path: Path) -> None:
    done = warm.safenav("resume", path, *option)
    assert done.returncode == 2
    assert "a resumed run has the clock of its trace" in done.stderr


def test_a_live_run_stays_live(tmp_path: Path) -> None:
    source, trace = tmp_path / "s.yaml", tmp_path / "whole.jsonl"
    source.write_text(whole(case("resumed/untraversable")))
    run = ("run", source, "--clock", "live", "--seed", "7", "--trace", trace)
    assert warm.safenav(*run).returncode == 0
    trace.write_text("".join(trace.read_text().splitlines(keepends=True)[:6]))
    again = resumed(read_trace(trace), load_scenario(source))
    assert (again.clock.value, again.seed) == ("live", 7)


@pytest.mark.parametrize(
    ("expect", "resumed_once", "resumed_twice"),
    [
        ("{ticks: 27, rounds: 2}", 0, 0),
        ("{ticks: 26}", 1, 0),
        ("{outcome: tick_limit}", 1, 1),
    ],
)
def test_a_run_and_its_rest_are_compared_with_what_is_expected(
    expect: str, resumed_once: int, resumed_twice: int, tmp_path: Path
) -> None:
    """Of a rest of a rest the beginning is not known."""
    lab, path, rest = (tmp_path / name for name in ("lab.yaml", "trace.jsonl", "rest.jsonl"))
    text = (SCENARIOS / "hello.yaml").read_text()
    lab.write_text(text.replace("{outcome: completed}", expect))
    path.write_text("".join(play(load_scenario(lab)).lines[:12]))  # after the first goal
    for trace, code in ((path, resumed_once), (rest, resumed_twice)):
        done = warm.safenav("resume", trace, lab, "--trace", tmp_path / "new.jsonl", "--no-map")
        assert done.returncode == code, done.stderr
        lines = (tmp_path / "new.jsonl").read_text().splitlines(keepends=True)
        rest.write_text("".join(lines[:4]))


def test_a_resumed_run_may_be_expected_to_end_otherwise(tmp_path: Path) -> None:
    lab, path = tmp_path / "lab.yaml", tmp_path / "trace.jsonl"
    text = (SCENARIOS / "hello.yaml").read_text().replace("ticks: 100", "ticks: 12")
    lab.write_text(text.replace("{outcome: completed}", "{outcome: tick_limit}"))
    path.write_text("".join(play(load_scenario(lab)).lines[:5]))
    done = warm.safenav("resume", path, lab, "--trace", tmp_path / "rest.jsonl", "--no-map")
    assert done.returncode == 0, done.stderr
