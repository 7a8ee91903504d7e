"""``safenav check``: validate a scenario and say whether each robot is realizable."""

from __future__ import annotations

import json
from pathlib import Path

import click

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav check scenarios/case_study_1.yaml
  safenav check scenarios/hello.yaml --json
\b
Exit codes:
  0  valid, and every robot is realizable   1  some robot is unrealizable
  2  bad input   3  time or memory limit   4  synthesizer failure
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON.")
def command(scenario: Path, as_json: bool) -> int:
    """Validate SCENARIO, compile each robot's specification and ask whether it is realizable.
    Nothing is run."""
    from safenav.report.waiting import WaitingLine
    from safenav.runtime.controllers import first_answers
    from safenav.runtime.explanation import explain_unrealizable
    from safenav.runtime.mission import default_synthesizer
    from safenav.scenario.loader import load_scenario
    from safenav.scenario.objective import describe
    from safenav.spec.robot import assumption_names

    plan = load_scenario(scenario)
    answers = first_answers(plan, default_synthesizer(plan), WaitingLine())
    verdicts = []
    for name, answer in answers.items():
        why = (
            None
            if answer.realizable
            else explain_unrealizable(answer.task.robot, answer.task, plan.map)
        )
        verdicts.append(
            {
                "robot": name,
                "objective": describe(answer.task.objective),
                "verdict": answer.result.verdict.value,
                "assumptions": assumption_names(answer.task, plan.map),
                "explanation": why,
            }
        )
    if as_json:
        click.echo(json.dumps({"scenario": plan.name, "robots": verdicts}, indent=2))
    else:
        for verdict in verdicts:
            good = verdict["explanation"] is None
            word = click.style(str(verdict["verdict"]), fg="green" if good else "red")
            click.echo(f"{verdict['robot']}: {word}, {verdict['objective']}")
            for assumption in verdict["assumptions"] or ():
                click.echo(f"    assumes: {assumption}")
            if not good:
                click.echo(f"    {verdict['explanation']}")
    good = all(answer.realizable for answer in answers.values())
    return ExitCode.OK if good else ExitCode.NEGATIVE
