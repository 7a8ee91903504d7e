"""``safenav run``: the story, the machine-readable result, exit codes, interruption."""

import json
from pathlib import Path

from cli.conftest import Command
from once import SCENARIOS


def test_json_result_is_the_only_output(safenav: Command) -> None:
    done = safenav("run", SCENARIOS / "case_study_1.yaml", "--json")
    result = json.loads(done.stdout)
    assert result["outcome"] == "completed"
    assert result["as_expected"] is True
    assert result["resolved"] == ["door@47"]
    assert result["helpers"] == {"door@47": "digit"}


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
