"""Commands for specification files: ``safenav verify``, and parts of ``safenav synth`` and
``safenav explain``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import click
from msgspec.structs import replace

from safenav.cli import warn
from safenav.errors import Diagnostic, ExitCode, InputError, ResourceLimitError, SynthesizerError
from safenav.explain.lines import explain_lines
from safenav.explain.vacuity import Cause, vacuous_wins
from safenav.file_kind import kind_of
from safenav.lines import json_flaw, json_line, read_file
from safenav.outcome import Verdict
from safenav.outfile import write_all, write_out
from safenav.report.terminal.specification_text import (
    failure_lines,
    line_explanation_data,
    line_explanation_lines,
    verification_data,
    win_lines,
)
from safenav.report.terminal.table import table
from safenav.scenario.yaml import source
from safenav.spec.parsing import check_formulas, read_specification
from safenav.spec.specification import Owner, Specification
from safenav.strict_json import read_json
from safenav.synthesis.export import StrategySize, statistics_of, to_dot, to_graphml
from safenav.synthesis.request import SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.specification_file import load_specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.counterstrategy import lost_opening
from safenav.verify.measures import counterstrategy_measures, strategy_measures
from safenav.verify.verification import (
    first_failure,
    verify_counterstrategy,
    verify_strategy,
)

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

WARNING_SECONDS, WARNING_MB = 5.0, 100
"""Limits of the synthesis whose strategy `explain` examines for warnings, after its verdict."""


def is_specification(file: Path) -> bool:
    """Return whether a file contains a specification; False if it cannot be read."""
    try:
        with file.open(encoding="utf-8", errors="replace") as text:
            return kind_of(text.read(source.MAX_BYTES)) == "specification"
    except OSError:
        return False


def synthesize(
    file: Path, output: Path | None, measures: Path | None, verify: bool, strict: bool
) -> int:
    """Print the size of a strategy, and write it into ``output`` and its ``measures``; return the
    exit code."""
    spec = load_specification(file)
    synthesizer = Synthesizer(verifier=first_failure if verify else None)
    result = _listed(synthesizer.synthesize, spec)
    if not _is_proven(result):
        # The verdict may be quick even if the strategy is too large to list.
        decided = _decided(file, synthesizer.synthesize(spec, strategy=False))
        if decided.verdict is Verdict.REALIZABLE:
            raise _too_large(file, "realizable, but its strategy", result)
        result = decided
    negative = result.verdict is Verdict.UNREALIZABLE
    shown = _listed(synthesizer.counterstrategy, spec) if negative else result
    if not _is_proven(shown):
        click.echo(
            str(_too_large(file, "unrealizable, but the environment's strategy", shown)), err=True
        )
        return ExitCode.NEGATIVE
    figures = replace(statistics_of(spec, shown), seconds=result.seconds)
    print_sizes("file", [(figures, words_of(shown))])
    if output is not None:
        name = f"{file.stem}.counterstrategy" if negative else file.stem
        write_all(output, files_of(shown, name))
        click.echo(f"\nwritten to {output}: {name}.json, {name}.dot, {name}.graphml")
    if measures is not None:
        assert shown.strategy is not None
        made = (counterstrategy_measures if negative else strategy_measures)(spec, shown.strategy)
        write_out(measures, json_line(made))
    if negative:
        if not shown.states:
            click.echo(f"it has no node: {_opening_words(spec)}")
        click.echo(f"the environment's strategy; to see why: safenav explain {file}", err=True)
        return ExitCode.NEGATIVE
    return ExitCode.NEGATIVE if _warn(file, result, synthesizer) and strict else ExitCode.OK


def _opening_words(spec: Specification) -> str:
    """Return in words how the environment wins immediately, where its strategy has no node."""
    row = lost_opening(spec) or ()
    named = zip(spec.owned(Owner.INPUT), row, strict=False)
    inputs = " ".join(f"{variable.name}={value}" for variable, value in named)
    return f"the initial inputs {inputs} leave no output" if inputs else "no output may begin"


def words_of(result: SynthesisResult) -> str:
    """Return in a word whether a strategy was verified."""
    return {True: "yes", None: "no"}[result.verified or None]


def print_sizes(first: str, rows: Iterable[tuple[StrategySize, str]]) -> None:
    """Print a table of strategies, each with a word on its verification; ``first``: the heading of
    their names."""
    lines = [
        (
            *(each.robot, each.verdict, each.states, each.edges, each.goals, each.bits),
            *(round(each.seconds * 1000, 1), verified),
        )
        for each, verified in rows
    ]
    headings = (first, "verdict", "states", "edges", "goals", "bits", "ms", "verified")
    for line in table(headings, lines):
        click.echo(line)


def explain(file: Path, as_json: bool) -> int:
    """Print why a specification is unrealizable; return the exit code."""
    spec = load_specification(file)
    synthesizer = Synthesizer(verifier=first_failure)
    result = _decided(file, synthesizer.synthesize(spec, strategy=False))
    if result.verdict is Verdict.REALIZABLE:
        if as_json:
            click.echo(json.dumps({"specification": str(file), "unrealizable": None}, indent=2))
        else:
            good = click.style("realizable", fg="green")
            click.echo(f"{file} is {good}: nothing to explain")
            brief = Synthesizer(seconds=WARNING_SECONDS, memory_mb=WARNING_MB)
            _warn(file, _listed(brief.synthesize, spec), synthesizer)
        return ExitCode.OK
    if not as_json:
        click.echo(f"{file}: {click.style('unrealizable', fg='red', bold=True)}")
    found = explain_lines(spec, synthesizer)
    if as_json:
        data = {"specification": str(file), "unrealizable": line_explanation_data(found)}
        click.echo(json.dumps(data, indent=2))
    else:
        for line in line_explanation_lines(found, str(file)):
            click.echo(line)
    return ExitCode.NEGATIVE


def _decided(file: Path, result: SynthesisResult) -> SynthesisResult:
    if _is_proven(result):
        return result
    raise ResourceLimitError(f"{file}: {result.verdict.value}: nothing is proven")


def _listed(
    ask: Callable[[Specification], SynthesisResult], spec: Specification
) -> SynthesisResult:
    """Return the result of a synthesis request; OUT_OF_MEMORY if its output exceeds a limit."""
    try:
        return ask(spec)
    except ResourceLimitError as error:
        nothing = Verdict.OUT_OF_MEMORY
        return SynthesisResult(spec.robot, nothing, 0.0, False, "", detail=str(error))


def _is_proven(result: SynthesisResult) -> bool:
    return result.verdict in (Verdict.REALIZABLE, Verdict.UNREALIZABLE)


def _too_large(file: Path, what: str, result: SynthesisResult) -> ResourceLimitError:
    limit = (result.detail.splitlines() or [result.verdict.value.replace("_", " ")])[0]
    hint = "`slugs --explicitStrategy FILE` has no limits; `safenav verify` checks what it prints"
    return ResourceLimitError(f"{file}: {what} is too large to list ({limit})\n    {hint}")


def _warn(file: Path, result: SynthesisResult, synthesizer: Synthesizer) -> bool:
    """Warn about a system that wins by breaking its assumptions; return whether it does. A strategy
    that is too large to list is not examined."""
    if result.strategy is None:
        return False
    found = vacuous_wins(result.strategy, synthesizer)
    for vacuity in found:
        warn(*win_lines(vacuity, result.strategy, str(file)))
    return bool(found)


def files_of(result: SynthesisResult, name: str) -> Iterator[tuple[str, str | bytes]]:
    """Return the files of an explicit strategy, if there is one: names and contents."""
    if result.strategy is not None and result.strategy_json is not None:
        yield f"{name}.json", result.strategy_json
        yield f"{name}.dot", to_dot(result.strategy)
        yield f"{name}.graphml", to_graphml(result.strategy)


@click.command(epilog=EPILOG)
@click.argument("specification", type=click.Path())
@click.argument("strategy", type=click.Path())
@click.option(
    "--counterstrategy",
    is_flag=True,
    help="STRATEGY is the environment's: the proof that SPECIFICATION is unrealizable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print all failures as JSON.")
def verify(specification: str, strategy: str, counterstrategy: bool, as_json: bool) -> int:
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
            what = f"the environment wins immediately, {_opening_words(spec)}"
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
