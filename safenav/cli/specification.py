"""Specifications in files, for ``safenav synth`` and ``safenav explain``."""

from __future__ import annotations

import json
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from safenav.cli.output import made_folder
from safenav.errors import ExitCode, ResourceLimitError
from safenav.outcome import Verdict
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.verdict import SynthesisResult

if TYPE_CHECKING:
    from safenav.synthesis.export import StrategySize


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
    from safenav.synthesis.export import statistics_of
    from safenav.synthesis.specification_file import load_specification

    spec = load_specification(file)
    synthesizer = _synthesizer(verify)
    result = _decided(file, synthesizer.synthesize(spec))
    negative = result.verdict is Verdict.UNREALIZABLE
    shown = synthesizer.counterstrategy(spec) if negative else result
    figures = replace(statistics_of(spec, shown), seconds=result.seconds)
    print_sizes("file", [(figures, words_of(shown))])
    if output is not None:
        name = f"{file.stem}.counterstrategy" if negative else file.stem
        _write(shown, made_folder(output), name)
    if negative:
        click.echo(f"the states are the environment's; why: safenav explain {file}", err=True)
        return ExitCode.NEGATIVE
    return ExitCode.NEGATIVE if _warn(file, result, synthesizer) and strict else ExitCode.OK


def words_of(result: SynthesisResult) -> str:
    """Whether a strategy was verified, in a word."""
    return {True: "yes", None: "no"}[result.verified or None]


def print_sizes(first: str, rows: Iterable[tuple[StrategySize, str]]) -> None:
    """Print a table of strategies, each with a word on its verification; ``first``: the heading of
    their names."""
    from safenav.report.terminal.table import table

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
