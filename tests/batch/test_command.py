"""The command as people and CI use it: exit codes, files, artifacts, interruption."""

import json
import os
import pty
import signal
import subprocess
import time
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from batch.made_scenarios import SlugsLog, Write
from batch.running import SAFENAV, environment, safenav, started, wait_until
from children import ran
from safenav.batch.case import Conditions
from safenav.batch.search import find_cases
from safenav.batch.worker import leave, run_case
from safenav.errors import SafenavError

pytestmark = pytest.mark.usefixtures("slugs")


def test_a_scenario_comes_from_standard_input(write: Write) -> None:
    write("a.yaml")
    done = ran([*SAFENAV, "batch", "-"], input=Path("a.yaml").read_text(), env=environment())
    assert "1 passed" in done.stdout, done.stdout + done.stderr


def test_a_broken_scenario_a_crash_and_a_hang_do_not_take_the_batch_down(
    write: Write, slugs: SlugsLog
) -> None:
    write("bad.yaml", text="safenav: 1\nmap: [")
    write("crash.yaml", "crasher")
    write("fails.yaml", "broken")
    write("other.yaml", expect="{outcome: completed}")
    write("quick.yaml")
    done = safenav(".", "--json", "--out", "out")
    assert done.returncode == 1
    # Alone: on a busy machine the others take longer than a second.
    write("hang.yaml", "sleeper")
    hung = safenav("hang.yaml", "--time-limit", "1", "--json", "--out", "hung")
    assert (hung.returncode, "0 passed, 1 hung" in hung.stderr) == (1, True)
    found = [*json.loads(done.stdout)["results"], *json.loads(hung.stdout)["results"]]
    results = {result["name"]: result for result in found}
    told = {
        "bad.yaml": ("invalid", "bad.yaml:3:1: not YAML"),
        "crash.yaml": ("crashed", "the process that ran it died: killed by SIGSEGV"),
        "fails.yaml": ("error", "out of order"),
        "hang.yaml": ("hung", "stopped after 1 s (time limit)"),
        "other.yaml": ("different", "outcome: expected completed, got unrealizable"),
        "quick.yaml": ("passed", ""),
    }
    assert results.keys() == told.keys()
    for name, (verdict, reason) in told.items():
        assert results[name]["verdict"] == verdict
        assert reason in "\n".join(results[name]["reasons"])
    for name in ("crash.yaml", "hang.yaml"):  # the stack shows where it was
        assert "slugs.py" in results[name]["detail"]
    assert "1 passed, 1 invalid, 1 crashed, 1 error, 1 different" in done.stderr
    assert slugs.all_gone()
    for name, out in (("crash.yaml", "out"), ("hang.yaml", "hung")):
        assert [*Path(out, "failures").glob(f"{name}-*/trace.jsonl")]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_batch_is_resumed_where_it_was(
    write: Write, slugs: SlugsLog, number: signal.Signals
) -> None:
    for letter in "abcdefgh":
        write(f"{letter}.yaml", "quick" if letter in "abc" else "sleeper")
    words = [".", "--out", "out", "--jobs", "2"]
    state = Path("out/results.jsonl")
    with started(*words, "--junit", "junit.xml") as batch:
        wait_until(batch, lambda: state.exists() and state.read_text().count("\n") >= 3)
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
    junit = ET.parse("junit.xml")
    assert len(junit.findall(".//skipped")) == 8 - len(done)
    slugs.path.unlink()
    resumed = safenav(*words, "--resume")
    assert resumed.returncode == 0
    assert (
        "8 passed in" in resumed.stdout and f"({len(done)} of them done before)" in resumed.stdout
    )
    assert len(slugs.pids) == 8 - len(done)
    assert len(state.read_text().splitlines()) == 8


def test_no_case_begins_in_a_batch_that_has_ended(write: Write, slugs: SlugsLog) -> None:
    """A thread that had taken the next case started a new process for it, and the end of the batch
    waited for that."""
    write("a.yaml", "sleeper")
    (case,) = find_cases(["a.yaml"]).cases
    leave("interrupted")
    with pytest.raises(SafenavError, match="the batch has ended"):
        run_case("interrupted", case, Conditions())
    assert not slugs.pids


def test_a_process_that_is_ended_during_a_synthesis_ends_in_order(
    write: Write, slugs: SlugsLog
) -> None:
    """Its interpreter waited for a thread, then aborted."""
    write("a.yaml", "sleeper")
    (case,) = find_cases(["a.yaml"]).cases
    with ThreadPoolExecutor(1) as threads:
        running = threads.submit(run_case, "ended", case, Conditions())
        while not slugs.pids:
            time.sleep(0.01)
        stat = Path(f"/proc/{slugs.pids[0]}/stat").read_text()
        os.kill(int(stat.rpartition(")")[2].split()[1]), signal.SIGTERM)
        result, _ = running.result()
    assert (result.detail, result.reasons) == (
        "",
        ["the process that ran it died: exit status 0"],
    )
    assert slugs.all_gone()


def test_a_terminal_shows_the_progress_of_a_batch(write: Write) -> None:
    write("a.yaml", expect="{outcome: completed}")
    write("b.yaml", "slow")
    master, terminal = pty.openpty()
    batch = subprocess.Popen(
        [*SAFENAV, "batch", ".", "--jobs", "1"],
        stdout=subprocess.PIPE,
        stderr=terminal,
        env=environment(),
    )
    os.close(terminal)
    seen = b""
    while True:
        try:
            data = os.read(master, 4096)
        except OSError:  # the other side is closed
            break
        if not data:
            break
        seen += data
    os.close(master)
    batch.communicate()
    assert b"a.yaml: outcome: expected completed" in seen
    assert b"1/2, 1 failed; running b.yaml (0 s)" in seen
    assert seen.endswith(b"\r\x1b[K")
