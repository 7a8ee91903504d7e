"""Specifications in files, for ``safenav synth`` and ``safenav explain``."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import click

from safenav.cli.output import made_folder
from safenav.errors import ExitCode, ResourceLimitError
from safenav.outcome import Verdict
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.verdict import SynthesisResult


def is_specification(file: Path) -> bool:
    """Whether a file holds a specification, not a scenario; not if it cannot be read."""
    from safenav.scenario.yaml import source

    try:
        with file.open(encoding="utf-8", errors="replace") as text:
            return source.is_specification(text.read(source.MAX_BYTES))
    except OSError:
        return False


def synthesize(file: Path, output: Path | None, verify: bool, strict: bool) -> int:
    """Print the size of the strategy of a specification, and write it into ``output``."""
    from safenav.report.terminal.table import table
    from safenav.synthesis.export import statistics_of
    from safenav.synthesis.specification_file import load_specification

    spec = load_specification(file)
    synthesizer = _synthesizer(verify)
    result = _decided(file, synthesizer.synthesize(spec))
    negative = result.verdict is Verdict.UNREALIZABLE
    shown = synthesizer.counterstrategy(spec) if negative else result
    figures = statistics_of(spec, shown)
    verified = {True: "yes", None: "no"}[shown.verified or None]
    row = (
        figures.robot,
        figures.verdict,
        figures.states,
        figures.edges,
        figures.goals,
        figures.bits,
        round(result.seconds * 1000, 1),
        verified,
    )
    headings = ("file", "verdict", "states", "edges", "goals", "bits", "ms", "verified")
    for line in table(headings, [row]):
        click.echo(line)
    if output is not None:
        name = f"{file.stem}.counterstrategy" if negative else file.stem
        _write(shown, made_folder(output), name)
    if negative:
        click.echo(f"the states are the environment's; why: safenav explain {file}", err=True)
        return ExitCode.NEGATIVE
    return ExitCode.NEGATIVE if _warn(file, result, synthesizer) and strict else ExitCode.OK


def explain(file: Path, as_json: bool) -> int:
    """Print why a specification is unrealizable."""
    from safenav.explain.lines import explain_lines
    from safenav.report.terminal.line_explanation import (
        line_explanation_data,
        line_explanation_lines,
    )
    from safenav.synthesis.specification_file import load_specification

    spec = load_specification(file)
    synthesizer = _synthesizer(verify=True)
    result = _decided(file, synthesizer.synthesize(spec))
    if result.verdict is Verdict.REALIZABLE:
        if as_json:
            click.echo(json.dumps({"specification": str(file), "unrealizable": None}, indent=2))
        else:
            good = click.style("realizable", fg="green")
            click.echo(f"{file} is {good}: nothing to explain")
            _warn(file, result, synthesizer)
        return ExitCode.OK
    found = explain_lines(spec, synthesizer)
    if as_json:
        data = {"specification": str(file), "unrealizable": line_explanation_data(found)}
        click.echo(json.dumps(data, indent=2))
    else:
        for line in line_explanation_lines(found, str(file)):
            click.echo(line)
    return ExitCode.NEGATIVE


def _synthesizer(verify: bool) -> Synthesizer:
    from safenav.verify.verification import first_failure

    return Synthesizer(verifier=first_failure if verify else None)


def _decided(file: Path, result: SynthesisResult) -> SynthesisResult:
    if result.verdict in (Verdict.REALIZABLE, Verdict.UNREALIZABLE):
        return result
    raise ResourceLimitError(f"{file}: {result.verdict.value}: nothing is proven")


def _warn(file: Path, result: SynthesisResult, synthesizer: Synthesizer) -> bool:
    """Warn of a system that wins by breaking its assumptions; whether it does."""
    from safenav.explain.vacuity import vacuous_wins
    from safenav.report.terminal.line_explanation import win_lines

    assert result.strategy is not None
    found = vacuous_wins(result.strategy, synthesizer)
    for vacuity in found:
        first, *rest = win_lines(vacuity, result.strategy, str(file))
        click.echo(f"{click.style('warning:', fg='yellow', bold=True)} {first}", err=True)
        for line in rest:
            click.echo(line, err=True)
    return bool(found)


def _write(result: SynthesisResult, folder: Path, name: str) -> None:
    from safenav.outfile import write_whole
    from safenav.synthesis.export import to_dot, to_graphml

    assert result.strategy is not None and result.strategy_json is not None
    for suffix, data in (
        (".json", result.strategy_json),
        (".dot", to_dot(result.strategy).encode()),
        (".graphml", to_graphml(result.strategy).encode()),
    ):
        write_whole(folder / f"{name}{suffix}", partial(Path.write_bytes, data=data))
    click.echo(f"\nwritten to {folder}: {name}.json, {name}.dot, {name}.graphml")
