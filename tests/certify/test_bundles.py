"""Bundles of the shipped scenarios: accepted by their own checker, and by nothing but Python."""

import errno
import hashlib
import json
import os
import re
import shutil
import zipfile
from pathlib import Path

import pytest

import warm
from certify.making import (
    SCENARIOS,
    certified,
    files_of,
    judged,
    lines_of,
    rewrite,
    run_checker,
    shipped,
    with_lines,
)
from runtime.played import whole
from safenav.certify import bundle as writing
from safenav.certify.bundle import bundle_of_run
from safenav.certify.check import check_bundle
from safenav.errors import UsageError

COMPLETED = (
    "case_study_1",
    "case_study_1_beliefs",
    "case_study_2",
    "case_study_2_beliefs",
    "case_study_3",
    "case_study_3_beliefs",
    "cornered",
    "corridor_swap",
    "hello",
    "two_digits",
)
UNREALIZABLE = (
    "unrealizable/contradictory_objective",
    "unrealizable/forbidden_way",
    "unrealizable/impossible_start",
)


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPLETED)
def test_the_run_of_a_shipped_scenario_is_proven(name: str) -> None:
    status, said = judged(shipped(name))
    assert status == 0, said
    assert said.endswith("accepted\n")
    assert "The mission is completed" in said
    assert "obeys the scenario and meets that objective" in said or "joint plan" in said


@pytest.mark.parametrize("name", UNREALIZABLE)
def test_that_a_robot_is_unrealizable_is_proven(name: str) -> None:
    status, said = judged(shipped(name))
    assert status == 0, said
    assert "No strategy exists for" in said


@pytest.mark.parametrize("name", ["never resolvable", "deadlock", "one way"])
def test_that_no_team_can_complete_is_proven(name: str) -> None:
    status, said = judged(shipped(name))
    assert status == 0, said
    assert ("An operator is needed: " in said and "whatever" in said) or "no order of moves" in said


@pytest.mark.parametrize("name", ["never resolvable", "deadlock"])
def test_the_end_names_no_robot_whose_strategy_is_not_disproven(name: str, tmp_path: Path) -> None:
    files = files_of(shipped(name))
    lines = lines_of(files)
    lines[-1]["unrealizable"] = {"a": "0" * 64}
    status, said = judged(rewrite(with_lines(files, lines), tmp_path / "bundle"))
    assert "no strategy" not in said
    assert status == 0, said


@pytest.mark.slow
@pytest.mark.parametrize("name", ["team_of_six", "warehouse"])
def test_the_run_of_a_large_team_is_proven(name: str) -> None:
    status, said = judged(shipped(name))
    assert status == 0, said


@pytest.mark.parametrize("name", ["hello", "case_study_3", "unrealizable/forbidden_way"])
def test_a_copy_of_the_checker_reports_the_same_and_leaves_the_bundle_unchanged(name: str) -> None:
    bundle = shipped(name)
    before = {path: path.read_bytes() for path in bundle.rglob("*") if path.is_file()}
    assert run_checker(bundle) == judged(bundle)
    assert before == {path: path.read_bytes() for path in bundle.rglob("*") if path.is_file()}


def test_a_full_disk_is_reported_and_nothing_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(writing, "write_files", full)
    with pytest.raises(UsageError, match=r"cannot write .*: No space left on device"):
        bundle_of_run(SCENARIOS / "hello.yaml", tmp_path / "made")
    assert list(tmp_path.iterdir()) == []


def test_a_zip_holds_the_same(tmp_path: Path) -> None:
    bundle = shipped("hello")
    packed = tmp_path / "hello.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        for name in [*files_of(bundle), "manifest.json"]:
            archive.write(bundle / name, name)
    status, said = run_checker(packed, program=bundle / "check.py")
    assert (status, said.splitlines()[-1]) == (0, "accepted")


def test_a_broken_zip_is_refused_without_a_traceback(tmp_path: Path) -> None:
    packed = tmp_path / "hello.zip"
    with zipfile.ZipFile(packed, "w") as archive:
        for name, data in files_of(shipped("hello")).items():
            archive.writestr(name, data)
        archive.write(shipped("hello") / "manifest.json", "manifest.json")
    data = bytearray(packed.read_bytes())
    middle = data.index(b'"safenav-bundle"')
    data[middle] ^= 1  # its sum is no longer that of the zip
    packed.write_bytes(data)
    status, said = run_checker(packed, program=shipped("hello") / "check.py")
    assert status == 1
    assert "refused: a file is not as documented: BadZipFile" in said


def test_a_file_that_is_not_a_bundle_differs_from_a_refusal(tmp_path: Path) -> None:
    status, said = run_checker(tmp_path, program=shipped("hello") / "check.py")
    assert status == 2
    assert "is not a bundle" in said


@pytest.mark.parametrize(
    "name",
    [
        *("dataclasses.py", "notes.txt", "proofs/x.json", "judge/x.txt", "../evil", "/etc/evil"),
        *("source/..", "source/a/b", "source\\evil"),
    ],
)
def test_a_file_that_no_claim_needs_is_refused(name: str, tmp_path: Path) -> None:
    packed = tmp_path / "bundle.zip"
    files = {**files_of(shipped("hello")), name: b"{}"}
    manifest = json.loads((shipped("hello") / "manifest.json").read_bytes())
    manifest["files"][name] = {"bytes": 2, "sha256": hashlib.sha256(b"{}").hexdigest()}
    with zipfile.ZipFile(packed, "w") as archive:
        for each, data in (files | {"manifest.json": json.dumps(manifest).encode()}).items():
            archive.writestr(each, data)
    verdict = check_bundle(packed)
    assert verdict.verdict == "refused"
    assert f"{name} is not a file of this bundle" in verdict.reason


CHEATS = (
    *("judge/state/__init__.py", "judge.abi3.so", "judge.pyc", "judge/state.abi3.so"),
    *("__pycache__/judge.cpython-311.pyc", "judge/__pycache__/x.pyc", "dataclasses.py"),
    *("judge.py", "judge/state.so/x.py"),
)
"""Files that Python might run in place of the checker's own text."""
DAMAGED = "a part of this checker is missing, damaged or not for Python"
ALTERED: dict[str, tuple[bytes | None, str]] = {
    "manifest.json": (b"\xff\xfe\x00", "a file is not as documented"),
    "extra": (b"x", "extra is either missing or not in the manifest"),
    os.fsdecode(b"\xff"): (b"", "\\udcff is either missing or not in the manifest"),
    "judge/bundle/strategies.py": (None, DAMAGED),
    "judge/state.py": (b"def", DAMAGED),
    **dict.fromkeys(CHEATS, (b"print('accepted')\nraise SystemExit(0)\n", "")),
}


@pytest.mark.parametrize("name", ALTERED, ids=ascii)
def test_an_altered_folder_is_refused_without_a_traceback(name: str, tmp_path: Path) -> None:
    content, words = ALTERED[name]
    copy = shutil.copytree(shipped("hello"), tmp_path / "copy")
    (copy / name).parent.mkdir(exist_ok=True)
    (copy / name).unlink() if content is None else (copy / name).write_bytes(content)
    status, said = run_checker(copy)
    assert status == 1
    assert said.splitlines()[-1].startswith(f"refused: {words}")


def test_a_file_that_a_line_names_and_that_is_missing_is_named(tmp_path: Path) -> None:
    files = files_of(shipped("hello"))
    gone = next(name for name in files if name.startswith("proofs/"))
    del files[gone]
    status, said = run_checker(rewrite(files, tmp_path / "b", prove=False))
    assert status == 1
    assert f"{gone} is missing" in said


def safenav(*arguments: str | Path) -> tuple[int, str]:
    """Exit status and output of a command."""
    done = warm.safenav(*arguments)
    return done.returncode, done.stdout + done.stderr


def test_the_commands_make_a_bundle_and_check_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario, target = SCENARIOS / "hello.yaml", tmp_path / "hello.zip"
    assert safenav("certify", scenario, "-o", target)[0] == 0
    monkeypatch.setenv("SAFENAV_CACHE", "/dev/null")  # a cache that keeps nothing is not needed
    assert safenav("certify", scenario, "-o", tmp_path / "without_cache.zip")[0] == 0
    status, said = safenav("check", target)
    assert (status, said.split()[-1]) == (0, "accepted")
    status, said = safenav("certify", scenario, "-o", target)
    assert status == 2
    assert "name a bundle that does not" in said


def test_a_trace_of_an_earlier_run_is_certified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "cache"))
    scenario, trace = SCENARIOS / "case_study_1.yaml", tmp_path / "door.jsonl"
    assert safenav("run", scenario, "--trace", trace)[0] == 0
    assert safenav("certify", "--trace", trace, "-o", tmp_path / "door")[0] == 0
    assert run_checker(tmp_path / "door")[0] == 0
    for old, new, (code, words) in (
        (b'{"type":"move"', b'{"kind":"move"', (2, "`type` must be a string")),
        (b'"region":14,', b'"place":14,', (1, "its circumstances are missing")),
    ):
        (broken := tmp_path / "broken.jsonl").write_bytes(trace.read_bytes().replace(old, new, 1))
        status, said = safenav("certify", "--trace", broken, "-o", tmp_path / "broken")
        assert status == code and words in said
    monkeypatch.setenv("SAFENAV_CACHE", str(tmp_path / "another"))
    status, said = safenav("certify", "--trace", trace, "-o", tmp_path / "again")
    assert status == 2
    assert "is no longer in the cache" in said


def test_a_run_on_a_map_with_warnings_is_certified(tmp_path: Path) -> None:
    """A warning names the map's file, which has another place when the source is read again."""
    pixels = bytes([254] * 7 + [205])
    (tmp_path / "hall.pgm").write_bytes(b"P5 8 1 255\n" + pixels)
    settings = "image: hall.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
    settings += "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
    (tmp_path / "hall.yaml").write_text(settings)
    scenario = tmp_path / "ros.yaml"
    scenario.write_text(
        "safenav: 1\nname: hall\nmap: {ros: hall.yaml, rows: 1, cols: 8}\n"
        "robots: {q: {model: quadcopter, start: 0, objective: {visit: [0, 3]}}}\n"
    )
    assert "gray 205" in safenav("check", scenario)[1]
    status, said = safenav("certify", scenario, "-o", tmp_path / "hall")
    assert (status, said.split()[-1]) == (0, "accepted")


def test_the_page_groups_the_claims_and_leads_to_their_evidence() -> None:
    bundle = shipped("case_study_3")
    text = (bundle / "index.html").read_text()
    ids, claims = {*re.findall(r'id="(.*?)"', text)}, check_bundle(bundle).claims
    assert {claim["id"] for claim in claims} <= ids
    for link in re.findall(r'href="(.*?)"', text):
        assert (bundle / link).is_file(), link
    headings = re.findall(r"<h2>(.*?)</h2>", text)
    assert headings == ["Guaranteed", "Not covered", "Check it yourself"]
    assert re.findall(r"<h3>(.*?)</h3>", text)[:2] == ["Run", "Strategies"]
    assert all(text.count(f'<span id="{claim["id"]}">') == 1 for claim in claims)
    assert not {"<script", "src=", "http"} & {*re.findall("<script|src=|http", text)}


NAMED = """
map:
  grid: ["#########", "#.......#", "#.......#", "#########"]
  names: {dock: [1, 1], shelf: [2, 7]}
areas: {ward: {rows: 1, columns: 4-5}}
robots:
  dan: {model: digit, start: dock, heading: east, objective: {patrol: [dock, shelf]}}
  dora: {model: quadcopter, start: shelf, objective: {patrol: [ward, shelf]}}
until: {rounds: 1}
"""


def test_claims_name_regions_and_areas_and_count_rounds() -> None:
    said = certified(NAMED)
    assert "dan for 'patrol dock, shelf'" in said
    assert "dora for 'patrol ward, shelf'" in said
    assert "every robot has met its objective once after the last resolution" in said


MATRIX = """
batch: 1
scenarios: [hello.yaml]
matrix:
  map.grid:
    - ["#####", "#...#", "#####"]
    - ["#####", "#...#", "#####", "#####"]
"""
"""The names of its cases differ only in characters that do not fit the name of a file."""


def test_a_batch_certifies_each_run(tmp_path: Path) -> None:
    hello = "map: {grid: ['#####', '#...#', '#####']}\nrobots:\n"
    hello += "  a: {model: quadcopter, start: 6, objective: {visit: [6, 8]}}\n"
    (tmp_path / "hello.yaml").write_text(whole(hello))
    (tmp_path / "matrix.yaml").write_text(MATRIX)
    folder = tmp_path / "bundles"
    named = (tmp_path / "matrix.yaml", SCENARIOS / "hello.yaml")
    status, said = safenav("batch", *named, "--certify", folder)
    assert status == 0, said
    bundles = sorted(folder.iterdir())
    assert len(bundles) == 3
    for bundle in bundles:
        assert safenav("check", bundle)[0] == 0
