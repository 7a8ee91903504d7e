"""``safenav synth``: synthesize the controllers of a scenario and write them to files."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import click

from safenav.cli import options, specification, warn
from safenav.errors import ExitCode, UsageError
from safenav.explain.summary import explain_unrealizable
from safenav.explain.vacuity import vacuous_wins
from safenav.outfile import write_all
from safenav.report.terminal.fold import echo_folded
from safenav.report.terminal.specification_text import vacuity_lines
from safenav.report.terminal.synthesis_progress import WaitingLine
from safenav.runtime.control.tasks import Controller
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.spec.compile import assumption_names, compile_task
from safenav.synthesis.export import statistics_of
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.words import shortened

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav synth lab.yaml
  safenav synth lab.yaml --robot walker -o out
  safenav synth out/walker.structuredslugs -o again --measures walker.measures.json
\b
Files written for each robot R into DIR:
  R.structuredslugs  the specification, with the origin of each constraint
  R.json             the strategy, as slugs prints it
  R.dot              the automaton for Graphviz (dot -Tsvg)
  R.graphml          the automaton for networkx, Gephi, yEd
A specification S gets S.json, or the strategy of the environment, S.counterstrategy.json; with
DOT and GraphML.
\b
Exit codes:
  0  all realizable   1  some robot is unrealizable (--strict: or a warning)   2  bad input
  3  time or memory limit   4  synthesizer failure
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT)
@click.option("--robot", help="Only this robot.")
@click.option("-o", "--output", type=options.FOLDER, help="Directory to write files into.")
@click.option(
    "--measures",
    type=options.FILE,
    help="With a specification: write the measures of its strategy into this file.",
)
@click.option("--verify/--no-verify", default=True, help="Check each strategy independently.")
@click.option("--strict", is_flag=True, help="Warnings count as unrealizable.")
def command(
    scenario: Path,
    robot: str | None,
    output: Path | None,
    measures: Path | None,
    verify: bool,
    strict: bool,
) -> int:
    """Synthesize the controllers for the start of SCENARIO and print their size.

    SCENARIO may be a specification of your own, in slugsin or structured slugs; an unrealizable one
    gets the environment's strategy.
    """
    if specification.is_specification(scenario):
        if robot is not None:
            raise UsageError(f"{scenario} is a specification: without --robot")
        if measures is not None and not verify:
            raise UsageError("--measures are those of a verified strategy: without --no-verify")
        return specification.synthesize(scenario, output, measures, verify, strict)
    if measures is not None:
        hint = "-o writes the specification of each robot"
        raise UsageError(f"{scenario} is a scenario; --measures takes a specification: {hint}")
    plan = load_scenario(scenario)
    options.check_robot(robot, plan, scenario)
    synthesizer = default_synthesizer(plan, verify=verify)
    wanted = [robot] if robot is not None else [r.name for r in plan.robots]
    answers = first_results(plan, synthesizer, WaitingLine(), wanted)
    if output is not None:
        parts = (_files(answer, plan) for answer in answers.values())
        write_all(output, chain.from_iterable(parts))
    _print_statistics(answers, plan)
    if output is not None:
        click.echo(f"\nwritten to {output}")
    warned = _warn(answers, synthesizer)
    status = _explain_failures(answers, plan)
    return ExitCode.NEGATIVE if strict and warned else status


def _print_statistics(answers: dict[str, Controller], plan: Scenario) -> None:
    rows = []
    for answer in answers.values():
        figures = statistics_of(compile_task(answer.task, plan.map), answer.result)
        verified = specification.words_of(answer.result)
        rows.append((figures, verified if answer.realizable else "-"))
    specification.print_sizes("robot", rows)
    for name, answer in answers.items():
        if answer.allows(plan.map.word):
            echo_folded([f"{name}: {answer.words(plan.map.word)}"])
        rules = map(shortened, assumption_names(answer.task, plan.map))
        echo_folded(f"{name} assumes: {rule}" for rule in rules)


def _warn(answers: dict[str, Controller], synthesizer: Synthesizer) -> bool:
    """Warn about robots that win by breaking their own assumptions; return whether any does."""
    warned = False
    for name, answer in answers.items():
        strategy = answer.result.strategy
        if strategy is None or not answer.realizable:
            continue
        for vacuity in vacuous_wins(strategy, synthesizer):
            warned = True
            warn(*vacuity_lines(name, vacuity, strategy))
    return warned


def _explain_failures(answers: dict[str, Controller], plan: Scenario) -> int:
    failed = [answer for answer in answers.values() if not answer.realizable]
    for answer in failed:
        click.echo(
            f"{click.style('unrealizable:', fg='red', bold=True)} "
            f"{explain_unrealizable(answer.task.robot, answer.task, plan.map)}",
            err=True,
        )
    return ExitCode.NEGATIVE if failed else ExitCode.OK


def _files(answer: Controller, plan: Scenario) -> Iterator[tuple[str, str | bytes]]:
    name = answer.task.robot.name
    yield f"{name}.structuredslugs", compile_task(answer.task, plan.map).to_structuredslugs()
    yield from specification.files_of(answer.result, name)
