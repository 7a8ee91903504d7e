"""Bundles of shipped scenarios are accepted by their own checker, and by nothing but Python; files
that were altered are refused. The commands: the transcript ``certify``. Lies in the trace:
``tests/lies``.

Among the tests the campaign of forged bundles is short; SAFENAV_FUZZ=2000 tries as many others."""

import errno
import hashlib
import json
import os
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from campaigns.bundles import KINDS, forged
from certify.making import (
    Files,
    files_of,
    judged,
    lines_of,
    rewrite,
    run_checker,
    shipped,
    with_lines,
)
from safenav import Synthesizer, UsageError, check_bundle, make_bundle

COMPLETED = "The mission is completed"
LARGE = [f"case_study_{k}" for k in ("1", "1_beliefs", "2", "2_beliefs", "3", "3_beliefs")]
CLAIMS = [
    *(
        pytest.param(name, COMPLETED, marks=pytest.mark.slow)
        for name in (*LARGE, "team_of_six", "warehouse")
    ),
    *((name, COMPLETED) for name in ("cornered", "corridor_swap", "hello", "two_digits", "map")),
    ("unrealizable/contradictory_objective", "No strategy exists for"),
    ("unrealizable/forbidden_way", "liveness region = 25; liveness region = 10'.\n"),
    ("unrealizable/impossible_start", "No strategy exists for"),
    ("never resolvable", "An operator is needed: some robot cannot continue, whatever"),
    ("never resolvable", "No robot can resolve door@7, unless the scenario or"),
    ("deadlock", "An operator is needed: no order of moves"),
    ("one way", "An operator is needed: some robot cannot continue, whatever"),
]


@pytest.mark.parametrize(("name", "words"), CLAIMS)
def test_the_outcome_of_a_run_is_proven(name: str, words: str) -> None:
    status, said = judged(shipped(name))
    assert status == 0 and words in said and said.endswith("accepted\n"), said
    driven = "obeys the scenario and meets that objective" in said or "joint plan" in said
    assert driven or words != COMPLETED


def test_an_unrealizable_robot_without_a_failed_synthesis_is_refused(tmp_path: Path) -> None:
    files = files_of(shipped("deadlock"))
    lines = lines_of(files)
    lines[-1]["unrealizable"] = {"a": "0" * 64}
    status, said = judged(rewrite(with_lines(files, lines), tmp_path / "bundle"))
    assert status == 1 and "no synthesis of a has failed" in said, said


def test_a_bundle_makes_no_claim_about_a_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    bundle = shipped("a deadlock until a change")
    assert b'"waiting"' in (bundle / "trace.jsonl").read_bytes()
    monkeypatch.setattr("safenav.judge.world.MOST_STATES", 60)
    assert check_bundle(str(bundle)).accepted


@pytest.mark.parametrize("name", ["hello", "case_study_3", "unrealizable/forbidden_way"])
def test_a_copy_of_the_checker_reports_the_same_and_leaves_the_bundle_unchanged(name: str) -> None:
    bundle = shipped(name)
    before = files_of(bundle)
    assert run_checker(bundle) == judged(bundle)
    assert before == files_of(bundle)


def test_a_full_disk_is_reported_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace, real = (shipped("hello") / "trace.jsonl").read_bytes(), Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        real(path, data[:10])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(UsageError, match=r"cannot write .*: No space left on device"):
        make_bundle(tmp_path / "made", trace, {}, Synthesizer())
    assert list(tmp_path.iterdir()) == []


def test_the_page_lists_the_claims_and_links_their_evidence() -> None:
    bundle = shipped("case_study_3")
    text = (bundle / "index.html").read_text()
    for link in re.findall(r'href="(.*?)"', text):
        assert (bundle / link).is_file(), link
    headings = re.findall(r"<h2>(.*?)</h2>", text)
    assert headings == ["Guaranteed", "Not covered", "Check it yourself"]
    ids = [claim["id"] for claim in check_bundle(bundle).claims]
    assert all(text.count(f'<li id="{each}">') == 1 for each in ids)
    assert not re.findall("<script|src=|http", text)


def zipped(files: Files, target: Path) -> Path:
    """Pack files with a manifest that fits them, also under names that no folder can hold."""
    manifest = json.loads((shipped("hello") / "manifest.json").read_bytes())
    manifest["files"] = {
        name: {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        for name, data in files.items()
    }
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in (files | {"manifest.json": json.dumps(manifest).encode()}).items():
            archive.writestr(name, data)
    return target


def test_a_damaged_archive_is_refused_without_a_traceback(tmp_path: Path) -> None:
    packed = zipped(files_of(shipped("hello")), tmp_path / "hello.zip")
    data = packed.read_bytes()
    content, link = data.index(b'"safenav-bundle"'), data.index(b"PK\x01\x02") + 41
    for at, why in ((content, "documented: BadZipFile"), (link, "a bundle has files only")):
        packed.write_bytes(data[:at] + bytes([data[at] ^ 0xA0]) + data[at + 1 :])
        status, said = run_checker(packed, shipped("hello") / "check.py")
        assert status == 1 and "refused: " in said and why in said


@pytest.mark.parametrize(
    "name",
    [
        *("dataclasses.py", "notes.txt", "proofs/x.json", "judge/x.txt", "../evil", "/etc/evil"),
        *("source/..", "source/a/../b", "source/a//b", "source\\evil"),
    ],
)
def test_a_file_that_no_claim_needs_is_refused(name: str, tmp_path: Path) -> None:
    verdict = check_bundle(
        zipped(files_of(shipped("hello")) | {name: b"{}"}, tmp_path / "bundle.zip")
    )
    assert verdict.verdict == "refused"
    assert f"no line of this bundle names {name}" in verdict.reason


CHEATS = (
    *("judge/state/__init__.py", "judge.abi3.so", "judge.pyc", "judge/state.abi3.so"),
    *("__pycache__/judge.cpython-311.pyc", "judge/__pycache__/x.pyc", "dataclasses.py"),
    *("judge.py", "judge/state.so/x.py"),
)
"""Files that Python might run in place of the checker's own text."""
DAMAGED = "a part of this checker is missing, damaged or not for Python"
ALTERED: dict[str, tuple[bytes | None, str]] = {
    "manifest.json": (b"\xff\xfe\x00", "a file is not as documented"),
    "./manifest.json": (b'{"format": "safenav-bundle", "version": 4}', "not a bundle of version 5"),
    "trace.jsonl": (b"{}", "trace.jsonl is not the file that the manifest names"),
    "index.html": (b"<p>", "index.html is not the file that the manifest names"),
    "source/hello.yaml": (b"", "source/hello.yaml is not the file that the manifest names"),
    "extra": (b"x", "missing, or not in the manifest: extra"),
    os.fsdecode(b"\xff"): (b"", "missing, or not in the manifest: \\udcff"),
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


@pytest.mark.parametrize(
    "make",
    [os.symlink, lambda old, at: at.symlink_to(old.parent), lambda _, at: os.mkfifo(at)],
    ids=["a link", "a link to a folder", "a pipe"],
)
def test_a_bundle_with_a_link_or_a_pipe_is_refused(
    make: Callable[[Path, Path], None], tmp_path: Path
) -> None:
    copy = shutil.copytree(shipped("hello"), tmp_path / "copy")
    make((copy / "index.html").rename(tmp_path / "elsewhere"), copy / "index.html")
    status, said = run_checker(copy)
    last = "refused: a bundle has files only: no links, no devices"
    assert (status, said.splitlines()[-1]) == (1, last)


@pytest.mark.parametrize(
    ("folder", "more", "words"),
    [("proofs/", None, "is missing"), ("strategies/", b" ", "is not named by its sha256")],
)
def test_a_file_named_by_a_hash_must_exist_and_match_it(
    folder: str, more: bytes | None, words: str, tmp_path: Path
) -> None:
    files = files_of(shipped("hello"))
    name = next(name for name in files if name.startswith(folder))
    data = files.pop(name)
    files |= {} if more is None else {name: data + more}
    assert f"{name} {words}" in judged(rewrite(files, tmp_path / "b", prove=False))[1]


COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) // len(KINDS) or 3
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "1000")) if "SAFENAV_FUZZ" in os.environ else 0


@pytest.mark.parametrize("kind", KINDS)
def test_a_forged_bundle_is_refused_unless_it_is_harmless(kind: str) -> None:
    found = {seed: forged(kind, seed) for seed in range(FIRST, FIRST + COUNT)}
    assert {seed: harms for seed, harms in found.items() if harms} == {}
    assert None in found.values(), "no forgery of this kind is refused"
