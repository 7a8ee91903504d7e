"""``safenav check``: validate a scenario and check whether each robot is realizable."""

from __future__ import annotations

import json
import shlex
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import click
from msgspec.structs import replace

from safenav.cli import options, warn
from safenav.errors import ExitCode
from safenav.explain.summary import explain_unrealizable
from safenav.explain.vacuity import vacuous_wins
from safenav.outcome import Outcome
from safenav.report.terminal.fold import echo_folded
from safenav.report.terminal.specification_text import vacuity_data, vacuity_lines
from safenav.report.terminal.synthesis_progress import WaitingLine
from safenav.review.foresight import foreseen
from safenav.review.rehearsal import Rehearsal, rehearse
from safenav.runtime.control.tasks import Controller
from safenav.runtime.run.mission import Mission, default_synthesizer, first_results
from safenav.scenario.lint import lint
from safenav.scenario.model import Scenario
from safenav.scenario.objective_text import describe
from safenav.scenario.reading.loader import load_scenario
from safenav.spec.compile import assumption_names
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.vocabulary import OperatorCause
from safenav.trace.words import listed, shortened

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav check lab.yaml
  safenav check lab.yaml --strict --json
\b
Exit codes:
  0  valid, and every robot is realizable   1  some robot is unrealizable (--strict: or a warning)
  2  bad input   3  time or memory limit   4  synthesizer failure
"""


APART = " apart from deadlines and batteries"
"""Restriction of the robots' verdicts if a deadline or a battery makes the mission unrealizable."""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT)
@click.option("--strict", is_flag=True, help="Warnings count as unrealizable.")
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON.")
def command(scenario: Path, strict: bool, as_json: bool) -> int:
    """Validate SCENARIO, compile each robot's specification and check whether it is realizable.
    Then run it without its hidden obstacles, and report the outcome and the missed deadlines. Valid
    items that are probably unintended give warnings: an obstacle with an action that no robot has,
    a capability that no obstacle needs, a seed without effect, robots that must stay where there is
    no room for all of them, a robot that can win by breaking its assumptions about the other
    robots, a battery that runs empty, a deadlock."""
    plan = load_scenario(scenario)
    synthesizer = default_synthesizer(plan)
    answers = first_results(plan, synthesizer, WaitingLine())
    of_scenario = [*lint(plan), *foreseen(plan), *_with_inputs(plan, synthesizer)]
    warnings, verdicts = list(of_scenario), list[dict[str, Any]]()
    for name, answer in answers.items():
        strategy = answer.result.strategy
        vacuous = vacuous_wins(strategy, synthesizer) if answer.realizable and strategy else ()
        for vacuity in vacuous:
            assert strategy is not None
            warnings += vacuity_lines(name, vacuity, strategy)
        vacuities = [vacuity_data(vacuity, strategy) for vacuity in vacuous if strategy]
        verdicts.append(_verdict(name, answer, plan) | {"warnings": vacuities})
    realizable = all(answer.realizable for answer in answers.values())
    refusal = Mission(plan, synthesizer).refusal() if realizable else None
    ahead = rehearse(plan, synthesizer) if realizable and refusal is None else None
    seen = [*_empty(plan, ahead), *_deadlock(ahead, of_scenario)]
    of_scenario, warnings = [*of_scenario, *seen], [*warnings, *seen]
    if as_json:
        data: dict[str, Any] = {"robots": verdicts, "warnings": of_scenario}
        if ahead is not None:
            data["without_obstacles"] = {
                "outcome": ahead.result.outcome.value,
                "explanation": ahead.result.explanation,
                "ticks": ahead.result.ticks,
                "late": ahead.late,
            }
        if refusal is not None:
            data["unrealizable"] = refusal
        click.echo(json.dumps({"scenario": plan.name, **data}, indent=2))
    else:
        for verdict in verdicts:
            words = answers[str(verdict["robot"])].words(plan.map.word)
            _tell(verdict, words, scenario, "" if refusal is None else APART)
        if refusal is not None:
            echo_folded([f"{click.style('unrealizable', fg='red')}: {refusal}"])
        if ahead is not None:
            echo_folded([_seen(ahead)])
        for line in warnings:
            if line.startswith(" "):
                echo_folded([line], err=True)
            else:
                warn(line)
    good = realizable and refusal is None and not (strict and warnings)
    return ExitCode.OK if good else ExitCode.NEGATIVE


def _seen(ahead: Rehearsal) -> str:
    """``without hidden obstacles: completed in tick 30; late: digit``."""
    result = ahead.result
    line = f"without hidden obstacles: {result.outcome.value} in tick {result.ticks}"
    if result.outcome is not Outcome.COMPLETED:
        line += f": {result.explanation}"
    return f"{line}; late: {listed(ahead.late)}" if ahead.late else line


def _empty(plan: Scenario, ahead: Rehearsal | None) -> Iterator[str]:
    """Yield warnings of batteries that run empty, unless a robot would bring another one."""
    if ahead is not None and plan.flat is None:
        for robot, tick in ahead.flat.items():
            yield f"the battery of {robot} is empty in tick {tick} without hidden obstacles"


def _deadlock(ahead: Rehearsal | None, warnings: Collection[str]) -> Iterator[str]:
    """Yield a warning of a proven deadlock, unless one of ``warnings`` is the reason for it."""
    if ahead is None or ahead.result.cause != OperatorCause.DEADLOCK.value:
        return
    if not any(each in ahead.result.explanation for each in warnings):
        yield "no order of moves completes the mission: an operator will be needed"


def _with_inputs(plan: Scenario, synthesizer: Synthesizer) -> Iterator[str]:
    """Yield warnings about objectives from inputs that are unrealizable from the start."""
    for robot in plan.robots:
        for event, objective in robot.when:  # as if the input were on from the start
            team = (replace(r, objective=objective) if r is robot else r for r in plan.robots)
            then = replace(plan, robots=tuple(team))
            answer = first_results(then, synthesizer, WaitingLine(), [robot.name])[robot.name]
            if not answer.realizable:
                explanation = explain_unrealizable(answer.task.robot, answer.task, plan.map)
                yield f"when {event} is on from the start, {explanation}"


def _verdict(name: str, answer: Controller, plan: Scenario) -> dict[str, Any]:
    """Return the verdict on a robot as data."""
    task = answer.task
    why = None if answer.realizable else explain_unrealizable(task.robot, task, plan.map)
    return {
        "robot": name,
        "objective": describe(answer.asked, plan.map.word),
        "form": answer.form.value,
        "allows": answer.allows(plan.map.word),
        "verdict": answer.result.verdict.value,
        "assumptions": assumption_names(task, plan.map),
        "explanation": why,
    }


def _tell(verdict: Mapping[str, Any], words: str, scenario: Path, apart: str) -> None:
    """Print the verdict on a robot. ``words``: its objective; ``apart``: restriction of the
    verdict."""
    good = verdict["explanation"] is None
    word = click.style(str(verdict["verdict"]), fg="green" if good else "red")
    lines = [f"{verdict['robot']}: {word}{apart}, {words}"]
    lines += [f"    assumes: {shortened(rule)}" for rule in verdict["assumptions"] or ()]
    if not good:
        lines.append(f"    {verdict['explanation']}")
        lines.append(f"    safenav explain {shlex.quote(str(scenario))} proposes repairs")
    echo_folded(lines)
