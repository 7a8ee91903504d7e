"""Hostile traces and bundles run no code, touch no file, put no word into a claim, and stay within
500 MB and 20 s. ``SAFENAV_FUZZ=500`` tries 500 traces and 200 bundles."""

import json
import os
import sys
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import pytest

from certify.making import files_of, lines_of, shipped
from hostile.attack import SAFENAV, attack
from hostile.enemy import Enemy, written
from safenav.certify.bundle import programs
from support.damage import GOOD

COUNT = min(500, int(os.environ.get("SAFENAV_FUZZ", "0")))
TRACES, BUNDLES = (COUNT, COUNT * 2 // 5) if COUNT else (40, 15)
VIEWS = (
    ("replay", "-o", "made.html"),
    ("replay", "-o", "made.svg"),
    ("export", "--side", "1", "-o", "made.csv"),
    ("export", "--motion", "made.jsonl"),
    ("resume", "--max-ticks", "50", "--trace", "made.jsonl"),
    ("certify", "-o", "made", "--trace"),
)
"""Commands on a trace beside its check; their files are called ``made``."""


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
def sandbox(tmp_path: Path) -> Path:
    for name in ("home", "sandbox"):
        (tmp_path / name).mkdir()
    return tmp_path / "sandbox"


@pytest.mark.parametrize("seed", range(TRACES))
def test_a_hostile_trace_does_no_harm(seed: int, sandbox: Path) -> None:
    enemy = Enemy(seed, sandbox.parent / "canary")
    trace = sandbox / "hostile.jsonl"
    trace.write_bytes(enemy.lines(enemy.rng.choice(honest())))
    view = enemy.rng.choice(VIEWS)
    shown = (*view, trace) if view[-1] == "--trace" else (view[0], trace, *view[1:])
    for words in (("check", trace), shown):
        done = attack([*SAFENAV, *words], sandbox, ["made"])
        report(f"trace {seed} {words[0]}", done)
        assert done.flaws == (), f"seed {seed}: {words}"
        assert not (sandbox.parent / "canary").exists()


@pytest.mark.parametrize("seed", range(BUNDLES))
def test_a_hostile_bundle_does_no_harm(seed: int, sandbox: Path) -> None:
    enemy = Enemy(seed, sandbox.parent / "canary")
    files = files_of(enemy.rng.choice(sources()))
    bundle = written(enemy.bundle(files), sandbox / "bundle", Random(seed))
    own = sandbox.parent / "reviewer"
    for name, text in programs().items():
        (own / name).parent.mkdir(parents=True, exist_ok=True)
        (own / name).write_bytes(text)
    checker = (sys.executable, "-I", "-S", own / "check.py", bundle)
    for words in ((*checker, "--json"), (*SAFENAV, "check", bundle)):
        done = attack(words, sandbox)
        report(f"bundle {seed}", done)
        assert done.flaws == (), f"seed {seed}: {words}"
        assert not (sandbox.parent / "canary").exists()
    assert not (sandbox.parent.parent / "canary").exists()


def report(what: str, done: object) -> None:
    """Append the figures to a file, if a campaign wants them."""
    if file := os.environ.get("SAFENAV_FIGURES"):
        with Path(file).open("a") as out:
            out.write(json.dumps([what, done.__dict__]) + "\n")
