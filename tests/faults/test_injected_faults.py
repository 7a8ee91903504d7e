"""Faults outside safenav: nothing is lost, nothing is executed, no traceback."""

import ctypes
import json
import os
import resource
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

import warm
from children import ran
from once import ROOT, SCENARIOS
from safenav import Synthesizer, check_trace

CASE_STUDY = SCENARIOS / "case_study_1.yaml"
_PR_CAPBSET_DROP, _CAP_DAC_OVERRIDE, _CAP_DAC_READ_SEARCH = 24, 1, 2

Safenav = Callable[..., CompletedProcess[str]]


@pytest.fixture
def safenav(tmp_path: Path) -> Safenav:
    """Runs ``safenav ARGUMENTS...`` in a directory and with a cache of its own, and checks that
    there is no traceback; ``limit``: of the process."""
    own = {**os.environ, "SAFENAV_CACHE": str(tmp_path / "cache"), "NO_COLOR": "1"}

    def run(*arguments: object, limit: Any = None, **variables: str) -> CompletedProcess[str]:
        environment = {**own, **variables}
        if limit is None:
            done = warm.safenav(*arguments, cwd=tmp_path, env=environment)
        else:  # Python 3.11 does not notice that a compiled file was cut off, and others read it
            environment |= {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
            words = [sys.executable, "-m", "safenav", *arguments]
            done = ran(words, cwd=tmp_path, env=environment, preexec_fn=limit)
        assert "Traceback" not in done.stderr
        return done

    return run


def records(trace: Path) -> list[dict[str, Any]]:
    """The lines of a trace, every one of them whole; the judge must find nothing."""
    assert check_trace(trace).findings == ()
    return [json.loads(line) for line in trace.read_text(encoding="utf-8").splitlines()]


def small_files(most: int = 4096) -> None:
    """No file of the process may grow beyond 4 kB: what a full disk looks like."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


def no_privileges() -> None:
    """Let read-only files be read-only for root as well."""
    if os.geteuid() == 0:
        library = ctypes.CDLL(None)
        for capability in (_CAP_DAC_OVERRIDE, _CAP_DAC_READ_SEARCH):
            library.prctl(_PR_CAPBSET_DROP, capability, 0, 0, 0)


TURN = 's/"state": \\[0/"state": [2/; s/"state": \\[1/"state": [0/; s/\\[2/[1/'
"""The lowest bit of every region is turned: the robot would walk somewhere else."""
FAILS = """#!/bin/sh
unset SLUGS_PARENT
SLUGS="{slugs}"
echo asked >> "{count}"
if [ "$(wc -l < "{count}")" -lt 3 ] || ! mkdir "{count}.failed" 2>/dev/null; then
    exec "$SLUGS" "$@"
fi
{answer}
"""
"""The real synthesizer but for one answer in mid-run."""


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        ("kill -9 $$", "SIGKILL"),
        (f'"$SLUGS" "$@" | sed \'{TURN}\'', "gave a wrong result"),
        ('"$SLUGS" "$@" | head -c 100', "not JSON"),
    ],
    ids=["a killed program", "a wrong strategy", "half a reply"],
)
def test_a_reply_that_is_not_a_strategy_is_never_executed(
    answer: str, why: str, safenav: Safenav, tmp_path: Path
) -> None:
    slugs, trace = tmp_path / "slugs that fails", tmp_path / "t.jsonl"
    slugs.write_text(
        FAILS.format(slugs=Synthesizer().binary, count=tmp_path / "count", answer=answer)
    )
    slugs.chmod(0o755)
    done = safenav("run", CASE_STUDY, "--trace", trace, SAFENAV_SLUGS=str(slugs))
    assert done.returncode == 4 and why in done.stderr
    *lines, last = records(trace)
    assert last["outcome"] == "error"
    assert any(line["type"] == "move" for line in lines)
    # Wrong results are not cached: the next run, with the real slugs, requests them again.
    assert safenav("run", CASE_STUDY).returncode == 0


def test_a_full_disk_is_reported_and_leaves_complete_lines(
    safenav: Safenav, tmp_path: Path
) -> None:
    # The trace: reported immediately, and all written lines but the last are complete.
    beyond_the_header = partial(small_files, 8192)
    done = safenav("run", CASE_STUDY, "--trace", "t.jsonl", limit=beyond_the_header)
    assert done.returncode == 2
    assert "cannot write the trace t.jsonl" in done.stderr
    *whole, _ = (tmp_path / "t.jsonl").read_text(encoding="utf-8").split("\n")
    assert json.loads(whole[0])["type"] == "header"
    assert all(json.loads(line) for line in whole)
    # The files of a synthesis: all or none, perhaps with the folder that it made.
    (tmp_path / "old").mkdir()
    for folder in ("old", "new/out"):
        done = safenav("synth", CASE_STUDY, "-o", folder, limit=small_files)
        assert done.returncode == 2
        assert "cannot write" in done.stderr
        assert [*(tmp_path / folder).iterdir()] == []
    # The cache: the run continues without it.
    assert safenav("run", CASE_STUDY, limit=small_files).returncode == 0


def test_path_names_may_have_spaces_and_unicode(safenav: Safenav, tmp_path: Path) -> None:
    folder = tmp_path / "mein Gebäude 建物" / "it's 'here'"
    folder.mkdir(parents=True)
    scenario, trace = folder / "сценарий 1.yaml", folder / "след ü.jsonl"
    scenario.write_text(CASE_STUDY.read_text(encoding="utf-8"), encoding="utf-8")
    cache = str(folder / "ca che")
    for _ in range(2):
        done = safenav("run", scenario, "--trace", trace, SAFENAV_CACHE=cache)
        assert (done.returncode, done.stderr) == (0, "")
    assert records(trace)[-1]["outcome"] == "completed"
    assert safenav("check", trace).returncode == 0
    assert safenav("synth", scenario, "-o", folder / "out put").returncode == 0
    assert (folder / "out put" / "digit.json").exists()
    assert safenav("replay", trace, "-o", folder / "page ü.html").returncode == 0
    assert (folder / "page ü.html").stat().st_size > 1000


def test_no_file_is_written_outside_the_named_folder(safenav: Safenav, tmp_path: Path) -> None:
    locked, a_file = tmp_path / "locked", tmp_path / "file"
    locked.mkdir()
    locked.chmod(0o555)
    a_file.write_text("kept")
    for place in (locked / "out", a_file, a_file / "below", "/proc/nowhere"):
        done = safenav("synth", CASE_STUDY, "-o", place, limit=no_privileges)
        assert done.returncode == 2, place
        assert f"cannot write {place}" in done.stderr
        done = safenav("run", CASE_STUDY, "--trace", Path(place) / "t", limit=no_privileges)
        assert done.returncode == 2, place
        assert "cannot write" in done.stderr
    assert a_file.read_text() == "kept"
    assert list(locked.iterdir()) == []
