"""``safenav verify``: check a strategy against its specification, by itself."""

from __future__ import annotations

import json
import sys

import click

from safenav.errors import Diagnostic, ExitCode, InputError, SynthesizerError

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav synth lab.yaml -o out
  safenav verify out/walker.structuredslugs out/walker.json
  safenav verify out/walker.structuredslugs - --json < out/walker.json
\b
Exit codes:
  0  the strategy satisfies the specification   1  it does not
  2  bad input: invalid specification or strategy, or they do not belong together
"""


@click.command(epilog=EPILOG)
@click.argument("specification", type=click.Path())
@click.argument("strategy", type=click.Path())
@click.option(
    "--counterstrategy",
    is_flag=True,
    help="STRATEGY is the environment's: the proof that SPECIFICATION is unrealizable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print all failures as JSON.")
def command(specification: str, strategy: str, counterstrategy: bool, as_json: bool) -> int:
    """Check that the explicit STRATEGY (JSON, as slugs prints it) keeps all guarantees of the
    SPECIFICATION (structured slugs), whatever the environment does within the assumptions.
    Either may be `-` for standard input.

    Initial states, one answer to each allowed input, safety, and no cycle that starves a goal.
    A failure names the constraint, its origin, and a shortest path to it.
    """
    from safenav.explain.vacuity import Way
    from safenav.report.terminal.strategy_failure import failure_lines, verification_data
    from safenav.spec.parsing import check_formulas, read_specification
    from safenav.synthesis.strategy import Strategy
    from safenav.verify.verification import verify_counterstrategy, verify_strategy

    if specification == strategy == "-":
        raise click.UsageError("only one of SPECIFICATION and STRATEGY can be standard input")
    spec = read_specification(_text(specification), specification)
    check_formulas(spec, specification)
    try:
        automaton = Strategy.parse(_bytes(strategy), spec)
    except SynthesizerError as error:
        hint = "it must be the explicit strategy of this very specification, as JSON"
        raise InputError([Diagnostic(strategy, 0, 0, str(error), hint)]) from error
    check = verify_counterstrategy if counterstrategy else verify_strategy
    found = check(spec, automaton)
    if as_json:
        click.echo(json.dumps(verification_data(found, automaton), indent=2))
    elif found.ok:
        good = click.style("correct:", fg="green", bold=True)
        what = "the environment wins with it" if counterstrategy else "all guarantees are kept"
        click.echo(f"{good} {what} ({found.nodes} nodes, {found.edges} transitions checked)")
        if found.vacuous:
            warning = click.style("warning:", fg="yellow", bold=True)
            click.echo(f"{warning} {Way.NO_BEGINNING} (ENV_INIT)", err=True)
    else:
        for failure in found.failures:
            bad = click.style("wrong:", fg="red", bold=True)
            first, *rest = failure_lines(failure, automaton)
            click.echo(f"{bad} {first}")
            for line in rest:
                click.echo(f"    {line}")
    return ExitCode.OK if found.ok else ExitCode.NEGATIVE


def _bytes(name: str) -> bytes:
    try:
        if name == "-":
            return sys.stdin.buffer.read()
        with click.open_file(name, "rb") as file:
            data: bytes = file.read()
            return data
    except OSError as error:
        found = error.strerror or str(error)
        raise InputError([Diagnostic(name, 0, 0, found)]) from error


def _text(name: str) -> str:
    try:
        return _bytes(name).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError([Diagnostic(name, 0, 0, "not valid UTF-8 text")]) from error
