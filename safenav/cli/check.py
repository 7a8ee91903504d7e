"""``safenav check`` and ``certify``: judge files and write the bundle of a run."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import click
from msgspec import Struct, to_builtins
from msgspec.structs import replace

from safenav import errors
from safenav.cli import options, report_error, warn_of
from safenav.cli.options import GivenFile
from safenav.files import check_kind
from safenav.report.terminal.layout import echo_lines
from safenav.trace.words import counted, listed, moment_words, obstacle_words, shortened

if TYPE_CHECKING:
    from safenav.run.checked import CheckedTrace

EXAMPLES = """\
  safenav new lab.yaml && safenav check lab.yaml --strict
  safenav run lab.yaml --trace lab.jsonl && safenav check lab.jsonl
  safenav certify lab.yaml -o bundle && safenav check bundle
With the extra 'motion':
  safenav export lab.jsonl --motion lab.motion.jsonl
  safenav check lab.jsonl lab.motion.jsonl
The exit code of several files is the largest.
"""
GOOD = "valid and realizable; no rule broken; accepted; each requirement satisfied"
BAD = """unrealizable (--strict: or a warning); a rule broken, or an outcome missing;
     refused; a requirement violated or undecided"""

SCENARIO, TRACE, MOTION, BUNDLE = "scenario", "trace", "motion file", "bundle"
ARCHIVE = ("PK\x03\x04", "PK\x05\x06")
"""The first bytes of zip files."""
SHOWN = 5
"""Maximum number of printed findings per file."""


class JudgedFile(Struct, frozen=True):
    """The verdict on a file as data and in words."""

    status: errors.ExitCode
    data: Mapping[str, Any]
    lines: Sequence[str] = ()
    warnings: Sequence[str] = ()


@options.command(EXAMPLES, GOOD, BAD)
def check(
    files: Annotated[tuple[Path, ...], options.INPUT],
    *,
    strict: Annotated[bool, "Scenarios: warnings count as unrealizable."],
    require: Annotated[tuple[str, ...], "Motions: add a requirement."],
    rate: Annotated[float, options.HERTZ, "Motions: samples per second."] = 50.0,
    as_json: options.AsJson,
) -> int:
    """Judge each FILE: a scenario (are its robots realizable?), a trace (docs/judge.md), a bundle
    (docs/certify.md), or a motion file together with its trace (docs/motion.md). Their kind is
    recognized by their content; `-` is standard input."""
    found = [(recognized(file), file) for file in map(options.GivenFile, files)]
    kinds = {kind for kind, _ in found}
    if SCENARIO not in kinds:
        options.refuse("a scenario", "strict")
    if MOTION not in kinds:
        options.refuse("a motion file", "require", "rate")
    traces = [file for kind, file in found if kind == TRACE]
    judges: dict[str, Callable[[GivenFile], JudgedFile]] = {
        SCENARIO: lambda file: of_scenario(file, strict),
        TRACE: lambda file: of_trace(file, MOTION in kinds),
        MOTION: lambda file: of_motion(file, traces, require, rate),
        BUNDLE: of_bundle,
    }
    status, data = errors.ExitCode.OK, list[Mapping[str, Any]]()
    several = len(found) > 1
    for kind, file in found:
        try:
            judged = judges[kind](file)
        except errors.SafenavError as error:
            if not several:
                raise
            judged = JudgedFile(error.exit_code, {"error": str(error)})
            report_error(str(error))
        status = max(status, judged.status)
        data.append({"file": str(file.path), **judged.data} if several else judged.data)
        if not as_json:
            if several and kind == SCENARIO and judged.lines:
                click.echo(f"{file.path}:")
            echo_lines(judged.lines)
            warn_of(judged.warnings)
    if as_json:
        options.print_json(data if several else data[0])
    return status


def recognized(file: GivenFile) -> str:
    """Return the kind of a file. Raises InputError for a file that is not judged."""
    path, name = file.path, file.name
    if path.is_dir():
        if not (path / "manifest.json").is_file():
            hint = f"a bundle has a manifest.json; to run scenarios: safenav batch {path}"
            raise errors.InputError(
                [errors.Diagnostic(name, 0, 0, "this folder is not a bundle", hint)]
            )
        return BUNDLE
    if file.beginning.startswith(ARCHIVE) and path.is_file():
        return BUNDLE
    if file.kind in (SCENARIO, TRACE, MOTION):
        return str(file.kind)
    check_kind(file.beginning, f"{SCENARIO}, {TRACE}, {BUNDLE} or {MOTION}", name)
    lines = path.suffix == ".jsonl" or (name == "-" and file.beginning.lstrip().startswith("{"))
    return TRACE if lines else SCENARIO


def of_scenario(file: GivenFile, strict: bool) -> JudgedFile:
    """Judge each robot and the team, then run the scenario without its hidden obstacles. Probably
    unintended items give warnings: those of ``lint`` and ``foreseen``, an unrealizable objective of
    an input, an empty battery, a deadlock. ``strict``: whether warnings count as unrealizable."""
    from safenav.report.terminal.layout import WaitingLine
    from safenav.review.foresight import examined, foreseen, rehearse
    from safenav.review.lint import lint
    from safenav.runtime.run.deadlines import refusal_of
    from safenav.runtime.run.mission import default_synthesizer, first_results
    from safenav.scenario.objective import describe
    from safenav.scenario.reading.loader import load_scenario_text
    from safenav.team.apply import initial
    from safenav.team.team import team_of

    plan = load_scenario_text(file.text(), file.name)
    synthesizer = default_synthesizer(plan)
    answers = first_results(plan, synthesizer, WaitingLine())
    warnings = [*lint(plan), *foreseen(plan)]
    for robot in plan.robots:
        for event, objective in robot.when:  # as if the input were initially on
            as_own = replace(robot, objective=objective, when=())
            team = (as_own if r is robot else r for r in plan.robots)
            then = replace(plan, robots=tuple(team))
            answer = first_results(then, synthesizer, WaitingLine(), [robot.name])[robot.name]
            if not answer.realizable:
                why = examined(answer, plan)["explanation"]
                warnings.append(f"when {event} is on from the start, {why}")
    realizable = all(answer.realizable for answer in answers.values())
    end = refusal_of(team_of(plan), initial(team_of(plan))) if realizable else None
    refusal = None if end is None else end.explanation
    apart = "" if refusal is None else " apart from deadlines and batteries"
    verdicts, lines = list[dict[str, Any]](), list[str]()
    for name, answer in answers.items():
        data = {
            "robot": name,
            "objective": describe(answer.asked, plan.map.word),
            "form": answer.form.value,
            "verdict": answer.result.verdict.value,
        } | examined(answer, plan)
        verdicts.append(data)
        word = click.style(data["verdict"], fg="green" if answer.realizable else "red")
        lines.append(f"{name}: {word}{apart}, {answer.words(plan.map.word)}")
        lines += [f"    assumes: {shortened(rule)}" for rule in data["assumptions"] or ()]
        if not answer.realizable:
            repairs = f"safenav explain {shlex.quote(plan.source)} proposes repairs"
            lines += [f"    {data['explanation']}", f"    {repairs}"]
    whole: dict[str, Any] = {"scenario": plan.name, "robots": verdicts, "warnings": warnings}
    if realizable and refusal is None:
        ahead = rehearse(plan, synthesizer)
        warnings += ahead.warnings
        result = ahead.result
        whole["without_obstacles"] = {
            "outcome": result.outcome.value,
            "explanation": result.explanation,
            "ticks": result.ticks,
            "late": result.late or (),
        }
        when = moment_words(result.ticks, result.makespan)
        line = f"without hidden obstacles: {result.outcome.value} {when}"
        _, more, left = result.explanation.partition("; ")  # the open orders
        done = result.outcome == "completed"
        line += f"{more}{left}" if done else f" ({result.explanation})"
        late = [obstacle_words(name, plan.map.word) for name in result.late or ()]
        lines.append(f"{line}; late: {listed(late)}" if late else line)
    if refusal is not None:
        whole["unrealizable"] = refusal
        lines.append(f"{click.style('unrealizable', fg='red')}: {refusal}")
    good = realizable and refusal is None and not (strict and warnings)
    return JudgedFile(options.code_of(good), whole, lines, warnings)


def of_trace(file: GivenFile, with_motion: bool) -> JudgedFile:
    """Judge a trace and, if a motion is given, the scenario's requirements on it."""
    from safenav.judge.state import EXTERNAL
    from safenav.run.checked import checked
    from safenav.trace.file import read_bytes

    content = file.bytes()
    trace = read_bytes(content, file.name)
    found = checked(content, trace)
    lines = [*trace_lines(found)]
    if trace.header.world == "external":
        lines.append(EXTERNAL)
    if not with_motion and (formulas := trace.header.scenario.requirements):
        what = counted(len(formulas), "requirement")
        lines.append(f"Not judged: {what}; also give the motion of the run.")
    good = not found.findings and found.complete
    return JudgedFile(
        options.code_of(good), {"ok": not found.findings, **to_builtins(found)}, lines
    )


def trace_lines(found: CheckedTrace) -> Iterator[str]:
    yield from broken(found.source, found.findings)
    yield from broken(found.source, found.notes, "more not judged")
    if not found.complete:
        yield "The trace ends before its outcome; checked as far as it goes."
    if found.outcome in EARLY:
        yield f"Not judged: the reason of the early end ({found.outcome})."
    if not found.findings:
        yield f"{found.source}: no rule broken (outcome {found.outcome or 'unknown'})."
    if found.strays or found.hands:
        yield (
            f"{counted(found.strays, 'step')} ended elsewhere than commanded, "
            f"{counted(found.hands, 'change')} by a user or the world."
        )


def of_motion(
    file: GivenFile, traces: Sequence[GivenFile], more: tuple[str, ...], rate: float
) -> JudgedFile:
    """Judge a motion against its own trace, or the first trace if none is its own. Then judge its
    scenario's requirements and the formulas ``more`` on the motion."""
    from safenav.motion.check.requirements import SATISFIED, judged
    from safenav.motion.check.verdict import check_motion
    from safenav.motion.file import parsed
    from safenav.trace.file import read_bytes

    if not traces:
        hint = f"give both: safenav check {file.path} TRACE"
        raise errors.UsageError(f"{file.path}: a motion is judged against its trace\n    {hint}")
    motion = parsed(file.bytes(), file.name)
    runs = [read_bytes(each.bytes(), each.name) for each in traces]
    run = next((run for run in runs if run.digest == motion.header.trace), runs[0])
    found = check_motion(motion, run)
    # Signals of a motion that breaks rules are unreliable.
    judgements = [] if found else judged(motion, run, more, rate)
    lines = [*broken(file.name, found)]
    if found and (more or run.header.scenario.requirements):
        lines.append("the requirements are not evaluated on a motion that breaks rules")
    if not found:
        robots, seconds = counted(len(motion.header.robots), "robot"), motion.outcome.makespan
        lines.append(f"{file.name}: no rule broken in {seconds:.1f} s of {robots}")
    lines += map(str, judgements)
    good = not found and all(one.verdict == SATISFIED for one in judgements)
    data = {"ok": good, "findings": to_builtins(found)}
    return JudgedFile(
        options.code_of(good), data | {"requirements": [one.data() for one in judgements]}, lines
    )


def of_bundle(file: GivenFile) -> JudgedFile:
    """Check a bundle with the installed checker, not the copy in the bundle."""
    from safenav.certify.check import check_bundle
    from safenav.report.terminal.layout import table

    found = check_bundle(file.path)
    rows = [(claim["id"], claim["text"]) for claim in found.claims]
    colour = "green" if found.accepted else "red"
    reason = f": {found.reason}" if found.reason else ""
    lines = [*table(("claim", "established"), rows)] if rows else []
    lines += [f"not compared: {what}" for what in found.not_compared]
    lines.append(f"{file.path}: {click.style(found.verdict, fg=colour)}{reason}")
    too_large = found.verdict == "too large"
    status = errors.ExitCode.RESOURCE_LIMIT if too_large else options.code_of(found.accepted)
    return JudgedFile(status, asdict(found), lines)


def broken(source: object, found: Sequence[object], rest: str = "more") -> Iterator[str]:
    """Yield the first findings about a source and the number of others, called ``rest``."""
    yield from (f"{source}: {each}" for each in found[:SHOWN])
    if len(found) > SHOWN:
        yield f"and {len(found) - SHOWN} {rest} (--json prints them)"


EARLY = ("assumption_violated", "search_limit", "time_limit", "interrupted", "error")
BUNDLE_FILE = options.Output(".zip", folder=True)
CERTIFY_EXAMPLES = """\
  safenav new lab.yaml && safenav certify lab.yaml -o bundle
  safenav check bundle && python3 -I -S bundle/check.py bundle
  safenav certify lab.yaml -o lab.zip
  safenav run lab.yaml --trace lab.jsonl
  safenav certify lab.jsonl -o moved
"""
CERTIFIED = "the bundle is written, and its checker accepts it"
NOT_CERTIFIED = "a checker refuses the run: the reason is printed, no bundle is written"


@options.command(CERTIFY_EXAMPLES, CERTIFIED, NOT_CERTIFIED)
def certify(
    file: options.InputFile,
    output: Annotated[Path, BUNDLE_FILE, "-o --output", "A folder, or a .zip."],
) -> int:
    """Write a bundle: the run, each strategy with its proof, and a checker that needs only Python.
    FILE is a scenario, which is run, or the trace of an earlier run.

    Any outcome can be certified, including that the mission is infeasible; not runs with
    'coordination: assignable'."""
    from safenav.certify.bundle import bundle_of_run, bundle_of_trace

    given = options.GivenFile(file)
    if given.kind == TRACE:
        made = bundle_of_trace(given.bytes(), given.name, output)
    else:
        made = bundle_of_run(given.text(), file, output)
    echo_lines(f"  {claim['text']}" for claim in made.verdict.claims)
    click.echo(f"{made.path}: {made.files} files, {made.bytes / 1024:.0f} KiB, accepted")
    return errors.ExitCode.OK
