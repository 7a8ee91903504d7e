"""Small scenarios, and a slugs binary that does what the name of a scenario's robot says.

It never finds a strategy, so a scenario passes if it expects to be unrealizable. So these tests of
batches need no synthesizer.
"""

from collections.abc import Callable
from pathlib import Path

from synthesis.requests import gone

SLUGS = """\
#!/bin/sh
if [ "$1" = --version ]; then echo "slugs 9.9.9"; exit 0; fi
spec=$(cat)
echo $$ >> {log}
case "$spec" in
  *sleeper*) sleep 900 & echo $! >> {log}.children; wait ;;
  *crasher*) kill -SEGV $PPID; exec sleep 900 ;;
  *slow*) sleep 0.3 ;;
  *broken*) echo "out of order" >&2; exit 4 ;;
esac
echo "RESULT: Specification is unrealizable." >&2
exit 10
"""

Write = Callable[..., Path]


class SlugsLog:
    """The requests that the slugs binary has received."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def pids(self) -> list[int]:
        return [int(line) for line in self.path.read_text().split()] if self.path.exists() else []

    def all_gone(self) -> bool:
        """Whether no process of the requests runs, nor one that these have started."""
        log = self.path.with_name(f"{self.path.name}.children")
        children = log.read_text().split() if log.exists() else []
        return all(gone(int(pid)) for pid in [*self.pids, *children])


def scenario(robot: str = "quick", expect: str = "{outcome: unrealizable}") -> str:
    return (
        "safenav: 1\nmap: {grid: ['#####', '#...#', '#####']}\n"
        f"robots: {{{robot}: {{model: quadcopter, start: 6, objective: {{visit: [6, 8]}}}}}}\n"
        f"limits: {{ticks: 50}}\nexpect: {expect}\n"
    )
