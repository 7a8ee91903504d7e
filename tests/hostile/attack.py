"""Runs a program on a hostile file, and judges what it did."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hostile.enemy import MARK, changed

MOST_MB, MOST_SECONDS = 500, 20
LAUNCHER = Path(__file__).with_name("launcher.py")
DOCUMENTED = (0, 1, 2, 3)
_ESCAPES = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@dataclass(frozen=True)
class Attack:
    """What a program did. ``flaws``: what it should not have done."""

    status: int
    megabytes: float
    seconds: float
    flaws: tuple[str, ...]


def attack(words: Sequence[object], sandbox: Path, made: Sequence[str] = ()) -> Attack:
    """Run a program in ``sandbox``, in which it may make the files ``made`` only. Its time is that
    of the processor: other programs may be busy."""
    before, home = dict(changed(sandbox)), sandbox.parent / "home"
    cache = os.environ["SAFENAV_CACHE"]
    env = {"HOME": str(home), "PATH": os.environ["PATH"], "SAFENAV_CACHE": cache}
    out, err, cost = (sandbox.parent / name for name in ("out.txt", "err.txt", "cost.json"))
    with out.open("wb") as stdout, err.open("wb") as stderr:
        subprocess.run(
            [sys.executable, "-I", "-S", LAUNCHER, cost, *map(str, words)],
            cwd=sandbox,
            env=env,
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
            check=True,
        )
    used = json.loads(cost.read_text())
    status, megabytes, seconds = used["status"], used["megabytes"], used["seconds"]
    said = out.read_text("utf-8", "replace")
    complained = err.read_text("utf-8", "replace")
    flaws = []
    if status not in DOCUMENTED:
        flaws.append(f"exit code {status}: {complained[-300:]}")
    if "Traceback" in complained + said:
        flaws.append(complained[-600:])
    if megabytes > MOST_MB:
        flaws.append(f"{megabytes:.0f} MB")
    if seconds > MOST_SECONDS:
        flaws.append(f"{seconds:.0f} s")
    new = {name for name, size in changed(sandbox) if before.get(name) != size}
    flaws += [f"it made {name}" for name in sorted(new) if not name.startswith((*made, "\0"))]
    flaws += [f"an escape sequence: {found!r}" for found in _ESCAPES.findall(said)[:1]]
    flaws += [f"a claim: {claim}" for claim in _claims(said) if MARK in claim]
    return Attack(status, megabytes, seconds, tuple(flaws))


def _claims(said: str) -> list[str]:
    """The claims of a bundle that a checker prints as JSON."""
    try:
        return [str(claim["text"]) for claim in json.loads(said)["claims"]]
    except (ValueError, KeyError, TypeError):
        return []


SAFENAV = (sys.executable, "-m", "safenav")
