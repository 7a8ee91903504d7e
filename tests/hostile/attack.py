"""Runs a program on a hostile file, and judges what it did.

``attack.py FILE WORD...`` runs a program within limits, and writes what it used: Linux counts the
memory of the process that starts a program in the peak of the program. A test process may have any
size; this one is small. The word ``safenav`` alone stands for its command in a process of
``warm.py``, whose memory counts as well.
"""

import atexit
import json
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

if __name__ != "__main__":
    import warm
    from children import ran

MARK = "zqx"
"""It stands in each hostile word; no claim may contain it."""
MOST_MB, MOST_SECONDS = 500, 20
DOCUMENTED = (0, 1, 2, 3)
_ESCAPES = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


class Attack(NamedTuple):
    """What a program did. ``flaws``: what it should not have done."""

    status: int
    megabytes: float
    seconds: float
    complained: str
    flaws: tuple[str, ...]


def attack(words: Sequence[object], sandbox: Path, made: Sequence[str] = ()) -> Attack:
    """Run a program in ``sandbox``, in which it may make the files ``made`` only, and none beside
    it. Its time is that of the processor: other programs may be busy."""
    outside = sandbox.parent
    cost = outside / "cost.json"
    cost.touch()
    before = _sizes(outside)
    env = {name: os.environ[name] for name in ("PATH", "SAFENAV_CACHE")}
    env["HOME"] = str(outside / "home")
    if words[0] == "safenav":
        done = warm.program("hostile.attack", cost, *words[1:], cwd=sandbox, env=env)
        status = done.returncode
        megabytes, seconds = json.loads(cost.read_text() or "[Infinity, Infinity]")
    else:
        program = (sys.executable, "-I", "-S", __file__, cost, *words)
        done = ran(program, cwd=sandbox, env=env, stdin=subprocess.DEVNULL, errors="replace")
        status, megabytes, seconds = json.loads(cost.read_text())
    said, complained = done.stdout, done.stderr
    flaws = [] if status in DOCUMENTED else [f"exit code {status}: {complained[-300:]}"]
    flaws += [complained[-600:]] if "Traceback" in complained + said else []
    flaws += [f"{megabytes:.0f} MB"] if megabytes > MOST_MB else []
    flaws += [f"{seconds:.0f} s"] if seconds > MOST_SECONDS else []
    allowed = (*(f"sandbox/{name}" for name in made), cost.name, "home")
    new = {name for name, size in _sizes(outside).items() if before.get(name) != size}
    flaws += [f"it made {name}" for name in sorted(new) if not name.startswith(allowed)]
    flaws += [f"an escape sequence: {found!r}" for found in _ESCAPES.findall(said)[:1]]
    flaws += [f"a claim: {claim}" for claim in _claims(said) if MARK in claim]
    return Attack(status, megabytes, seconds, complained, tuple(flaws))


def _sizes(folder: Path) -> dict[str, int]:
    """The files of a folder with their sizes, and its folders."""
    return {
        file.relative_to(folder).as_posix(): 0 if file.is_dir() else file.lstat().st_size
        for file in folder.rglob("*")
    }


def _claims(said: str) -> list[str]:
    """The claims of a bundle that a checker prints as JSON."""
    try:
        return [str(claim["text"]) for claim in json.loads(said)["claims"]]
    except (ValueError, KeyError, TypeError):
        return []


def limited() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))


def main() -> int:
    """Run a command of safenav in this process, and write what it used."""
    from safenav import cli

    file, begun = Path(sys.argv.pop(1)), time.process_time()
    limited()

    def ended() -> None:
        used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
        seconds = time.process_time() - begun + used[1].ru_utime + used[1].ru_stime
        file.write_text(json.dumps((max(each.ru_maxrss for each in used) / 1024, seconds)))

    atexit.register(ended)
    return int(cli.main() or 0)


def run(file: str, *words: str) -> None:
    """Run a program, and write what it used."""
    limited()
    os.nice(5)
    begun = time.monotonic()
    _, code, used = os.wait4(os.posix_spawnp(words[0], words, os.environ), 0)
    seconds = min(used.ru_utime + used.ru_stime, time.monotonic() - begun)
    cost = os.waitstatus_to_exitcode(code), used.ru_maxrss / 1024, seconds
    Path(file).write_text(json.dumps(cost))


if __name__ == "__main__":
    run(*sys.argv[1:])
