"""Measures the start of commands: CPU time, interleaved, beside that of Python alone.

    python benchmarks/start.py [--repeat 20]

`check` finds its strategies in the cache, which a first run fills. Compiled bytecode exists.
"""

import sys
from pathlib import Path
from statistics import median

import click
from measuring import measure

from safenav.report.terminal.layout import table

ROOT = Path(__file__).resolve().parents[1]
SCENARIO = str(ROOT / "scenarios" / "case_study_1.yaml")
SAFENAV = str(Path(sys.executable).with_name("safenav"))
COMMANDS = (
    ("python -c pass", (sys.executable, "-c", "pass"), None),
    ("import click, yaml", (sys.executable, "-c", "import click, yaml"), None),
    ("safenav --help", (SAFENAV, "--help"), 0.05),
    ("safenav check case_study_1", (SAFENAV, "check", SCENARIO), 0.12),
)
"""Each command with its bar in CPU seconds."""


@click.command()
@click.option("--repeat", type=click.IntRange(1), default=20, show_default=True)
def main(repeat: int) -> None:
    """Print the medians and the least CPU seconds of each command."""
    found: dict[str, list[float]] = {name: [] for name, _, _ in COMMANDS}
    for _ in range(repeat + 1):
        for name, command, _ in COMMANDS:
            found[name].append(measure(command, timeout=60).cpu_seconds)
    rows = [
        (name, bar, round(median(found[name][1:]), 3), round(min(found[name][1:]), 3))
        for name, _, bar in COMMANDS
    ]
    for line in table(("command", "bar", "median CPU s", "least CPU s"), rows):
        click.echo(line)


if __name__ == "__main__":
    main()
