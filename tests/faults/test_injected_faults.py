"""Faults outside safenav, one test each: nothing is lost, nothing is executed, no traceback."""

import json
from functools import partial
from pathlib import Path

from faults.conftest import CASE_STUDY, Process, Script, no_privileges, records, small_files


def test_a_killed_synthesizer_leaves_a_sound_trace(safenav: Process, slugs_that: Script) -> None:
    done = safenav("run", CASE_STUDY, "--trace", "t.jsonl", SAFENAV_SLUGS=slugs_that("kill -9 $$"))
    assert done.returncode == 4
    assert "SIGKILL" in done.stderr
    trace = records(safenav.folder / "t.jsonl")
    assert trace[-1]["outcome"] == "error"
    assert any(record["type"] == "move" for record in trace)


def test_a_wrong_strategy_is_never_executed(safenav: Process, slugs_that: Script) -> None:
    # The lowest bit of every region is turned: the robot would walk somewhere else.
    turn = 's/"state": \\[0/"state": [2/; s/"state": \\[1/"state": [0/; s/\\[2/[1/'
    wrong = slugs_that(f'"$SLUGS" "$@" | sed \'{turn}\'')
    done = safenav("run", CASE_STUDY, "--trace", "t.jsonl", SAFENAV_SLUGS=wrong)
    assert done.returncode == 4
    assert "gave a wrong result" in done.stderr
    assert records(safenav.folder / "t.jsonl")[-1]["outcome"] == "error"
    # Wrong results are not cached: the next run, with the real slugs, requests them again.
    assert safenav("run", CASE_STUDY).returncode == 0


def test_a_strategy_that_is_cut_off_is_refused(safenav: Process, slugs_that: Script) -> None:
    cut = slugs_that('"$SLUGS" "$@" | head -c 100')
    done = safenav("run", CASE_STUDY, "--trace", "t.jsonl", SAFENAV_SLUGS=cut)
    assert done.returncode == 4
    assert "not JSON" in done.stderr
    assert records(safenav.folder / "t.jsonl")[-1]["outcome"] == "error"


def test_a_full_disk_is_reported_and_leaves_complete_lines(safenav: Process) -> None:
    # The trace: reported immediately, and all written lines but the last are complete.
    beyond_the_header = partial(small_files, 8192)
    done = safenav("run", CASE_STUDY, "--trace", "t.jsonl", limit=beyond_the_header)
    assert done.returncode == 2
    assert "cannot write the trace t.jsonl" in done.stderr
    *whole, _ = (safenav.folder / "t.jsonl").read_text(encoding="utf-8").split("\n")
    assert json.loads(whole[0])["type"] == "header"
    assert all(json.loads(line) for line in whole)
    # The files of a synthesis: all or none, and no new folder.
    (safenav.folder / "old").mkdir()
    for folder in ("old", "new/out"):
        done = safenav("synth", CASE_STUDY, "-o", folder, limit=small_files)
        assert done.returncode == 2
        assert "cannot write" in done.stderr
    assert [*(safenav.folder / "old").iterdir()] == [] and not (safenav.folder / "new").exists()
    # The cache: the run continues without it.
    assert safenav("run", CASE_STUDY, limit=small_files).returncode == 0


def test_path_names_may_have_spaces_and_unicode(safenav: Process) -> None:
    folder = safenav.folder / "mein Gebäude 建物" / "it's 'here'"
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


def test_no_file_is_written_outside_the_named_folder(safenav: Process) -> None:
    text = CASE_STUDY.read_text(encoding="utf-8")
    for name in ("../../evil", "/tmp/evil", "a/b", "..", "nul\\0"):
        file = safenav.folder / "names.yaml"
        file.write_text(text.replace("  digit:", f'  "{name}":'))
        done = safenav("synth", "names.yaml", "-o", "out")
        assert done.returncode == 2
        assert "cannot name a robot" in done.stderr or "names.yaml:" in done.stderr
    assert not (safenav.folder / "out").exists()
    locked = safenav.folder / "locked"
    locked.mkdir()
    locked.chmod(0o555)
    a_file = safenav.folder / "file"
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
