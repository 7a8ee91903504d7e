"""Transcripts of commands: see ``support.transcripts``."""

import os
import re
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from zipfile import ZipFile

import pytest

import warm
from children import ran
from once import ROOT, SCENARIOS
from support import damage
from support.transcripts import check, helps

TRANSCRIPTS = Path(__file__).with_name("transcripts")
MAPS = ROOT / "tests" / "maps"


def written(folder: Path) -> None:
    """Write the files that no text holds."""
    shutil.copytree(MAPS, folder / "maps")
    shutil.copytree(SCENARIOS, folder / "scenarios")
    (folder / "loop").symlink_to("loop")
    (folder / "binary").write_bytes(b"\xff\xfe\x00")
    text = "[INPUT]\na\n[OUTPUT]\nb\n[SYS_LIVENESS]\nb\n"
    (folder / "marked.spec").write_text(text, encoding="utf-8-sig")
    (folder / "binary.jsonl").write_bytes(b"\xff\xfe\x00")
    (folder / "deep").write_text("[" * 100_000)
    lines = damage.GOOD["door"]()
    good = "\n".join(damage.text(lines)) + "\n"
    (folder / "good.jsonl").write_text(good)
    (folder / "cut.jsonl").write_text(good[:-40])
    (folder / "partial.jsonl").write_text(good[: good.index('{"type": "outcome"')])
    moved = {"line": ["move", {"tick": 8, "robot": "digit"}], "fields": {"to": 17}}
    lines = damage.damage(lines, [moved, {"line": ["outcome"], "fields": {"ticks": 9}}])
    (folder / "bad.jsonl").write_text("\n".join(damage.text(lines)) + "\n")
    (folder / "large.yaml").write_text("#" * 5_000_001)
    with ZipFile(folder / "n.zip", "w") as archive:
        archive.writestr("lab.yaml", "safenav: 1\n")  # readable in the archive
    with ZipFile(folder / "b.zip", "w") as archive:
        archive.writestr("manifest.json", "{}" * 200)
    whole = (folder / "b.zip").read_bytes()
    (folder / "b.zip").write_bytes(whole[:60] + whole[-60:])


@pytest.mark.parametrize("file", sorted(TRANSCRIPTS.glob("*.txt")), ids=lambda file: file.stem)
def test_commands_print_their_transcript(file: Path, tmp_path: Path) -> None:
    written(tmp_path)

    def run(words: list[str], variables: Mapping[str, str]) -> tuple[int, str]:
        own = {"NO_COLOR": "1", "COLUMNS": "100", "SAFENAV_CACHE": str(tmp_path / "cache")}
        env = {**os.environ, **own, **variables}
        words = [sys.executable if word == "python" else word for word in words]
        if words[0] != "safenav":
            said = " ".join(word if word in (">", ">>", "|") else quote(word) for word in words)
            done = ran(["sh", "-c", f"{{ {said}; }} 2>&1"], cwd=tmp_path)
        else:
            words, given = (words[:-2], words[-1]) if "<" in words else (words, "")
            text = (tmp_path / given).read_text(encoding="utf-8") if given else ""
            done = warm.safenav(*words[1:], cwd=tmp_path, env=env, text=text, together=True)
        return done.returncode, done.stdout

    check(file, tmp_path, run)


def test_the_help_of_every_command_is_on_one_screen_with_examples_and_exit_codes() -> None:
    pages = helps()
    commands = re.findall(
        r"^  (\w+)  ", pages.pop("safenav").partition("Commands:")[2], re.MULTILINE
    )
    assert commands == [*pages]
    for shown in pages.values():
        assert "Exit codes:" in shown and "Example" in shown
        assert len(shown.splitlines()) <= 40
