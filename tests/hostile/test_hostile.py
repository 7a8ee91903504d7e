"""Hostile traces, bundles and other files run no code, touch no file, put no word into a claim, and
stay within 500 MB and 20 s. ``SAFENAV_FUZZ=500`` tries 500 traces and 200 bundles."""

import os
import re
import shutil
import struct
import sys
import zlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import pytest

from certify.making import files_of, lines_of, shipped
from hostile.attack import MOST_MB, attack
from hostile.enemy import Enemy, written
from once import beside, from_yaml
from support.damage import GOOD

COUNT = min(500, int(os.environ.get("SAFENAV_FUZZ", "0")))
TRACES, BUNDLES = (COUNT, COUNT * 2 // 5) if COUNT else (40, 15)
VIEWS = (
    ("replay", "-o", "made.html"),
    ("replay", "-o", "made.svg"),
    ("export", "--side", "1", "-o", "made.csv"),
    ("export", "--motion", "made.jsonl"),
    ("resume", "--max-ticks", "50", "--trace", "made.jsonl"),
    ("certify", "-o", "made"),
)
"""Commands on a trace beside its check; their files are called ``made``."""
DATA = from_yaml(beside(__file__, "bombs.yaml"))
TEXTS, BOMBS = DATA["texts"], DATA["bombs"]


@cache
def sources() -> list[Path]:
    """Honest bundles of each kind of run."""
    names = ("formulas", "in seconds", "alternation", "hello", "case_study_1", "deadlock")
    return [shipped(name) for name in names]


@cache
def honest() -> list[list[Any]]:
    """Honest traces."""
    made = [lines_of(files_of(bundle)) for bundle in sources()]
    return [*made, *(read() for read in GOOD.values())]


@pytest.fixture
def sandbox(tmp_path: Path) -> Iterator[Path]:
    for name in ("home", "sandbox"):
        (tmp_path / name).mkdir()
    yield tmp_path / "sandbox"
    shutil.rmtree(tmp_path / "sandbox")  # some files are large


@pytest.mark.parametrize("seed", range(TRACES))
def test_a_hostile_trace_does_no_harm(seed: int, sandbox: Path) -> None:
    enemy = Enemy(seed, sandbox.parent / "canary")
    trace = sandbox / "hostile.jsonl"
    trace.write_bytes(enemy.lines(enemy.rng.choice(honest())))
    view = enemy.rng.choice(VIEWS)
    shown = (*view, trace) if view[-1] == "--trace" else (view[0], trace, *view[1:])
    for words in (("check", trace), shown):
        assert attack(["safenav", *words], sandbox, ["made"]).flaws == (), words


@pytest.mark.parametrize("seed", range(BUNDLES))
def test_a_hostile_bundle_does_no_harm(seed: int, sandbox: Path) -> None:
    enemy = Enemy(seed, sandbox.parent / "canary")
    files = files_of(enemy.rng.choice(sources()))
    bundle = written(enemy.bundle(files), sandbox / "bundle", Random(seed))
    own = sandbox.parent / "reviewer"
    for name in ("check.py", *(name for name in files if name.startswith("judge/"))):
        (own / name).parent.mkdir(parents=True, exist_ok=True)
        (own / name).write_bytes(files[name])
    checker = (sys.executable, "-I", "-S", own / "check.py", bundle, "--json")
    for words in (checker, ("safenav", "check", bundle)):
        assert attack(words, sandbox).flaws == (), words
    assert not (sandbox.parent.parent / "canary").exists()


def expanded(text: str) -> str:
    """The text of a file (``bombs.yaml``)."""

    def part(found: re.Match[str]) -> str:
        inside, times = found[1], found[2]
        if times is None:
            return str(TEXTS[inside])
        if "{k" not in inside:
            return inside * int(times)
        numbers = range(int(times))
        return "".join(inside.replace("{k+1}", str(k + 1)).replace("{k}", str(k)) for k in numbers)

    while "«" in text:
        text = re.sub(r"«([^«»]*?)(?:\*(\d+))?»", part, text)
    return text


def png(width: int, height: int, rows: int) -> bytes:
    """An image of zeros, of fewer or more rows than it says: some bytes for a hundred megabytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", check)

    head = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    body = zlib.compress(bytes((4 * width + 1) * rows), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@pytest.mark.parametrize("name", BOMBS)
def test_a_small_file_that_expands_to_a_huge_one_is_refused(name: str, sandbox: Path) -> None:
    bomb = BOMBS[name]
    for file, content in bomb["files"].items():
        text = isinstance(content, str)
        data = expanded(content).encode("latin-1") if text else png(*content["png"])
        (sandbox / file).write_bytes(data)
    done = attack(["safenav", *bomb["words"].split()], sandbox)
    assert done.flaws == ()
    assert done.status in bomb.get("status", [2]), done.complained[:500]
    assert bomb.get("told", "") in done.complained


def test_the_measured_peak_of_memory_is_that_of_the_program_alone(sandbox: Path) -> None:
    """A large test process is not counted, and a large program is."""
    own = b"x" * (200 << 20)
    small = attack([sys.executable, "-c", ""], sandbox)
    del own
    assert 0 < small.megabytes < 100 and small.flaws == ()
    command = attack(["safenav", "--version"], sandbox)
    assert small.megabytes < command.megabytes < 200 and command.flaws == ()
    large = attack([sys.executable, "-c", f"b'x' * ({MOST_MB} << 20)"], sandbox)
    assert large.megabytes > MOST_MB and large.flaws == (f"{large.megabytes:.0f} MB",)


def test_the_harness_notices_files_and_output_of_an_attacked_program(sandbox: Path) -> None:
    program = "open('x', 'w'); open('../y', 'w'); print('\\x1b[0m'); raise SystemExit(9)"
    flaws = attack([sys.executable, "-c", program], sandbox).flaws
    assert [flaw.split(":")[0] for flaw in flaws] == [
        *("exit code 9", "it made sandbox/x", "it made y", "an escape sequence")
    ]
