"""Batches as people and CI use them: results on the disk, reports, processes, interruption. What
they print, and which files they find: ``cli/transcripts/batch*.txt``."""

import json
import os
import pty
import re
import signal
import subprocess
import xml.etree.ElementTree as ET
from contextlib import suppress
from pathlib import Path

import pytest

from batch.conftest import SAFENAV, SlugsLog, Write, safenav, started, wait_until
from children import gone
from once import ROOT

BATCH = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")


def junit(file: str) -> ET.Element:
    """A report, which keeps to the schema."""
    import xmlschema

    xmlschema.XMLSchema(str(Path(__file__).with_name("junit.xsd"))).validate(file)
    return ET.parse(file).getroot()


def test_a_broken_scenario_a_crash_and_a_hang_do_not_stop_the_batch(
    write: Write, slugs: SlugsLog
) -> None:
    write("bad.yaml", text="safenav: 1\nmap: [")
    write("crash.yaml", "crasher")
    write("fails.yaml", "broken")
    write("other.yaml", expect="{outcome: completed}")
    write("quick.yaml")
    done = safenav(".", "--json", "--out", "out", "--junit", "j.xml")
    assert done.returncode == 1
    # Alone, and after it has begun on a busy machine as well.
    write("hang.yaml", "sleeper")
    hung = safenav("hang.yaml", "--time-limit", "4", "--json", "--out", "hung")
    assert (hung.returncode, "0 passed, 1 hung" in hung.stderr) == (1, True)
    found = [*json.loads(done.stdout)["results"], *json.loads(hung.stdout)["results"]]
    results = {result["name"]: result for result in found}
    told = {
        "bad.yaml": ("invalid", "bad.yaml:3:1: not YAML"),
        "crash.yaml": ("crashed", "the process that ran this case died: killed by SIGSEGV"),
        "fails.yaml": ("error", "order ü <&> ]]>"),
        "hang.yaml": ("hung", "stopped after 4 s (time limit)"),
        "other.yaml": ("different", "outcome: expected completed, got unrealizable"),
        "quick.yaml": ("passed", ""),
    }
    assert results.keys() == told.keys()
    for name, (verdict, reason) in told.items():
        assert results[name]["verdict"] == verdict
        assert reason in "\n".join(results[name]["reasons"])
        out = Path("hung" if verdict == "hung" else "out", "failures")
        assert bool([*out.glob(f"{name}-*.jsonl")]) == (name not in ("bad.yaml", "quick.yaml"))
    for name in ("crash.yaml", "hang.yaml"):  # the stack shows where it was
        assert "slugs.py" in results[name]["detail"]
    assert "1 passed, 1 invalid, 1 crashed, 1 error, 1 different" in done.stderr
    assert slugs.all_gone()
    root = junit("j.xml")
    assert [root.get(key) for key in ("tests", "failures", "errors")] == ["5", "1", "3"]
    error = root.find(".//testcase[@name='fails.yaml']/error")
    assert error is not None and "order ü <&> ]]>" in str(error.get("message"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_batch_resumes_with_the_missing_cases(
    write: Write, slugs: SlugsLog, number: signal.Signals
) -> None:
    for letter in "abcdefgh":
        write(f"{letter}.yaml", "quick" if letter in "abc" else "sleeper")
    words = [".", "--out", "out", "--jobs", "2"]
    state = Path("out/results.jsonl")
    with started(*words, "--junit", "junit.xml") as batch:
        wait_until(batch, lambda: state.exists() and state.read_text().count("\n") >= 3)
        second = safenav(*words, "--resume")
        assert second.returncode == 2 and "another batch is writing" in second.stderr
        batch.send_signal(number)
        output, errors = batch.communicate(timeout=300)
    assert batch.returncode == 130
    assert "; interrupted" in output
    assert "--resume" in errors
    assert slugs.all_gone()
    done = [json.loads(line)["name"] for line in state.read_text().splitlines()]
    assert sorted(done) == ["a.yaml", "b.yaml", "c.yaml"]
    for letter in "defgh":
        write(f"{letter}.yaml")
    assert len(junit("junit.xml").findall(".//skipped")) == 5
    slugs.path.unlink()
    resumed = safenav(*words, "--resume")
    assert resumed.returncode == 0
    assert "8 passed in" in resumed.stdout and "(3 of them from earlier runs)" in resumed.stdout
    assert len(slugs.pids) == 5
    assert len(state.read_text().splitlines()) == 8


@pytest.mark.parametrize("cut", [1, 200])
def test_a_case_whose_result_is_cut_is_run_again(write: Write, slugs: SlugsLog, cut: int) -> None:
    for letter in "abc":
        write(f"{letter}.yaml")
    safenav(".", "--out", "out")
    results = Path("out/results.jsonl")
    results.write_bytes(results.read_bytes()[: -1 - cut])
    assert "(2 of them from earlier runs)" in safenav(".", "--out", "out", "--resume").stdout
    assert len(slugs.pids) == 4
    assert len(results.read_text().splitlines()) == 3


def test_workers_end_when_the_batch_is_killed(slugs: SlugsLog, write: Write) -> None:
    write("a.yaml", "sleeper")
    with started("a.yaml") as batch:
        wait_until(batch, lambda: bool(slugs.pids))
        worker = slugs.parent()
        batch.send_signal(signal.SIGKILL)
    assert gone(worker)
    assert slugs.all_gone()


def test_a_synthesis_ends_with_the_process_that_requested_it(write: Write, slugs: SlugsLog) -> None:
    write("a.yaml", "sleeper")
    with started("a.yaml", "--json") as batch:
        wait_until(batch, lambda: bool(slugs.pids))
        os.kill(slugs.parent(), signal.SIGTERM)
        output, _ = batch.communicate(timeout=300)
    (result,) = json.loads(output)["results"]
    died = ["the process that ran this case died: killed by SIGTERM"]
    assert (result["detail"], result["reasons"]) == ("", died)
    assert slugs.all_gone()


def test_a_batch_whose_workers_cannot_start_ends_with_an_error(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "yaml.py").write_text("raise RuntimeError('no yaml here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    write("a.yaml")
    done = safenav("a.yaml")
    assert done.returncode == 4
    assert "did not start" in done.stderr and "no yaml here" in done.stderr


@pytest.mark.parametrize("words", ["batch . --jobs 1", "check b.yaml"])
def test_a_terminal_shows_the_progress(words: str, write: Write) -> None:
    write("a.yaml", expect="{outcome: completed}")
    write("b.yaml", "slow")
    master, terminal = pty.openpty()
    command, seen = [*SAFENAV, *words.split()], b""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=terminal):
        os.close(terminal)
        with suppress(OSError):  # the other side is closed
            while data := os.read(master, 4096):
                seen += data
    os.close(master)
    told = {"batch": b"1/2, 1 failed; running b.yaml (0 s)", "check": b"synthesizing slow: "}
    assert told[words.split()[0]] in seen
    assert seen.endswith(b"\r\x1b[K")


def test_the_documented_library_example_runs(
    write: Write, capsys: pytest.CaptureFixture[str]
) -> None:
    write("scenarios/good.yaml")
    write("scenarios/wrong.yaml", expect="{outcome: completed}")
    (example,) = re.findall(r"^```python\n(.*?)^```", BATCH, re.MULTILINE | re.DOTALL)
    exec(compile(example, "docs/batch.md", "exec"), {})
    reasons = "['outcome: expected completed, got unrealizable']"
    assert capsys.readouterr().out == f"scenarios/wrong.yaml different {reasons}\n"
