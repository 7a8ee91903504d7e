"""``safenav synth``, ``verify`` and ``explain``: strategies of scenarios and specifications."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import click
from msgspec import Struct
from msgspec.structs import replace

from safenav import errors
from safenav.cli import options, warn, warn_of
from safenav.cli.options import code_of, print_json
from safenav.explain.play import Cause, vacuities
from safenav.files import json_flaw, json_line, read_input, write_all, write_out
from safenav.report.terminal import specification_text as texts
from safenav.report.terminal.layout import WaitingLine, echo_lines, table
from safenav.review.foresight import examined
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.spec.compile import compile_task
from safenav.spec.specification import Owner, Section, Specification
from safenav.spec.task import Weakening
from safenav.strict_json import read_json
from safenav.synthesis import slugs
from safenav.synthesis.slugs import SynthesisResult, Synthesizer
from safenav.synthesis.strategy import Strategy, bit_names, to_dot, to_graphml
from safenav.trace.words import shortened
from safenav.verify import verification
from safenav.verify.verification import first_failure, lost_opening

FILES = options.Output(folder=True, printed=True)
SYNTH_EXAMPLES = """\
  safenav new lab.yaml && safenav synth lab.yaml
  safenav synth lab.yaml --robot walker -o out
  safenav synth lab.yaml --robot walker -o -
  safenav synth out/walker.structuredslugs -o again --measures walker.measures.json
\b
Files in the output folder for each robot R (for a specification, R is the name of its file):
  R.structuredslugs, R.slugsin  the specification, with the origin of each constraint
  R.json                        the strategy, as slugs prints it
  R.dot, R.graphml              the automaton for Graphviz; for networkx, Gephi, yEd
An unrealizable one gets the environment's strategy, as R.counterstrategy.json, .dot, .graphml.
"""


class Synthesized(Struct, frozen=True):
    """A specification and its result. An unrealizable one has the environment's strategy."""

    spec: Specification
    result: SynthesisResult

    @property
    def realizable(self) -> bool:
        return self.result.verdict is errors.Verdict.REALIZABLE

    def data(self) -> dict[str, Any]:
        """Return the figures of the result as data (None for a missing strategy)."""
        strategy = self.result.strategy
        return {
            "robot": self.spec.robot,
            "verdict": self.result.verdict.value,
            "states": self.result.states,
            "edges": None if strategy is None else strategy.edges,
            "goals": max(1, len(self.spec.section(Section.SYS_LIVENESS))),
            "variables": len(self.spec.variables),
            "bits": sum(len(bit_names(variable)) for variable in self.spec.variables),
            "seconds": self.result.seconds,
            "verified": bool(self.result.verified),
        }

    def row(self) -> Sequence[object]:
        """Return the line of this result in the table."""
        data = self.data()
        size = [data[key] for key in ("robot", "verdict", "states", "edges", "goals", "bits")]
        return [*size, round(self.result.seconds * 1000, 1), "yes" if data["verified"] else "-"]

    def files(self, of_robot: bool) -> Iterator[tuple[str, str | bytes]]:
        """Yield names and contents of all files, with the specification's if ``of_robot``."""
        if of_robot:
            yield f"{self.spec.robot}.structuredslugs", self.spec.to_structuredslugs()
            if (slugsin := slugs.slugsin_of(self.spec)) is not None:
                yield f"{self.spec.robot}.slugsin", slugsin
        name = self.spec.robot
        stem = name if self.realizable else f"{name}.counterstrategy"
        strategy, printed = self.result.strategy, self.result.strategy_json
        if strategy is not None and printed is not None:
            yield f"{stem}.json", printed
            yield f"{stem}.dot", to_dot(strategy)
            yield f"{stem}.graphml", to_graphml(strategy)

    def outdated(self) -> Iterator[str]:
        """Yield the names of possible files of an earlier verdict."""
        for stem in (self.spec.robot, f"{self.spec.robot}.counterstrategy"):
            yield from (f"{stem}{ending}" for ending in (".json", ".dot", ".graphml"))


@options.command(SYNTH_EXAMPLES, "all realizable", "a robot is unrealizable")
def synth(
    scenario: options.InputFile,
    robot: options.Robot,
    output: Annotated[
        Path | None,
        FILES,
        "-o --output",
        "Write into this folder; -: print the strategy of one robot.",
    ],
    measures: Annotated[Path | None, options.Output(), "Progress measures (specifications only)."],
    avoiding: Annotated[bool, "Avoid the other robots (without coordination)."],
    as_json: options.AsJson,
) -> int:
    """Synthesize the controllers for the start of SCENARIO and print their size. SCENARIO may be a
    specification of your own, in slugsin or structured slugs."""
    given = options.GivenFile(scenario, slugs.MOST_OF_A_TEXT)
    if given.kind == "specification" or (measures is not None and given.kind is None):
        options.refuse("scenarios", "robot", "avoiding")
        return _of_specification(given, output, measures, as_json)
    options.refuse("a specification; -o writes the specification of each robot", "measures")
    plan, refused, wanted = options.loaded(given, robot)
    if str(output) == "-" and len(wanted) > 1:
        raise errors.UsageError(
            f"-o - prints one strategy: add --robot NAME, one of {', '.join(wanted)}"
        )
    synthesizer = default_synthesizer(plan)
    answers = first_results(plan, synthesizer, WaitingLine(), wanted, strategies=True)
    if avoiding:  # each robot observes rivals beside it and enters no region of theirs
        for name, answer in answers.items():
            own = answer.task.robot
            others = (each for each in plan.robots if each.name != name)
            rivals = tuple(other.name for other in others if own.conflicts(other))
            task = replace(answer.task, avoids=rivals)
            result = synthesizer.synthesize(compile_task(task, plan.map))
            rung = answer.rung  # no joint plan drives the robot
            if rivals and rung.weakening is Weakening.PLANNED:
                rung = replace(rung, weakening=Weakening.SHARED)
            answers[name] = replace(answer, task=task, rung=rung, result=result)
    if refused is not None and all(answer.realizable for answer in answers.values()):
        raise refused  # not because of an unreachable target
    made, data, notes = list[Synthesized](), list[dict[str, Any]](), list[str]()
    for name, answer in answers.items():
        spec, result = compile_task(answer.task, plan.map), answer.result
        more = examined(answer, plan)
        if not answer.realizable:
            unrealizable = click.style("unrealizable:", fg="red", bold=True)
            click.echo(f"{unrealizable} {more['explanation']}", err=True)
            if output is not None:
                other = synthesizer.counterstrategy(spec)
                result = other if other.verdict.proven else result
        made.append(one := Synthesized(spec, result))
        notes += [f"{name}: {answer.words(plan.map.word)}"] if more["allows"] else []
        notes += [f"{name} assumes: {shortened(rule)}" for rule in more["assumptions"]]
        data.append(one.data() | more)
    _report(made, output, "robot", {"scenario": plan.name, "robots": data}, as_json, notes)
    return code_of(all(one.realizable for one in made))


def _of_specification(
    given: options.GivenFile, output: Path | None, measures: Path | None, as_json: bool
) -> int:
    """Synthesize a specification. Write and print its strategy or the environment's. Return the
    exit code."""
    file, spec = given.path, specification_of(given)
    synthesizer = Synthesizer(verifier=first_failure)
    result = decided(file, synthesizer.synthesize(spec))
    if result.verdict is errors.Verdict.UNREALIZABLE:
        result = decided(file, synthesizer.counterstrategy(spec))
    one = Synthesized(spec, result)
    if measures is not None and output is not None:
        written = [(output / name).resolve() for name, _ in one.files(of_robot=False)]
        if measures.resolve() in written:
            problem = f"--measures {measures} would overwrite the strategy"
            raise errors.UsageError(f"{problem}; give another file")
    _report([one], output, "file", {"specification": str(file), **one.data()}, as_json)
    strategy = one.result.strategy
    assert strategy is not None
    if measures is not None:
        made = verification.measures(spec, strategy, not one.realizable)
        write_out(measures, json_line(made))
    if one.realizable:
        for vacuity in vacuities(strategy):
            warn_of(texts.vacuity_lines(vacuity, strategy, str(file)))
    else:
        if not strategy.states:
            words = f"the counterstrategy has no node: {opening_words(spec)}"
            click.echo(words, err=as_json or str(output) == "-")
        hint = f"for the reason: safenav explain {file}"
        click.echo(f"this is the environment's strategy; {hint}", err=True)
    return code_of(one.realizable)


def decided(file: Path, result: SynthesisResult) -> SynthesisResult:
    if result.verdict.proven:
        return result
    raise errors.ResourceLimitError(f"{file}: {result.verdict.value}: nothing is proven")


def specification_of(given: options.GivenFile) -> Specification:
    """Return the specification in a file with the file's name."""
    stem = given.path.stem if given.path.is_file() else "specification"
    return slugs.specification_in(given.bytes(), given.name, stem, warn)


def _report(
    made: Sequence[Synthesized],
    output: Path | None,
    first: str,
    data: Mapping[str, Any],
    as_json: bool,
    notes: Sequence[str] = (),
) -> None:
    """Write the files and print a table or the summary. ``first``: the first column's heading."""
    printed = str(output) == "-"
    files = list[tuple[str, str | bytes]]()
    if printed:
        write_out(Path("-"), made[0].result.strategy_json or b"")
    elif output is not None:
        files = [file for one in made for file in one.files(of_robot=first == "robot")]
        write_all(output, files)
        for name in {name for one in made for name in one.outdated()} - {name for name, _ in files}:
            (output / name).unlink(missing_ok=True)
    if as_json:
        print_json(data)
        return
    headings = (first, "verdict", "states", "edges", "goals", "bits", "ms", "verified")
    echo_lines([*table(headings, [one.row() for one in made]), *notes], err=printed)
    if files:
        listing = f": {', '.join(name for name, _ in files)}" if len(made) == 1 else ""
        click.echo(f"\nwritten to {output}{listing}")


def opening_words(spec: Specification) -> str:
    """Return, in words, how the environment wins immediately if its strategy has no node."""
    row = lost_opening(spec) or ()
    named = zip(spec.owned(Owner.INPUT), row, strict=False)
    inputs = " ".join(f"{variable.name}={value}" for variable, value in named)
    return f"the initial inputs {inputs} allow no output" if inputs else "no output is allowed"


VERIFY_EXAMPLES = """\
  safenav new lab.yaml && safenav synth lab.yaml -o out
  safenav verify out/walker.structuredslugs out/walker.json
  safenav verify out/walker.structuredslugs - --json < out/walker.json
"""


@options.command(VERIFY_EXAMPLES, "the strategy satisfies the specification", "it does not")
def verify(
    specification: Annotated[str, click.Path()],
    strategy: Annotated[str, click.Path()],
    counterstrategy: Annotated[bool, "STRATEGY is a counterstrategy of SPECIFICATION."],
    as_json: options.AsJson,
) -> int:
    """Check that the explicit STRATEGY (JSON, as slugs prints it) satisfies all guarantees of the
    SPECIFICATION (structured slugs), whatever the environment does within the assumptions. Either
    may be `-` for standard input.

    The check covers the initial states, a successor for each allowed input, safety, and cycles that
    starve a goal. A failure names the fault, the constraint that it violates (if any) with its
    origin, and a shortest path to its node.
    """
    if specification == strategy == "-":
        raise click.UsageError("only one of SPECIFICATION and STRATEGY can be standard input")
    spec = slugs.specification_in(read_input(specification), specification, "robot")
    data = read_input(strategy)
    try:
        read_json(data)
        automaton = Strategy.parse(data, spec)
    except (ValueError, errors.SynthesizerError) as error:
        malformed = isinstance(error, ValueError)
        flaw = f"the strategy is not JSON: {json_flaw(error)}" if malformed else str(error)
        hint = "it must be the explicit strategy of this specification, as JSON: 'safenav synth "
        hint += "-o DIR' writes both"
        raise errors.InputError([errors.Diagnostic(strategy, 0, 0, flaw, hint)]) from error
    found = verification.verify(spec, automaton, counterstrategy)
    if as_json:
        print_json({"ok": found.ok, **texts.data_of(found)})
    elif found.ok:
        good = click.style("correct:", fg="green", bold=True)
        what = "the environment wins with it" if counterstrategy else "all guarantees are satisfied"
        if counterstrategy and not found.nodes:
            what = f"the environment wins immediately, {opening_words(spec)}"
        click.echo(f"{good} {what} ({found.nodes} nodes, {found.edges} transitions checked)")
        if found.vacuous:
            warn(f"{Cause.NO_BEGINNING} (ENV_INIT)")
    for failure in () if as_json else found.failures:
        first, *rest = texts.failure_lines(failure, automaton)
        click.echo(f"{click.style('wrong:', fg='red', bold=True)} {first}")
        echo_lines(f"    {line}" for line in rest)
    return code_of(found.ok)


EXPLAIN_EXAMPLES = """\
  safenav new lab.yaml && safenav explain lab.yaml
  safenav explain lab.yaml --robot walker --json
  safenav synth lab.yaml -o out && safenav explain out/walker.structuredslugs
"""
EXPLAINED = "a robot is unrealizable, or the run needs an operator"


@options.command(EXPLAIN_EXAMPLES, "nothing to explain", EXPLAINED)
def explain(scenario: options.InputFile, robot: options.Robot, as_json: options.AsJson) -> int:
    """Explain why robots are unrealizable: a minimal unrealizable core, a losing play and
    verified repairs. Scenarios with unreachable targets, which other commands refuse, are explained
    as well. If all robots are realizable, the run is simulated. If it needs an operator, the proof
    is shown step by step, with repairs that complete the run.

    SCENARIO may be a specification of your own, in slugsin or structured slugs. Then the core
    consists of its lines, and the repairs are assumptions."""
    from safenav.report.terminal.explanation_text import explanation_lines
    from safenav.review.postmortem import explain_team

    given = options.GivenFile(scenario, slugs.MOST_OF_A_TEXT)
    if given.kind == "specification":
        options.refuse("scenarios", "robot")
        return _explain_specification(given, as_json)
    plan, refused, wanted = options.loaded(given, robot)
    found = explain_team(plan, default_synthesizer(plan), wanted, WaitingLine())
    data = list[dict[str, Any]]()
    for explanation in found:
        lines = [*explanation_lines(explanation, plan)]
        if not as_json:
            echo_lines(["", *lines][not data :])
        data.append({"says": [*map(click.unstyle, lines)], **texts.data_of(explanation)})
    if refused is not None and not data and robot is None:
        raise refused  # not because of an unreachable target
    if not data and robot is None:
        from safenav.report.terminal.explanation_text import postmortem_lines
        from safenav.review.postmortem import explain_run

        run = explain_run(plan, plan.catalogue.robots, lambda: default_synthesizer(plan))
        if as_json:
            print_json({"scenario": plan.name, "unrealizable": data, **texts.data_of(run)})
        else:
            echo_lines(postmortem_lines(run, plan.map.word))
        return errors.exit_code_of(run.result.outcome) or code_of(not run.result.late)
    if as_json:
        print_json({"scenario": plan.name, "unrealizable": data})
    elif not data:
        click.echo(f"{robot} is {click.style('realizable', fg='green')}: nothing to explain")
    return code_of(not data)


def _explain_specification(given: options.GivenFile, as_json: bool) -> int:
    """Print why a specification is unrealizable. Return the exit code."""
    from safenav.explain.investigation import explain_lines

    file, spec = given.path, specification_of(given)
    synthesizer = Synthesizer(verifier=first_failure)
    result = decided(file, synthesizer.synthesize(spec, strategy=False))
    realizable = result.verdict is errors.Verdict.REALIZABLE
    if not as_json:
        word = click.style(result.verdict.value, fg="green" if realizable else "red")
        click.echo(f"{file} is {word}: nothing to explain" if realizable else f"{file}: {word}")
    found = None if realizable else explain_lines(spec, synthesizer)
    if as_json:
        print_json({"specification": str(file), "unrealizable": texts.data_of(found)})
    elif found is not None:
        echo_lines(texts.line_explanation_lines(found, str(file)))
    return code_of(realizable)
