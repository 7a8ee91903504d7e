"""``safenav check-trace``: check a trace against the rules, independently of the run."""

from __future__ import annotations

import json

import click
from msgspec import to_builtins

from safenav.checked_trace import CheckedTrace, checked
from safenav.cli import options
from safenav.errors import ExitCode
from safenav.trace.reading import read_content
from safenav.trace.words import counted

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav check-trace lab.jsonl
  safenav check-trace --json lab.jsonl
  head -5 lab.jsonl > part.jsonl && safenav check-trace --partial part.jsonl
  safenav resume part.jsonl --trace rest.jsonl
\b
Exit codes:
  0  no rule is broken
  1  a rule is broken, or the trace ends before its outcome and --partial is not given
  2  not a trace, or it cannot be read   3  the map is too large to be judged"""


@click.command(name="check-trace", epilog=EPILOG)
@click.argument("trace", type=click.Path())
@options.show_all
@click.option("--partial", is_flag=True, help="Accept a trace that ends before its outcome.")
@click.option("--json", "as_json", is_flag=True, help="Print the whole result as JSON.")
def command(trace: str, show_all: bool, partial: bool, as_json: bool) -> int:
    """Check a trace (`-`: standard input) against the rules of a run (docs/judge.md).

    Walls, mobility, obstacles, collisions, goals and the outcome are recomputed from the trace
    alone; what cannot be judged is listed.
    """
    found = checked(read_content(trace), "<stdin>" if trace == "-" else trace)
    if as_json:
        click.echo(json.dumps({"ok": not found.findings, **to_builtins(found)}, indent=2))
    else:
        _tell(found, show_all, partial)
    good = not found.findings and (found.complete or partial)
    return ExitCode.OK if good else ExitCode.NEGATIVE


def _tell(found: CheckedTrace, show_all: bool, partial: bool) -> None:
    options.print_findings(found.source, found.findings, show_all)
    options.print_findings(found.source, found.notes, show_all, "more not judged")
    if not found.complete:
        click.echo("The trace ends before its outcome; checked as far as it goes.")
        if not partial:
            click.echo("The outcome is missing. Pass --partial to accept that.")
    if not found.findings:
        numbers = found.statistics
        click.echo(
            f"{found.source}: no rule broken in {counted(numbers['ticks'], 'tick')} of "
            f"{counted(numbers['robots'], 'robot')} ({counted(numbers['moves'], 'move')}, "
            f"{counted(numbers['goals'], 'goal')}, {numbers['resolved']} resolved, "
            f"outcome {found.outcome or 'unknown'})."
        )
    if found.strays or found.hands:
        click.echo(
            f"{counted(found.strays, 'step')} ended elsewhere than commanded, "
            f"{counted(found.hands, 'change')} by a user or the world."
        )
