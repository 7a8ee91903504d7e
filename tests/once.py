"""Expensive things are made once per test run, by the first process that needs them.

A session fixture of pytest-xdist exists once in each worker; the folder that this module gives
is the same one for all of them.
"""

import fcntl
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import yaml

FOLDER = "SAFENAV_TEST_FOLDER"
"""The variable that names the folder of this test run; it is removed at the end."""
RUNNING = "running"
"""The file there that is locked until the end."""

ROOT = Path(__file__).resolve().parents[1]
SCENARIOS = ROOT / "scenarios"
CORPUS = Path(os.environ.get("SAFENAV_CORPUS") or ROOT / "tests" / "corpus")
"""Published specifications; `SAFENAV_CORPUS` names more of them."""


def beside(module: str, file: str) -> str:
    """The text of a file in the folder of a module."""
    return (Path(module).parent / file).read_text(encoding="utf-8")


def from_yaml(text: str) -> Any:
    """The data in a text of YAML, read in C: each worker reads all tables of the tests."""
    return yaml.load(text, Loader=yaml.CSafeLoader)


def made_once(name: str, make: Callable[[Path], object]) -> Path:
    """Return the folder ``name`` as ``make`` has filled it: in the first process; the others wait.

    Its content is shared, so tests must not change it.
    """
    shared = Path(os.environ[FOLDER]) / "made"
    folder, done = shared / name, shared / f"{name}.done"
    with locked(shared / f"{name}.lock"):
        if not done.exists():
            folder.mkdir(exist_ok=True)
            make(folder)
            done.touch()
    return folder


@cache
def trace_of_shipped(name: str) -> Path:
    """The trace of ``scenarios/NAME.yaml``, played once; it ends as the scenario expects."""
    import warm  # which imports this module

    def play(folder: Path) -> None:
        scenario, trace = SCENARIOS / f"{name}.yaml", folder / f"{name}.jsonl"
        done = warm.safenav("run", scenario, "--no-map", "--trace", trace)
        assert done.returncode == 0, done.stdout + done.stderr

    return made_once(f"trace of {name}", play) / f"{name}.jsonl"


@contextmanager
def locked(file: Path) -> Iterator[None]:
    """Let only one process at a time execute the block."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
