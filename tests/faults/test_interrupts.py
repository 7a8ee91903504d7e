"""Ctrl-C and SIGTERM at random moments: each command ends with 130 or has finished; it prints
nothing that it would not have printed, writes no half file, and leaves no process."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from random import Random
from typing import NamedTuple

import pytest

from children import ran
from faults.conftest import CASE_STUDY, ROOT
from safenav.files import write_all
from warm import safenav

INTERRUPTED = 130
PATIENCE = 300
"""Seconds; a command that swallows the signal takes longer, or ends with another status."""

COMMANDS: dict[str, tuple[str, ...]] = {
    "run": ("run", "big.yaml", "--trace", "out.jsonl"),
    "run with pages": ("run", "s.yaml", "--trace", "out.jsonl", "--html", "out.html"),
    "run live": ("run", "s.yaml", "--clock", "live", "--trace", "out.jsonl"),
    "resume": ("resume", "cut.jsonl", "--trace", "out.jsonl"),
    "synth": ("synth", "big.yaml", "-o", "out"),
    "verify": ("verify", "quad.structuredslugs", "quad.json"),
    "check": ("check", "big.yaml"),
    "check with batteries": ("check", "batteries.yaml"),
    "check with three carts": ("check", "three_carts.yaml"),
    "explain": ("explain", "unrealizable.yaml"),
    "explain with runs": ("explain", "circle.yaml"),
    "batch": ("batch", "suite", "--jobs", "2", "--junit", "out.xml"),
    "certify": ("certify", "s.yaml", "-o", "out"),
    "check of a trace": ("check", "t.jsonl"),
    "check of a bundle": ("check", "bundle"),
    "draw": ("draw", "big.yaml", "-o", "out.svg"),
    "replay": ("replay", "t.jsonl", "-o", "out.html"),
    "export of a motion": ("export", "t.jsonl", "--motion", "out.jsonl"),
    "check of a motion": ("check", "m.jsonl", "t.jsonl"),
    "export": ("export", "t.jsonl", "-o", "out.csv"),
    "new": ("new", "out.yaml"),
    "schema": ("new", "out.json", "--schema"),
    "doctor": ("doctor",),
}
COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or len(COMMANDS)
_MEASURED = re.compile(r"\d[\d.,]* ?(?:ms|s|KiB|MB)\b|\d+\.\d\d$")
_AT_THE_END = re.compile(r"interrupted|--resume|(?:ticks|the run), \d+ synthes|█|_decimal")
"""An interrupted run says so, with what it has done so far and where the robots are. (Python itself
warns if its module of decimals is interrupted while it loads.)"""
_LINE = "every line of an interrupted command is one of the finished command's"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the inputs of all commands."""
    folder = tmp_path_factory.mktemp("inputs")
    scenarios = ROOT / "scenarios"
    (folder / "s.yaml").write_text(CASE_STUDY.read_text())
    (folder / "big.yaml").write_text((scenarios / "team_of_six.yaml").read_text())
    (folder / "batteries.yaml").write_text((scenarios / "battery_delivery.yaml").read_text())
    for name in ("three_carts.yaml", "circle.yaml"):
        shutil.copy(Path(__file__).parent / name, folder)
    dead_end = (scenarios / "unrealizable" / "dead_end.yaml").read_text()
    (folder / "unrealizable.yaml").write_text(dead_end)
    (folder / "suite").mkdir()
    for number in (1, 2, 3):
        source = scenarios / f"case_study_{number}.yaml"
        (folder / "suite" / source.name).write_text(source.read_text())
    for command in (
        ("run", "s.yaml", "--trace", "t.jsonl", "--motion", "m.jsonl"),
        ("synth", "s.yaml", "-o", "."),
        ("certify", "s.yaml", "-o", "bundle"),
    ):
        done = safenav(*command, cwd=folder, env=ENVIRONMENT)
        assert done.returncode == 0, done.stderr
    lines = (folder / "t.jsonl").read_text().splitlines(keepends=True)
    (folder / "cut.jsonl").write_text("".join(lines[: len(lines) // 2]))
    return folder


class Finished(NamedTuple):
    """A command that ran to its end: its seconds, its status, its lines, and all files then."""

    seconds: float
    status: int
    lines: set[str]
    files: set[str]


ENVIRONMENT = {**os.environ, "SAFENAV_CACHE": "off", "NO_COLOR": "1", "COLUMNS": "200"}


def process(name: str) -> list[str]:
    return [sys.executable, "-m", "safenav", *COMMANDS[name]]


def running(group: int) -> list[str]:
    """The running processes of a group: not those that are dead, until init takes note of it."""
    found = []
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, of, *_ = file.read_text().rpartition(") ")[2].split()
            if int(of) == group and state != "Z":
                found.append(file.with_name("cmdline").read_text().replace("\0", " "))
    return found


def handles_signals(pid: int) -> bool:
    """Whether SIGTERM is handled, by the first statement of safenav. Before that Python itself
    begins, and an interrupt shows one of its tracebacks."""
    with suppress(OSError):
        status = Path(f"/proc/{pid}/status").read_text()
        caught = int(re.search(r"^SigCgt:\s*(\w+)$", status, re.MULTILINE)[1], 16)
        return bool(caught >> (signal.SIGTERM - 1) & 1)
    return False


def normal(text: str) -> list[str]:
    """The lines of an output, without measured times and sizes, which depend on them."""
    return [_MEASURED.sub("N", line.strip()) for line in text.splitlines() if line.strip()]


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def finished(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Finished]:
    @cache
    def of(name: str) -> Finished:
        folder = tmp_path_factory.mktemp("finished") / "inputs"
        shutil.copytree(inputs, folder)
        begun = time.monotonic()
        done = ran(process(name), cwd=folder, env=ENVIRONMENT)
        lines = {*normal(done.stdout + done.stderr)}
        return Finished(time.monotonic() - begun, done.returncode, lines, files(folder))

    return of


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(COUNT))
def test_an_interrupted_command_prints_nothing_false(
    seed: int, inputs: Path, finished: Callable[[str], Finished], tmp_path: Path
) -> None:
    random = Random(seed)
    name = [*COMMANDS][seed % len(COMMANDS)]
    whole, folder = finished(name), tmp_path / "inputs"
    shutil.copytree(inputs, folder)
    before = files(folder)
    number = random.choice([signal.SIGINT, signal.SIGTERM])
    child = subprocess.Popen(
        process(name),
        cwd=folder,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while child.poll() is None and not handles_signals(child.pid):
        time.sleep(0.002)
    time.sleep(random.uniform(0, max(0.3, whole.seconds)))
    sent = time.monotonic()
    child.send_signal(number)
    try:
        out, err = child.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        raise AssertionError(f"{name}: {number.name} was swallowed") from None
    print(f"{name}: {number.name}, {child.returncode} after {time.monotonic() - sent:.2f} s")
    assert running(child.pid) == [], "it has left processes behind"
    written = files(folder) - before
    if child.returncode == whole.status:
        assert written == whole.files - before
        return
    assert ", in main" not in err, "a traceback through safenav itself"
    assert child.returncode == INTERRUPTED, out + err
    strange = [
        line
        for line in normal(out + err)
        if line not in whole.lines and not _AT_THE_END.search(line)
    ]
    assert strange == [], _LINE
    for path in written:
        assert path in whole.files, f"{path} is left behind"
        check_whole(folder / path)


def test_an_interrupt_between_two_files_waits_for_all_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    renamed = Path.replace

    def interrupted(self: Path, target: Path) -> Path:
        os.kill(os.getpid(), signal.SIGINT)
        return renamed(self, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_all(tmp_path, [("one", "1"), ("two", "2"), ("three", "3")])
    assert files(tmp_path) == {"one", "two", "three"}


def check_whole(path: Path) -> None:
    """An output is complete, or a trace of complete lines that says how it ended."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".jsonl":
        lines = [json.loads(line) for line in text.splitlines()]
        assert text.endswith("\n")
        assert lines[-1].get("outcome", "interrupted") in ("interrupted", "completed")
    elif path.suffix == ".json":
        json.loads(text)
    elif path.suffix == ".html":
        assert text.rstrip().endswith("</html>")
    with suppress(UnicodeDecodeError):
        assert text, f"{path} is empty"
