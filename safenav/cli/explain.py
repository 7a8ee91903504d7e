"""``safenav explain``: why robots are unrealizable, and repairs."""

from __future__ import annotations

import json
from pathlib import Path

import click

from safenav.errors import ExitCode, UsageError

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav explain lab.yaml
  safenav explain lab.yaml --robot walker --json
\b
Exit codes:
  0  every robot is realizable: nothing to explain   1  some robot is unrealizable
  2  bad input   3  time or memory limit   4  synthesizer failure
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--robot", help="Only this robot.")
@click.option("--json", "as_json", is_flag=True, help="Print the explanations as JSON.")
def command(scenario: Path, robot: str | None, as_json: bool) -> int:
    """Explain why robots are unrealizable: a minimal unrealizable core, a losing play and
    verified repairs. A SCENARIO whose targets cannot be reached, which every other command refuses,
    is explained as well."""
    from safenav.report.terminal.explanation_text import explanation_data, explanation_lines
    from safenav.report.terminal.synthesis_progress import WaitingLine
    from safenav.runtime.explanation import explain_team
    from safenav.runtime.mission import default_synthesizer
    from safenav.scenario.reading.loader import load_scenario

    plan = load_scenario(scenario, reachable=False)
    names = [r.name for r in plan.robots]
    if robot is not None and robot not in names:
        raise UsageError(f"{scenario}: there is no robot '{robot}'; it has {', '.join(names)}")
    wanted = names if robot is None else [robot]
    found = explain_team(plan, default_synthesizer(plan), wanted, WaitingLine())
    if as_json:
        robots = [explanation_data(explanation, plan) for explanation in found]
        click.echo(json.dumps({"scenario": plan.name, "unrealizable": robots}, indent=2))
    elif not found:
        whose = "every robot" if robot is None else robot
        click.echo(f"{whose} is {click.style('realizable', fg='green')}: nothing to explain")
    else:
        for place, explanation in enumerate(found):
            for line in explanation_lines(explanation, plan):
                click.echo(line)
            if place + 1 < len(found):
                click.echo()
    return ExitCode.NEGATIVE if found else ExitCode.OK
