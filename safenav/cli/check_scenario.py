"""JudgedFile of a scenario: realizability of each robot, and warnings."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import click
from msgspec.structs import replace

from safenav.cli.judgement import JudgedFile
from safenav.errors import ExitCode
from safenav.explain.summary import explain_unrealizable
from safenav.explain.vacuity import vacuous_wins
from safenav.outcome import Outcome
from safenav.report.terminal.specification_text import vacuity_data, vacuity_lines
from safenav.report.terminal.synthesis_progress import WaitingLine
from safenav.review.foresight import foreseen
from safenav.review.rehearsal import Rehearsal, rehearse
from safenav.runtime.control.tasks import Controller
from safenav.runtime.run.mission import Mission, default_synthesizer, first_results
from safenav.scenario.lint import lint
from safenav.scenario.model import Scenario
from safenav.scenario.objective_text import describe
from safenav.spec.compile import assumption_names
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.vocabulary import OperatorCause
from safenav.trace.words import listed, shortened

APART = " apart from deadlines and batteries"
"""Restriction of the robots' verdicts if a deadline or a battery makes the mission unrealizable."""


def judge_scenario(plan: Scenario, strict: bool) -> JudgedFile:
    """Judge each robot and the team, then run the scenario without its hidden obstacles. Valid
    items that are probably unintended give warnings: an obstacle with an action that no robot has,
    a capability that no obstacle needs, a seed without effect, robots that must stay where there is
    no room for all of them, a robot that can win by breaking its assumptions about the other
    robots, a battery that runs empty, a deadlock. ``strict``: they count as unrealizable."""
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
    data: dict[str, Any] = {"scenario": plan.name, "robots": verdicts, "warnings": of_scenario}
    lines = list[str]()
    for verdict in verdicts:
        words = answers[str(verdict["robot"])].words(plan.map.word)
        lines += _lines(verdict, words, plan.source, "" if refusal is None else APART)
    if ahead is not None:
        data["without_obstacles"] = {
            "outcome": ahead.result.outcome.value,
            "explanation": ahead.result.explanation,
            "ticks": ahead.result.ticks,
            "late": ahead.late,
        }
        lines.append(_seen(ahead))
    if refusal is not None:
        data["unrealizable"] = refusal
        lines.append(f"{click.style('unrealizable', fg='red')}: {refusal}")
    good = realizable and refusal is None and not (strict and warnings)
    return JudgedFile(ExitCode.OK if good else ExitCode.NEGATIVE, data, lines, warnings)


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


def _lines(verdict: Mapping[str, Any], words: str, scenario: str, apart: str) -> list[str]:
    """Return the verdict on a robot. ``words``: its objective; ``apart``: restriction of the
    verdict."""
    good = verdict["explanation"] is None
    word = click.style(str(verdict["verdict"]), fg="green" if good else "red")
    lines = [f"{verdict['robot']}: {word}{apart}, {words}"]
    lines += [f"    assumes: {shortened(rule)}" for rule in verdict["assumptions"] or ()]
    if not good:
        lines.append(f"    {verdict['explanation']}")
        lines.append(f"    safenav explain {shlex.quote(scenario)} proposes repairs")
    return lines
