"""``safenav synth``: synthesize the controllers of a scenario and write them to files."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import click
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from safenav.cli import options, warn
from safenav.cli.specification import (
    decided,
    is_proven,
    is_specification,
    listed,
    opening_words,
    too_large,
    warn_of_vacuity,
)
from safenav.errors import ExitCode, UsageError
from safenav.explain.summary import explain_unrealizable
from safenav.explain.vacuity import vacuous_wins
from safenav.lines import json_line
from safenav.outcome import Verdict
from safenav.outfile import write_all, write_out
from safenav.report.terminal.fold import echo_folded
from safenav.report.terminal.specification_text import vacuity_data, vacuity_lines
from safenav.report.terminal.synthesis_progress import WaitingLine
from safenav.report.terminal.table import table
from safenav.runtime.control.tasks import Controller
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.spec.compile import assumption_names, compile_task
from safenav.spec.specification import Specification
from safenav.synthesis.export import StrategySize, statistics_of, to_dot, to_graphml
from safenav.synthesis.request import SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.specification_file import load_specification, slugsin_of
from safenav.trace.words import shortened
from safenav.verify.measures import counterstrategy_measures, strategy_measures
from safenav.verify.verification import first_failure

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav synth lab.yaml
  safenav synth lab.yaml --robot walker -o out
  safenav synth lab.yaml --robot walker -o -
  safenav synth out/walker.structuredslugs -o again --measures walker.measures.json
\b
Files in DIR for each robot R (a specification: of its name):
  R.structuredslugs, R.slugsin  the specification, with the origin of each constraint
  R.json                        the strategy, as slugs prints it
  R.dot, R.graphml              the automaton for Graphviz; for networkx, Gephi, yEd
An unrealizable one gets the environment's strategy, as R.counterstrategy.json, .dot, .graphml.
\b
Exit codes:
  0  all realizable   1  some robot is unrealizable (--strict: or a warning)
  2  bad input   3  time or memory limit   4  synthesizer failure
"""


class Synthesized(Struct, frozen=True):
    """A specification with its result. ``shown``: the strategy to write, that of the environment
    if it is unrealizable."""

    name: str
    spec: Specification
    result: SynthesisResult
    shown: SynthesisResult

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE

    @property
    def size(self) -> StrategySize:
        return replace(statistics_of(self.spec, self.shown), seconds=self.result.seconds)

    @property
    def verified(self) -> bool:
        return self.shown.strategy is not None and bool(self.shown.verified)

    def data(self) -> dict[str, Any]:
        return {"robot": self.name, **to_builtins(self.size), "verified": self.verified}

    def files(self, of_robot: bool) -> Iterator[tuple[str, str | bytes]]:
        """Yield names and contents of its files. ``of_robot``: also the specification."""
        if of_robot:
            yield f"{self.name}.structuredslugs", self.spec.to_structuredslugs()
            if (slugsin := slugsin_of(self.spec)) is not None:
                yield f"{self.name}.slugsin", slugsin
        strategy, stem = self.shown.strategy, self.name
        if not self.realizable:
            stem += ".counterstrategy"
        if strategy is not None and self.shown.strategy_json is not None:
            yield f"{stem}.json", self.shown.strategy_json
            yield f"{stem}.dot", to_dot(strategy)
            yield f"{stem}.graphml", to_graphml(strategy)


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT)
@click.option("--robot", help="Only this robot.")
@options.output(
    folder=True, printed=True, help="Write into this folder; -: print the strategy of one robot."
)
@click.option("--measures", type=options.FILE, help="Write the measures of a specification.")
@click.option("--avoiding", is_flag=True, help="Avoid the other robots (without coordination).")
@click.option("--verify/--no-verify", default=True, help="Check each strategy independently.")
@click.option("--strict", is_flag=True, help="Warnings count as unrealizable.")
@click.option("--json", "as_json", is_flag=True, help="Print one summary as JSON.")
def command(
    scenario: Path,
    robot: str | None,
    output: Path | None,
    measures: Path | None,
    avoiding: bool,
    verify: bool,
    strict: bool,
    as_json: bool,
) -> int:
    """Synthesize the controllers for the start of SCENARIO and print their size. SCENARIO may be a
    specification of your own, in slugsin or structured slugs."""
    if as_json and str(output) == "-":
        raise UsageError("--json and -o - both print to standard output: give one of them")
    if is_specification(scenario):
        if robot is not None:
            raise UsageError(f"{scenario} is a specification: without --robot")
        if avoiding:
            raise UsageError(f"{scenario} is a specification: without --avoiding")
        if measures is not None and not verify:
            raise UsageError("--measures are those of a verified strategy: without --no-verify")
        return _specification(scenario, output, measures, verify, strict, as_json)
    if measures is not None:
        hint = "-o writes the specification of each robot"
        raise UsageError(f"{scenario} is a scenario; --measures takes a specification: {hint}")
    return _scenario(scenario, robot, output, avoiding, verify, strict, as_json)


def _scenario(
    file: Path,
    robot: str | None,
    output: Path | None,
    avoiding: bool,
    verify: bool,
    strict: bool,
    as_json: bool,
) -> int:
    plan, refused = options.loaded(file)
    options.check_robot(robot, plan, file)
    wanted = [robot] if robot is not None else [r.name for r in plan.robots]
    if str(output) == "-" and len(wanted) > 1:
        raise UsageError(f"-o - prints one strategy: add --robot NAME, one of {', '.join(wanted)}")
    synthesizer = default_synthesizer(plan, verify=verify)
    answers = first_results(plan, synthesizer, WaitingLine(), wanted)
    if avoiding:
        answers = {name: _avoiding(each, plan, synthesizer) for name, each in answers.items()}
    if refused is not None and all(answer.realizable for answer in answers.values()):
        raise refused  # for another reason than an unreachable target
    made, data, notes, warned = list[Synthesized](), list[dict[str, Any]](), list[str](), False
    for name, answer in answers.items():
        spec = compile_task(answer.task, plan.map)
        shown, strategy, why = answer.result, answer.result.strategy, None
        if not answer.realizable:
            why = explain_unrealizable(answer.task.robot, answer.task, plan.map)
            click.echo(f"{click.style('unrealizable:', fg='red', bold=True)} {why}", err=True)
            if output is not None:
                shown = listed(synthesizer.counterstrategy, spec)
        made.append(one := Synthesized(name, spec, answer.result, shown))
        vacuities = list[dict[str, Any]]()
        if answer.realizable and strategy is not None:
            for vacuity in vacuous_wins(strategy, synthesizer):
                warn(*vacuity_lines(name, vacuity, strategy))
                vacuities.append(vacuity_data(vacuity, strategy))
        warned = warned or bool(vacuities)
        allows = answer.allows(plan.map.word)
        notes += [f"{name}: {answer.words(plan.map.word)}"] if allows else []
        rules = assumption_names(answer.task, plan.map)
        notes += [f"{name} assumes: {shortened(rule)}" for rule in rules]
        more = {"allows": allows, "assumptions": rules, "explanation": why, "warnings": vacuities}
        data.append(one.data() | more)
    _report(made, output, "robot", {"scenario": plan.name, "robots": data}, as_json, notes)
    bad = not all(one.realizable for one in made) or (strict and warned)
    return ExitCode.NEGATIVE if bad else ExitCode.OK


def _avoiding(answer: Controller, plan: Scenario, synthesizer: Synthesizer) -> Controller:
    """Return the controller of a robot that observes which neighbouring regions robots in conflict
    occupy, and never enters one of these."""
    rivals = tuple(other.name for other in plan.in_conflict(answer.task.robot))
    task = replace(answer.task, avoids=rivals)
    return replace(answer, task=task, result=synthesizer.synthesize(compile_task(task, plan.map)))


def _specification(
    file: Path,
    output: Path | None,
    measures: Path | None,
    verify: bool,
    strict: bool,
    as_json: bool,
) -> int:
    spec = load_specification(file)
    synthesizer = Synthesizer(verifier=first_failure if verify else None)
    result = listed(synthesizer.synthesize, spec)
    if not is_proven(result):
        # The verdict may be quick even if the strategy is too large to list.
        proven = decided(file, synthesizer.synthesize(spec, strategy=False))
        if proven.verdict is Verdict.REALIZABLE:
            raise too_large(file, "realizable, but its strategy", result)
        result = proven
    negative = result.verdict is Verdict.UNREALIZABLE
    shown = listed(synthesizer.counterstrategy, spec) if negative else result
    if not is_proven(shown):
        found = too_large(file, "unrealizable, but the environment's strategy", shown)
        click.echo(str(found), err=True)
        return ExitCode.NEGATIVE
    one = Synthesized(file.stem, spec, result, shown)
    _report([one], output, "file", {"specification": str(file), **one.data()}, as_json)
    if measures is not None:
        assert shown.strategy is not None
        made = (counterstrategy_measures if negative else strategy_measures)(spec, shown.strategy)
        write_out(measures, json_line(made))
    if negative:
        if not shown.states:
            click.echo(f"it has no node: {opening_words(spec)}", err=as_json or str(output) == "-")
        click.echo(f"the environment's strategy; to see why: safenav explain {file}", err=True)
        return ExitCode.NEGATIVE
    warned = warn_of_vacuity(file, result, synthesizer)
    return ExitCode.NEGATIVE if warned and strict else ExitCode.OK


def _report(
    made: Sequence[Synthesized],
    output: Path | None,
    first: str,
    data: dict[str, Any],
    as_json: bool,
    notes: Sequence[str] = (),
) -> None:
    """Write the files, and print a table or the summary. ``first``: the heading of the names."""
    printed = str(output) == "-"
    names = list[str]()
    if printed:
        write_out(Path("-"), made[0].shown.strategy_json or b"")
    elif output is not None:
        files = [file for one in made for file in one.files(of_robot=first == "robot")]
        names = [name for name, _ in files]
        write_all(output, files)
    if as_json:
        click.echo(json.dumps(data, indent=2))
        return
    rows = []
    for one in made:
        size, verified = one.size, "-" if one.shown.strategy is None else "no"
        figures = (size.robot, size.verdict, size.states, size.edges, size.goals, size.bits)
        rows.append((*figures, round(size.seconds * 1000, 1), "yes" if one.verified else verified))
    headings = (first, "verdict", "states", "edges", "goals", "bits", "ms", "verified")
    echo_folded([*table(headings, rows), *notes], err=printed)
    if names:
        listing = f": {', '.join(names)}" if len(made) == 1 else ""
        click.echo(f"\nwritten to {output}{listing}")
