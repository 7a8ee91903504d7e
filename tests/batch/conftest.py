"""Batches as commands, in a folder of their own, with a stand-in for slugs; no process is left."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import warm
from children import gone, none_left

SLUGS = """\
#!/usr/bin/env -S setpriv --pdeathsig KILL sh
[ "$PPID" = "$SLUGS_PARENT" ] || exit  # the parent has ended before that
spec=$(cat)
echo $$ >> {log}
case "$spec" in
  *sleeper*) exec sleep 900 ;;
  *crasher*) kill -SEGV $PPID; exec sleep 900 ;;
  *slow*) sleep 0.7 ;;
  *broken*) printf 'out of \\033[2J order ü <&> ]]>' >&2; exit 4 ;;
esac
echo "RESULT: Specification is unrealizable." >&2
exit 10
"""
"""A slugs binary that does what the name of a scenario's robot says. It never finds a strategy, so
a scenario passes if it expects to be unrealizable."""

Write = Callable[..., Path]


def scenario(robot: str = "quick", expect: str = "{outcome: unrealizable}") -> str:
    return (
        "safenav: 1\nmap: {grid: ['#####', '#...#', '#####']}\n"
        f"robots: {{{robot}: {{model: quadcopter, start: 6, objective: {{visit: [6, 8]}}}}}}\n"
        f"limits: {{ticks: 50}}\nexpect: {expect}\n"
    )


class SlugsLog:
    """The requests that the slugs binary has received."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def pids(self) -> list[int]:
        return [int(line) for line in self.path.read_text().split()] if self.path.exists() else []

    def parent(self) -> int:
        """The process that has made the first request."""
        stat = Path(f"/proc/{self.pids[0]}/stat").read_text()
        return int(stat.rpartition(")")[2].split()[1])

    def all_gone(self) -> bool:
        """Whether no process of the requests runs."""
        return all(map(gone, self.pids))


@pytest.fixture(autouse=True)
def slugs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SlugsLog]:
    """Every test leaves no child process behind, neither running nor as a zombie."""
    binary, log = tmp_path / "slugs", tmp_path / "slugs.log"
    binary.write_text(SLUGS.format(log=log))
    binary.chmod(0o755)
    monkeypatch.setenv("SAFENAV_SLUGS", str(binary))
    monkeypatch.setenv("SAFENAV_CACHE", "off")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    with none_left():
        yield SlugsLog(log)


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a scenario (of a robot of that name) into an empty working directory."""
    home = tmp_path / "work"
    home.mkdir()
    monkeypatch.chdir(home)

    def write(name: str, robot: str = "quick", text: str | None = None, **options: str) -> Path:
        path = home / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(scenario(robot, **options) if text is None else text)
        return path

    return write


SAFENAV = [sys.executable, "-c", "from safenav.cli import main; main()"]


def safenav(*words: str) -> warm.Done:
    return warm.safenav("batch", *words)


@contextmanager
def started(*words: str) -> Iterator[subprocess.Popen[str]]:
    """The command while it runs; killed at the end if it still does."""
    pipe = subprocess.PIPE
    command = [*SAFENAV, "batch", *words]
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True) as batch:
        try:
            yield batch
        finally:
            batch.kill()


def wait_until(batch: subprocess.Popen[str], reached: Callable[[], bool]) -> None:
    while not reached():
        assert batch.poll() is None, batch.communicate()
        time.sleep(0.01)
