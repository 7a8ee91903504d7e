"""``safenav run``: the story, the machine-readable result, exit codes, interruption."""

import json
from pathlib import Path

import pytest

from cli.conftest import Command
from once import SCENARIOS
from safenav.checked_trace import check_trace

NO_WAY = """\
safenav: 1
map: {grid: "#######\\n#.....#\\n#######\\n"}
robots: {flyer: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}}
obstacles: [{type: door, region: 10}]
"""


@pytest.mark.parametrize("number", [1, 2, 3])
def test_case_study_is_told_and_ends_as_expected(safenav: Command, number: int) -> None:
    done = safenav("run", SCENARIOS / f"case_study_{number}.yaml", "--trace", "t.jsonl")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    for words in ("keeps out", "requests help", "objectives pushed", "resolves", "completed"):
        assert words in done.stdout
    assert "██" in done.stdout


def test_json_result_is_the_only_output(safenav: Command) -> None:
    done = safenav("run", SCENARIOS / "case_study_1.yaml", "--json")
    result = json.loads(done.stdout)
    assert result["outcome"] == "completed"
    assert result["as_expected"] is True
    assert result["resolved"] == ["door@47"]
    assert result["helpers"] == {"door@47": "digit"}


def test_broken_expectation_is_a_negative_with_the_difference(
    safenav: Command, tmp_path: Path
) -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(text.replace("helpers: {door@47: digit}", "helpers: {door@47: quad}"))
    done = safenav("run", wrong)
    assert done.returncode == 1
    assert "expected quad to be requested for door@47, digit was" in done.stderr


@pytest.mark.parametrize(
    ("expect", "code"), [("", 1), ("expect: {outcome: operator_needed}\n", 0)], ids=["bare", "met"]
)
def test_operator_needed(safenav: Command, tmp_path: Path, expect: str, code: int) -> None:
    scenario = tmp_path / "no_way.yaml"
    scenario.write_text(NO_WAY + expect)
    done = safenav("run", scenario)
    assert done.returncode == code
    assert "operator needed" in done.stdout
    needed = "it needs a robot with 'push', and no robot of this team has it"
    assert f"flyer requests help with door@10, but no robot helps: {needed}\n" in done.stdout
    assert (
        "there is no path from 9 [1, 2] to 12 [1, 5]: 10 [1, 3] is closed (this team cannot "
        "resolve door@10)" in done.stdout
    )
    if code:
        assert f"explain: safenav explain {scenario}" in done.stderr


@pytest.mark.parametrize(
    ("clock", "at", "note"),
    [("lockstep", 2, ""), ("lockstep", 9, "tick 9"), ("live", 2, ""), ("live", 90, "90 s")],
)
def test_changes_that_a_run_did_not_reach_are_noted(
    safenav: Command, tmp_path: Path, clock: str, at: int, note: str
) -> None:
    scenario = tmp_path / "s.yaml"
    scenario.write_text(
        'safenav: 1\nmap: {grid: ["....."]}\nuntil: {rounds: 1}\n'
        "robots: {q: {model: quadcopter, start: 0, objective: {visit: [4, 0]}}}\n"
        f"changes: [{{at: {at}, robot: q, objective: {{hold: 1}}}}]\n"
    )
    done = safenav("run", scenario, "--clock", clock)
    assert done.returncode == 0
    assert done.stderr == (f"note: completed before the change of q at {note}\n" if note else "")


def test_tick_limit_is_a_resource_limit(safenav: Command) -> None:
    done = safenav("run", SCENARIOS / "case_study_1.yaml", "--max-ticks", 5)
    assert done.returncode == 3
    assert "not completed after 5 ticks: quad and digit have completed 0 of 2" in done.stdout


OUTPUTS = [
    "run s.yaml --trace {}",
    "run s.yaml --motion {} --trace t.jsonl",
    "run s.yaml --live --trace {}",
    "batch s.yaml --junit {}",
    "draw s.yaml -o {}.svg",
    "new {}.yaml",
    "new {}.json --schema",
    "export t.jsonl --motion {}",
    "replay t.jsonl -o {}",
    "export t.jsonl --waypoints {}",
]


@pytest.mark.parametrize("line", OUTPUTS)
def test_outputs_are_tried_before_any_work(line: str, safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text((SCENARIOS / "hello.yaml").read_text())
    done = safenav(*line.format("missing/out").split())
    assert done.returncode == 2
    assert done.stderr.startswith("error: cannot write missing/out")
    assert "No such file or directory" in done.stderr
    assert done.stdout == ""
    assert {path.name for path in tmp_path.iterdir()} == {"s.yaml"}, "nothing half written"


@pytest.mark.parametrize(
    "line", ["run s.yaml -o s.yaml/out", "synth s.yaml -o s.yaml", "certify s.yaml -o s.yaml/out"]
)
def test_folders_are_tried_too(line: str, safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text((SCENARIOS / "hello.yaml").read_text())
    done = safenav(*line.split())
    assert (done.returncode, done.stdout) == (2, "")
    assert "error: cannot write s.yaml" in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"s.yaml"}


def test_a_refused_run_leaves_the_trace_of_an_earlier_one(safenav: Command, tmp_path: Path) -> None:
    text = (SCENARIOS / "hello.yaml").read_text()
    (tmp_path / "s.yaml").write_text(text.replace("rounds: 2", "rounds: 2, by: 400"))
    (tmp_path / "old.jsonl").write_text("earlier")
    for trace in ("old.jsonl", "new.jsonl"):
        done = safenav("run", "s.yaml", "--clock", "live", "--trace", trace)
        assert (done.returncode, done.stdout) == (2, ""), done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"s.yaml", "old.jsonl"}
    assert (tmp_path / "old.jsonl").read_text() == "earlier"
    assert safenav("run", "s.yaml", "--trace", "old.jsonl").returncode == 0
    assert (tmp_path / "old.jsonl").read_text().startswith('{"type":"header"')


def test_a_device_stays_one(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "s.yaml").write_text((SCENARIOS / "hello.yaml").read_text())
    assert safenav("run", "s.yaml", "--html", "/dev/null").returncode == 0
    assert not Path("/dev/null").is_file()


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("run", "error: missing argument 'SCENARIO'\n    safenav run --help lists the options"),
        ("run s.yaml --foo", "error: no such option '--foo'"),
        ("run s.yaml --seed x", "error: invalid value for '--seed'"),
        ("check s.yaml", "error: s.yaml: no such file"),
        ("check s.jsonl", "error: s.jsonl: cannot be read"),
    ],
)
def test_every_error_begins_alike(line: str, told: str, safenav: Command) -> None:
    done = safenav(*line.split())
    assert done.returncode == 2
    assert done.stderr.startswith(told), done.stderr


def test_output_goes_where_its_ending_says(safenav: Command, tmp_path: Path) -> None:
    file = tmp_path / "no_way.yaml"
    file.write_text(NO_WAY)
    safenav("run", file, "-o", "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"no_way.jsonl", "no_way.html"}
    safenav("run", file, "--output", "here.jsonl", "--html", "there.html")
    assert check_trace(tmp_path / "here.jsonl").findings == ()
    assert "<html" in (tmp_path / "there.html").read_text()
    done = safenav("run", file, "-o", "a.html", "--html", "b.html")
    assert (
        done.returncode,
        "--output a.html and --html b.html name the same output" in done.stderr,
    ) == (
        2,
        True,
    )
