"""``safenav explain``: why robots are unrealizable, and repairs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from safenav.cli import options
from safenav.cli.specification import decided, is_specification, listed, warn_of_vacuity
from safenav.errors import ExitCode, UsageError, exit_code_of
from safenav.explain.lines import explain_lines
from safenav.outcome import Verdict
from safenav.report.terminal.explanation_text import explanation_data, explanation_lines
from safenav.report.terminal.fold import echo_folded
from safenav.report.terminal.postmortem_text import postmortem_data, postmortem_lines
from safenav.report.terminal.specification_text import (
    line_explanation_data,
    line_explanation_lines,
)
from safenav.report.terminal.synthesis_progress import WaitingLine
from safenav.review.postmortem import explain_run
from safenav.review.team import explain_team
from safenav.runtime.run.mission import default_synthesizer
from safenav.scenario.model import Scenario
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.specification_file import load_specification
from safenav.verify.verification import first_failure

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav explain lab.yaml
  safenav explain lab.yaml --robot walker --json
  safenav synth lab.yaml -o out && safenav explain out/walker.structuredslugs
\b
Exit codes:
  0  nothing to explain   1  a robot is unrealizable, or the run needs an operator
  2  bad input   3  time or memory limit   4  synthesizer failure
"""


WARNING_SECONDS, WARNING_MB = 5.0, 100
"""Limits of the synthesis whose strategy is examined for warnings, after the verdict."""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT)
@click.option("--robot", help="Only this robot.")
@click.option("--json", "as_json", is_flag=True, help="Print the explanations as JSON.")
def command(scenario: Path, robot: str | None, as_json: bool) -> int:
    """Explain why robots are unrealizable: a minimal unrealizable core, a losing play and
    verified repairs. Scenarios with unreachable targets, which other commands refuse, are explained
    as well. If all robots are realizable, the run is simulated. If it needs an operator, the proof
    is shown step by step, with repairs that complete the run.

    SCENARIO may be a specification of your own, in slugsin or structured slugs. Then the core
    consists of its lines, and the repairs are assumptions."""
    if is_specification(scenario):
        if robot is not None:
            raise UsageError(f"{scenario} is a specification: without --robot")
        return _of_specification(scenario, as_json)
    plan, refused = options.loaded(scenario)
    options.check_robot(robot, plan, scenario)
    wanted = [r.name for r in plan.robots] if robot is None else [robot]
    found = explain_team(plan, default_synthesizer(plan), wanted, WaitingLine())
    data = list[dict[str, Any]]()
    for explanation in found:
        if not as_json:
            echo_folded(["", *explanation_lines(explanation, plan)][not data :])
        data.append(explanation_data(explanation, plan))
    if refused is not None and not data and robot is None:
        raise refused  # for another reason than an unreachable target
    if not data and robot is None:
        return _of_the_run(plan, as_json)
    if as_json:
        click.echo(json.dumps({"scenario": plan.name, "unrealizable": data}, indent=2))
    elif not data:
        click.echo(f"{robot} is {click.style('realizable', fg='green')}: nothing to explain")
    return ExitCode.NEGATIVE if data else ExitCode.OK


def _of_the_run(plan: Scenario, as_json: bool) -> int:
    """Explain why the run of a team of realizable robots needs an operator, if it does."""
    found = explain_run(plan, plan.catalogue.robots, lambda: default_synthesizer(plan))
    if as_json:
        click.echo(json.dumps(postmortem_data(found, plan), indent=2))
    else:
        echo_folded(postmortem_lines(found, plan.map.word))
    return exit_code_of(found.result.outcome)


def _of_specification(file: Path, as_json: bool) -> int:
    """Print why a specification is unrealizable; return the exit code."""
    spec = load_specification(file)
    synthesizer = Synthesizer(verifier=first_failure)
    result = decided(file, synthesizer.synthesize(spec, strategy=False))
    if result.verdict is Verdict.REALIZABLE:
        if as_json:
            click.echo(json.dumps({"specification": str(file), "unrealizable": None}, indent=2))
        else:
            good = click.style("realizable", fg="green")
            click.echo(f"{file} is {good}: nothing to explain")
            brief = Synthesizer(seconds=WARNING_SECONDS, memory_mb=WARNING_MB)
            warn_of_vacuity(file, listed(brief.synthesize, spec), synthesizer)
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
