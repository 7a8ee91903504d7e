"""``safenav verify``: check a strategy against its specification."""

from __future__ import annotations

import json

import click

from safenav.cli import warn
from safenav.cli.specification import opening_words
from safenav.errors import Diagnostic, ExitCode, InputError, SynthesizerError
from safenav.explain.vacuity import Cause
from safenav.lines import json_flaw, read_file
from safenav.report.terminal.specification_text import failure_lines, verification_data
from safenav.spec.parsing import check_formulas, read_specification
from safenav.strict_json import read_json
from safenav.synthesis.strategy import Strategy
from safenav.verify.verification import verify_counterstrategy, verify_strategy

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
    """Check that the explicit STRATEGY (JSON, as slugs prints it) satisfies all guarantees of the
    SPECIFICATION (structured slugs), whatever the environment does within the assumptions.
    Either may be `-` for standard input.

    The check covers the initial states, a successor for each allowed input, safety, and cycles
    that starve a goal. A failure names the constraint, its origin, and a shortest path to it.
    """
    if specification == strategy == "-":
        raise click.UsageError("only one of SPECIFICATION and STRATEGY can be standard input")
    spec = read_specification(_text(specification), specification)
    check_formulas(spec, specification)
    hint = "it must be the explicit strategy of this specification, as JSON"
    try:
        read_json(data := _bytes(strategy))
        automaton = Strategy.parse(data, spec)
    except ValueError as error:
        flaw = f"the strategy is not JSON: {json_flaw(error)}"
        raise InputError([Diagnostic(strategy, 0, 0, flaw, hint)]) from error
    except SynthesizerError as error:
        raise InputError([Diagnostic(strategy, 0, 0, str(error), hint)]) from error
    check = verify_counterstrategy if counterstrategy else verify_strategy
    found = check(spec, automaton)
    if as_json:
        click.echo(json.dumps(verification_data(found, automaton), indent=2))
    elif found.ok:
        good = click.style("correct:", fg="green", bold=True)
        what = "the environment wins with it" if counterstrategy else "all guarantees are satisfied"
        if counterstrategy and not found.nodes:
            what = f"the environment wins immediately, {opening_words(spec)}"
        click.echo(f"{good} {what} ({found.nodes} nodes, {found.edges} transitions checked)")
        if found.vacuous:
            warn(f"{Cause.NO_BEGINNING} (ENV_INIT)")
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
        return read_file(None if name == "-" else name)
    except OSError as error:
        found = error.strerror or str(error)
        raise InputError([Diagnostic(name, 0, 0, found)]) from error


def _text(name: str) -> str:
    try:
        return _bytes(name).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError([Diagnostic(name, 0, 0, "not valid UTF-8 text")]) from error
